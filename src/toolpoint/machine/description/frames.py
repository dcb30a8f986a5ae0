"""Described frames as transforms, and transforms as described frames."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from toolpoint._check import FloatArray, frozen
from toolpoint.machine.description.body import FrameDescription
from toolpoint.spatial import rotation
from toolpoint.spatial import transform as tf

MAX_KEPT_FRAMES = 1000  # a machine is built anew at every move of a slider, and its frames stay


def frame(description: FrameDescription) -> FloatArray:
    """Return the transform (4, 4) of a described frame, read-only: zyx Euler angles, then the place."""
    return _frame(tuple(description.at), tuple(description.rotation))


@lru_cache(maxsize=MAX_KEPT_FRAMES)
def _frame(place: tuple[float, ...], angles: tuple[float, ...]) -> FloatArray:
    return frozen(tf.transform(rotation.from_euler("zyx", angles), place))


def describe_frame(transform: FloatArray) -> FrameDescription:
    """Return the description of a transform (4, 4): zyx Euler angles in rad, the last zero where they are not unique."""
    r = transform[:3, :3]
    cosine = np.hypot(r[0, 0], r[1, 0])
    pitch = np.arctan2(-r[2, 0], cosine)
    if cosine < 1e-12:
        angles = (np.arctan2(-r[0, 1], r[1, 1]), pitch, 0.0)
    else:
        angles = (np.arctan2(r[1, 0], r[0, 0]), pitch, np.arctan2(r[2, 1], r[2, 2]))
    x, y, z = (float(v) for v in transform[:3, 3])
    a, b, c = (float(v) for v in angles)
    return FrameDescription((x, y, z), (a, b, c))
