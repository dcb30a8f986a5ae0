"""Counts of unstable multipliers over depth at one speed from the phase of Hill's determinant, and the boundary points."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray
from toolpoint.cutting.stability.hill.system import HillSystem, Root

WILD = 1.2  # rad: larger phase steps are halved
DIP = 2.0  # larger steps of the logarithm of its modulus are halved too: a dip may hide a turn
NARROW = 1e-6  # rad: least theta interval; a step that stays wild is a jump where the band begins or ends
MOST = 900  # theta nodes
PARTS = 4  # of a cell, for the signs at theta = 0 and pi
SMALLEST = 1e-3  # share of the largest depth below which nothing hidden is looked for
REAL = 1e-6  # rad: a root this near to 0 or pi is a fold or flip
UNLIKELY = 1e-4  # relative width of a bracket in which Newton's method should long have found the root
Row = tuple[float, float, int, float]  # depth, theta, change, error


class _CountCell(NamedTuple):
    """Depths between which the count may change, and the counts at both."""

    low: float
    high: float
    below: int
    above: int


class Phase:
    """Theta nodes over [0, pi] between which the logarithm of the determinant changes little, at one or many depths."""

    def __init__(self, start: FloatArray, value: Callable[[float], ComplexArray]) -> None:
        self.theta = start.tolist()
        self.value = [value(t) for t in self.theta]
        self.complete = True
        i = 0
        while i < len(self.theta) - 1:
            a, b = self.theta[i], self.theta[i + 1]
            step = _steps(self.value[i + 1] - self.value[i])
            if (np.abs(step.imag).max() < WILD and np.abs(step.real).max() < DIP) or b - a < NARROW:
                i += 1
                continue
            if len(self.theta) >= MOST:
                self.complete = False
                break
            self.theta.insert(i + 1, (a + b) / 2)
            self.value.insert(i + 1, value((a + b) / 2))


def _steps(difference: ComplexArray) -> ComplexArray:
    """Differences of logarithms with the phase in -pi .. pi."""
    return difference.real + 1j * ((difference.imag + np.pi) % (2 * np.pi) - np.pi)


def count_encirclements(theta: list[float], value: ComplexArray) -> tuple[int, tuple[float, float]]:
    """(unstable multipliers, theta interval of the largest phase step) from the determinant's logarithm at the nodes."""
    return _counts(theta, value[:, None])[0]


def _counts(theta: list[float], table: ComplexArray) -> list[tuple[int, tuple[float, float]]]:
    """Counts and intervals of every column."""
    step = _steps(np.diff(table, axis=0)).imag
    at = np.argmax(np.abs(step), axis=0).tolist()
    unstable = np.round(-step.sum(axis=0) / np.pi).astype(int).tolist()
    return [(n, (theta[k], theta[k + 1])) for n, k in zip(unstable, at, strict=True)]


class PlainCount:
    """Counts of a plain cut: its eigenvalues over theta serve every depth."""

    def __init__(self, system: HillSystem, start: FloatArray, levels: FloatArray) -> None:
        self.system, eigenvalues = system, {}

        def value(theta: float) -> ComplexArray:
            eigenvalues[theta] = system.eigenvalues(theta)
            return _logarithm(eigenvalues[theta], levels)

        phase = Phase(start, value)
        self.theta, self.complete = phase.theta, phase.complete
        self.eigenvalues = np.array([eigenvalues[t] for t in self.theta])
        table = np.array(phase.value)
        self.known = dict(zip(levels.tolist(), _counts(self.theta, table), strict=True))

    def __call__(self, depth: float) -> tuple[int, tuple[float, float]]:
        if depth in self.known:
            return self.known[depth]
        return count_encirclements(self.theta, _log_product(np.asarray(1 + depth * self.eigenvalues, complex)))

    def add(self, theta: float) -> None:
        """Take a root's theta as a node: close to it the determinant turns by half a circle within a hair."""
        at = int(np.searchsorted(self.theta, theta))
        self.theta.insert(at, theta)
        self.eigenvalues = np.insert(self.eigenvalues, at, self.system.eigenvalues(theta), axis=0)


class ShapedCount:
    """Counts of a cut whose shape depends on depth: a scan over theta for every depth."""

    def __init__(self, system: HillSystem, start: FloatArray) -> None:
        self.system, self.start, self.complete = system, start, True
        self.known: dict[float, tuple[int, tuple[float, float]]] = {}

    def __call__(self, depth: float) -> tuple[int, tuple[float, float]]:
        if depth not in self.known:
            phase = Phase(self.start, lambda t: np.array([self.system.logarithm(t, depth)]))
            self.complete &= phase.complete
            self.known[depth] = count_encirclements(phase.theta, np.array(phase.value)[:, 0])
        return self.known[depth]

    def add(self, theta: float) -> None:
        """Take a root's theta as a node."""
        self.start = np.union1d(self.start, [theta])


def _logarithm(eigenvalues: ComplexArray, depths: FloatArray) -> ComplexArray:
    """log prod(1 + depth eigenvalue) at these depths."""
    return _log_product(1 + depths[:, None] * eigenvalues[None, :])


def _log_product(factors: ComplexArray) -> ComplexArray:
    """Logarithm of the product along the last axis, its phase up to whole turns: one logarithm for every eight factors.

    Eight, as factors are far from 1e38 each, so that no product leaves the range of the numbers; logarithms of all factors
    were half the time of a chart.
    """
    whole = factors.shape[-1] // 8 * 8
    parts = factors[..., :whole].reshape(*factors.shape[:-1], whole // 8, 8).prod(axis=-1)
    return np.asarray(np.log(parts + 1e-300).sum(-1) + np.log(factors[..., whole:].prod(axis=-1) + 1e-300), complex)


def first_nodes(system: HillSystem, base: int) -> FloatArray:
    """Even theta nodes and more where a narrow resonance turns the determinant."""
    f, width = system.response.hints()
    spacing = np.pi / base
    around = []
    for middle, half in zip(f, width):
        turn, spread = 2 * np.pi * middle * system.period, 2 * np.pi * half * system.period
        if spread < spacing:
            around.append(turn + spread * np.array([-2.5, -0.8, 0.0, 0.8, 2.5]))
    extra = np.concatenate([np.zeros(0), *around]) % (2 * np.pi)
    nodes = np.sort(np.concatenate([np.linspace(0, np.pi, base + 1), np.where(extra > np.pi, 2 * np.pi - extra, extra)]))
    keep = np.concatenate([[True], np.diff(nodes) > 0.02 * spacing])
    return np.unique(np.concatenate([nodes[keep], [np.pi]]))


class HillSearch:
    """Boundary points of one speed."""

    def __init__(self, system: HillSystem, base: int, levels: FloatArray) -> None:
        self.system, self.base, self.grid = system, base, levels
        self.count = self._counting(base)
        self.bracketed = False

    def _counting(self, base: int) -> PlainCount | ShapedCount:
        start = first_nodes(self.system, base)
        return PlainCount(self.system, start, self.grid) if self.system.plain else ShapedCount(self.system, start)

    @property
    def status(self) -> str:
        """What of the search was not reached, else complete."""
        if not self.count.complete:
            return "the phase of some depths was not resolved: lower depth_max"
        return "some boundary points were bracketed only: see their error" if self.bracketed else "complete"

    def rows(self) -> list[Row]:
        """Boundary points up to the largest level; with more theta nodes where a count changes without a root: a turn of the
        phase between two nodes was not seen."""
        for base in (2 * self.base, 4 * self.base):
            rows = self._solved_band(last=False)
            if rows is not None:
                return rows
            self.count = self._counting(base)
        return self._solved_band(last=True) or []

    def _solved_band(self, last: bool) -> list[Row] | None:
        """Boundary points; None where a count changes without a root, unless it is the `last` attempt."""
        stack = self._cells()
        rows: list[Row] = []
        while stack:
            cell = stack.pop()
            a, b, m, n = cell
            root = self._hidden(a, b) if m == n else self._root(a, b, m, n)
            if root is not None:
                rows += self._row(root)
                if root.change != n - m:
                    stack += self._rest(cell, root)
            elif m == n:
                continue
            elif not last and b - a < UNLIKELY * b:
                return None
            elif b - a < 1e-7 * b:
                self.bracketed = True
                rows.append(self._jump(a, b, n - m))
            else:
                middle = (a + b) / 2
                half = self.count(middle)[0]
                stack += [c for c in (_CountCell(a, middle, m, half), _CountCell(middle, b, half, n)) if c.below != c.above]
        return rows

    def _cells(self) -> list[_CountCell]:
        """Depths between which the count is looked at; a shaped cut's cells of equal counts too, for what may hide in them."""
        turned = self._between_real_roots() if self.system.plain else self._turned()
        levels = [0.0, *sorted({*self.grid.tolist(), *turned})]
        counts = [0, *(self.count(w)[0] for w in levels[1:])]
        cells = [_CountCell(a, b, m, n) for (a, b), (m, n) in zip(pairwise(levels), pairwise(counts))]
        return [c for c in cells if c.below != c.above or (not self.system.plain and c.low > 0)]

    def _between_real_roots(self) -> list[float]:
        """Depths between the flips and folds of a plain cut, so that no two of them share a cell."""
        assert isinstance(self.count, PlainCount)
        ends = self.count.eigenvalues[[0, -1]].ravel()
        real = ends[(np.abs(ends.imag) < 1e-9 * np.abs(ends)) & (ends.real < 0)].real
        roots = np.sort(-1 / real[-1 / real < self.grid[-1]])
        return ((roots[1:] + roots[:-1]) / 2).tolist()

    def _turned(self) -> list[float]:
        """Depths between the levels at which the sign of the determinant at theta = 0 or pi is not that of the level below."""
        out = []
        before = (1.0, 1.0)
        for a, b in pairwise([0.0, *self.grid.tolist()]):
            parts = a + (b - a) * np.arange(1, PARTS + 1) / PARTS
            signs = [tuple(np.sign(self.system.sign(theta, w)) for theta in (0.0, np.pi)) for w in parts]
            out += [float(w) for w, pair in zip(parts[:-1], signs) if pair != before]
            before = signs[-1]
        return out

    def _hidden(self, a: float, b: float) -> Root | None:
        """A root in a cell whose ends have the same count, begun where the phase turns most at either end."""
        if b - a < SMALLEST * self.grid[-1]:
            return None
        for depth in (b, a):
            low, high = self.count(depth)[1]
            root = self._settled(self.system.root((low + high) / 2, depth, within=(a, b)))
            if root is not None and a < root.depth < b and 0 <= root.theta <= np.pi:
                return root
        return None

    def _rest(self, cell: _CountCell, root: Root) -> list[_CountCell]:
        """What is left of a cell on both sides of a root that does not explain all of its change."""
        low, high = root.depth * (1 - 1e-6), root.depth * (1 + 1e-6)
        if 0 < root.theta < np.pi:
            self.count.add(root.theta)
        before, after = self.count(low)[0], self.count(high)[0]
        parts = (_CountCell(cell.low, low, cell.below, before), _CountCell(high, cell.high, after, cell.above))
        return [part for part in parts if part.below != part.above and part.high > part.low]

    def _root(self, a: float, b: float, m: int, n: int) -> Root | None:
        """A root with a depth between a and b: real where the determinant changes its sign at 0 or pi, else from the theta
        where the phase turns most."""
        middle = (a + b) / 2
        if (n - m) % 2:
            for theta in (np.pi, 0.0):
                root = self._real(theta, a, b)
                if root is not None:
                    return root
            return None
        low, high = self.count(middle)[1]
        root = self._settled(self.system.root((low + high) / 2, middle))
        if root is None or not a < root.depth < b or not 0 <= root.theta <= np.pi or root.change * (n - m) <= 0:
            return None
        return root

    def _settled(self, root: Root | None) -> Root | None:
        """A root at theta = 0 or pi as the flip or fold that it is: one multiplier, not a pair."""
        if root is None:
            return None
        nearest = np.pi * round(root.theta / np.pi)
        return root if abs(root.theta - nearest) > REAL else self.system.root(nearest, root.depth, real=True)

    def _real(self, theta: float, a: float, b: float) -> Root | None:
        from scipy.optimize import brentq

        at = max(a, 1e-9 * b)
        if (self.system.sign(theta, at) > 0) == (self.system.sign(theta, b) > 0):
            return None
        depth = float(brentq(lambda w: self.system.sign(theta, w), at, b, xtol=1e-6 * b, rtol=1e-6))
        root = self.system.root(theta, depth, real=True)
        return root if root is not None and at < root.depth < b else None

    def _row(self, root: Root) -> list[Row]:
        """The point of a root, none where its correction takes it beyond the largest depth."""
        theta, depth, error = self.system.corrected(root)
        if abs(depth - root.depth) > 0.3 * root.depth:  # no first-order matter: the root stays, its error says so
            theta, depth = root.theta, root.depth
        theta = min(abs(theta), 2 * np.pi - theta)
        return [(depth, theta, root.change, error)] if depth <= self.grid[-1] else []

    def _jump(self, a: float, b: float, change: int) -> Row:
        """A point where Newton's method found no root: where the band begins the determinant jumps across zero."""
        low, high = self.count((a + b) / 2)[1]
        near = self.system.near((low + high) / 2, (a + b) / 2)
        return (a + b) / 2, (low + high) / 2, change, b - a + self.system.corrected(near)[2] + 2 * near.step


def chatter_frequency(system: HillSystem, theta: float) -> float:
    """Of all |theta/2 pi + k|/T the frequency with the largest response, Hz."""
    f: FloatArray = np.abs(system.hertz(theta, system.harmonics))
    size: Array = np.linalg.norm(system.response.at(f), axis=(1, 2))
    return float(f[np.argmax(size)])
