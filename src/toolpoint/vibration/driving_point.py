"""Driving points: force and response at one point along one axis, which fix the scale of a mode."""

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
    row_of = {(dof.point, _axis(dof)): (row, _sense(dof)) for row, dof in enumerate(outputs)}
    pairs = []
    for column, dof in enumerate(inputs):
        match = row_of.get((dof.point, _axis(dof)))
        if match is not None:
            pairs.append(DrivingPoint(match[0], column, match[1] * _sense(dof)))
    return tuple(pairs)


def _axis(dof: Dof) -> object:
    """Return the axis of a Dof without its sign."""
    return dof.vector if dof.vector is not None else dof.direction[1:]


def _sense(dof: Dof) -> float:
    """Return -1 for a direction against its axis, else 1."""
    return -1.0 if dof.vector is None and dof.direction[0] == "-" else 1.0
