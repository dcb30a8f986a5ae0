"""A screening as plain frozen data, one to one with a plan file: machine, changes, doubts, design, metrics, the path that is
milled."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from toolpoint._quantity import Key, Quantity, limit_faults
from toolpoint.machine.description.variation import Factor, Swap

AxisPosition = Annotated[float, Quantity("axis position", "m or rad")]
PathLength = Annotated[float, Quantity("length", "m", above=0)]
PathPlace = Annotated[float, Quantity("length", "m")]
PathFeed = Annotated[float, Quantity("speed", "m/s", above=0)]
SpindleTurning = Annotated[float, Quantity("spindle speed", "rpm", above=0)]
PathTime = Annotated[float, Quantity("time", "s", above=0)]


@dataclass(frozen=True)
class MilledSquare:
    """A square that is milled: side (m), centre (m), the directions of its first and second side; and how.

    window : s of the middle of every side that is run, whole sides where left out; sides : which of the four; spacing : m
    between the places at which the structure is assembled; steps : in a tooth period.
    """

    side: PathLength
    speed: SpindleTurning
    depth: PathLength
    centre: tuple[PathPlace, ...] = (0.0, 0.0, 0.0)
    first: tuple[float, ...] = (1.0, 0.0, 0.0)
    second: tuple[float, ...] = (0.0, 1.0, 0.0)
    feed: PathFeed = 0.005
    law: Literal["quintic", "jerk-limited"] = "quintic"
    loads: tuple[str, ...] = ("cutting",)
    regenerative: bool = False
    window: PathTime | None = None
    sides: tuple[int, ...] = (1, 2, 3, 4)
    branch: str = ""
    spacing: PathLength = 2e-3
    steps: int = 100


@dataclass(frozen=True)
class ScreeningPlan:
    """Plan of a screening.

    points : of samples; draws : of the doubts; metrics : by name, at `pose`, and the accuracy of milling where there is a
    square.
    """

    machine: str
    factors: tuple[Factor, ...] = ()
    swaps: tuple[Swap, ...] = ()
    doubts: tuple[Factor, ...] = ()
    design: Literal["one at a time", "full factorial", "fractional factorial", "latin hypercube", "sobol sequence",
                    "sobol indices"] = "one at a time"
    points: int = 64
    levels: int = 2
    seed: int = 1
    draws: int = 0
    metrics: tuple[str, ...] = ()
    pose: Mapping[str, AxisPosition] = field(default_factory=dict)
    square: MilledSquare | None = None
    source: str = ""

    @property
    def changes(self) -> tuple[Factor | Swap, ...]:
        """Factors, then swaps."""
        return (*self.factors, *self.swaps)


def find_plan_faults(plan: ScreeningPlan) -> Iterator[tuple[Key, str]]:
    """Yield place and text of every fault of a plan."""
    outside = list(limit_faults(plan))
    if outside:
        yield from outside
        return
    if not plan.changes:
        yield ("factors",), "neither factors nor swaps; must have at least one"
    if not plan.metrics and plan.square is None:
        yield ("metrics",), "neither metrics nor a square; must have something to measure"
    for i, name in enumerate(() if plan.square is None else plan.square.loads):
        if name not in ("cutting", "gravity", "path"):
            yield ("square", "loads", i), f"{name!r}; must be of cutting, gravity, path"
    for name in ("centre", "first", "second") if plan.square is not None else ():
        if len(getattr(plan.square, name)) != 3:
            yield ("square", name), "must be three numbers"
    for i, number in enumerate(() if plan.square is None else plan.square.sides):
        if number not in (1, 2, 3, 4):
            yield ("square", "sides", i), f"{number}; must be of 1, 2, 3, 4"
