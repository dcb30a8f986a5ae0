"""Forward kinematics of a serial arm straight from its table, beside the chain of the package."""

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray, floats
from toolpoint.kinematics.arms.denavit_hartenberg import ArmRow
from toolpoint.spatial import rotation as rot
from toolpoint.spatial import transform as tf


def arm_forward(rows: Sequence[ArmRow], positions: FloatArray, convention: str = "standard") -> FloatArray:
    """Return the frame of the last link for axis positions (..., n), straight from the table, shape (..., 4, 4)."""
    q = floats("positions", positions, (len(rows),))
    names = [row.axis for row in rows]
    place = np.broadcast_to(np.eye(4), (*q.shape[:-1], 4, 4))
    for i, row in enumerate(rows):
        value = q[..., i] + sum(factor * q[..., names.index(name)] for name, factor in row.coupled.items())
        theta, d = (row.theta + 0 * value, row.d + value) if row.slides else (row.theta + value, row.d + 0 * value)
        screw = tf.transform(rot.about("z", theta), np.stack([0 * d, 0 * d, d], axis=-1))
        across = tf.transform(rot.about("x", row.alpha), [row.a, 0.0, 0.0])
        place = place @ screw @ across if convention == "standard" else place @ across @ screw
    return place
