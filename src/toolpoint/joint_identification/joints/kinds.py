r"""The kinds of joint: the twists that each leaves free, as a function of few parameters.

A joint is named by its freedoms, that is by the motions that the modes show, and by nothing else. A kind is a set of
directions of one frame, any of x y z rx ry rz: there are twenty such sets that no renaming of the frame's axes makes equal
(`WAYS`), among them

- locked, slide (x), hinge (rx), cylindrical (x and rx), universal (rx, ry), turn and slide (x, rz), spherical, planar (x, y,
  rz), guide (all but one translation), mount (all six); those without a name in the trade are called by their directions;
- screw: one rotation that drags a translation along its axis in a fixed ratio;
- general: any other subspace of twists, among it skew axes.

A paper may name the same joint by its design: a cylindrical joint that only ever turns (the column of Machines 2022, 10(11),
1102, of which a rotation about x is all that its table lists) is a hinge here, because no mode slides along its axis.

The free twists of a kind are :math:`Ad(F) E_S` with the frame F and the unit twists :math:`E_S` of its directions. Motions of
the frame that leave this subspace as it is (the stabiliser: twists xi with :math:`[\xi, E_S]` inside the span) are no
parameters; all others are, as coordinates of :math:`F \exp(N \theta)`.

Everything is written about a reference point near the joint and divided by a length, so that a twist is (velocity at
the reference point, length times rotation) and all six numbers are displacements of one size. A rotation about d through
p is :math:`(p \times d, d)`. Every chart is centred on a start: its parameters are zero there.
Source of twists and adjoints: Murray, Li, Sastry, A Mathematical Introduction to Robotic Manipulation, chapter 2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import combinations, permutations

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.spatial import transform as tf
from toolpoint.spatial.rotation import skew

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
_NAMED_KINDS = {
    "locked": (), "slide": ("x",), "hinge": ("rx",), "cylindrical": ("x", "rx"), "turn and slide": ("x", "rz"),
    "universal": ("rx", "ry"), "two slides": ("x", "y"), "spherical": ("rx", "ry", "rz"), "planar": ("x", "y", "rz"),
    "three slides": ("x", "y", "z"), "guide": ("y", "z", "rx", "ry", "rz"), "mount": DIRECTIONS}


def _signature(ways: tuple[str, ...]) -> tuple[int, int, int]:
    """Return the numbers of translations, of rotations, and of axes with both: equal for sets that renaming makes equal."""
    slides, turns = {w for w in ways if len(w) == 1}, {w[1] for w in ways if len(w) == 2}
    return len(slides), len(turns), len(slides & turns)


def _catalogue() -> dict[str, tuple[str, ...]]:
    """Return all sets of directions, one of those that renaming makes equal, by name."""
    result = dict(_NAMED_KINDS)
    signatures = {_signature(ways) for ways in result.values()}
    for count in range(1, 7):
        for ways in combinations(DIRECTIONS, count):
            if _signature(ways) not in signatures:
                signatures.add(_signature(ways))
                result["free in " + " ".join(ways)] = ways
    return result


WAYS = _catalogue()
SLIDING_TURN = 1e-9  # rad/m: turn of a twist over its translation, below which it is a slide


@dataclass(frozen=True, eq=False)
class FreedomChart:
    """A kind near a start.

    `basis` maps the parameters (n,) to the free twists (6, freedoms); `frame` maps them to the joint's frame (4, 4);
    `ways` are the directions of that frame, empty for a screw and a general joint.
    """

    kind: str
    freedoms: int
    parameters: int
    basis: Callable[[FloatArray], FloatArray]
    frame: Callable[[FloatArray], FloatArray]
    ways: tuple[str, ...] = ()


def unit_twists(ways: tuple[str, ...]) -> FloatArray:
    """Return the unit twists (6, f) of directions."""
    return np.eye(6)[:, [DIRECTIONS.index(way) for way in ways]]


def charts(span: FloatArray) -> list[FreedomChart]:
    """Return the kinds of as many freedoms as `span` (6, f) has columns, each started from where it lies nearest to it."""
    f = span.shape[1]
    result = [frame_chart(kind, nearest_frame(span, ways), ways) for kind, ways in WAYS.items() if len(ways) == f]
    return [*result, screw_chart(span)] if f == 1 else result


def frame_chart(kind: str, start: FloatArray, ways: tuple[str, ...]) -> FreedomChart:
    """Return the chart of a kind whose frame starts at `start` (4, 4)."""
    units, motions = unit_twists(ways), effective_moves(ways)
    start = _near_origin(start, ways)

    def frame(theta: FloatArray) -> FloatArray:
        return start @ tf.exponential(motions @ theta) if motions.shape[1] else start

    return FreedomChart(kind, len(ways), motions.shape[1], lambda theta: tf.adjoint(frame(theta)) @ units, frame, ways)


def general(span: FloatArray) -> FreedomChart:
    """Return the chart of all subspaces of f twists near `span` (6, f), orthonormal columns: f (6 - f) parameters."""
    full = np.linalg.qr(np.hstack([span, np.eye(6)]))[0][:, :6]
    f = span.shape[1]
    inside, outside = full[:, :f], full[:, f:]

    def basis(theta: FloatArray) -> FloatArray:
        return inside + outside @ theta.reshape(6 - f, f)

    return FreedomChart("general", f, f * (6 - f), basis, lambda theta: tf.transform(None, nearest_point(basis(theta))))


def screw_chart(span: FloatArray) -> FreedomChart:
    """Return the chart of one screw near a twist: five parameters; its frame has the axis as x."""
    chart = general(span)

    def frame(theta: FloatArray) -> FloatArray:
        v, w = np.split(chart.basis(theta)[:, 0], 2)
        turn = float(np.linalg.norm(w))
        if turn < SLIDING_TURN * np.linalg.norm(v):  # a slide, whose axis lies nowhere: that of exact modes has no turn at all
            return tf.transform(_from_axis(v / np.linalg.norm(v)))
        return tf.transform(_from_axis(w / turn), np.cross(w, v) / turn**2)

    return FreedomChart("screw", 1, chart.parameters, chart.basis, frame)


@cache
def _stabiliser(ways: tuple[str, ...]) -> FloatArray:
    """Return orthonormal twists (6, s), in the joint's frame, that move the frame and keep the span of its directions."""
    inside = unit_twists(ways)
    outside = np.eye(6) - inside @ inside.T
    rows = np.concatenate([(outside @ np.stack([tf.twist_bracket(e, b) for e in np.eye(6)], axis=1)) for b in inside.T]
                          ) if ways else np.zeros((1, 6))
    singular, vt = np.linalg.svd(rows)[1:]
    return np.asarray(vt[int((singular > 1e-9).sum()):].T)


@cache
def _centraliser(ways: tuple[str, ...]) -> FloatArray:
    """Return orthonormal twists (6, s) that move the frame and keep each direction: no stiffness determines them."""
    rows = np.concatenate([np.stack([tf.twist_bracket(e, b) for e in np.eye(6)], axis=1) for b in unit_twists(ways).T]
                          ) if ways else np.zeros((1, 6))
    singular, vt = np.linalg.svd(rows)[1:]
    return np.asarray(vt[int((singular > 1e-9).sum()):].T)


@cache
def effective_moves(ways: tuple[str, ...], with_stiffness: bool = False) -> FloatArray:
    """Return orthonormal twists (6, n) in the joint's frame that move the free twists.

    With stiffness, also those that move the directions within their span: elastic centre, principal directions.
    """
    stabiliser = _centraliser(ways) if with_stiffness else _stabiliser(ways)
    return np.asarray(np.linalg.svd(stabiliser, full_matrices=True)[0][:,
                                                                       stabiliser.shape[1]:]) if stabiliser.size else np.eye(6)


@cache
def inner_moves(ways: tuple[str, ...]) -> FloatArray:
    """Return twists (6, n) that move the directions within their span: only the stiffness determines them."""
    stabiliser, centraliser = _stabiliser(ways), _centraliser(ways)
    remaining = stabiliser - centraliser @ (centraliser.T @ stabiliser)
    left, singular, _ = np.linalg.svd(remaining, full_matrices=False)
    return np.asarray(left[:, singular > 1e-9])


def idle_translations(ways: tuple[str, ...], with_stiffness: bool) -> FloatArray:
    """Return orthonormal translations (3, n), in the joint's frame, that change neither the free twists nor (with stiffness)
    what their springs do."""
    stabiliser = _centraliser(ways) if with_stiffness else _stabiliser(ways)
    left, singular, _ = np.linalg.svd(stabiliser[:3], full_matrices=False)
    return np.asarray(left[:, singular > 1e-9])


def turning_axes(ways: tuple[str, ...]) -> FloatArray:
    """Return orthonormal directions (3, n), in the joint's frame, about which the motions alone do not orient the frame."""
    left, singular, _ = np.linalg.svd(_stabiliser(ways)[3:], full_matrices=False)
    return np.asarray(left[:, singular > 1e-9])


def nearest_frame(span: FloatArray, ways: tuple[str, ...]) -> FloatArray:
    """Return the frame (4, 4) in which the directions lie nearest to a subspace, from the axes that the subspace itself has."""
    units, f = unit_twists(ways), len(ways)
    outside = np.eye(6) - span @ np.linalg.pinv(span)
    if f in (0, 6):
        return np.eye(4)
    best: FloatArray = np.eye(4)
    lowest_cost = np.inf
    axes_tried = np.array(_axes_of(span))
    for axes, point, cost in zip(axes_tried, *_nearest_places(outside, axes_tried, units), strict=True):
        # Symmetric forms have several frames of equal cost: the first one stays, whatever rounding says.
        if cost < lowest_cost - 1e-12:
            best, lowest_cost = tf.transform(axes, point), cost
    return best


def _nearest_places(outside: FloatArray, axes: FloatArray, units: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the points (n, 3) and the costs (n,) at which directions in axes (n, 3, 3) lie nearest to the subspace; linear in
    the point, so least squares, of all axes at once."""
    moved = np.concatenate([axes @ units[:3], axes @ units[3:]], axis=1)
    # A point p adds p x d to the velocity of a direction that turns about d.
    rows = (outside[:, :3] @ skew(-np.swapaxes(moved[:, 3:], 1, 2))).reshape(len(axes), -1, 3)
    right = -np.swapaxes(outside @ moved, 1, 2).reshape(len(axes), -1)
    points = (np.linalg.pinv(rows, rcond=1e-6) @ right[..., None])[..., 0]
    return points, (((rows @ points[..., None])[..., 0] - right) ** 2).sum(axis=1)


def _axes_of(span: FloatArray) -> list[FloatArray]:
    """Return rotations whose axes are directions that a subspace has: of its rotations, its translations, and mixtures."""
    turn_left, turn_size, turn_right = np.linalg.svd(span[3:], full_matrices=True)
    # Measured motions never have a rotation of nought: below a twentieth they count as slides.
    slides = span[:3] @ turn_right[int((turn_size > 0.05).sum()):].T
    lines = [*turn_left.T, *(np.linalg.svd(slides)[0].T if slides.size else []), *np.linalg.svd(span[:3])[0].T]
    result = []
    for i, first in enumerate(lines):
        for second in lines[i + 1:] + lines[:i]:
            across = second - first * (first @ second)
            if np.linalg.norm(across) < 0.3:
                continue
            a, b = first, across / np.linalg.norm(across)
            frame = np.stack([a, b, np.cross(a, b)], axis=1)
            result += [_signed(frame[:, list(order)]) for order in permutations(range(3))]
    return result


def _signed(axes: FloatArray) -> FloatArray:
    """Return right-handed axes."""
    return axes if np.linalg.det(axes) > 0 else axes * np.array([1, 1, -1])


def _near_origin(frame: FloatArray, ways: tuple[str, ...]) -> FloatArray:
    """Return the frame moved along motions that keep its directions, nearest to the reference point."""
    kept = _stabiliser(ways)
    sliding = kept @ np.linalg.svd(kept[3:])[2][int((np.linalg.svd(kept[3:])[1] > 1e-9).sum()):].T if kept.size else kept
    if not sliding.size:
        return frame
    along = frame[:3, :3] @ np.linalg.qr(sliding[:3])[0]
    result = frame.copy()
    result[:3, 3] -= along @ (along.T @ frame[:3, 3])
    return result


def nearest_point(span: FloatArray) -> FloatArray:
    """Return the point where the free twists translate least: v + w x p = 0 in the least-squares sense."""
    v, w = span[:3], span[3:]
    rows = np.concatenate([-np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) for x, y, z in w.T])
    # w x p = v_p - v: rows p = v with rows = -[w].
    return np.asarray(np.linalg.lstsq(rows, v.T.ravel(), rcond=1e-9)[0])


def _from_axis(axis: FloatArray) -> FloatArray:
    """Return a rotation whose x axis is a unit vector."""
    others = np.linalg.svd(axis[None])[2][1:].T
    return _signed(np.column_stack([axis, others]))
