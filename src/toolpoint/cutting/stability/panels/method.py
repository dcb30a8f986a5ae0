r"""PanelArnoldi: fast stability of general milling: unequal pitch and helix, process damping, speed variation, round edges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, count, positive
from toolpoint.cutting.cut.modal_state import plane_with_static
from toolpoint.cutting.cut.problem import MillingProblem, TurningProblem
from toolpoint.cutting.stability.levels import depth_levels, spacing_note
from toolpoint.cutting.stability.method import MEASURED_REASON, TURNING_REASON, Problem, refuse_overdamped, require_milling
from toolpoint.cutting.stability.result import StabilityChart, assemble_chart
from toolpoint.cutting.stability.warm_start import WarmStart

# Decay of a real pole in a tooth period, as an exponent, up to which panels are right (found to 87, wrong at 131).
MAX_PANEL_DECAY = 90.0
NOT_NORMAL_REASON = ("at some speeds a cut lasts so many vibrations that rounding moves the limit by more than the tolerance: "
                     "see its error; raise the least speed")
FIRST_ALONE_REASON = "complete up to the first loss of stability of every speed; stable bands above it were not looked for"
DEFAULT_LIMIT_FRACTION = 0.02  # of the largest depth: expected limit where the single-frequency solution has none
OVERFLOW_REASON = "the largest depths of some speeds are beyond double precision and taken as unstable: lower depth_max"


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
    first_only : bool
        Look for the first loss of stability alone, from where the speed before (or the single-frequency solution) had it:
        for maps of many poses, at a quarter of the work. What is stable again above it is not looked for. Below it, narrow
        losses are looked for where the growth falls again and where another multiplier takes the lead.

    Source: Butcher, Bobrenkov, J. Vib. Control 17 (2011) 1873 for collocation of the monodromy operator; Engin, Altintas,
    Int. J. Machine Tools Manufacture 41 (2001) 2195 for general end mills.

    Examples
    --------
    >>> PanelArnoldi(first_only=True).nodes
    4
    """

    name: ClassVar[str] = "panel"
    needs_modes: ClassVar[bool] = True
    takes_response: ClassVar[bool] = False
    uses_warm: ClassVar[bool] = True
    nodes: int = 4
    levels: int = 20
    tolerance: float = 1e-5
    first_only: bool = False

    def __post_init__(self) -> None:
        for name, minimum in (("nodes", 3), ("levels", 3)):
            count(f"PanelArnoldi.{name}", getattr(self, name), minimum)
        positive("PanelArnoldi.tolerance", self.tolerance, 1e-2)

    def __str__(self) -> str:
        return "PanelArnoldi"

    def refuses(self, problem: Problem) -> str | None:
        """Return why not: turning and measured FRFs only; it takes every other cut."""
        if isinstance(problem, TurningProblem):
            return TURNING_REASON
        return None if problem.plane.is_modal else MEASURED_REASON

    def solve(self, problem: Problem, speeds: FloatArray, depth_max: float, *, warm: WarmStart | None = None
              ) -> StabilityChart:
        """Return the chart, beginning with the panels and the roots of a near problem where `warm` has them."""
        from toolpoint.cutting.stability.panels.cost import check_affordable
        from toolpoint.cutting.stability.panels.speeds import search_chain, search_each

        problem, warm = require_milling(self, problem), warm or WarmStart()
        if problem.speed_variation is not None:
            refuse_overdamped("PanelArnoldi with a varying speed", problem, speeds, decay_max=MAX_PANEL_DECAY)
        check_affordable(problem, float(speeds.min()))
        warm.fit(problem, depth_max)
        settings = self.nodes, self.levels, self.tolerance
        if self.first_only:
            expected = _expected(problem, speeds[:1], depth_max)
            outcomes = search_chain(settings, problem, speeds.tolist(), depth_max=depth_max, warm=warm, expected=expected)
        else:
            outcomes = search_each(settings, problem, speeds.tolist(), depth_max=depth_max, warm=warm)
        rows = [(i, *row) for i, outcome in enumerate(outcomes) for row in outcome.rows]
        for speed, outcome in zip(speeds.tolist(), outcomes, strict=True):
            warm.keep_roots(speed, outcome.slopes)
        overflow = any(outcome.overflow for outcome in outcomes)
        is_normal = all(outcome.is_normal for outcome in outcomes)
        columns = np.array(rows, float).reshape(-1, 6).T
        spacing = ("bands of depths between search levels, two fifths of a depth apart, can be missed" if self.first_only else
                   spacing_note(depth_levels(problem, depth_max, self.levels, power=1.5)))
        note = ("largest multipliers of the one-period map; error of each point from two discretisations; "
                f"{spacing}, unless the multipliers beside them announce it")
        status = (OVERFLOW_REASON if overflow else NOT_NORMAL_REASON if not is_normal
                  else FIRST_ALONE_REASON if self.first_only else "complete")
        return assemble_chart(speeds, depth_max, columns, method=str(self), notes=(*plane_with_static(problem).notes, note),
                         search=status)

    def multipliers(self, problem: MillingProblem, speed: float, depth: float) -> ComplexArray:
        """Return the largest multipliers over one period, largest first.

        The period is the tooth period for a regular tool, else a revolution, with speed variation its revolutions.
        """
        from toolpoint.cutting.stability.panels.search import PeriodMap, waves_of
        from toolpoint.cutting.stability.panels.store import PanelStore

        plane = plane_with_static(problem, speed)
        turn = PeriodMap(problem, plane, speed, self.nodes + 3, 6, PanelStore())
        return turn.multipliers(depth, waves_of(plane, problem, speed), 1e-11)


def _expected(problem: MillingProblem, speed: FloatArray, depth_max: float) -> float:
    """Return the expected limit of a speed, m: that of the single-frequency solution."""
    from toolpoint.cutting.stability.methods.zero_order import ZeroOrder

    limit = float(ZeroOrder().solve(problem, speed, depth_max).limit[0])
    return limit if 0 < limit < depth_max else DEFAULT_LIMIT_FRACTION * depth_max
