"""Counts of unstable multipliers over depth at one speed from the phase of Hill's determinant, and the boundary points."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray
from toolpoint.cutting.stability.hill.system import HillSystem, Root
from toolpoint.cutting.stability.result import REAL_ANGLE_TOLERANCE

MAX_PHASE_STEP = 1.2  # rad: larger phase steps are halved
MAX_LOG_STEP = 2.0  # larger steps of the logarithm of the modulus are halved too: a dip may hide a turn of the phase
MIN_THETA_INTERVAL = 1e-6  # rad: least theta interval; a step that stays wild is a jump where the band begins or ends
MAX_THETA_NODES = 900  # theta nodes
SIGN_PARTS = 4  # parts of a depth cell at whose ends the sign of the determinant is taken, at theta = 0 and pi
NODE_MARGIN, RESONANCE_NODE_MARGIN = 0.02, 0.3  # least distance of nodes: of the even spacing, of a resonance's half width
MIN_HIDDEN_DEPTH_RATIO = 1e-3  # share of the largest depth below which nothing hidden is looked for
UNSOLVED_BRACKET_RATIO = 1e-4  # relative width of a bracket: where Newton's method finds no root in it, theta nodes are too few
Row = tuple[float, float, int, float]  # depth, theta, change, error


class _CountCell(NamedTuple):
    """Depths (m) between which the count of unstable multipliers may change, and the counts at both: below at `lower`."""

    lower: float
    upper: float
    below: int
    above: int


class Phase:
    """Theta nodes over [0, pi] between which the logarithm of the determinant changes little, at one or many depths.

    start : first nodes, rad; value : theta to logarithms, one for each depth. The intervals are halved until every step is
    below `MAX_PHASE_STEP` and `MAX_LOG_STEP`; `complete` says whether `MAX_THETA_NODES` were enough.
    """

    def __init__(self, start: FloatArray, value: Callable[[float], ComplexArray]) -> None:
        self.theta = start.tolist()
        self.value = [value(t) for t in self.theta]
        self.complete = True
        i = 0
        while i < len(self.theta) - 1:
            a, b = self.theta[i], self.theta[i + 1]
            step = _steps(self.value[i + 1] - self.value[i])
            if (np.abs(step.imag).max() < MAX_PHASE_STEP
                and np.abs(step.real).max() < MAX_LOG_STEP) or b - a < MIN_THETA_INTERVAL:
                i += 1
                continue
            if len(self.theta) >= MAX_THETA_NODES:
                self.complete = False
                break
            self.theta.insert(i + 1, (a + b) / 2)
            self.value.insert(i + 1, value((a + b) / 2))


def _steps(difference: ComplexArray) -> ComplexArray:
    """Return the differences of logarithms with the phase in -pi .. pi."""
    return difference.real + 1j * ((difference.imag + np.pi) % (2 * np.pi) - np.pi)


def count_encirclements(theta: list[float], value: ComplexArray) -> tuple[int, tuple[float, float]]:
    """Return (unstable multipliers, theta interval of the largest phase step) from logarithms (n,) at nodes theta (n,).

    The count is minus the change of the phase from 0 to pi, over pi: the argument principle on the upper half circle.
    """
    return _counts(theta, value[:, None])[0]


def _counts(theta: list[float], table: ComplexArray) -> list[tuple[int, tuple[float, float]]]:
    """Return the counts and intervals of every column."""
    step = _steps(np.diff(table, axis=0)).imag
    largest = np.argmax(np.abs(step), axis=0).tolist()
    unstable = np.round(-step.sum(axis=0) / np.pi).astype(int).tolist()
    return [(n, (theta[k], theta[k + 1])) for n, k in zip(unstable, largest, strict=True)]


class PlainCount:
    """Counts of a plain cut by depth (m): eigenvalues of its matrix over theta serve every depth.

    start : first theta nodes; levels : depths at which the phase must be resolved.
    """

    def __init__(self, system: HillSystem, start: FloatArray, levels: FloatArray) -> None:
        self.system, eigenvalues = system, {}

        def value(theta: float) -> ComplexArray:
            eigenvalues[theta] = system.eigenvalues(theta)
            return _logarithm(eigenvalues[theta], levels)

        phase = Phase(start, value)
        self.theta, self.complete = phase.theta, phase.complete
        self.eigenvalues = np.array([eigenvalues[t] for t in self.theta])
        table = np.array(phase.value)
        self.known_counts = dict(zip(levels.tolist(), _counts(self.theta, table), strict=True))

    def __call__(self, depth: float) -> tuple[int, tuple[float, float]]:
        if depth in self.known_counts:
            return self.known_counts[depth]
        return count_encirclements(self.theta, _log_product(np.asarray(1 + depth * self.eigenvalues, complex)))

    def add(self, theta: float) -> None:
        """Take a root's theta as a node."""
        index = int(np.searchsorted(self.theta, theta))
        self.theta.insert(index, theta)
        self.eigenvalues = np.insert(self.eigenvalues, index, self.system.eigenvalues(theta), axis=0)


class ShapedCount:
    """Counts of a cut whose shape depends on depth, by depth (m): a scan over theta for every depth."""

    def __init__(self, system: HillSystem, start: FloatArray) -> None:
        self.system, self.start, self.complete = system, start, True
        self.known_counts: dict[float, tuple[int, tuple[float, float]]] = {}

    def __call__(self, depth: float) -> tuple[int, tuple[float, float]]:
        if depth not in self.known_counts:
            phase = Phase(self.start, lambda t: np.array([self.system.logarithm(t, depth)]))
            self.complete &= phase.complete
            self.known_counts[depth] = count_encirclements(phase.theta, np.array(phase.value)[:, 0])
        return self.known_counts[depth]

    def add(self, theta: float) -> None:
        """Take a root's theta as a node."""
        self.start = np.union1d(self.start, [theta])


def _logarithm(eigenvalues: ComplexArray, depths: FloatArray) -> ComplexArray:
    """Return log prod(1 + depth eigenvalue) at these depths, shape (depths,)."""
    return _log_product(1 + depths[:, None] * eigenvalues[None, :])


def _log_product(factors: ComplexArray) -> ComplexArray:
    """Return the logarithm of the product along the last axis, its phase up to whole turns.

    Eight factors are multiplied before a logarithm is taken: each is far below 1e38, so that no product overflows. Logarithms
    of all factors took half the time of a chart.
    """
    grouped = factors.shape[-1] // 8 * 8
    parts = factors[..., :grouped].reshape(*factors.shape[:-1], grouped // 8, 8).prod(axis=-1)
    return np.asarray(np.log(parts + 1e-300).sum(-1) + np.log(factors[..., grouped:].prod(axis=-1) + 1e-300), complex)


def first_nodes(system: HillSystem, base: int) -> FloatArray:
    """Return `base` + 1 even theta nodes over [0, pi], and more where a narrow resonance turns the determinant."""
    f, width = system.response.hints()
    spacing = np.pi / base
    nodes, margins = [np.linspace(0, np.pi, base + 1)], [np.full(base + 1, NODE_MARGIN * spacing)]
    for middle, half in zip(f, width):
        turn, spread = 2 * np.pi * middle * system.period, 2 * np.pi * half * system.period
        if spread < spacing:
            # A resonance wider than the even spacing is resolved by it; a narrow one turns the phase within a few half
            # widths.
            around = (turn + spread * np.array([-2.5, -0.8, 0.0, 0.8, 2.5])) % (2 * np.pi)
            nodes.append(np.where(around > np.pi, 2 * np.pi - around, around))
            # Nodes of a resonance far narrower than the spacing stay: between two others its turn of the phase is not seen.
            margins.append(np.full(around.size, min(NODE_MARGIN * spacing, RESONANCE_NODE_MARGIN * spread)))
    theta, margin = np.concatenate(nodes), np.concatenate(margins)
    order = np.argsort(theta)
    theta, margin = theta[order], margin[order]
    # Nodes that nearly coincide would cost an eigenvalue problem each.
    keep = np.concatenate([[True], np.diff(theta) > np.minimum(margin[1:], margin[:-1])])
    return np.unique(np.concatenate([theta[keep], [np.pi]]))


class HillSearch:
    """Search for the boundary points of one speed.

    system : of the speed; base : theta intervals at first; levels : depths (m) at which multipliers are counted first, the last
    the largest of the chart.
    """

    def __init__(self, system: HillSystem, base: int, levels: FloatArray) -> None:
        self.system, self.base, self.grid = system, base, levels
        self.count = self._start_counts(base)
        self.bracketed = False

    def _start_counts(self, base: int) -> PlainCount | ShapedCount:
        """Return the counts on `base` theta intervals and those about narrow resonances."""
        start = first_nodes(self.system, base)
        return PlainCount(self.system, start, self.grid) if self.system.is_linear else ShapedCount(self.system, start)

    @property
    def status(self) -> str:
        """Sentence on what the search did not resolve, else ``complete``."""
        if not self.count.complete:
            return "the phase of some depths was not resolved: lower depth_max"
        return "some boundary points were bracketed only: see their error" if self.bracketed else "complete"

    def rows(self) -> list[Row]:
        """Return the boundary points up to the largest level.

        Where a count changes without a root, a turn of the phase between two theta nodes was not seen: the search begins
        again with twice, then four times as many intervals.
        """
        for base in (2 * self.base, 4 * self.base):
            rows = self._solve_band(last=False)
            if rows is not None:
                return rows
            self.count = self._start_counts(base)
        return self._solve_band(last=True) or []

    def _solve_band(self, last: bool) -> list[Row] | None:
        """Return boundary points; None where a count changes without a root, unless it is the `last` attempt."""
        stack = self._cells()
        rows: list[Row] = []
        while stack:
            cell = stack.pop()
            a, b, m, n = cell
            root = self._hidden_root(a, b) if m == n else self._root(a, b, m, n)
            if root is not None:
                rows += self._row(root)
                # A root that changes the count by another number than the cell does has neighbours in it.
                if root.change != n - m:
                    stack += self._remaining_cells(cell, root)
            elif m == n:
                continue
            elif not last and b - a < UNSOLVED_BRACKET_RATIO * b:
                return None
            elif b - a < 1e-7 * b:
                self.bracketed = True
                rows.append(self._bracketed_row(a, b, n - m))
            else:
                middle = (a + b) / 2
                half = self.count(middle)[0]
                stack += [c for c in (_CountCell(a, middle, m, half), _CountCell(middle, b, half, n)) if c.below != c.above]
        return rows

    def _cells(self) -> list[_CountCell]:
        """Return the depth cells to be searched: those of unequal counts; of a shaped cut all above the first.

        A cell of equal counts may hide two roots. A plain cut has ten times as many levels, and such cells are not searched.
        """
        turned = self._between_real_roots() if self.system.is_linear else self._depths_of_sign_changes()
        levels = [0.0, *sorted({*self.grid.tolist(), *turned})]
        counts = [0, *(self.count(w)[0] for w in levels[1:])]
        cells = [_CountCell(a, b, m, n) for (a, b), (m, n) in zip(pairwise(levels), pairwise(counts))]
        return [c for c in cells if c.below != c.above or (not self.system.is_linear and c.lower > 0)]

    def _between_real_roots(self) -> list[float]:
        """Return depths (m) midway between the real roots (flips at theta = pi, folds at 0) of a plain cut: a cell each."""
        assert isinstance(self.count, PlainCount)
        ends = self.count.eigenvalues[[0, -1]].ravel()
        real = ends[(np.abs(ends.imag) < 1e-9 * np.abs(ends)) & (ends.real < 0)].real
        roots = np.sort(-1 / real[-1 / real < self.grid[-1]])
        return ((roots[1:] + roots[:-1]) / 2).tolist()

    def _depths_of_sign_changes(self) -> list[float]:
        """Return depths (m) between levels where the determinant at theta = 0 or pi has not the sign of the level below.

        Each such change is a flip or a fold, which two equal counts at the levels would hide.
        """
        out = []
        signs_below = (1.0, 1.0)
        for a, b in pairwise([0.0, *self.grid.tolist()]):
            parts = a + (b - a) * np.arange(1, SIGN_PARTS + 1) / SIGN_PARTS
            signs = [tuple(np.sign(self.system.sign(theta, w)) for theta in (0.0, np.pi)) for w in parts]
            out += [float(w) for w, pair in zip(parts[:-1], signs) if pair != signs_below]
            signs_below = signs[-1]
        return out

    def _hidden_root(self, a: float, b: float) -> Root | None:
        """Return a root in a cell of depths a, b with equal counts, or None; begun where the phase turns most at either end."""
        if b - a < MIN_HIDDEN_DEPTH_RATIO * self.grid[-1]:
            return None
        for depth in (b, a):
            theta_min, theta_max = self.count(depth)[1]
            root = self._settle(self.system.root((theta_min + theta_max) / 2, depth, within=(a, b)))
            if root is not None and a < root.depth < b and 0 <= root.theta <= np.pi:
                return root
        return None

    def _remaining_cells(self, cell: _CountCell, root: Root) -> list[_CountCell]:
        """Return the parts of a cell on both sides of a root that does not explain all of its change."""
        lower, upper = root.depth * (1 - 1e-6), root.depth * (1 + 1e-6)
        if 0 < root.theta < np.pi:
            self.count.add(root.theta)
        count_below, count_above = self.count(lower)[0], self.count(upper)[0]
        parts = (_CountCell(cell.lower, lower, cell.below, count_below), _CountCell(upper, cell.upper, count_above, cell.above))
        return [part for part in parts if part.below != part.above and part.upper > part.lower]

    def _root(self, a: float, b: float, m: int, n: int) -> Root | None:
        """Return a root with a depth between a and b, at which the counts are m and n, or None.

        An odd change of the count is a real root, at theta = pi or 0, where the determinant changes its sign. An even one is
        begun from the theta at which the phase turns most.
        """
        middle = (a + b) / 2
        if (n - m) % 2:
            for theta in (np.pi, 0.0):
                root = self._real(theta, a, b)
                if root is not None:
                    return root
            return None
        theta_min, theta_max = self.count(middle)[1]
        root = self._settle(self.system.root((theta_min + theta_max) / 2, middle))
        if root is None or not a < root.depth < b or not 0 <= root.theta <= np.pi or root.change * (n - m) <= 0:
            return None
        return root

    def _settle(self, root: Root | None) -> Root | None:
        """Solve a root at theta = 0 or pi again as the flip or fold that it is: one multiplier, not a pair."""
        if root is None:
            return None
        real_angle = np.pi * round(root.theta / np.pi)
        return root if abs(root.theta - real_angle) > REAL_ANGLE_TOLERANCE else self.system.root(real_angle,
                                                                                                 root.depth, real=True)

    def _real(self, theta: float, a: float, b: float) -> Root | None:
        """Return the root at theta = 0 or pi between two depths, None where the determinant keeps its sign."""
        from scipy.optimize import brentq

        # At no depth the determinant is one and its logarithm has no slope to begin with.
        lower = max(a, 1e-9 * b)
        if (self.system.sign(theta, lower) > 0) == (self.system.sign(theta, b) > 0):
            return None
        # A rough bracket is enough: Newton's method on the eigenvalue goes on from there.
        depth = float(brentq(lambda w: self.system.sign(theta, w), lower, b, xtol=1e-6 * b, rtol=1e-6))
        root = self.system.root(theta, depth, real=True)
        return root if root is not None and lower < root.depth < b else None

    def _row(self, root: Root) -> list[Row]:
        """Return the row of a root, none where its correction takes it beyond the largest depth."""
        theta, depth, error = self.system.corrected(root)
        if abs(depth - root.depth) > 0.3 * root.depth:  # no first-order matter: the root stays, its error says so
            theta, depth = root.theta, root.depth
        theta = min(abs(theta), 2 * np.pi - theta)
        return [(depth, theta, root.change, error)] if depth <= self.grid[-1] else []

    def _bracketed_row(self, a: float, b: float, change: int) -> Row:
        """Return the row of a bracket without a root: where the measured band begins, the determinant jumps across zero."""
        theta_min, theta_max = self.count((a + b) / 2)[1]
        state = self.system.near((theta_min + theta_max) / 2, (a + b) / 2)
        return (a + b) / 2, (theta_min + theta_max) / 2, change, b - a + self.system.corrected(state)[2] + 2 * state.step


def chatter_frequency(system: HillSystem, theta: float) -> float:
    """Return the chatter frequency, Hz: of all ``|theta/(2 pi) + k|/T`` the one with the largest response."""
    f: FloatArray = np.abs(system.hertz(theta, system.harmonics))
    size: Array = np.linalg.norm(system.response.at(f), axis=(1, 2))
    return float(f[np.argmax(size)])
