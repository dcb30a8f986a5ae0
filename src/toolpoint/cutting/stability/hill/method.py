r"""HillDeterminant: stability of any end mill straight from a measured FRF, by Hill's determinant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from toolpoint._check import FloatArray, count, fail, positive
from toolpoint.cutting.cut.problem import MillingProblem, TurningProblem
from toolpoint.cutting.stability.hill.fourier import is_plain
from toolpoint.cutting.stability.hill.response import HarmonicResponse
from toolpoint.cutting.stability.levels import depth_levels, spacing_note
from toolpoint.cutting.stability.method import TURNING_REASON, Problem, require_milling
from toolpoint.cutting.stability.result import StabilityChart, assemble_chart
from toolpoint.cutting.stability.warm_start import WarmStart

MAX_PLAIN_ROWS = 700  # rows of the matrix of a plain cut (neither helix nor corner): more take minutes a speed
MAX_SHAPED_ROWS = 500  # rows of the matrix of a cut whose shape depends on depth
PLAIN_LEVEL_FACTOR = 10  # search levels of a plain cut, whose eigenvalues serve every depth, over those of a shaped one


@dataclass(frozen=True)
class HillDeterminant:
    r"""Hill's infinite determinant of the harmonics of the vibration: no modes, no time steps.

    On the boundary :math:`r(t) = e^{i \theta t/T} \sum_l r_l e^{2 \pi i l t/T}`, T the tooth period of a regular tool, else a
    revolution, so that :math:`\omega_l = (\theta + 2 \pi l)/T` and

    .. math:: r_k = -G(i \omega_k) \sum_l \Big[\sum_j (A_{j,k-l} - e^{-i \omega_l \tau_j} A_{j,k-l})
              + i \omega_l \tfrac{C}{v} D_{k-l}\Big] r_l

    with :math:`A_{j,h}` the Fourier coefficients of :math:`k n^T` of edge j, summed along it (with a helix angle of its own for
    every edge the delay :math:`\tau_j` varies along it and stays inside the sum), and D those of process damping. The number of
    unstable multipliers is minus the phase change of the determinant over :math:`\theta \in [0, \pi]` in units of pi. Straight
    edges of any pitch: the matrix is proportional to depth and its eigenvalues over theta serve all depths. Helix, corner
    radius and ball: the count is taken at levels of depth. Boundary points are solved by Newton's method in (theta, depth).

    A measured FRF is used at the harmonics that lie in its band (the cubic through four lines; faded out over the last 3 % of
    the band, zero outside). The stated error of a point is 1.5 times the sum of its changes (of first order) when the upper
    tenth of the band is left out, when the band is continued by its mass line, when the response below the band is held at
    its first line, and when every other line is left out; and the 95 % interval of the lines' noise, as the FRF states its
    variance, else from the scatter of neighbouring lines (`noise`). Modes enter with their exact response up to `reach` times
    the highest frequency that matters and four tooth passings further; the harmonics above are added in first order, the
    largest of their partial sums is the stated error. What first order leaves out is taken as three times the error's square
    over the depth.

    Parameters
    ----------
    reach : float
        Highest harmonic over the highest mode, for modes.
    levels : int
        Depths at which the count is taken for helix, corner radius and ball; ten times as many for straight edges. Bands of
        (un)stable depths narrower than their spacing can be missed.
    base : int
        Theta intervals before refinement.

    Source: Hill's determinant of a periodic delay equation: Insperger, Stepan, Semi-Discretization for Time-Delay Systems,
    2011, section 2; Altintas, Engin, Budak, J. Manufacturing Science Engineering 121 (1999) 173, for variable pitch.

    Examples
    --------
    >>> HillDeterminant(reach=3.0).takes_response
    True
    """

    name: ClassVar[str] = "hill"
    needs_modes: ClassVar[bool] = False
    takes_response: ClassVar[bool] = True
    uses_warm: ClassVar[bool] = False
    reach: float = 2.0
    levels: int = 20
    base: int = 16

    def __post_init__(self) -> None:
        if positive("HillDeterminant.reach", self.reach, 20.0) < 1:
            fail("HillDeterminant.reach", f"{self.reach:g}", "must be at least 1: the highest mode must be in the matrix")
        count("HillDeterminant.levels", self.levels, 4)
        count("HillDeterminant.base", self.base, 4)

    def __str__(self) -> str:
        return "HillDeterminant"

    def refuses(self, problem: Problem) -> str | None:
        """Return why a problem is refused (turning, spindle-speed variation), None for every other cut."""
        if isinstance(problem, TurningProblem):
            return TURNING_REASON
        if problem.speed_variation is not None:
            return ("spindle-speed variation; delays must be constant in time (identify modes where the dynamics are "
                    "measured, and use PanelArnoldi() or Collocation(): --method panel, collocation)")
        return None

    def solve(self, problem: Problem, speeds: FloatArray, depth_max: float, *, warm: WarmStart | None = None
              ) -> StabilityChart:
        """Return the chart; see `stability.chart`. `warm` is not used."""
        from toolpoint.cutting.stability.hill.search import HillSearch, chatter_frequency
        from toolpoint.cutting.stability.hill.system import HillSystem  # brings the compiler, which few callers need

        problem = require_milling(self, problem)
        rows: list[tuple[float, ...]] = []
        status, notes = "complete", problem.notes
        levels = self._levels(problem, depth_max)
        for i, speed in enumerate(speeds.tolist()):
            plane = problem.plane_at(speed).with_modal_residual()
            notes = tuple(dict.fromkeys((*notes, *plane.notes)))
            response = HarmonicResponse.of(plane, self.reach, problem.tool.teeth * speed / 60)
            _check_affordable(problem, response, speed)
            search = HillSearch(HillSystem(problem, speed, response), self.base, levels)
            for depth, theta, change, error in search.rows():
                rows.append((i, depth, theta, chatter_frequency(search.system, theta), change, error))
            status = search.status if status == "complete" else status
        columns = np.array(rows, float).reshape(-1, 6).T
        notes = (*notes, self._note(problem, levels))
        return assemble_chart(speeds, depth_max, columns, method=str(self), notes=notes, search=status)

    def _levels(self, problem: MillingProblem, depth_max: float) -> FloatArray:
        """Return the depths (m) at which multipliers are counted, closer together towards zero."""
        if is_plain(problem):
            return depth_levels(problem, depth_max, PLAIN_LEVEL_FACTOR * self.levels, power=2.0)
        return depth_levels(problem, depth_max, self.levels, power=1.5)

    def _note(self, problem: MillingProblem, levels: FloatArray) -> str:
        """Return the sentence on method, errors and spacing of levels."""
        source = "harmonics beyond the matrix" if problem.plane.is_modal else (
            "the ends of the band, the lines' spacing, and 95 % of "
            + ("the limits of drawn responses" if problem.plane.draws is not None else
               f"the lines' noise ({'by their scatter' if problem.plane.variance is None else 'as stated'})"))
        return (f"count of multipliers from Hill's determinant; error of each point from {source}; "
                f"{spacing_note(levels)}")


def _check_affordable(problem: MillingProblem, response: HarmonicResponse, speed: float) -> None:
    """Refuse matrices that would take minutes a speed, with the remedy."""
    from toolpoint.cutting.stability.hill.system import HillSystem

    size, rows_max = HillSystem.rows(problem, speed, response), MAX_PLAIN_ROWS if is_plain(problem) else MAX_SHAPED_ROWS
    if size > rows_max:
        fail("speeds", f"{speed:g} rev/min needs a matrix of {size} (highest frequency times period)",
             f"must be at most {rows_max}", remedy="leave out the modes or FRF lines far above the chatter band, raise the "
             "least speed, or identify modes and use PanelArnoldi() (--method panel)")
