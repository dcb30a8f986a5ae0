"""CutPanels: the cut of one speed and depth laid over panels of rotation, ready for the kernels of PanelArnoldi."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from toolpoint._check import Array, FloatArray
from toolpoint.cutting.cut.arc import gauss
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.stability.panels.kernels import lay, limits, look_back, place
from toolpoint.cutting.stability.panels.records import EdgeLaw, EdgeLines, LaidCut, Layout, LookBack, PanelNodes, Walls

MANY = 1000  # more Gauss points than any piece of an edge has
LARGEST_PANEL = 14  # nodes, where fewer than 11 are the least


@lru_cache(maxsize=64)
def barycentric(n: int) -> FloatArray:
    """Weights of barycentric interpolation at n Gauss points."""
    x, w, _ = gauss(n)
    return (-1.0) ** np.arange(n) * np.sqrt((1 - x**2) * w)


@lru_cache(maxsize=64)
def rising_table(kinds: tuple[int, ...]) -> FloatArray:
    """Integration matrices of n-point panels, padded: (kinds, n + 1, n), the last row the weights of the whole panel."""
    out = np.zeros((len(kinds), max(kinds) + 1, max(kinds)))
    for place_, n in enumerate(kinds):
        _, w, rising = gauss(n)
        out[place_, :n, :n], out[place_, n, :n] = rising, w
    return out


@lru_cache(maxsize=64)
def legendre_table(kinds: tuple[int, ...]) -> FloatArray:
    """Legendre polynomials at the Gauss nodes of every kind, padded: (kinds, n, n), row k holds P_k."""
    out = np.zeros((len(kinds), max(kinds), max(kinds)))
    for place_, n in enumerate(kinds):
        out[place_, :n, :n] = np.polynomial.legendre.legvander(gauss(n)[0], n - 1).T
    return out


@dataclass(frozen=True)
class Edges:
    """What of the tool matters to the panels: tips, lags and delays of the edges, rad, and their length marks, m.

    start, slope : lag of tooth j at height z is start + slope z; ahead, ahead_slope : its delay the same way; spread : whether
    delays change with height; marks : edge lengths where pieces of integration end; turns : those of them where a wall of the
    work begins to bound a rounded edge, or its entry or exit turns back; period : rad.
    """

    start: FloatArray
    slope: FloatArray
    ahead: FloatArray
    ahead_slope: FloatArray
    spread: bool
    marks: FloatArray
    turns: FloatArray
    period: float
    corner: float
    points: int

    @property
    def lines(self) -> EdgeLines:
        """What the kernels read of the edges."""
        return EdgeLines(self.start, self.slope, self.ahead, self.ahead_slope, self.spread, self.marks)

    @classmethod
    def of(cls, problem: MillingProblem, depth: float, points: int) -> Edges:
        """Return the edges at this depth; `points` Gauss points on a piece of a helical or rounded edge."""
        every = _whole_edges(problem)
        marks = _marks(problem, depth, float(np.abs(every.slope).max()))
        turns = every.turns
        if every.corner > 0:
            turns = turning_points(problem, depth, every.slope)
            marks = np.unique(np.concatenate([marks, turns]))
        return replace(every, marks=marks, turns=turns, points=min(every.points, points))


@lru_cache(maxsize=4)
def _whole_edges(problem: MillingProblem) -> Edges:
    """Return what of the edges does not change with depth; points: 1 where a piece needs no more, else as many as wanted."""
    tool = problem.tool
    start = np.concatenate([[0.0], np.cumsum(tool.pitch)[:-1]])
    slope = 2 * np.tan(np.asarray(tool.helix)) / tool.diameter
    slope_ahead = slope - np.roll(slope, 1)
    ahead = (start - np.roll(start, 1)) % (2 * np.pi)
    ahead = np.where(ahead < 1e-12, 2 * np.pi, ahead)
    alike = tool.is_regular and problem.speed_variation is None
    revolutions = 1 if problem.speed_variation is None else problem.speed_variation.revolutions
    plain = not tool.has_helix and tool.corner_radius == 0
    return Edges(start, slope, ahead, slope_ahead, bool(np.ptp(slope) > 1e-12), np.zeros(0), np.zeros(0),
                 2 * np.pi / tool.teeth if alike else 2 * np.pi * revolutions, tool.corner_radius, 1 if plain else MANY)


def _marks(problem: MillingProblem, depth: float, slope: float) -> FloatArray:
    """Edge lengths from the tip to the depth: pieces over which the lag grows by a third of the arc, half a rad, at most."""
    step = min(0.5, problem.engagement.arc / 3)
    corner = problem.tool.corner_radius
    if corner == 0:
        number = max(1, int(np.ceil(slope * depth / step)))
        return np.linspace(0.0, depth, number + 1)
    top = float(np.arccos(max(-1.0, 1 - min(depth, corner) / corner)))
    number = max(3, int(np.ceil(slope * min(depth, corner) / step)))
    marks = corner * np.linspace(0.0, top, number + 1)
    if depth > corner:
        number = max(1, int(np.ceil(slope * (depth - corner) / step)))
        marks = np.concatenate([marks, marks[-1] + np.linspace(0, depth - corner, number + 1)[1:]])
    return marks


def turning_points(problem: MillingProblem, depth: float, slopes: FloatArray) -> FloatArray:
    """Edge lengths on the corner where a wall begins to bound the local radius, and where the entry or exit of a helical edge
    moves neither up nor down it: there the cut begins or ends within the edge, not at its ends."""
    arc, radius, corner = problem.engagement, problem.tool.radius, problem.tool.corner_radius
    walls = (radius * np.abs(np.cos([arc.entry, arc.exit])) - radius + corner) / corner
    top = corner * float(np.arccos(max(-1.0, 1 - min(depth, corner) / corner)))
    begins = corner * np.arcsin(walls[(walls > 0) & (walls < 1)])
    grid = np.unique(np.concatenate([top * (1 - np.cos(np.linspace(0, np.pi, 200))) / 2, begins[begins < top]]))
    lengths = [u for u in begins.tolist() if u < top]
    for slope in np.unique(slopes[slopes > 0]).tolist():
        for wall in range(2):
            def angle(u: float, wall: int = wall, slope: float = slope) -> float:
                z, _, r = place(u, corner, radius)
                return float(limits(arc.entry, arc.exit, radius / max(r, 1e-9 * radius))[wall] + slope * z)

            rise = np.sign(np.diff([angle(u) for u in grid]))
            lengths += [_turn(angle, float(grid[i]), float(grid[i + 2]), float(rise[i]))
                      for i in np.flatnonzero(rise[:-1] * rise[1:] < 0)]
    return np.unique(np.array(lengths))


def _turn(angle: Callable[[float], float], low: float, high: float, rising: float) -> float:
    """Where between two edge lengths an angle is largest (`rising` first) or smallest."""
    from scipy.optimize import minimize_scalar

    return float(minimize_scalar(lambda u: -rising * angle(u), bounds=(low, high), method="bounded",
                                 options={"xatol": 1e-12 * high}).x)


def ends_of(problem: MillingProblem, edges: Edges, longest: float) -> FloatArray:
    """Ends of the panels, rad: entries and exits of tip, corner and top of every edge, the same one delay later where that
    edge cuts, split so that none is longer than `longest`."""
    arc, radius = problem.engagement, problem.tool.radius
    times, later = [], []
    heights = {0.0, float(edges.marks[-1]), min(0.5 * np.pi * edges.corner, float(edges.marks[-1])), *edges.turns.tolist()}
    span = []
    for u in sorted(heights):
        z, _, r = place(u, edges.corner, radius)
        entry, leave = limits(arc.entry, arc.exit, radius / max(r, 1e-9 * radius))
        lag, delay = edges.start + edges.slope * z, edges.ahead + edges.ahead_slope * z
        times += [entry + lag, leave + lag]
        span.append((entry + lag, leave + lag, delay))
    turns = 2 * np.pi * np.arange(max(1, round(edges.period / (2 * np.pi))))
    first = (np.concatenate(times)[:, None] + turns).ravel() % edges.period
    first = np.unique(np.round(first / edges.period, 11)) * edges.period
    for low, high, delay in span:
        for j in range(low.size):  # images matter only while that edge cuts
            image = first + delay[j]
            inside = ((image - low[j] - 1e-9) % (2 * np.pi)) < (high[j] - low[j])
            later.append(image[inside] % edges.period)
    every = np.concatenate([[0.0, edges.period], first, *later]) if edges.period > 0 else first
    every = np.unique(np.round(every / edges.period, 11)) * edges.period
    parts = np.maximum(1, np.ceil(np.diff(every) / longest).astype(int))
    return np.concatenate([[0.0], *(a + (b - a) * np.arange(1, n + 1) / n for a, b, n in zip(every[:-1], every[1:], parts))])


class CutPanels:
    """Panels of one depth: nodes, cut and delayed entries, in the order that the kernels take (`layout`)."""

    def __init__(self, problem: MillingProblem, depth: float, waves: float, least: int, points: int) -> None:
        edges = Edges.of(problem, depth, points)
        plain = edges.points == 1
        shortest = float(edges.ahead.min() if not edges.spread else 0.5 * edges.ahead.min())
        longest = max(LARGEST_PANEL - least, 3) / waves  # rad that a panel's nodes resolve
        self.ends = ends_of(problem, edges, min(0.95 * shortest, longest))
        self.edges, self.problem = edges, problem
        count = least + np.ceil(waves * np.diff(self.ends)).astype(int)
        self._lay(count, gauss(edges.points), least)
        keep = self.cutting | self.needed
        if not keep.all():
            self._lay(np.where(keep, count, 0), gauss(edges.points), least)
        self.depth, self.plain = depth, plain

    def scale(self, depth: float) -> float:
        """Factor of the laid cut at another depth: a plain cut is linear in it, any other holds for its own alone."""
        return depth / self.depth if self.plain else 1.0

    def _lay(self, count: Array, rule: tuple[FloatArray, ...], least: int) -> None:
        problem, edges = self.problem, self.edges
        self.count, self.offset = count, np.concatenate([[0], np.cumsum(count)[:-1]])
        q, d = int(count.sum()), problem.plane.size
        self.empty = q == 0  # no edge is within the walls of the work
        if self.empty:
            return
        x = np.concatenate([gauss(int(n))[0] for n in count if n > 0])
        bary = np.concatenate([barycentric(int(n)) for n in count if n > 0])
        panel = np.repeat(np.arange(count.size), count)
        half = np.diff(self.ends)[panel] / 2
        self.angle, self.half = self.ends[panel] + half * (1 + x), half
        room = q * edges.start.size * ((edges.marks.size * rule[0].size) if edges.spread else 1)
        cut = LaidCut(np.zeros((q, d, d)), np.zeros((q, d, d)), np.zeros(q + 1, np.int64), np.zeros((room, d, d)),
                      np.zeros(room))
        arc, radius = problem.engagement, problem.tool.radius
        used = lay(self.angle, edges.lines, Walls(edges.corner, radius, arc.entry, arc.exit),
                   EdgeLaw(problem.coefficients.cutting, problem.damping_friction), rule[0], rule[1], cut)
        self.cutting = np.zeros(count.size, bool)
        self.cutting[panel[np.diff(cut.first) > 0]] = True
        self.needed = np.zeros(count.size, bool)
        entries = LookBack(np.zeros(used, np.int64), np.zeros(used, bool), np.zeros((used, int(count.max()))))
        look_back(self.angle, cut.first, cut.back[:used], PanelNodes(edges.period, self.ends, self.offset, count, x, bary),
                  self.needed, entries)
        self.layout = Layout(self.offset, count, self.cutting, cut.now, cut.drag, cut.first, cut.matrix[:used], *entries)

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return int(self.count.sum())

    @property
    def nbytes(self) -> int:
        """Memory taken, bytes."""
        return 0 if self.empty else sum(part.nbytes for part in self.layout)
