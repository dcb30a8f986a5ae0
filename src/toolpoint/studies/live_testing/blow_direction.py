r"""Direction of a blow, from the first motion of a sensor of several axes beside the struck point.

While the force acts, the tip moves as its mass lets it: the velocity that a blow leaves, :math:`\int a\,dt` over the pulse,
points where the blow went, if the mass that answers is alike in all directions. From blow to blow the structure is the same: a
turn against the other blows is one of the hammer, whatever the masses are.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.signals.hits import Hit
from toolpoint.vibration import Record
from toolpoint.vibration.dof import Dof

MAX_TURN_DEGREES = 10.0  # of a blow against the mean of the others, beyond which it is refused
MAX_SKEW_DEGREES = 25.0  # of a blow against its axis: a softer direction beside it may cause as much, so it is only named
MIN_COMPARED_BLOWS = 3  # accepted, from which their mean direction is known
PULSE_WIDTHS = 1.0  # of the pulse behind its peak, over which the first motion is taken


def find_velocity(record: Record, hit: Hit) -> FloatArray | None:
    """Return the velocity (3,) that a blow leaves at the struck point, m/s, nan along axes without a sensor; None where no
    two accelerations of the struck point were taken."""
    force_at = record.quantities.index("force")
    struck = record.channels[force_at]
    places = [k for k, (dof, kind) in enumerate(zip(record.channels, record.quantities, strict=True))
              if kind == "acceleration" and dof.point == struck.point and axis_of(dof) is not None]
    if len({axis_of(record.channels[k]) for k in places}) < 2 or axis_of(struck) is None:
        return None
    width = max(hit.pulse - hit.peak, 2)
    first, last = max(hit.peak - width, 0), min(hit.peak + round(PULSE_WIDTHS * width) + 1, record.samples.shape[0])
    velocity = np.full(3, np.nan)
    for k in places:
        axis, sign = axis_of(record.channels[k]) or (0, 1)
        offset = float(np.median(record.samples[:max(first, 1), k]))
        velocity[axis] = sign * float((record.samples[first:last, k] - offset).sum()) / record.sample_rate
    return velocity


def axis_of(dof: Dof) -> tuple[int, int] | None:
    """Return axis (0, 1, 2) and sign of a Dof along x, y or z, None for any other."""
    return ("xyz".index(dof.direction[1]), -1 if dof.direction[0] == "-" else 1) if dof.direction in (
        "+x", "-x", "+y", "-y", "+z", "-z") else None


def question_direction(velocity: FloatArray, struck: Dof, accepted: Sequence[FloatArray]) -> tuple[str, bool]:
    """Return what is wrong with the direction of a blow, empty where nothing is, and whether it speaks against the blow.

    accepted : velocities (3,) of the accepted blows before it.
    """
    axes = np.isfinite(velocity)
    if len(accepted) >= MIN_COMPARED_BLOWS:
        mean = np.mean([part[axes] / np.linalg.norm(part[axes]) for part in accepted], axis=0)
        turn = _angle(velocity[axes], mean)
        if turn > MAX_TURN_DEGREES:
            return f"direction: turned by {turn:.0f}° against the other blows", True
        return "", False
    axis, sign = axis_of(struck) or (0, 1)
    aim = sign * np.eye(3)[axis][axes]
    skew = _angle(velocity[axes], aim)
    if skew > MAX_SKEW_DEGREES:
        return (f"the first motion is {skew:.0f}° off {struck.direction}: a skew blow, a turned sensor, or a tip that is "
                "lighter across", False)
    return "", False


def _angle(first: FloatArray, second: FloatArray) -> float:
    cosine = float(first @ second) / max(float(np.linalg.norm(first) * np.linalg.norm(second)), 1e-300)
    return float(np.degrees(np.arccos(min(max(cosine, -1.0), 1.0))))
