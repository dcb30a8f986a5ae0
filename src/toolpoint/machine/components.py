"""Components of a measured machine: their points, the order in which they carry each other, and all that its tester knows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from toolpoint.machine.description.body import BodyDescription, FrameDescription, Vector
from toolpoint.machine.description.machine import PointDescription

if TYPE_CHECKING:  # as in the description of a machine
    from toolpoint.cutting.description import CuttingDescription


@dataclass(frozen=True)
class MassDeviation:
    """Standard deviations of a body's mass properties: `mass` and `inertia` as shares of themselves (the inertia goes with the
    mass, its own comes beside), `centre` of each coordinate, m."""

    mass: float = 0.0
    inertia: float = 0.0
    centre: float = 0.0


@dataclass(frozen=True)
class DrivenAxis:
    """An axis as its tester knows it: it moves the component `moves` along (or, where `turns`, about) a unit `direction`.

    direction : in the machine frame; at : a point of the axis, m, for one that turns; limits : m or rad; elastic_at : whether
    the springs of the joint travel with the ``child`` or stay with the ``parent``; at_reference : what the axis showed in the
    test. """

    moves: str
    direction: Vector
    turns: bool = False
    at: Vector | None = None
    limits: tuple[float, float] = (float("-inf"), float("inf"))
    elastic_at: str = "child"
    at_reference: float = 0.0


@dataclass(frozen=True)
class Components:
    """Content of a component file.

    name : of the machine; chain : components from the ground up, or child to parent; points : component to its measured points;
    bodies : component to its mass properties in the machine frame, empty where they are not known; deviations : how well these
    are known; axes : by name; places : further named points of bodies, as in a machine file; tool, table : the points between
    which is cut; tool_axis : the direction of the tool, away from the work; coordinate_deviation : of the measured points'
    coordinates, m; calibration_deviation : of the gain of each channel (force, directions of the sensor), None where not told;
    frame : place and orientation of the test's frame (points and directions) in the machine frame, None where not told. """

    name: str
    chain: tuple[str, ...] | Mapping[str, str]
    points: Mapping[str, Sequence[str | int]]
    bodies: Mapping[str, BodyDescription] = field(default_factory=dict)
    deviations: Mapping[str, MassDeviation] = field(default_factory=dict)
    axes: Mapping[str, DrivenAxis] = field(default_factory=dict)
    places: Mapping[str, PointDescription] = field(default_factory=dict)
    tool: str | None = None
    table: str | None = None
    cutting: CuttingDescription | None = None
    tool_axis: Vector = (0.0, 0.0, 1.0)
    coordinate_deviation: float = 0.0
    calibration_deviation: float | None = None
    frame: FrameDescription | None = None

    @property
    def parents(self) -> dict[str, str]:
        """Parent of every child."""
        if isinstance(self.chain, Mapping):
            return dict(self.chain)
        return dict(zip(self.chain[1:], self.chain[:-1], strict=True))

    @property
    def order_text(self) -> str:
        """The chain or tree in words."""
        if isinstance(self.chain, Mapping):
            return ", ".join(f"{parent} - {child}" for child, parent in self.chain.items())
        return " - ".join(self.chain)
