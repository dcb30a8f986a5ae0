"""Difference in a machine's answers between damping laws that a test does not separate, and intervals that cover it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt
from toolpoint._rounding import NORMAL_QUANTILE_95
from toolpoint.machine import Machine, MachineDescription, assemble, build
from toolpoint.studies.measured.machine_check import solve_poles
from toolpoint.vibration import frequency_response

_MAX_LAW_DIFFERENCE = 0.05  # of limits by laws that the test does not separate: a larger one is a doubt
# On both sides of a resonance and at its top, within two half widths: there a law of damping shows.
_LINES_PER_HALF_WIDTH = (-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0)
_DAMPING = ("loss_factor", "damping", "damping_matrix")
_MAX_TRAVEL_AXES = 3  # axes whose ends are combined


@dataclass(frozen=True)
class LawSpread:
    """The largest relative difference of depth limits and damping ratios between alike laws, and the law it is from."""

    difference: float
    rival: str

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """A doubt where the difference is one that a user must know."""
        if self.difference < _MAX_LAW_DIFFERENCE:
            return ()
        return (Doubt("damping", f"the test does not tell the law of damping from {self.rival}, by which limits and damping "
                      f"ratios differ by up to {100 * self.difference:.2g} %: the intervals cover it",
                      "test at the ends of the travel, or with less noise", figure=self.difference),)


def cover_rivals(machine: MachineDescription, rivals: Sequence[tuple[str, MachineDescription]]
                 ) -> tuple[MachineDescription, LawSpread]:
    """Return the machine with its damping's covariance wide enough for the answers by every rival law, and their spread.

    All losses together are known no better than the answers differ: as depth limits go with damping, a share of the one is
    the same share of the other.
    """
    spread = LawSpread(0.0, "")
    chosen = _answers(build(machine))
    for name, rival in rivals:
        try:
            other = _answers(build(rival))
        except (ToolpointError, np.linalg.LinAlgError):
            continue
        if other.shape == chosen.shape and chosen.size:
            difference = float(np.abs(np.log(np.maximum(other, 1e-300) / np.maximum(chosen, 1e-300))).max())
            spread = LawSpread(difference, name) if difference > spread.difference else spread
    identified = machine.identified
    if identified is None or spread.difference == 0.0:
        return machine, spread
    direction = np.array([machine.value(path) if set(path.split(".")) & {*_DAMPING, "modal_damping"} else 0.0
                          for path in identified.parameters])
    covariance = identified.matrix + (spread.difference / NORMAL_QUANTILE_95) ** 2 * np.outer(direction, direction)
    rows = tuple(tuple(float(f"{v:.9g}") for v in row[:n + 1]) for n, row in enumerate(covariance))
    return replace(machine, identified=replace(identified, covariance=rows)), spread


def _answers(machine: Machine) -> FloatArray:
    """Return the answers by which laws of damping are compared, at the reference pose and at the ends of the axes.

    Damping ratios, and the most negative real parts of the tool's receptance, whose inverse the depth limit follows.
    """
    description = machine.description
    point = description.tool
    label = point if description.table is None else f"{point}-{description.table}"
    labels = [f"{label}:+x", f"{label}:+y"] if point is not None else [f"{next(iter(description.points))}:+x"]
    answers = []
    for pose in _poses(description):
        system = assemble(machine, pose, labels)
        modes = solve_poles(system)
        ratio = np.maximum(modes.damping_ratio, 1e-6)
        answers.append(np.sort(ratio))
        if point is None:
            continue
        lines = np.unique(np.concatenate([modes.frequency * (1 + step * ratio) for step in _LINES_PER_HALF_WIDTH]))
        response = frequency_response.direct(system, lines[lines > 0]).values
        answers.append(-np.einsum("fii->fi", response).real.min(axis=0))
    return np.concatenate(answers)


def _poses(description: MachineDescription) -> list[dict[str, float]]:
    ends = {name: axis.limits for name, axis in description.axes.items() if np.isfinite(axis.limits).all()}
    names = list(ends)[:_MAX_TRAVEL_AXES]
    return [{}, *(dict(zip(names, corner, strict=True)) for corner in product(*(ends[name] for name in names)) if names)]
