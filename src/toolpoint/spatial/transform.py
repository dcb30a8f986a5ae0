r"""Rigid transforms (4x4), twists (v, w) and wrenches (f, m) about stated points; adjoints; all batched.

Order is always translation first: a twist is (v, w), a wrench is (f, m).
Source: Murray, Li, Sastry, A Mathematical Introduction to Robotic Manipulation, chapter 2.
"""

from __future__ import annotations

from math import factorial

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, floats
from toolpoint.spatial import rotation as rot

# rad: below, closed forms lose digits by differences, and five terms of their series are exact to rounding.
_SERIES_ANGLE = 0.3
# Coefficients of (a - sin a)/a^3 and of (1 - (a/2) cot(a/2))/a^2 in powers of a^2, the highest first.
_EXPONENTIAL = [(-1) ** k / factorial(2 * k + 3) for k in range(4, -1, -1)]
# Bernoulli numbers: B_2k/(2k)! of even order, the highest first, so that `polyval` takes them.
_LOGARITHM = [1 / 47900160, 1 / 1209600, 1 / 30240, 1 / 720, 1 / 12]


def transform(rotation: ArrayLike | None = None, translation: ArrayLike | None = None) -> FloatArray:
    """Return the transform x -> R x + t, shape (..., 4, 4); identity parts where left out."""
    r = np.eye(3) if rotation is None else rot.check_rotation(rotation)
    t = np.zeros(3) if translation is None else floats("translation", translation, (3,))
    batch = np.broadcast_shapes(r.shape[:-2], t.shape[:-1])
    result = np.zeros((*batch, 4, 4))
    result[..., :3, :3], result[..., :3, 3], result[..., 3, 3] = r, t, 1.0
    return result


def inverse(transform: FloatArray) -> FloatArray:
    """Return the inverse transform, shape (..., 4, 4)."""
    transpose = np.swapaxes(transform[..., :3, :3], -1, -2)
    result = np.zeros_like(transform)
    result[..., :3, :3] = transpose
    result[..., :3, 3] = -(transpose @ transform[..., :3, 3, None])[..., 0]
    result[..., 3, 3] = 1.0
    return result


def move(transform: FloatArray, points: ArrayLike) -> FloatArray:
    """Return points (..., n, 3) moved by a transform (..., 4, 4)."""
    p = np.asarray(points, float)
    return p @ np.swapaxes(transform[..., :3, :3], -1, -2) + transform[..., None, :3, 3]


def adjoint(transform: FloatArray) -> FloatArray:
    r"""Return the map of twists from the moved frame to the base frame, both about their own origins, (..., 6, 6).

    :math:`Ad = [[R, [t] R], [0, R]]` on (v, w).
    """
    r, t = transform[..., :3, :3], transform[..., :3, 3]
    result = np.zeros((*transform.shape[:-2], 6, 6))
    result[..., :3, :3] = result[..., 3:, 3:] = r
    result[..., :3, 3:] = rot.skew(t) @ r
    return result


def wrench_map(transform: FloatArray) -> FloatArray:
    r"""Return the map of wrenches from the moved frame to the base frame, :math:`Ad^{-T}`, shape (..., 6, 6)."""
    return np.swapaxes(adjoint(inverse(transform)), -1, -2)


def point_velocity(points: ArrayLike) -> FloatArray:
    """Return the map from a twist about the origin to the velocity of points, [I, -[p]], shape (..., 3, 6)."""
    p = np.asarray(points, float)
    result = np.zeros((*p.shape[:-1], 3, 6))
    result[..., :3] = np.eye(3)
    result[..., 3:] = -rot.skew(p)
    return result


def twist_bracket(first: FloatArray, second: FloatArray) -> FloatArray:
    r"""Return the Lie bracket of twists (v, w): :math:`(w_1 \times v_2 - w_2 \times v_1,\ w_1 \times w_2)`."""
    v1, w1, v2, w2 = first[..., :3], first[..., 3:], second[..., :3], second[..., 3:]
    return np.concatenate([np.cross(w1, v2) - np.cross(w2, v1), np.cross(w1, w2)], axis=-1)


def exponential(twist: ArrayLike) -> FloatArray:
    r"""Return the transform of a constant twist (v, w) acting for unit time, shape (..., 4, 4).

    :math:`R = \exp[w]`, :math:`t = (I + \frac{1 - \cos a}{a^2} [w] + \frac{a - \sin a}{a^3} [w]^2)\, v`, a = ``|w|``.
    """
    xi = floats("twist", twist, (6,))
    v, w = xi[..., :3], xi[..., 3:]
    angle = np.linalg.norm(w, axis=-1)[..., None, None]
    safe = np.where(angle < _SERIES_ANGLE, 1.0, angle)
    sine_term = np.where(angle < _SERIES_ANGLE, np.polyval(_EXPONENTIAL, angle**2), (safe - np.sin(safe)) / safe**3)
    cross = rot.skew(w)
    left = np.eye(3) + rot.versine(angle) * cross + sine_term * (cross @ cross)
    return transform(rot.from_vector(w), (left @ v[..., None])[..., 0])


def logarithm(transform: FloatArray) -> FloatArray:
    r"""Return the twist (v, w) with exponential(twist) = transform, rotation within 0 .. pi, shape (..., 6).

    :math:`v = (I - \frac{1}{2} [w] + \frac{1 - (a/2) \cot(a/2)}{a^2} [w]^2)\, t` a = ``|w|``.
    """
    w = rot.to_vector(transform[..., :3, :3])
    angle = np.linalg.norm(w, axis=-1)[..., None, None]
    safe = np.where(angle < _SERIES_ANGLE, 1.0, angle)
    half_a = safe / 2
    cotangent_term = np.where(angle < _SERIES_ANGLE, np.polyval(_LOGARITHM, angle**2), (1 - half_a / np.tan(half_a)) / safe**2)
    cross = rot.skew(w)
    inverse_left = np.eye(3) - 0.5 * cross + cotangent_term * (cross @ cross)
    v = (inverse_left @ transform[..., :3, 3, None])[..., 0]
    return np.concatenate([v, w], axis=-1)
