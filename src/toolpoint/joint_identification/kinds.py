r"""The kinds of joint: the twists that each leaves free, as a function of few parameters.

A joint is named by its freedoms, that is by the motions that the modes show, and by nothing else:

- locked: none;
- hinge: one rotation about an axis;
- slide: one translation;
- cylindrical: a rotation about an axis and a translation along the same axis, independent of each other (a rotation that
  drags a translation along in a fixed ratio is a screw, which is general);
- universal: two rotations about axes that meet;
- spherical: three rotations about one point;
- planar: two translations and the rotation about their normal;
- general: anything else, among it skew axes and more than three freedoms.

A paper may name the same joint by its design: a cylindrical joint that only ever turns (the column of Machines 2022, 10(11),
1102, of which a rotation about x is all that its table lists) is a hinge here, because no mode slides along its axis.

Everything is written about a reference point near the joint and divided by a length, so that a twist is (velocity at
the reference point, length times rotation) and all six numbers are displacements of one size. A rotation about d through
p is :math:`(p \times d, d)`. Every chart is centred on a start: its parameters are zero there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray

FREEDOMS = {"locked": 0, "slide": 1, "hinge": 1, "cylindrical": 2, "universal": 2, "spherical": 3, "planar": 3}
PARAMETERS = {"locked": 0, "slide": 2, "hinge": 4, "cylindrical": 4, "universal": 5, "spherical": 3, "planar": 2}


@dataclass(frozen=True, eq=False)
class FreedomChart:
    """A kind near a start.

    `basis` maps the parameters (n,) to the free twists (6, freedoms); `place` maps them to (point, direction), where
    direction is the axis, the common normal of the rotations (universal) or of the plane (planar), or zero (spherical).
    """

    kind: str
    freedoms: int
    parameters: int
    basis: Callable[[FloatArray], FloatArray]
    place: Callable[[FloatArray], tuple[FloatArray, FloatArray]]


def charts(span: FloatArray) -> list[FreedomChart]:
    """Return the special kinds with as many freedoms as `span` (6, f) has columns, started from it."""
    return [_chart(kind, span) for kind, freedoms in FREEDOMS.items() if freedoms == span.shape[1]]


def general(span: FloatArray) -> FreedomChart:
    """Return the chart of all subspaces of f twists near `span` (6, f), orthonormal columns: f (6 - f) parameters."""
    full = np.linalg.qr(np.hstack([span, np.eye(6)]))[0][:, :6]
    f = span.shape[1]
    inside, outside = full[:, :f], full[:, f:]

    def basis(theta: FloatArray) -> FloatArray:
        return inside + outside @ theta.reshape(6 - f, f)

    def place(theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        return _nearest_point(basis(theta)), np.zeros(3)

    return FreedomChart("general", f, f * (6 - f), basis, place)


def _chart(kind: str, span: FloatArray) -> FreedomChart:
    if kind == "spherical":
        return _spherical(_nearest_point(span))
    if kind == "locked":
        return FreedomChart(kind, 0, 0, lambda _: np.zeros((6, 0)), lambda _: (np.zeros(3), np.zeros(3)))
    turns = np.linalg.svd(span[3:])
    slides = np.linalg.svd(span[:3])
    if kind == "slide":
        return _directed(kind, slides[0][:, 0], lambda d: np.concatenate([d, np.zeros(3)])[:, None])
    if kind == "planar":
        return _directed(kind, turns[0][:, 0], _planar)
    if kind == "universal":
        return _universal(turns[0][:, 2], _nearest_point(span))
    # hinge, cylindrical: the combination that turns most lies nearest to the axis.
    twist = span @ turns[2][0]
    direction = turns[0][:, 0]
    point = np.cross(twist[3:], twist[:3]) / max(float(twist[3:] @ twist[3:]), 1e-12)
    return _axial(kind, direction, point)


def _nearest_point(span: FloatArray) -> FloatArray:
    """Return the point where the free twists translate least: v + w x p = 0 in the least-squares sense."""
    v, w = span[:3], span[3:]
    rows = np.concatenate([-np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) for x, y, z in w.T])
    # w x p = v_p - v: rows p = v with rows = -[w].
    return np.linalg.lstsq(rows, v.T.ravel(), rcond=1e-9)[0]


def _normals(direction: FloatArray) -> FloatArray:
    """Return two unit vectors normal to a direction, shape (3, 2)."""
    return np.linalg.svd(direction[None])[2][1:].T


def _turned(direction: FloatArray) -> Callable[[FloatArray], FloatArray]:
    across = _normals(direction)

    def at(theta: FloatArray) -> FloatArray:
        d = direction + across @ theta
        return d / np.linalg.norm(d)

    return at


def _directed(kind: str, start: FloatArray, basis: Callable[[FloatArray], FloatArray]) -> FreedomChart:
    at = _turned(start)
    return FreedomChart(kind, FREEDOMS[kind], 2, lambda t: basis(at(t)), lambda t: (np.zeros(3), at(t)))


def _planar(normal: FloatArray) -> FloatArray:
    across = _normals(normal)
    result = np.zeros((6, 3))
    result[:3, :2], result[3:, 2] = across, normal
    return result


def _axial(kind: str, start: FloatArray, point: FloatArray) -> FreedomChart:
    at, across = _turned(start), _normals(start)

    def place(theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        d, p = at(theta[:2]), point + across @ theta[2:]
        return p - d * (d @ p), d

    def basis(theta: FloatArray) -> FloatArray:
        p, d = place(theta)
        turn = np.concatenate([np.cross(p, d), d])[:, None]
        return turn if kind == "hinge" else np.hstack([turn, np.concatenate([d, np.zeros(3)])[:, None]])

    return FreedomChart(kind, FREEDOMS[kind], 4, basis, place)


def _universal(normal: FloatArray, point: FloatArray) -> FreedomChart:
    at = _turned(normal)

    def basis(theta: FloatArray) -> FloatArray:
        return rotations(_normals(at(theta[3:])), point + theta[:3])

    return FreedomChart("universal", 2, 5, basis, lambda t: (point + t[:3], at(t[3:])))


def _spherical(point: FloatArray) -> FreedomChart:
    return FreedomChart("spherical", 3, 3, lambda t: rotations(np.eye(3), point + t), lambda t: (point + t, np.zeros(3)))


def rotations(directions: FloatArray, point: FloatArray) -> FloatArray:
    """Return the twists (6, n) of rotations about directions (3, n) through one point."""
    return np.concatenate([np.cross(point, directions, axisb=0).T, directions])
