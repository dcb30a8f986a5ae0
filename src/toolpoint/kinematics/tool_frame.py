"""Axes x, y and z of a tool from the direction of its axis alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, floats
from toolpoint.spatial.rotation import skew


def smallest_turn(direction: ArrayLike) -> FloatArray:
    r"""Return the smallest rotation that brings z onto unit directions (..., 3), shape (..., 3, 3).

    :math:`R = I + [w] + [w]^2/(1 + d_z)` with :math:`w = e_z \times d`; its columns are the tool's x, y and z: the machine's
    own axes where the tool stands upright. For the direction opposite to z it is half a turn about x.
    """
    d = floats("direction", direction, (3,))
    w = np.stack([-d[..., 1], d[..., 0], np.zeros_like(d[..., 0])], axis=-1)
    is_opposite = d[..., 2] < -1 + 1e-12
    divisor = np.where(is_opposite, 1.0, 1.0 + d[..., 2])[..., None, None]
    k = skew(w)
    turn = np.eye(3) + k + k @ k / divisor
    return np.where(is_opposite[..., None, None], np.diag([1.0, -1.0, -1.0]), turn)
