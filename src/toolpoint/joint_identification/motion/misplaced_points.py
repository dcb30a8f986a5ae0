r"""One point of a rigid component that was measured elsewhere than stated: its place by the motions of the other points.

Without a point p the others determine the motions :math:`v_r, w_r` of all modes. A point that is really at :math:`p + \delta`
then shows

.. math:: u_{pr} - d \cdot (v_r + w_r \times p) = d \cdot (w_r \times \delta)

which is linear in :math:`\delta`, however large it is. It is misplaced where the others move as one body far better without
it, and where one shift of it explains what it shows in all modes, but for noise. Such a point is left out of the motion of its
component, which the others determine; what needs its place (a driving point) takes it where they put it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, IndexArray
from toolpoint._doubt import Doubt
from toolpoint.joint_identification.motion.measured import Component, Point, determines_motion
from toolpoint.joint_identification.motion.rigid_motion import SmallMotion

MIN_PLACED_POINTS = 4  # of a component, of which one may be misplaced
MIN_FREE_DISPLACEMENTS = 4  # of the other points in all modes, beyond their motions
MIN_PLACE_MISFIT_RATIO = 6.0  # misfit with a point over that without it, and of the point as stated over that at its new place
MAX_PLACED_MISFIT_RATIO = 25.0  # of a displacement at the new place over those of the others, which their motions reach farther
MAX_ROUNDING_MISFIT = 1e-16  # of what it left as stated: that of rounding
MIN_SHIFT_RATIO = 1e-3  # of the size of the component: less changes no joint, and may be rounding of exact shapes


@dataclass(frozen=True, eq=False)
class MisplacedPoint:
    """Point that lies elsewhere than stated; place (3,), by the motions of the others, m; doubt : what is said of it."""

    component: str
    point: Point
    place: FloatArray
    doubt: Doubt


def find_misplaced(parts: Mapping[str, Component]) -> list[MisplacedPoint]:
    """Return the point of every component that moves as one that lies elsewhere, where there is one.

    parts : at their stated places, with the variance of noise and coordinates.
    """
    misplaced = []
    for name, part in parts.items():
        if len(part.points) < MIN_PLACED_POINTS:
            continue
        total = _misfit(part, SmallMotion().twists(part))
        misfits = np.array([_leave_out(part, point)[0] for point in range(len(part.points))])
        order = np.argsort(misfits)
        suspect, second = int(order[0]), float(misfits[order[1]])
        min_misfit = MIN_PLACE_MISFIT_RATIO * misfits[suspect]
        if not np.isfinite(min_misfit) or total < min_misfit or second < min_misfit / 2:
            continue
        as_stated, moved, shift = _shift_of(part, suspect)
        freedom = max(int((part.owner == suspect).sum()) * part.values.shape[1] - 3, 1)
        # A point of another body moves otherwise wherever it is put: its best place leaves far more than noise.
        is_explained = moved / freedom < max(MAX_PLACED_MISFIT_RATIO * misfits[suspect], MAX_ROUNDING_MISFIT * as_stated)
        if as_stated < MIN_PLACE_MISFIT_RATIO * moved or not is_explained or (
                np.linalg.norm(shift) < MIN_SHIFT_RATIO * part.size):
            continue
        words = _doubt_of(part, suspect, shift, ratio=total / max(float(misfits[suspect]), 1e-300))
        misplaced.append(MisplacedPoint(name, part.points[suspect], part.at[suspect] + shift, words))
    return misplaced


def leave_out_misplaced(misplaced: Sequence[MisplacedPoint], points: Mapping[Point, ArrayLike],
                        components: Mapping[str, Sequence[Point]]
                        ) -> tuple[dict[Point, ArrayLike], dict[str, Sequence[Point]]]:
    """Return the points with the misplaced ones where the others put them, and the components without them."""
    left_out = {each.point for each in misplaced}
    return ({**points, **{each.point: each.place for each in misplaced}},
            {name: [point for point in labels if point not in left_out] for name, labels in components.items()})


def _doubt_of(part: Component, suspect: int, shift: FloatArray, *, ratio: float) -> Doubt:
    """Return the doubt about a misplaced point."""
    size = float(np.linalg.norm(shift))
    x, y, z = 1e3 * shift
    return Doubt(f"point {part.points[suspect]}", f"it moves as a point of {part.name} that lies {1e3 * size:.3g} mm "
                 f"from where it is stated, by ({x:.0f}, {y:.0f}, {z:.0f}) mm: without it {part.name} moves as one body "
                 f"{ratio:.2g} times better. It is left out of the motion of {part.name}", "measure its place again",
                 figure=size)


def _leave_out(part: Component, point: int) -> tuple[float, FloatArray]:
    """Return the misfit of the other points over its degrees of freedom, and their motions (6, m).

    The misfit is infinite where the others do not determine the motions with displacements to spare.
    """
    rows = np.flatnonzero(part.owner != point)
    others = replace(part, rows=part.rows[rows], places=part.places[rows], ways=part.ways[rows], owner=part.owner[rows],
                     values=part.values[rows], variance=None if part.variance is None else part.variance[rows])
    twist = SmallMotion().twists(others)
    free = (len(rows) - 6) * part.values.shape[1]
    if free < MIN_FREE_DISPLACEMENTS or not determines_motion(others.ways, others.places, np.delete(part.at, point, axis=0)):
        return float("inf"), twist
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
