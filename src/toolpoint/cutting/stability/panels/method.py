r"""PanelArnoldi: fast stability of general milling: unequal pitch and helix, process damping, speed variation, round edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, count, fail, positive
from toolpoint.cutting.cut.problem import MillingProblem, TurningProblem
from toolpoint.cutting.stability.methods.collocation import modal
from toolpoint.cutting.stability.result import StabilityChart, assembled
from toolpoint.cutting.stability.warm_start import WarmStart

BEYOND = "the largest depths of some speeds are beyond double precision and taken as unstable: lower depth_max"


@dataclass(frozen=True)
class PanelArnoldi:
    r"""Multipliers of the one-period map by Arnoldi's method, compiled; for every cut that has no single delay.

    The vibration is a polynomial through Gauss nodes on panels of rotation that end wherever an edge enters or leaves and
    one delay later; its equation on a panel is the closed-form convolution with the modal impulse response, so one
    application of the map costs work in proportion to nodes and modes. The largest multipliers come from Arnoldi's
    method, the boundary from the root of log(spectral radius) in depth. Unequal pitch, helix (each edge its own: the
    delay then varies along it), corner radius and ball (slices with their own chip normal), process damping and
    spindle-speed variation are in the map. Each boundary point is solved again with more nodes: the change is its error.

    Parameters
    ----------
    nodes : int
        Least Gauss nodes on a panel; more are taken where the modes oscillate within it.
    levels : int
        Depths at which the spectral radius is computed before the roots; where it comes near 1 between them more are
        added. Bands narrower than their spacing can be missed.
    tolerance : float
        Relative error of depth wanted; nodes are added until the estimate is below it (at most twice).

    Source: Butcher, Bobrenkov, J. Vib. Control 17 (2011) 1873 for collocation of the monodromy operator; Engin, Altintas,
    Int. J. Machine Tools Manufacture 41 (2001) 2195 for general end mills.
    """

    nodes: int = 4
    levels: int = 20
    tolerance: float = 1e-5

    def __post_init__(self) -> None:
        for name, low in (("nodes", 3), ("levels", 3)):
            count(f"PanelArnoldi.{name}", getattr(self, name), low)
        positive("PanelArnoldi.tolerance", self.tolerance, 1e-2)

    def __str__(self) -> str:
        return "PanelArnoldi"

    def solve(self, problem: MillingProblem | TurningProblem, speeds: FloatArray, depth_max: float) -> StabilityChart:
        """Return the chart; see `stability.chart`."""
        return self.solve_warm(problem, speeds, depth_max, WarmStart())

    def solve_warm(self, problem: MillingProblem | TurningProblem, speeds: FloatArray, depth_max: float,
                   warm: WarmStart) -> StabilityChart:
        """Return the chart, beginning with the panels and the roots of a near problem."""
        if isinstance(problem, TurningProblem):
            fail("problem", "a TurningProblem", "ZeroOrder is exact for it", "use method=ZeroOrder()")
        from toolpoint.cutting.stability.panels.search import Search

        modal(problem.plane)
        warm.fit(problem, depth_max)
        rows: list[tuple[float, ...]] = []
        overflow = False
        settings, store = (self.nodes, self.levels, self.tolerance), warm.panels(problem)
        for i, speed in enumerate(speeds.tolist()):
            one = Search(settings, problem, speed, depth_max, store, warm.roots.get(speed))
            rows += [(i, *row) for row in one.rows()]
            warm.keep_roots(speed, one.slopes)
            overflow |= one.overflow
        columns = np.array(rows, float).reshape(-1, 6).T
        note = (f"largest multipliers of the one-period map; error of each point from two discretisations; bands narrower "
                f"than the {self.levels} search levels can be missed")
        status = BEYOND if overflow else "complete"
        return assembled(speeds, depth_max, columns, method=str(self), notes=(*problem.notes, note), status=status)

    def multipliers(self, problem: MillingProblem, speed: float, depth: float) -> ComplexArray:
        """Return the largest multipliers over one period, largest first.

        The period is the tooth period for a regular tool, else a revolution, with speed variation its revolutions.
        """
        from toolpoint.cutting.stability.panels.search import PeriodMap, waves_of
        from toolpoint.cutting.stability.panels.store import PanelStore

        plane = modal(problem.plane_at(speed))
        one = PeriodMap(problem, plane, speed, self.nodes + 3, 6, PanelStore())
        return one.multipliers(depth, waves_of(plane, problem, speed), 1e-11)
