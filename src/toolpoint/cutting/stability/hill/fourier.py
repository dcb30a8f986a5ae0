"""HillCut: Fourier coefficients of a cut over one period, own and delayed, for the Hill matrix of HillDeterminant."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray
from toolpoint.cutting.cut.arc import gauss, lagrange
from toolpoint.cutting.cut.problem import MillingProblem

TURN = 2 * np.pi  # rad, a revolution


@dataclass(frozen=True)
class Slices:
    """Gauss slices of an edge, each field of shape (slices,); on the cylinder kappa, entry and leave hold one number for all.

    height : above the tip, m; kappa : axial immersion angle, rad (0 at the tip of a ball, pi/2 on the cylinder); entry, leave :
    angles at which the slice enters and leaves the work, rad; length : edge du that the slice stands for, a Gauss weight, m.
    """

    height: FloatArray
    kappa: FloatArray
    entry: FloatArray
    leave: FloatArray
    length: FloatArray


@dataclass(frozen=True, eq=False)
class HillCut:
    """The force of the edges as a Fourier series over one period of the rotation.

    The force on the tool is -(now r + C/v drag r' - sum_q late_q r(t - delay_q)), r its vibration (m), r' the rate of that, C
    the process damping (N/m), v the cutting speed. Coefficient h of each belongs to exp(i h 2 pi t/T), T the period, h from
    -order_max to order_max, h = 0 in the middle.

    Parameters
    ----------
    now, drag : (2 order_max + 1, d, d) complex
        N/m and m.
    late : (2 order_max + 1, delays, d, d) complex
        N/m.
    delay : (delays,) floats
        rad of rotation (time times the spindle's angular speed). Where delays change along an edge these are the nodes of an
        interpolation of exp(-i nu delay), nu the harmonic's frequency over the spindle's.
    teeth : int
        Periods in a revolution: the number of teeth of a regular tool, else one.
    """

    now: ComplexArray
    drag: ComplexArray
    late: ComplexArray
    delay: FloatArray
    teeth: int

    def scaled(self, factor: float) -> HillCut:
        """Return the same shape with the force multiplied (a plain edge is linear in depth)."""
        return HillCut(factor * self.now, factor * self.drag, factor * self.late, self.delay, self.teeth)


def is_plain(problem: MillingProblem) -> bool:
    """Whether the shape of the cut is the same at every depth, so that forces grow with it: neither helix nor corner radius."""
    return not problem.tool.has_helix and problem.tool.corner_radius == 0


def periods(problem: MillingProblem) -> int:
    """Return the number of periods of the cut in a revolution: the teeth of a regular tool, else one."""
    return problem.tool.teeth if problem.tool.is_regular else 1


def hill_cut(problem: MillingProblem, depth: float, order_max: int) -> HillCut:
    """Return the Fourier coefficients of the cut at this depth (m) up to order `order_max` of the period."""
    tool, number = problem.tool, periods(problem)
    # A regular tool repeats every tooth: all orders but multiples of the teeth cancel.
    order = number * np.arange(order_max + 1)
    start = np.concatenate([[0.0], np.cumsum(tool.pitch)[:-1]])
    slope = 2 * np.tan(np.asarray(tool.helix)) / tool.diameter
    d = problem.plane.size
    present, drag = np.zeros((order_max + 1, d, d), complex), np.zeros((order_max + 1, d, d), complex)
    delay, late = [], []
    for part in _edge_slices(problem, depth, float(np.abs(slope).max()), int(order[-1])):
        waves = _arc_waves(part, order)
        cut, push = (np.einsum("shk,skab->shab", waves, c[..., :d, :d]) for c in _directions(problem, part.kappa))
        ones = np.ones((1, part.height.size))
        for j in range(tool.teeth):
            turned = part.length[:, None] * np.exp(-1j * order * (start[j] + slope[j] * part.height[:, None]))
            present += _over_height(ones, turned, cut)[0]
            drag += _over_height(ones, turned, push)[0]
            edge_delay = (start[j] - start[j - 1]) % TURN + (slope[j] - slope[j - 1]) * part.height
            for nodes, share in _delays(edge_delay, TURN / tool.teeth if number > 1 else None, order_max):
                delay.append(nodes)
                late.append(_over_height(share, turned, cut))
    if not late:  # the tip stays beyond the walls of the work
        delay, late = [np.array([TURN])], [np.zeros((1, *present.shape), complex)]
    # Teeth of equal pitch share delays but for rounding: each is one column of waves less in every harmonic.
    delays, which = np.unique(np.round(np.concatenate(delay), 13), return_inverse=True)
    merged = np.zeros((delays.size, *present.shape), complex)
    np.add.at(merged, which, np.concatenate(late))
    return HillCut(_mirrored(present), _mirrored(drag), np.stack([_mirrored(m) for m in merged], axis=1), delays, number)


@lru_cache(maxsize=64)
def range_of_forces(problem: MillingProblem, order_max: int) -> ComplexArray:
    """Return an orthonormal basis of all forces of a plain cut, harmonics -order_max .. order_max, shape (harmonics d, rank).

    A force acts only while an edge cuts and, where one edge cuts at a time, along one direction: the range of the Toeplitz
    matrix of sum k k^T. It depends on the cut and the number of harmonics alone: neighbouring speeds share it.
    """
    d, order = problem.plane.size, periods(problem) * np.arange(2 * order_max + 1)
    part = _edge_slices(problem, 1.0, 0.0, 0)[0]
    t, n, minus_m = _vectors(part.kappa)
    kt, kn, ka = problem.coefficients.cutting / np.linalg.norm(problem.coefficients.cutting)
    force = kt * t + kn * n + ka * minus_m
    square = _product(force, force)
    if problem.process_damping > 0:
        push = n + problem.damping_friction * t
        square = square + _product(push, push)
    waves = np.einsum("shk,skab->hab", _arc_waves(part, order), square[..., :d, :d])
    start = np.concatenate([[0.0], np.cumsum(problem.tool.pitch)[:-1]])
    # The teeth differ in their starts only: their sum is one factor for each order.
    series = _mirrored(np.exp(-1j * order[:, None] * start).sum(1)[:, None, None] * waves)
    l = np.arange(2 * order_max + 1)
    blocks = series[l[:, None] - l[None, :] + 2 * order_max]
    # Hermitian and not negative: a sum of dyads. Its range is that of the forces themselves.
    size, basis = np.linalg.eigh(blocks.transpose(0, 2, 1, 3).reshape(d * l.size, d * l.size))
    # Directions below rounding of the largest are those in which no force acts.
    return np.ascontiguousarray(basis[:, size > 1e-14 * size[-1]])


def _mirrored(half: ComplexArray) -> ComplexArray:
    """Return the series (2 top + 1, ...) of a real function from its orders 0 .. top: a negative order is the conjugate."""
    return np.concatenate([half[:0:-1].conj(), half])


def _over_height(share: FloatArray, turned: ComplexArray, cut: ComplexArray) -> ComplexArray:
    """Sum over slices: share (sums, slices) times turned (slices, orders) times cut (slices or one, orders, d, d)."""
    if cut.shape[0] == 1:
        return (share @ turned)[..., None, None] * cut[0]
    terms = turned[..., None, None] * cut
    return (share @ terms.reshape(terms.shape[0], -1)).reshape(share.shape[0], *terms.shape[1:])


def _delays(edge_delay: FloatArray, single: float | None, order_max: int) -> list[tuple[FloatArray, FloatArray]]:
    """Return pairs of delays (n,) and shares (n, slices): how much of each slice counts at each delay.

    edge_delay : (slices,) behind the tooth before, rad; single : delay of a regular tool, rad, which is the same at all
    heights. Else there are Chebyshev nodes between the least and the largest delay, apart for each turn that an edge falls
    behind.
    """
    if single is not None:
        return [(np.array([single]), np.ones((1, edge_delay.size)))]
    # An edge of unequal helix may fall behind the one before it: its delay jumps by a turn there, which no interpolation
    # crosses.
    turns = np.floor((edge_delay + 1e-9) / TURN)
    out: list[tuple[FloatArray, FloatArray]] = []
    for turn in np.unique(turns):
        same_turn = turns == turn
        delay = edge_delay[same_turn] - TURN * turn
        delay = np.where(delay < 1e-9, TURN, delay)
        delay_min, delay_max = float(delay.min()), float(delay.max())
        half = (delay_max - delay_min) / 2
        # As many nodes as interpolate exp(-i nu delay) of the highest order to rounding.
        number = 1 if half < 1e-13 else 10 + int(np.ceil(0.8 * order_max * half))
        nodes = (delay_min + delay_max) / 2 + half * np.cos(np.pi * (np.arange(number) + 0.5) / number)
        share = np.zeros((number, edge_delay.size))
        share[:, same_turn] = 1.0 if number == 1 else lagrange((nodes - delay_min - half) / half,
                                                               (delay - delay_min - half) / half).T
        out.append((nodes, share))
    return out


def _edge_slices(problem: MillingProblem, depth: float, slope: float, highest: int) -> list[Slices]:
    """Return the slices of the rounded part and of the cylinder up to a depth (m), either left out where it does not cut.

    slope : largest turn of an edge over height, rad/m; highest : order for which the number of Gauss slices is chosen.
    """
    tool, arc, c = problem.tool, problem.engagement, problem.tool.corner_radius
    parts = []
    if c > 0:
        kappa_max = float(np.arccos(max(-1.0, 1 - min(depth, c) / c)))
        kappa, width = _corner_nodes(problem, kappa_max, 30 + int(np.ceil(0.4 * highest * (1 + slope * c))))
        radius = tool.radius - c + c * np.sin(kappa)
        entry, leave = arc.at_radius(tool.radius / np.maximum(radius, 1e-9 * tool.radius))
        keep = leave > entry
        if keep.any():
            parts.append(Slices(c * (1 - np.cos(kappa[keep])), kappa[keep], entry[keep], leave[keep], c * width[keep]))
    if depth > c:
        # A Gauss rule carries a wave with about 0.5 nodes a radian of its phase on both sides of 0; 14 more reach rounding.
        x, w, _ = gauss(1 if slope == 0 else 14 + int(np.ceil(0.27 * highest * slope * (depth - c))))
        part = np.ones(1)
        parts.append(Slices(c + (depth - c) * (1 + x) / 2, np.pi / 2 * part, arc.entry * part, arc.exit * part,
                            (depth - c) * w / 2))
    return parts


def _corner_nodes(problem: MillingProblem, kappa_max: float, number: int) -> tuple[FloatArray, FloatArray]:
    """Return nodes and weights in kappa (rad) from 0 to `kappa_max`, `number` of each for every piece.

    A piece ends where a wall of the work leaves the tool's reach. Entry and exit go with the square root there, so the sine
    squared makes nodes crowd at the ends of a piece.
    """
    tool, arc, c = problem.tool, problem.engagement, problem.tool.corner_radius
    # Where the radius times the cosine of a wall's angle equals the edge's own radius, the wall begins to be reached.
    sine = (tool.radius * np.abs(np.cos([arc.entry, arc.exit])) - (tool.radius - c)) / c
    marks = np.arcsin(sine[(sine > 1e-9) & (sine < 1 - 1e-12)])
    ends = np.unique(np.concatenate([[0.0, kappa_max], marks[marks < kappa_max]]))
    x, w, _ = gauss(number)
    fraction, rate = np.sin(np.pi * (1 + x) / 4) ** 2, np.pi / 4 * np.sin(np.pi * (1 + x) / 2)
    nodes = np.concatenate([a + (b - a) * fraction for a, b in pairwise(ends)])
    return nodes, np.concatenate([(b - a) * w * rate for a, b in pairwise(ends)])


def _arc_waves(part: Slices, order: Array) -> ComplexArray:
    """Return 1/(2 pi) times the integral of exp(-i (order - k) phi) over the arc, k = -2 .. 2, shape (slices, orders, 5)."""
    p = order[:, None] - np.arange(-2, 3)
    a, b = part.entry[:, None, None], part.leave[:, None, None]
    # The constant order has the length of the arc in place of 0/0.
    safe = np.where(p == 0, 1, p)
    waves = (np.exp(-1j * safe * a) - np.exp(-1j * safe * b)) / (2j * np.pi * safe)
    return np.where(p == 0, (b - a) / TURN, waves)


def _vectors(kappa: FloatArray) -> tuple[ComplexArray, ...]:
    """Return t, n and -m of `coefficients.edge_matrix` as series in exp(i q phi), q = -1, 0, 1; each (slices, q, component)."""
    sine, cosine = np.array([0.5j, 0, -0.5j]), np.array([0.5, 0, 0.5])
    unit, zero = np.array([0.0, 1, 0]), np.zeros(3)
    sk, ck = np.sin(kappa)[:, None, None], np.cos(kappa)[:, None, None]
    t = np.stack([cosine, -sine, zero], axis=-1)[None] + 0 * sk
    radial, axial = np.stack([sine, cosine, zero], axis=-1), np.stack([zero, zero, unit], axis=-1)
    n = radial * sk - axial * ck
    m = radial * ck + axial * sk
    return t, n, -m


def _product(left: ComplexArray, right: ComplexArray) -> ComplexArray:
    """Return the series of the dyad of two vectors, exp(i k phi), k = -2 .. 2, shape (slices, 5, 3, 3)."""
    out = np.zeros((left.shape[0], 5, 3, 3), complex)
    for p in range(3):
        for q in range(3):
            out[:, p + q] += left[:, p, :, None] * right[:, q, None, :]
    return out


def _directions(problem: MillingProblem, kappa: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Return k n^T (Pa) and the process damping's (n + mu t) n^T as series (slices, 5, 3, 3), see `_product`."""
    t, n, minus_m = _vectors(kappa)
    kt, kn, ka = problem.coefficients.cutting
    return _product(kt * t + kn * n + ka * minus_m, n), _product(n + problem.damping_friction * t, n)
