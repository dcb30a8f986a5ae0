r"""Rotations: matrices, rotation vectors, Euler angles and quaternions; active, column vectors, batched."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, fail, floats, one_of

_MIN_QUATERNION_VECTOR = 1e-8  # length of the vector part; below, angle / length is 2 to rounding


def skew(vector: ArrayLike) -> FloatArray:
    """Return the cross-product matrix [v] with [v] x = v x x, shape (..., 3, 3)."""
    v = np.asarray(vector, float)
    result = np.zeros((*v.shape, 3))
    result[..., 2, 1], result[..., 0, 2], result[..., 1, 0] = v[..., 0], v[..., 1], v[..., 2]
    return result - np.swapaxes(result, -1, -2)


def from_vector(vector: ArrayLike) -> FloatArray:
    r"""Return the matrix of a rotation vector (axis times angle, rad), shape (..., 3, 3).

    Rodrigues: :math:`R = I + \sin\theta/\theta\,[v] + (1 - \cos\theta)/\theta^2\,[v]^2`.
    """
    v = floats("vector", vector, (3,))
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    k = skew(v)
    return np.eye(3) + np.sinc(angle / np.pi) * k + versine(angle) * (k @ k)


def versine(angle: FloatArray) -> FloatArray:
    """Return (1 - cos a)/a^2 without loss of digits at small angles: half the squared sinc of a/2."""
    # 1 - cos a = 2 sin^2(a/2): no difference of nearly equal numbers.
    return 0.5 * np.sinc(angle / (2 * np.pi)) ** 2


def to_vector(rotation: ArrayLike) -> FloatArray:
    """Return the rotation vector (rad, length within 0 .. pi) of a matrix, shape (..., 3)."""
    r = check_rotation(rotation)
    quaternion = to_quaternion(r)
    w, v = quaternion[..., 0], quaternion[..., 1:]
    length = np.linalg.norm(v, axis=-1)
    # By both parts: arc cosine and arc sine lose half of the digits at 0 and at pi.
    angle = 2 * np.arctan2(length, w)
    factor = np.where(length > _MIN_QUATERNION_VECTOR, angle / np.where(length > _MIN_QUATERNION_VECTOR, length, 1.0), 2.0)
    return v * factor[..., None]


def to_quaternion(rotation: ArrayLike) -> FloatArray:
    """Return the unit quaternion (w, x, y, z), w >= 0, of a matrix, shape (..., 4); accurate at every angle."""
    r = check_rotation(rotation)
    trace = np.trace(r, axis1=-2, axis2=-1)
    # Shepperd: all four forms of 4 q q^T; the row with the largest diagonal has no cancellation.
    d = np.stack([trace, r[..., 0, 0], r[..., 1, 1], r[..., 2, 2]], axis=-1)
    products = np.empty((*r.shape[:-2], 4, 4))
    products[..., 0, 0] = 1 + trace
    for i in range(3):
        products[..., i + 1, i + 1] = 1 + 2 * r[..., i, i] - trace
        j, k = (i + 1) % 3, (i + 2) % 3
        products[..., 0, i + 1] = products[..., i + 1, 0] = r[..., k, j] - r[..., j, k]
        products[..., j + 1, k + 1] = products[..., k + 1, j + 1] = r[..., k, j] + r[..., j, k]
    largest = np.argmax(d, axis=-1)
    row = np.take_along_axis(products, largest[..., None, None], axis=-2)[..., 0, :]
    row = row / np.linalg.norm(row, axis=-1, keepdims=True)
    # q and -q are one rotation: the one of w >= 0 has an angle up to pi.
    return np.where(row[..., :1] < 0, -row, row)


def about(axis: str | ArrayLike, angle: ArrayLike) -> FloatArray:
    """Return the rotation by `angle` (rad, any shape) about ``x``, ``y``, ``z`` or a vector, shape (..., 3, 3)."""
    unit = np.eye(3)["xyz".index(one_of("axis", axis, "xyz"))] if isinstance(axis, str) else floats("axis", axis, (3,))
    length = float(np.linalg.norm(unit))
    if length == 0:
        fail("axis", "length 0", "must not be zero")
    return from_vector(np.asarray(angle, float)[..., None] * unit / length)


def from_euler(sequence: str, angles: ArrayLike) -> FloatArray:
    """Return the rotation of successive angles (rad): lower case about moving axes, e.g. ``zyx``; shape (..., 3, 3).

    ``zyx`` with (a, b, c) is Rz(a) Ry(b) Rx(c).
    """
    values = floats("angles", angles, (len(sequence),))
    result = np.broadcast_to(np.eye(3), (*values.shape[:-1], 3, 3))
    for i, axis in enumerate(sequence):
        result = result @ about(axis, values[..., i])
    return result


def check_rotation(rotation: ArrayLike) -> FloatArray:
    """Return a rotation matrix after checking that it is orthogonal and right-handed (within 1e-6)."""
    r = floats("rotation", rotation, (3, 3))
    error = float(np.abs(r @ np.swapaxes(r, -1, -2) - np.eye(3)).max())
    if error > 1e-6:
        fail("rotation", f"orthogonal only within {error:.2g}", "must be within 1e-6",
             remedy="project it onto a rotation with spatial.rotation.nearest")
    if (np.linalg.det(r) < 0).any():
        fail("rotation", "a left-handed matrix (determinant -1)", "must be right-handed")
    return r


def nearest(matrix: ArrayLike) -> FloatArray:
    """Return the rotation nearest to a matrix in the Frobenius norm (Kabsch), shape (..., 3, 3)."""
    u, _, vt = np.linalg.svd(floats("matrix", matrix, (3, 3)))
    sign = np.sign(np.linalg.det(u @ vt))
    reflection = np.broadcast_to(np.eye(3), u.shape).copy()
    # The smallest singular direction is reversed where u vt alone would be a reflection.
    reflection[..., 2, 2] = sign
    return u @ reflection @ vt
