"""Components of a measured machine: which points ride on which, their chain, and their bodies where known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from toolpoint.machine.description import BodyDescription


@dataclass(frozen=True)
class Components:
    """What a component file says.

    name : of the machine; chain : components from the ground up; points : component to its measured points; bodies :
    component to its mass properties in the machine frame, empty where they are not known.
    """

    name: str
    chain: tuple[str, ...]
    points: Mapping[str, Sequence[str | int]]
    bodies: Mapping[str, BodyDescription] = field(default_factory=dict)
