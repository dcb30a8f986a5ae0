"""Driving points: force and response at one point along one axis, where a mode's scale shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from toolpoint.vibration.dof import Dof


@dataclass(frozen=True)
class DrivingPoint:
    """Row (output), column (input) and sign (-1 where the two directions oppose each other)."""

    row: int
    column: int
    sign: float


def driving_points(outputs: Sequence[Dof], inputs: Sequence[Dof]) -> tuple[DrivingPoint, ...]:
    """Return every output-input pair at one point along one axis."""
    where = {(dof.point, _axis(dof)): (row, _sense(dof)) for row, dof in enumerate(outputs)}
    pairs = []
    for column, dof in enumerate(inputs):
        at = where.get((dof.point, _axis(dof)))
        if at is not None:
            pairs.append(DrivingPoint(at[0], column, at[1] * _sense(dof)))
    return tuple(pairs)


def _axis(dof: Dof) -> object:
    return dof.vector if dof.vector is not None else dof.direction[1:]


def _sense(dof: Dof) -> float:
    return -1.0 if dof.vector is None and dof.direction[0] == "-" else 1.0
