r"""ZeroOrder: the single-frequency stability solution with the full cross response (2x2, 3x3), from Modes or an Frf."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import ClassVar

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray, count
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.cut.problem import MillingProblem, TurningProblem
from toolpoint.cutting.stability.method import Problem, require_suited, with_plane
from toolpoint.cutting.stability.result import StabilityChart, assemble_chart
from toolpoint.cutting.stability.warm_start import WarmStart

KNOWN_ERROR = ("single-frequency solution: the directional factors are replaced by their mean; usual error 2-15 % at "
               "half immersion, up to 175 % at flip lobes of small immersion; flip lobes and islands are not found; "
               "compare with FloquetDeterminant")

MIN_HALVED_LINES = 8  # lines of a measured FRF, from which on every other one tells the error of their spacing
DEEPER_FACTOR = 1.5  # largest depth of solutions on every other line over that of the chart
MATCHED_LINES = 4.0  # spacings of lines within which a point of every other line has the same chatter frequency
MAX_RIVAL_ERROR = 0.5  # of a depth: a point with a larger error says nothing about another
END_PARTS = 16  # of the spacing of measured lines where a curve of real depths ends
MAX_REFINEMENTS = 60  # of a crossing between two lines
PERIODS_TOLERANCE = 1e-13  # misfit of a lobe's number, periods, at which its crossing is refined
MAX_PERIODS_MISFIT = 1e-6  # above, a bracket holds no crossing


@dataclass(frozen=True)
class ZeroOrder:
    r"""Single-frequency (zero-order) solution, exact where the directional matrix is constant (turning, full helix).

    For every chatter frequency the eigenvalues :math:`\Lambda` of :math:`-\bar A G(i\omega_c)` give
    :math:`1/w = (1 - e^{-i \omega_c T}) \Lambda`; w is real only on the curve
    :math:`w = \tfrac12 \mathrm{Re}(1/\Lambda) (1 + \kappa^2)`, :math:`\kappa = \mathrm{Im}/\mathrm{Re}` of
    :math:`1/\Lambda`, and the crossings with the wanted speeds are found on it exactly.

    Parameters
    ----------
    lines : int
        Frequency lines laid over the poles before the crossings are refined; a measured FRF is taken at its own lines.
    states_line_error : bool
        Whether points on a measured FRF state what its spacing and noise leave open: how far they move where the cut is solved
        on every other line, from the first and from the second on. That takes twice the time.

    Source: Altintas, Budak, CIRP Annals 44 (1995) 357-362, with the full cross terms.
    """

    name: ClassVar[str] = "zero-order"
    needs_modes: ClassVar[bool] = False
    takes_response: ClassVar[bool] = True
    uses_warm: ClassVar[bool] = False
    lines: int = 1500
    states_line_error: bool = field(default=True, repr=False)

    def __post_init__(self) -> None:
        count("ZeroOrder.lines", self.lines, 16)

    def __str__(self) -> str:
        return "ZeroOrder"

    def refuses(self, problem: Problem) -> str | None:
        """Return why not: process damping in milling; what else it leaves out is in the notes of the chart."""
        if isinstance(problem, MillingProblem) and problem.process_damping > 0:
            return "process damping in milling; has no zero-order solution here (use method=PanelArnoldi())"
        return None

    def solve(self, problem: Problem, speeds: FloatArray, depth_max: float, *, warm: WarmStart | None = None
              ) -> StabilityChart:
        """Return the chart; see `stability.chart`. It always begins cold."""
        require_suited(self, problem)
        parts = []
        for group in _group_speeds(problem, speeds):
            parts.append(_solve_group(problem, speeds, group, depth_max, self.lines))
        columns = [np.concatenate(c) for c in zip(*parts)]
        if self.states_line_error and not problem.plane.is_modal and problem.plane.lines[0].size >= MIN_HALVED_LINES:
            columns[-1] = columns[-1] + self._line_error(problem, speeds, columns, depth_max)
        return assemble_chart(speeds, depth_max, columns, method=str(self), notes=self._notes(problem))

    def _line_error(self, problem: Problem, speeds: FloatArray, columns: Sequence[Array], depth_max: float) -> FloatArray:
        """Return the error (m) of every point by the spacing and the noise of measured lines.

        It is the larger change of the two solutions on every other line, all of the depth where one of them has no such point.
        """
        index, depth, frequency, change = (columns[k] for k in (0, 1, 3, 4))
        lines = problem.plane.lines[0]
        reach = MATCHED_LINES * np.diff(lines)[np.clip(np.searchsorted(lines, frequency) - 1, 0, lines.size - 2)]
        half_method = replace(self, states_line_error=False)
        error = np.zeros(depth.size)
        for first in (0, 1):
            halved = with_plane(problem, problem.plane.every_other_line(first))
            # Somewhat deeper, so that a point near the largest depth is met again.
            chart = half_method.solve(halved, speeds, DEEPER_FACTOR * depth_max)
            for i in range(depth.size):
                candidates = chart.depth[(chart.index == index[i]) & (chart.change == change[i])
                                         & (np.abs(chart.frequency - frequency[i]) < reach[i])]
                error[i] = max(error[i], min(float(np.abs(candidates - depth[i]).min(initial=np.inf)), float(depth[i])))
        return _with_rivals(index, depth, change, error)

    def _notes(self, problem: MillingProblem | TurningProblem) -> tuple[str, ...]:
        if isinstance(problem, TurningProblem):
            return problem.notes
        helix = "" if not problem.tool.has_helix else "; helix does not change the mean matrix"
        uneven = "unequal pitch or helix taken as equal by the zero-order solution"
        pitch: tuple[str, ...] = () if problem.tool.is_regular else (uneven,)
        if problem.tool.corner_radius > 0:
            pitch = (*pitch, "corner radius left out by the zero-order solution: a sharp corner is taken")
        if problem.speed_variation is not None:
            pitch = (*pitch, "spindle-speed variation left out by the zero-order solution")
        return (*problem.notes, KNOWN_ERROR + helix, *pitch)


def _with_rivals(index: Array, depth: FloatArray, change: Array, error: FloatArray) -> FloatArray:
    """Return errors in which the one of each limit reaches down to the lower ends of deeper points that may lie before it."""
    result = error.copy()
    for speed in np.unique(index).tolist():
        leaving = np.flatnonzero((index == speed) & (change > 0))
        if leaving.size:
            limit = leaving[np.argmin(depth[leaving])]
            placed = leaving[error[leaving] < MAX_RIVAL_ERROR * depth[leaving]]
            result[limit] = max(error[limit], depth[limit] - (depth[placed] - error[placed]).min(initial=np.inf))
    return result


def _group_speeds(problem: MillingProblem | TurningProblem, speeds: FloatArray) -> list[Array]:
    """Return groups of speeds that share one response: all, or each alone where the response depends on the speed."""
    depends_on_speed = isinstance(problem, MillingProblem) and problem.depends_on_speed
    damped = problem.process_damping > 0
    return [np.array([i]) for i in range(speeds.size)] if depends_on_speed or damped else [np.arange(speeds.size)]


def _solve_group(problem: MillingProblem | TurningProblem, speeds: FloatArray, group: Array, depth_max: float,
                 lines: int) -> tuple[Array, ...]:
    speed = float(speeds[group[0]])
    if isinstance(problem, TurningProblem):
        plane, teeth, matrix = problem.plane, 1, np.diag([problem.stiffness, *np.zeros(problem.plane.size - 1)])
        lag = problem.process_damping / (problem.stiffness * float(problem.surface_speed(speed))) \
            if problem.process_damping else 0.0
    else:
        plane, teeth, matrix, lag = problem.plane_at(speed), problem.tool.teeth, problem.mean_matrix, 0.0
    period = 60 / (teeth * speeds[group])
    f = _frequency_lines(plane, lines, period)
    curves = Curves(plane, matrix, lag, isinstance(problem, TurningProblem))
    if not plane.is_modal:
        f = _with_ends_of_curves(curves, f)
    inverse = curves.inverse(f)  # of both branches at once: the responses at all lines are most of the work
    # Both branches are refined at once: a response at few frequencies costs its calls, not its numbers.
    brackets = _Brackets.joined([_brackets(curves, (f, inverse[:, branch]), branch, period, depth_max) for branch in (0, 1)])
    speed_index, depth, frequency, change = _refine_crossings(curves, brackets, period, depth_max)
    theta = np.abs(np.angle(np.exp(2j * np.pi * frequency * period[speed_index])))
    return group[speed_index], depth, theta, frequency, change, 1e-9 * depth + (0 if plane.is_modal else 1e-6 * depth)


def _frequency_lines(plane: PlaneDynamics, lines: int, period: FloatArray) -> FloatArray:
    if not plane.is_modal:
        f = plane.lines[0]
        return f[f > 0]
    centre, half = np.abs(plane.poles) / 2 / np.pi, -plane.poles.real / 2 / np.pi
    spread = np.sinh(np.linspace(-6, 6, max(31, lines // (2 * max(plane.poles.size, 1)))))
    around_poles = (centre[:, None] + half[:, None] * spread).ravel()
    frequency_max = 2.5 * centre.max()
    step = max(min(frequency_max / lines, 0.15 / period.max()), frequency_max / 40_000)
    f = np.concatenate([around_poles, np.arange(step, frequency_max, step)])
    return np.unique(f[(f > 1e-3 * centre.min()) & (f < frequency_max)])


def _with_ends_of_curves(curves: Curves, f: FloatArray) -> FloatArray:
    """Return measured lines with more frequencies between two of which one alone has a real depth.

    There a curve ends and the depth grows without limit: a deep crossing between the two has no bracket of lines.
    """
    inverse = curves.inverse(f)
    is_real = np.stack([np.isfinite(curves.depth(inverse[:, k], f, np.full(f.size, k))[0]) for k in (0, 1)])
    ends = np.flatnonzero((is_real[:, 1:] != is_real[:, :-1]).any(axis=0))
    inside = np.arange(1, END_PARTS) / END_PARTS
    return np.unique(np.concatenate([f, (f[ends, None] + inside * (f[ends + 1] - f[ends])[:, None]).ravel()]))


@dataclass(frozen=True)
class Curves:
    r"""Eigenvalues of -A G(i w), their continuous branches, and the real depths on them.

    With process damping in a one-direction cut (`lag` = C/(v K), s) the condition is
    :math:`(1 - e^{-ie}) + i\omega\,lag = v u`, v the inverse eigenvalue and u = 1/w: a quadratic with two real u.
    """

    plane: PlaneDynamics
    matrix: FloatArray
    lag: float
    single: bool

    def eigenvalues(self, f: FloatArray) -> ComplexArray:
        """Return both eigenvalues at each frequency in Hz, shape (n, 2); of a one-direction cut its only one, twice.

        With z: on a cylinder vibration along z makes no chip, so the eigenvalues that are not zero are those of the part of
        -G A in the plane; K_a enters through the cross response with z.
        """
        if self.plane.size == 3 and not self.single:
            m = -(self.plane.response(f) @ self.matrix)[..., :2, :2]
        else:
            m = -self.matrix @ self.plane.response(f)
        if self.single:
            return np.stack([m[..., 0, 0], m[..., 0, 0]], axis=-1)
        half = (m[..., 0, 0] + m[..., 1, 1]) / 2
        root = np.sqrt(half**2 - (m[..., 0, 0] * m[..., 1, 1] - m[..., 0, 1] * m[..., 1, 0]))
        return np.stack([half + root, half - root], axis=-1)

    def inverse(self, f: FloatArray) -> ComplexArray:
        """Return 1/eigenvalue of both branches, sorted so that each is continuous along f, shape (n, 2)."""
        values = self.eigenvalues(f)
        crossed = np.abs(values[1:, 0] - values[:-1, 1]) + np.abs(values[1:, 1] - values[:-1, 0])
        straight = np.abs(np.diff(values[:, 0])) + np.abs(np.diff(values[:, 1]))
        swapped = np.concatenate([[False], np.cumsum(straight > crossed) % 2 == 1])
        values[swapped] = values[swapped][:, ::-1]
        return _invert(values)

    def near(self, f: FloatArray, guess: ComplexArray) -> ComplexArray:
        """Return the 1/eigenvalue nearest to a guess."""
        values = _invert(self.eigenvalues(f))
        pick = np.argmin(np.where(np.isnan(values), np.inf, np.abs(values - guess[:, None])), axis=1)
        return values[np.arange(f.size), pick]

    def depth(self, inverse: ComplexArray, f: FloatArray, branch: Array) -> tuple[FloatArray, FloatArray]:
        """Return the real depth w (NaN where there is none) and phase e = w_c T mod 2 pi on the curve.

        branch : (n,), 0 or 1.
        """
        drag = 2 * np.pi * f * self.lag
        square, linear = np.abs(inverse) ** 2, inverse.real + inverse.imag * drag
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.sqrt(linear**2 - square * drag**2)
            u = (linear + (np.where(branch == 0, root, -root) if self.single else root)) / square
            u = np.where(u > 0, u, np.nan)
            if self.single and self.lag == 0:
                u = np.where(branch == 1, np.nan, u)
            q = inverse * u - 1j * drag
            return 1 / u, 2 * np.arctan2(q.real, q.imag)

    def change(self, f: FloatArray, period: FloatArray, inverse: ComplexArray) -> Array:
        """Change of the unstable count with depth: minus the sense in which kappa crosses the positive real axis."""
        side = []
        for x in (f * (1 - 1e-7), f * (1 + 1e-7)):
            w = 2 * np.pi * x
            side.append((1 - np.exp(-1j * w * period) + 1j * w * self.lag) / self.near(x, inverse))
        return np.where((side[1] - side[0]).imag > 0, -2, 2)


def _invert(values: ComplexArray) -> ComplexArray:
    # A direction in which no force acts has an eigenvalue of rounding, whose inverse would be a limit of 1e13.
    zero = np.abs(values) <= 1e-13 * np.abs(values).max(initial=0.0)
    return np.where(zero, np.nan, 1 / np.where(zero, 1, values))


@dataclass(frozen=True)
class _Brackets:
    """Neighbouring lines between which a branch crosses a lobe of a speed, (n,) each.

    f0, f1 : Hz; v0, v1 : inverse eigenvalue there; lobe : whole number of periods; speed : its place; branch : 0 or 1.
    """

    f0: FloatArray
    f1: FloatArray
    v0: ComplexArray
    v1: ComplexArray
    lobe: FloatArray
    speed: Array
    branch: Array

    @classmethod
    def joined(cls, parts: Sequence[_Brackets]) -> _Brackets:
        return cls(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(cls)))


def _brackets(curves: Curves, points: tuple[FloatArray, ComplexArray], branch: int, period: FloatArray,
              depth_max: float) -> _Brackets:
    """Return the brackets of the crossings of one branch with every speed.

    points : frequencies, Hz, and the inverse eigenvalue of the branch at each.
    """
    f, inverse = points
    w, e = curves.depth(inverse, f, np.full(f.size, branch))
    lower_depth = np.fmin(w[:-1], w[1:])
    both = np.flatnonzero(np.isfinite(w[:-1]) & np.isfinite(w[1:]) & (lower_depth <= 3 * depth_max))
    a = f[both] * period[:, None] - e[both] / (2 * np.pi)
    b = f[both + 1] * period[:, None] - e[both + 1] / (2 * np.pi)
    first, last = np.ceil(np.minimum(a, b)), np.floor(np.maximum(a, b))
    s, i = np.nonzero((last >= first) & (np.abs(b - a) < 50))
    repeat = (last - first + 1)[s, i].astype(int)
    number = np.arange(repeat.sum()) - np.repeat(np.cumsum(repeat) - repeat, repeat)
    lobe = np.repeat(first[s, i], repeat) + number
    s, line = np.repeat(s, repeat), both[np.repeat(i, repeat)]
    return _Brackets(f[line], f[line + 1], inverse[line], inverse[line + 1], lobe, s, np.full(s.size, branch))


def _refine_crossings(curves: Curves, brackets: _Brackets, period: FloatArray, depth_max: float
                      ) -> tuple[Array, FloatArray, FloatArray, Array]:
    """Solve f T - e(f)/2 pi = lobe in each bracket by false position (Illinois).

    Returns for every crossing the place of the speed, depth, frequency, and change of the unstable count.
    """
    frequency, inverse, misfit = brackets.f1.copy(), brackets.v1.copy(), np.full(brackets.speed.size, np.inf)
    x0, x1, v0, v1, left = brackets.f0, brackets.f1, brackets.v0, brackets.v1, np.arange(brackets.speed.size)

    def gap(x: FloatArray, v: ComplexArray) -> FloatArray:
        phase = curves.depth(v, x, brackets.branch[left])[1]
        return x * period[brackets.speed[left]] - phase / (2 * np.pi) - brackets.lobe[left]

    g0, g1 = gap(x0, v0), gap(x1, v1)
    for _ in range(MAX_REFINEMENTS):
        if not left.size:
            break
        step = np.where(g1 != g0, g1 - g0, 1.0)
        x = np.clip(x1 - g1 * (x1 - x0) / step, np.minimum(x0, x1), np.maximum(x0, x1))
        part = np.where(x1 != x0, (x - x0) / np.where(x1 != x0, x1 - x0, 1.0), 0.0)
        v = curves.near(x, v0 + part * (v1 - v0))
        g = gap(x, v)
        frequency[left], inverse[left], misfit[left] = x, v, np.abs(g)
        other = np.sign(g) != np.sign(g1)
        g0, x0, v0 = np.where(other, g1, g0 / 2), np.where(other, x1, x0), np.where(other, v1, v0)
        is_open = ~(np.abs(g) < PERIODS_TOLERANCE)
        left, g0, x0, v0 = left[is_open], g0[is_open], x0[is_open], v0[is_open]
        g1, x1, v1 = g[is_open], x[is_open], v[is_open]
    depth = curves.depth(inverse, frequency, brackets.branch)[0]
    keep = (depth <= depth_max) & (misfit < MAX_PERIODS_MISFIT)
    s, frequency, inverse = brackets.speed[keep], frequency[keep], inverse[keep]
    return s, depth[keep], frequency, curves.change(frequency, period[s], inverse)
