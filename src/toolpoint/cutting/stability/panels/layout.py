"""CutPanels: the cut of one speed and depth laid over panels of rotation, ready for the kernels of PanelArnoldi."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from toolpoint._check import Array, BoolArray, FloatArray
from toolpoint.cutting.cut.arc import gauss
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.stability.panels.edge_walls import limits, place
from toolpoint.cutting.stability.panels.laying import find_ends, lay_panels
from toolpoint.cutting.stability.panels.records import EdgeLaw, EdgeLines, Layout, Walls

UNLIMITED_POINTS = 1000  # Gauss points: more than any piece of an edge has
MAX_PANEL_NODES = 14  # nodes of a panel, while its least number is below 11


@lru_cache(maxsize=64)
def barycentric(n: int) -> FloatArray:
    """Return the weights of barycentric interpolation at n Gauss points."""
    x, w, _ = gauss(n)
    return (-1.0) ** np.arange(n) * np.sqrt((1 - x**2) * w)


@lru_cache(maxsize=64)
def node_table(nodes_max: int) -> tuple[FloatArray, FloatArray]:
    """Return the Gauss nodes and their barycentric weights, row n for n of them, padded: both (nodes_max + 1, nodes_max)."""
    nodes, weights = np.zeros((nodes_max + 1, nodes_max)), np.zeros((nodes_max + 1, nodes_max))
    for n in range(1, nodes_max + 1):
        nodes[n, :n], weights[n, :n] = gauss(n)[0], barycentric(n)
    return nodes, weights


@lru_cache(maxsize=64)
def rising_table(kinds: tuple[int, ...]) -> FloatArray:
    """Return the integration matrices of n-point panels, padded: (kinds, n + 1, n), the last row the weights of the whole
    panel."""
    out = np.zeros((len(kinds), max(kinds) + 1, max(kinds)))
    for place_, n in enumerate(kinds):
        _, w, rising = gauss(n)
        out[place_, :n, :n], out[place_, n, :n] = rising, w
    return out


@lru_cache(maxsize=64)
def legendre_table(kinds: tuple[int, ...]) -> FloatArray:
    """Return the Legendre polynomials at the Gauss nodes of every kind, padded: (kinds, n, n), row k holds P_k."""
    out = np.zeros((len(kinds), max(kinds), max(kinds)))
    for place_, n in enumerate(kinds):
        out[place_, :n, :n] = np.polynomial.legendre.legvander(gauss(n)[0], n - 1).T
    return out


class Edges(NamedTuple):
    """Edges of the tool as the panels need them: tips, lags and delays of the edges, rad, and their length marks, m.

    start, slope : lag of tooth j at height z is start + slope z; tip_delay, delay_slope : its delay likewise; spread : whether
    delays change with height; marks : edge lengths where pieces of integration end; turns : those of them where a wall of the
    work begins to bound a rounded edge, or its entry or exit turns back; period : rad; corner : radius, m; points : Gauss
    points on a piece of an edge; steepest : largest size of a slope, rad/m.
    """

    start: FloatArray
    slope: FloatArray
    tip_delay: FloatArray
    delay_slope: FloatArray
    spread: bool
    marks: FloatArray
    turns: FloatArray
    period: float
    corner: float
    points: int
    steepest: float

    @property
    def lines(self) -> EdgeLines:
        """Fields that the kernels read."""
        return EdgeLines(self.start, self.slope, self.tip_delay, self.delay_slope, self.spread, self.marks)

    @classmethod
    def of(cls, problem: MillingProblem, depth: float, points: int) -> Edges:
        """Return the edges at this depth; `points` Gauss points on a piece of a helical or rounded edge."""
        edges = _whole_edges(problem)
        marks = _marks(problem, depth, edges.steepest)
        turns = edges.turns
        if edges.corner > 0:
            turns = turning_points(problem, depth)
            marks = np.unique(np.concatenate([marks, turns]))
        return edges._replace(marks=marks, turns=turns, points=min(edges.points, points))


@lru_cache(maxsize=4)
def _whole_edges(problem: MillingProblem) -> Edges:
    """Return the part of the edges that does not change with depth; points: 1 where a piece needs no more, else unlimited."""
    tool = problem.tool
    start = np.concatenate([[0.0], np.cumsum(tool.pitch)[:-1]])
    slope = 2 * np.tan(np.asarray(tool.helix)) / tool.diameter
    delay_slope = slope - np.roll(slope, 1)
    tip_delay = (start - np.roll(start, 1)) % (2 * np.pi)
    # A single tooth follows itself: the remainder of a whole turn is none.
    tip_delay = np.where(tip_delay < 1e-12, 2 * np.pi, tip_delay)
    is_tooth_periodic = tool.is_regular and problem.speed_variation is None
    revolutions = 1 if problem.speed_variation is None else problem.speed_variation.revolutions
    is_linear = not tool.has_helix and tool.corner_radius == 0
    return Edges(start, slope, tip_delay, delay_slope, bool(np.ptp(slope) > 1e-12), np.zeros(0), np.zeros(0),
                 2 * np.pi / tool.teeth if is_tooth_periodic else 2 * np.pi * revolutions, tool.corner_radius,
                 1 if is_linear else UNLIMITED_POINTS,
                 float(np.abs(slope).max()))


def is_plain(problem: MillingProblem) -> bool:
    """Whether all edges are straight and square: the cut is then linear in its depth."""
    return _whole_edges(problem).points == 1


def _marks(problem: MillingProblem, depth: float, slope: float) -> FloatArray:
    """Return edge lengths from the tip to the depth, with pieces over which the lag grows by at most a third of the arc or half
    a rad."""
    step = min(0.5, problem.engagement.arc / 3)
    corner = problem.tool.corner_radius
    if corner == 0:
        number = max(1, int(np.ceil(slope * depth / step)))
        marks = np.arange(number + 1) * (depth / number)
        marks[-1] = depth
        return marks
    kappa_max = float(np.arccos(max(-1.0, 1 - min(depth, corner) / corner)))
    number = max(3, int(np.ceil(slope * min(depth, corner) / step)))
    marks = corner * np.linspace(0.0, kappa_max, number + 1)
    if depth > corner:
        number = max(1, int(np.ceil(slope * (depth - corner) / step)))
        marks = np.concatenate([marks, marks[-1] + np.linspace(0, depth - corner, number + 1)[1:]])
    return marks


def turning_points(problem: MillingProblem, depth: float) -> FloatArray:
    """Return the edge lengths on the corner, up to a depth, where a wall begins to bound the local radius, and where the entry
    or exit of a helical edge moves neither up nor down it: there the cut begins or ends within the edge, not at its ends."""
    corner = problem.tool.corner_radius
    turns = _corner_turns(problem)
    return turns[turns < corner * float(np.arccos(max(-1.0, 1 - min(depth, corner) / corner)))]


@lru_cache(maxsize=16)
def _corner_turns(problem: MillingProblem) -> FloatArray:
    """Return the turning points of the whole corner: all depths share them."""
    arc, radius, corner = problem.engagement, problem.tool.radius, problem.tool.corner_radius
    walls = (radius * np.abs(np.cos([arc.entry, arc.exit])) - radius + corner) / corner
    length_max = 0.5 * np.pi * corner
    begins = corner * np.arcsin(walls[(walls > 0) & (walls < 1)])
    # Chebyshev places: the walls' angles turn as a square root where a wall begins to bound the corner, and there the grid
    # is dense.
    grid = np.unique(np.concatenate([length_max * (1 - np.cos(np.linspace(0, np.pi, 400))) / 2, begins[begins < length_max]]))
    lengths = [u for u in begins.tolist() if u < length_max]
    slopes = _whole_edges(problem).slope
    for slope in np.unique(slopes[slopes > 0]).tolist():
        for wall in range(2):
            def angle(u: float, wall: int = wall, slope: float = slope) -> float:
                z, _, r = place(u, corner, radius)
                return float(limits(arc.entry, arc.exit, radius / max(r, 1e-9 * radius))[wall] + slope * z)

            rise = np.sign(np.diff(_wall_angles(problem, grid, wall) + slope * _corner_heights(problem, grid)))
            lengths += [_turning_length(angle, float(grid[i]), float(grid[i + 2]), float(rise[i]))
                      for i in np.flatnonzero(rise[:-1] * rise[1:] < 0)]
    return np.unique(np.array(lengths))


def _corner_heights(problem: MillingProblem, lengths: FloatArray) -> FloatArray:
    """Return the heights of places on the corner, as `edge_walls.place` gives them one by one."""
    corner = problem.tool.corner_radius
    return np.asarray(corner * (1 - np.cos(np.minimum(lengths / corner, 0.5 * np.pi))))


def _wall_angles(problem: MillingProblem, lengths: FloatArray, wall: int) -> FloatArray:
    """Return the entry (wall 0) or exit (1) at places on the corner, as `edge_walls.limits` gives them one by one."""
    arc, radius, corner = problem.engagement, problem.tool.radius, problem.tool.corner_radius
    local = radius - corner + corner * np.sin(np.minimum(lengths / corner, 0.5 * np.pi))
    ratio, angle = radius / np.maximum(local, 1e-9 * radius), (arc.entry, arc.exit)[wall]
    return np.where(ratio == 1.0, angle, np.arccos(np.clip(np.cos(angle) * ratio, -1.0, 1.0)))


def _turning_length(angle: Callable[[float], float], length_min: float, length_max: float, rising: float) -> float:
    """Return the edge length between two at which an angle is largest (`rising` first) or smallest."""
    from scipy.optimize import minimize_scalar

    return float(minimize_scalar(lambda u: -rising * angle(u), bounds=(length_min, length_max), method="bounded",
                                 options={"xatol": 1e-12 * length_max}).x)


class CutPanels:
    """Panels of one depth (m): nodes, cut and delayed entries, in the order that the kernels take (`layout`).

    waves : nodes per radian of rotation that the modes need; nodes_min : nodes of a panel beside these; points : Gauss points
    on a piece of a helical or rounded edge. `empty` says that no edge is within the walls of the work.
    """

    def __init__(self, problem: MillingProblem, depth: float, waves: float, nodes_min: int, points: int) -> None:
        edges = Edges.of(problem, depth, points)
        self.edges, self.problem, self.depth, self.is_linear = edges, problem, depth, edges.points == 1
        arc, marks = problem.engagement, edges.marks
        self.walls = Walls(edges.corner, problem.tool.radius, arc.entry, arc.exit)
        heights = sorted({0.0, float(marks[-1]), min(0.5 * np.pi * edges.corner, float(marks[-1])), *edges.turns.tolist()})
        # A panel that looks back into itself would have to be solved for what it reads: it stays shorter than any delay,
        # and delays that change with height may be half of the tip's.
        shortest = float(edges.tip_delay.min() if not edges.spread else 0.5 * edges.tip_delay.min())
        longest = max(MAX_PANEL_NODES - nodes_min, 3) / waves  # rad that a panel's nodes resolve
        self.ends = find_ends(np.array(heights), edges.lines, self.walls, edges.period, min(0.95 * shortest, longest))
        count = nodes_min + np.ceil(waves * (self.ends[1:] - self.ends[:-1])).astype(int)
        self._lay(count)
        if not self.empty:
            # In low immersion most of the period is neither cut nor looked back into: the modes pass it in closed form.
            keep = self.cutting | self.needed
            if not keep.all():
                self._leave_out(~keep)

    def scale(self, depth: float) -> float:
        """Return the factor of the laid cut at another depth: a plain cut is linear in it, any other holds for its own
        alone."""
        return depth / self.depth if self.is_linear else 1.0

    def _lay(self, count: Array) -> None:
        """Lay the cut over panels with so many nodes each."""
        problem, edges = self.problem, self.edges
        self.count = count
        self.empty = not count.any()  # no edge is within the walls of the work
        if self.empty:
            return
        x, w, _ = gauss(edges.points)
        law = EdgeLaw(problem.coefficients.cutting, problem.damping_friction)
        self.angle, self.half, self.offset, self.cutting, self.needed, *laid = lay_panels(
            self.ends, count, node_table(int(count.max())), (edges.lines, self.walls, law, x, w, edges.period),
            problem.plane.size)
        self.layout = Layout(self.offset, count, self.cutting, *laid)
        self._set_kinds()

    def _leave_out(self, unused: BoolArray) -> None:
        """Leave out the nodes of panels that neither cut nor are looked into: nothing is laid on them."""
        kept, count = np.repeat(~unused, self.count), np.where(unused, 0, self.count)
        self.count, self.empty = count, not count.any()
        if self.empty:
            return
        self.angle, self.half, self.offset = self.angle[kept], self.half[kept], np.cumsum(count) - count
        laid = self.layout
        self.layout = laid._replace(
            offset=self.offset, number=count, now=laid.now[kept], drag=laid.drag[kept], rows=laid.rows[:, :count.max()].copy(),
            first=np.append(laid.first[:-1][kept], laid.first[-1]))
        self._set_kinds()

    def _set_kinds(self) -> None:
        count = self.count
        kinds = tuple(sorted(set(count.tolist()) - {0}))
        self.kind = np.searchsorted(kinds, np.maximum(count, kinds[0]))
        self.rising, self.legendre = rising_table(kinds), legendre_table(kinds)

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return int(self.count.sum())

    @property
    def nbytes(self) -> int:
        """Memory taken, bytes."""
        return 0 if self.empty else sum(part.nbytes for part in self.layout)
