"""Automatic: the method that suits the problem, and at each speed the quicker of the two exact engines; one chart."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from toolpoint._check import Array, FloatArray, positive
from toolpoint.cutting.cut.problem import MillingProblem, TurningProblem
from toolpoint.cutting.stability.floquet.method import MAX_FLOQUET_DECAY, FloquetDeterminant, rows_of
from toolpoint.cutting.stability.hill.method import HillDeterminant
from toolpoint.cutting.stability.method import Problem, StabilityMethod, decay_of_overdamped, require_milling
from toolpoint.cutting.stability.methods.zero_order import ZeroOrder
from toolpoint.cutting.stability.panels.method import PanelArnoldi
from toolpoint.cutting.stability.result import StabilityChart, assemble_chart
from toolpoint.cutting.stability.warm_start import WarmStart

FLOQUET_NODE_SECONDS = 4e-9  # of FloquetDeterminant, for each theta node and q^2 (q + 30), q rows; one core of 2024


def default_method(problem: Problem) -> StabilityMethod:
    """Return the exact engine that suits a problem best.

    ZeroOrder for turning, where it is exact; HillDeterminant for a measured FRF; for modes FloquetDeterminant where one
    matrix serves all depths (it takes a helix too, but slower), PanelArnoldi for everything else.

    >>> from toolpoint.vibration import Modes
    >>> default_method(TurningProblem(1e9, Modes([100.0], [0.05], [[0.1]], ["tool:+x"]))).name  # exact for turning
    'zero-order'
    """
    if isinstance(problem, TurningProblem):
        return ZeroOrder()
    if not problem.plane.is_modal:
        return HillDeterminant()
    floquet = FloquetDeterminant()
    return PanelArnoldi() if floquet.refuses(problem) or problem.tool.has_helix else floquet


@dataclass(frozen=True)
class Automatic:
    """The default of `stability.chart`: `default_method`, at low speeds of many modes PanelArnoldi in its place.

    FloquetDeterminant's work grows with the cube of (highest frequency times tooth period), PanelArnoldi's in proportion
    to it: below some speed the second is faster by any factor. Both state the error of every point, and in both a
    static residual has a place of its own.

    Parameters
    ----------
    patience : float
        Estimated seconds a speed of FloquetDeterminant above which PanelArnoldi is taken.

    Examples
    --------
    >>> str(Automatic(patience=0.1))
    'Automatic'
    """

    name: ClassVar[str] = "auto"
    needs_modes: ClassVar[bool] = False
    takes_response: ClassVar[bool] = False
    uses_warm: ClassVar[bool] = True
    patience: float = 0.02

    def __post_init__(self) -> None:
        positive("Automatic.patience", self.patience)

    def __str__(self) -> str:
        return "Automatic"

    def refuses(self, problem: Problem) -> str | None:
        """Return why the method that suits the problem best cannot solve it; None where it can."""
        return default_method(problem).refuses(problem)

    def solve(self, problem: Problem, speeds: FloatArray, depth_max: float, *, warm: WarmStart | None = None
              ) -> StabilityChart:
        """Return the chart, each method beginning with what a near problem left; see `stability.chart`."""
        method = default_method(problem)
        if not isinstance(method, FloquetDeterminant):
            return method.solve(problem, speeds, depth_max, warm=warm)
        return self._by_speed(require_milling(method, problem), speeds, depth_max, warm)

    def _by_speed(self, problem: MillingProblem, speeds: FloatArray, depth_max: float, warm: WarmStart | None
                  ) -> StabilityChart:
        # By an estimate and not by a trial: a speed that is too slow would have spent its time already.
        slow = np.array([estimate_seconds(problem, float(n)) > self.patience
                         or decay_of_overdamped(problem, float(n)) > MAX_FLOQUET_DECAY for n in speeds])
        if slow.all() or not slow.any():
            method = PanelArnoldi() if slow.all() else FloquetDeterminant()
            return method.solve(problem, speeds, depth_max, warm=warm)
        fast_chart = FloquetDeterminant().solve(problem, speeds[~slow], depth_max, warm=warm)
        slow_chart = PanelArnoldi().solve(problem, speeds[slow], depth_max, warm=warm)
        note = (f"PanelArnoldi at {int(slow.sum())} speeds, the highest {speeds[slow].max():g} rev/min, "
                "FloquetDeterminant at the others")
        return _join_charts(speeds, depth_max, ((np.flatnonzero(~slow), fast_chart), (np.flatnonzero(slow), slow_chart)), note)


def _join_charts(speeds: FloatArray, depth_max: float, parts: tuple[tuple[Array, StabilityChart], ...], note: str
                 ) -> StabilityChart:
    """Return one chart of several, each with the places of its speeds among all."""
    charts = [chart for _, chart in parts]
    index = np.concatenate([places[chart.index] for places, chart in parts])
    columns = [np.concatenate([getattr(chart, name) for chart in charts])
               for name in ("depth", "theta", "frequency", "change", "error")]
    notes = dict.fromkeys((*(text for chart in charts for text in chart.notes), note))
    # Of two methods the worse search counts: a chart is complete where both parts are.
    search = next((chart.search for chart in charts if chart.search != "complete"), "complete")
    return assemble_chart(speeds, depth_max, (index, *columns), method=", ".join(chart.method for chart in charts),
                     notes=tuple(notes), search=search)


def estimate_seconds(problem: MillingProblem, speed: float) -> float:
    """Estimate the time of FloquetDeterminant at this speed, s."""
    plane = problem.plane_at(speed)
    q = rows_of(problem, plane, speed, nodes_min=FloquetDeterminant().nodes)
    # Fitted to measured times: modes fill the matrix (q^2 a mode), the Hessenberg form and the polynomial take q^3.
    return FLOQUET_NODE_SECONDS * (17 + 3 * plane.poles.size) * q**2 * (q + 30.0)
