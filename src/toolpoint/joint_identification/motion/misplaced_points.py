r"""One point of a rigid component that was measured elsewhere than stated: its place by the motions of the other points.

Without a point p the others determine the motions :math:`v_r, w_r` of all modes. A point that is really at :math:`p + \delta`
then shows

.. math:: u_{pr} - d \cdot (v_r + w_r \times p) = d \cdot (w_r \times \delta)

which is linear in :math:`\delta`, however large it is. It is misplaced where the others move as one body far better without it,
and where one shift of it explains what it shows in all modes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint._doubt import Doubt
from toolpoint.joint_identification.motion.measured import Component
from toolpoint.joint_identification.motion.rigid_motion import SmallMotion

MIN_PLACED_POINTS = 5  # of a component, of which one may be misplaced
MIN_PLACE_MISFIT_RATIO = 6.0  # misfit with a point over that without it, and of the point as stated over that at its new place


def question_places(parts: Mapping[str, Component]) -> list[Doubt]:
    """Return a doubt on every component of which one point moves as one that lies elsewhere.

    parts : at their stated places, with the variance of noise and coordinates.
    """
    doubts = []
    for name, part in parts.items():
        if len(part.points) < MIN_PLACED_POINTS:
            continue
        total = _misfit(part, SmallMotion().twists(part))
        misfits = np.array([_leave_out(part, point)[0] for point in range(len(part.points))])
        order = np.argsort(misfits)
        suspect, second = int(order[0]), float(misfits[order[1]])
        min_misfit = MIN_PLACE_MISFIT_RATIO * misfits[suspect]
        if total < min_misfit or second < min_misfit / 2:
            continue
        as_stated, moved, shift = _shift_of(part, suspect)
        if as_stated < MIN_PLACE_MISFIT_RATIO * moved:
            continue
        size = float(np.linalg.norm(shift))
        x, y, z = 1e3 * shift
        doubts.append(Doubt(f"point {part.points[suspect]}", f"it moves as a point of {name} that lies {1e3 * size:.3g} mm "
                            f"from where it is stated, by ({x:.0f}, {y:.0f}, {z:.0f}) mm: without it {name} moves as one body "
                            f"{total / misfits[suspect]:.2g} times better", "measure its place again", figure=size))
    return doubts


def _leave_out(part: Component, point: int) -> tuple[float, FloatArray]:
    """Return the misfit of the other points over its degrees of freedom, and their motions (6, m)."""
    rows = np.flatnonzero(part.owner != point)
    others = replace(part, rows=part.rows[rows], places=part.places[rows], ways=part.ways[rows], owner=part.owner[rows],
                     values=part.values[rows], variance=None if part.variance is None else part.variance[rows])
    twist = SmallMotion().twists(others)
    return _misfit(others, twist), twist


def _misfit(part: Component, twist: FloatArray) -> float:
    """Return the mean square of what motions leave, by the noise where that is known."""
    rows: IndexArray = np.arange(len(part.rows))
    left = (part.values - part.rows @ twist) * _weights(part, rows)
    return float((left**2).sum()) / max((len(part.rows) - 6) * part.values.shape[1], 1)


def _shift_of(part: Component, point: int) -> tuple[float, float, FloatArray]:
    """Return the misfit of a point where it is stated and where the others put it, and the shift (3,) between, m."""
    rows = np.flatnonzero(part.owner == point)
    twist = _leave_out(part, point)[1]
    weight = _weights(part, rows)
    left = ((part.values[rows] - part.rows[rows] @ twist) * weight).ravel()
    slopes = (np.cross(part.ways[rows][:, None], twist[3:].T[None]) * weight[:, :, None]).reshape(-1, 3)
    shift = np.linalg.lstsq(slopes, left, rcond=1e-9)[0]
    return float(left @ left), float(((left - slopes @ shift) ** 2).sum()), np.asarray(shift)


def _weights(part: Component, rows: IndexArray) -> FloatArray:
    """Return one over the standard deviation (n, m) of displacements; over the size of each mode where it is not known."""
    if part.variance is not None:
        return np.asarray(1 / np.sqrt(part.variance[rows]))
    return np.ones((len(rows), 1)) / np.where(part.motion > 0, part.motion, 1.0)
