r"""SemiDiscretization and FullDiscretization: the time-step methods of the literature, with their known errors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy  # its rooms load on first use

from toolpoint._check import ComplexArray, FloatArray, count, fail, positive
from toolpoint.cutting.cut.modal_state import modal_plane
from toolpoint.cutting.cut.problem import MillingProblem, TurningProblem
from toolpoint.cutting.stability.method import MEASURED_REASON, TURNING_REASON, Problem, require_milling
from toolpoint.cutting.stability.methods.search import search_depths
from toolpoint.cutting.stability.result import StabilityChart
from toolpoint.cutting.stability.warm_start import WarmStart

# (interval, state, displacement one period before its start and its end) -> state at its end
Advance = Callable[[int, FloatArray, Sequence[FloatArray]], FloatArray]


@dataclass(frozen=True)
class SemiDiscretization:
    """Semi-discretization: the delayed vibration is held (order 0) or linear (order 1) over each of equal intervals.

    Second order in the number of intervals; with 40 intervals the depth is overpredicted by up to 8 % on the usual
    benchmark. Straight teeth of equal pitch.

    Parameters
    ----------
    order : int
        0 (mean of two past samples) or 1 (linear between them).
    intervals : int
        Intervals in one tooth period.
    levels, tolerance
        Depths searched before bisection, and where bisection stops.

    Source: Insperger, Stepan, Semi-Discretization for Time-Delay Systems, Springer 2011, sections 3 and 5.

    Examples
    --------
    >>> str(SemiDiscretization(order=0, intervals=80))
    'SemiDiscretization(order=0, intervals=80)'
    """

    name: ClassVar[str] = "semi-discretization"
    needs_modes: ClassVar[bool] = True
    takes_response: ClassVar[bool] = False
    uses_warm: ClassVar[bool] = False
    order: int = 1
    intervals: int = 40
    levels: int = 24
    tolerance: float = 1e-7

    def __post_init__(self) -> None:
        if self.order not in (0, 1):
            fail("SemiDiscretization.order", f"{self.order}", "must be 0 or 1")
        count("SemiDiscretization.intervals", self.intervals, 4)
        positive("SemiDiscretization.tolerance", self.tolerance, 1e-2)

    def __str__(self) -> str:
        return f"SemiDiscretization(order={self.order}, intervals={self.intervals})"

    def refuses(self, problem: Problem) -> str | None:
        """Return why not: anything but straight teeth of equal pitch in the plane, on modes."""
        return _refusal(problem)

    def solve(self, problem: Problem, speeds: FloatArray, depth_max: float, *, warm: WarmStart | None = None
              ) -> StabilityChart:
        """Return the chart; see `stability.chart`. It always begins cold."""
        note = f"semi-discretization: second order in 1/intervals; at {self.intervals} its own error is not in `error`"
        problem = require_milling(self, problem)
        notes = (*modal_plane(problem.plane).notes, note)
        return search_depths(self, problem, speeds, depth_max=depth_max, notes=notes)

    def multipliers(self, problem: MillingProblem, speed: float, depth: float) -> ComplexArray:
        """Return the multipliers over one tooth period, largest first."""
        a, b, c, mean, step = _discretize(problem, speed, self.intervals)
        n, m = a.shape[0], self.intervals
        feedback = depth * np.einsum("ia,tab,bj->tij", b, mean, c)
        drive = depth * np.einsum("ia,tab->tib", b, mean)
        # One exponential of an augmented matrix gives the transition and both integrals of the held and of the linear input.
        block = np.zeros((m, n + 4, n + 4))
        block[:, :n, :n], block[:, :n, n:n + 2] = (a - feedback) * step, drive * step
        block[:, n:n + 2, n + 2:] = np.eye(2)
        e = scipy.linalg.expm(block)
        hold, ramp = e[:, :n, n:n + 2], e[:, :n, n + 2:]
        if self.order == 0:
            weights = [(hold[i] / 2, hold[i] / 2) for i in range(m)]
        else:
            weights = [(hold[i] - ramp[i], ramp[i]) for i in range(m)]
        return _spectrum(n, m, c, lambda i, x, past: e[i, :n, :n] @ x + weights[i][0] @ past[0] + weights[i][1] @ past[1])


@dataclass(frozen=True)
class FullDiscretization:
    """First full-discretization method: state, delayed state and coefficients all linear over each interval.

    Parameters
    ----------
    intervals : int
        Intervals in one tooth period.
    levels, tolerance
        Depths searched before bisection, and where bisection stops.

    Source: Ding, Zhu, Zhang, Ding, Int. J. Machine Tools Manufacture 50 (2010) 502-509.

    Examples
    --------
    >>> str(FullDiscretization(intervals=80))
    'FullDiscretization(intervals=80)'
    """

    name: ClassVar[str] = "full-discretization"
    needs_modes: ClassVar[bool] = True
    takes_response: ClassVar[bool] = False
    uses_warm: ClassVar[bool] = False
    intervals: int = 40
    levels: int = 24
    tolerance: float = 1e-7

    def __post_init__(self) -> None:
        count("FullDiscretization.intervals", self.intervals, 4)
        positive("FullDiscretization.tolerance", self.tolerance, 1e-2)

    def __str__(self) -> str:
        return f"FullDiscretization(intervals={self.intervals})"

    def refuses(self, problem: Problem) -> str | None:
        """Return why not: anything but straight teeth of equal pitch in the plane, on modes."""
        return _refusal(problem)

    def solve(self, problem: Problem, speeds: FloatArray, depth_max: float, *, warm: WarmStart | None = None
              ) -> StabilityChart:
        """Return the chart; see `stability.chart`. It always begins cold."""
        note = f"full discretization: at {self.intervals} intervals its own error is not in `error`"
        problem = require_milling(self, problem)
        notes = (*modal_plane(problem.plane).notes, note)
        return search_depths(self, problem, speeds, depth_max=depth_max, notes=notes)

    def multipliers(self, problem: MillingProblem, speed: float, depth: float) -> ComplexArray:
        """Return the multipliers over one tooth period, largest first."""
        a, b, c, mean, step = _discretize(problem, speed, self.intervals, sampled=True)
        n, m = a.shape[0], self.intervals
        first, last = mean[:-1], mean[1:]
        hold = _hold_integrals(a, step)
        # Product of two linear functions of u = s/dt: (1-u)^2, u(1-u) (both ways), u^2 weights.
        constant, ramp, square = hold
        start, mixed = constant - 2 * ramp + square, ramp - square
        transition = scipy.linalg.expm(a * step)

        def advance(i: int, x: FloatArray, past: Sequence[FloatArray]) -> FloatArray:
            at_start = depth * (start @ b @ first[i] + mixed @ b @ last[i])
            at_end = depth * (mixed @ b @ first[i] + square @ b @ last[i])
            right = transition @ x - at_start @ (c @ x - past[0]) + at_end @ past[1]
            return np.linalg.solve(np.eye(n) + at_end @ c, right)

        return _spectrum(n, m, c, advance)


def _hold_integrals(a: FloatArray, step: float) -> list[FloatArray]:
    """Return the integrals of e^{A (dt - s)} (s/dt)^k ds over one step, k = 0, 1, 2, from one exponential."""
    n = a.shape[0]
    block = np.zeros((4 * n, 4 * n))
    block[:n, :n] = a * step
    for k in range(3):
        block[k * n:(k + 1) * n, (k + 1) * n:(k + 2) * n] = np.eye(n)
    e = scipy.linalg.expm(block)
    return [step * e[:n, n:2 * n], step * e[:n, 2 * n:3 * n], 2 * step * e[:n, 3 * n:]]


def _refusal(problem: Problem) -> str | None:
    if isinstance(problem, TurningProblem):
        return TURNING_REASON
    if not problem.tool.is_regular or problem.tool.has_helix or problem.process_damping > 0 or problem.speed_variation:
        return ("unequal pitch, helix, process damping or speed variation; must have straight teeth of equal pitch "
                "(use PanelArnoldi() or Collocation(): --method panel, collocation)")
    if problem.plane.size != 2 or problem.tool.corner_radius > 0:
        return ("the direction z or a rounded edge; must be a cylindrical cut in the plane (use PanelArnoldi(): --method "
                "panel)")
    return None if problem.plane.is_modal else MEASURED_REASON


def _discretize(problem: MillingProblem, speed: float, intervals: int, sampled: bool = False
                ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]:
    """Return the state matrices of the modes, and the cut's matrix averaged over (or sampled at the ends of) the intervals."""
    plane = modal_plane(problem.plane_at(speed))
    s, residue = plane.poles, plane.residues
    n = 2 * s.size
    a, c, b = np.zeros((2 * n, 2 * n)), np.zeros((2, 2 * n)), np.zeros((2 * n, 2))
    row = 0
    for pole, r in zip(s, residue):
        # A residue of rank one (a mode) needs one pair of states, one of rank two (a repeated pole) two.
        u, size, v = np.linalg.svd(r)
        for i in range(2):
            if size[i] > 1e-13 * size[0]:
                left, rows = u[:, i] * size[i], slice(row, row + 2)
                # Real and imaginary part as two real states: expm of real matrices takes half the time.
                a[rows, rows] = [[pole.real, -pole.imag], [pole.imag, pole.real]]
                c[:, rows] = np.stack([2 * left.real, -2 * left.imag], axis=1)
                b[rows] = np.stack([v[i].real, v[i].imag])
                row += 2
    period = float(problem.tooth_period(speed))
    pitch = 2 * np.pi / problem.tool.teeth
    ends = problem.engagement.entry + pitch * np.arange(intervals + 1) / intervals
    mean = _sample_matrices(problem, ends) if sampled else _average_matrices(problem, ends)
    return a[:row, :row], b[:row], c[:, :row], mean, period / intervals


def _average_matrices(problem: MillingProblem, ends: FloatArray) -> FloatArray:
    """Return the mean of sum_j k n^T over each interval of rotation, shape (intervals, 2, 2), exact."""
    from toolpoint.cutting.cut.coefficients import mean_matrix

    pitch, arc = 2 * np.pi / problem.tool.teeth, problem.engagement
    total = np.zeros((ends.size - 1, 2, 2))
    for j in range(problem.tool.teeth):
        for i, (a, b) in enumerate(zip(ends[:-1] + j * pitch, ends[1:] + j * pitch)):
            start, end = max(a, arc.entry), min(b, arc.exit)
            if end > start:
                total[i] += mean_matrix(problem.coefficients, start, end, teeth=1) * 2 * np.pi / (b - a)
    return total


def _sample_matrices(problem: MillingProblem, ends: FloatArray) -> FloatArray:
    from toolpoint.cutting.cut.coefficients import chip_direction, force_direction

    pitch, arc = 2 * np.pi / problem.tool.teeth, problem.engagement
    phi = ends[:, None] + pitch * np.arange(problem.tool.teeth)
    # Samples fall exactly on entry and exit: rounding must lose neither.
    live = (phi >= arc.entry - 1e-12) & (phi <= arc.exit + 1e-12)
    k, chip = force_direction(problem.coefficients, phi), chip_direction(phi)
    return np.einsum("tj,tja,tjb->tab", live, k, chip)


def _spectrum(n: int, m: int, c: FloatArray, advance: Advance) -> ComplexArray:
    """Return the eigenvalues of the map of (state, m past displacements), largest first."""
    size = n + 2 * m
    x: FloatArray = np.eye(n, size)
    # Past displacements of one period, oldest first; the newest of them is the present state's.
    past = [np.eye(2, size, n + 2 * i) for i in range(m)] + [c @ x]
    rows = [c @ x]
    for i in range(m):
        x = advance(i, x, past[i:i + 2])
        rows.append(c @ x)
    values = np.linalg.eigvals(np.concatenate([x, *rows[:-1]]))
    return values[np.argsort(-np.abs(values))]
