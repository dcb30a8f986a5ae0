"""Automatic: FloquetDeterminant where its matrix is small, PanelArnoldi at the low speeds where it is not; one chart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, positive
from toolpoint.cutting.cut.problem import MillingProblem, TurningProblem
from toolpoint.cutting.stability.floquet.method import FloquetDeterminant, checked, rows_of
from toolpoint.cutting.stability.panels.method import PanelArnoldi
from toolpoint.cutting.stability.result import StabilityChart, assembled
from toolpoint.cutting.stability.warm_start import WarmStart

SECONDS = 4e-9  # of FloquetDeterminant, for each theta node and q^2 (q + 30), q rows; one core of 2024


@dataclass(frozen=True)
class Automatic:
    """The default of `stability.chart` for regular cylindrical tools on modes.

    FloquetDeterminant's work grows with the cube of (highest frequency times tooth period), PanelArnoldi's in proportion
    to it: below some speed the second is faster by any factor. Both state the error of every point.

    Parameters
    ----------
    patience : float
        Estimated seconds a speed of FloquetDeterminant above which PanelArnoldi is taken.
    """

    patience: float = 0.02

    def __post_init__(self) -> None:
        positive("Automatic.patience", self.patience)

    def __str__(self) -> str:
        return "Automatic"

    def solve(self, problem: MillingProblem | TurningProblem, speeds: FloatArray, depth_max: float) -> StabilityChart:
        """Return the chart; see `stability.chart`."""
        return self._solved(problem, speeds, depth_max, None)

    def solve_warm(self, problem: MillingProblem | TurningProblem, speeds: FloatArray, depth_max: float,
                   warm: WarmStart) -> StabilityChart:
        """Return the chart, each method beginning with what a near problem left."""
        return self._solved(problem, speeds, depth_max, warm)

    def _solved(self, problem: MillingProblem | TurningProblem, speeds: FloatArray, depth_max: float,
                warm: WarmStart | None) -> StabilityChart:
        checked(problem)
        assert isinstance(problem, MillingProblem)
        slow = np.array([estimated_seconds(problem, float(n)) > self.patience for n in speeds])
        if not slow.any():
            return _of(FloquetDeterminant(), problem, speeds, depth_max, warm)
        if slow.all():
            return _of(PanelArnoldi(), problem, speeds, depth_max, warm)
        first = _of(FloquetDeterminant(), problem, speeds[~slow], depth_max, warm)
        second = _of(PanelArnoldi(), problem, speeds[slow], depth_max, warm)
        places = (np.flatnonzero(~slow)[first.index], np.flatnonzero(slow)[second.index])
        names = ("depth", "theta", "frequency", "change", "error")
        columns = (np.concatenate(places), *(np.concatenate([getattr(first, n), getattr(second, n)]) for n in names))
        notes = dict.fromkeys((*first.notes, *second.notes, f"PanelArnoldi at {int(slow.sum())} speeds, the highest "
                               f"{speeds[slow].max():g} rev/min, FloquetDeterminant at the others"))
        return assembled(speeds, depth_max, columns, method="FloquetDeterminant, PanelArnoldi", notes=tuple(notes),
                         status=first.status if first.status != "complete" else second.status)


def _of(method: FloquetDeterminant | PanelArnoldi, problem: MillingProblem, speeds: FloatArray, depth_max: float,
        warm: WarmStart | None) -> StabilityChart:
    if warm is None:
        return method.solve(problem, speeds, depth_max)
    return method.solve_warm(problem, speeds, depth_max, warm)


def estimated_seconds(problem: MillingProblem, speed: float) -> float:
    """Estimated time of FloquetDeterminant at this speed, s."""
    plane = problem.plane_at(speed)
    q = rows_of(problem, plane, speed, FloquetDeterminant().nodes)
    return SECONDS * (17 + 3 * plane.poles.size) * q**2 * (q + 30.0)
