"""Misfit of the rigid motions of a component: as it is, and by the points that are left once some are taken out."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.joint_identification.motion.measured import Component, determines_motion
from toolpoint.joint_identification.motion.rigid_motion import SmallMotion

MAX_ROUNDING_MISFIT = 1e-16  # of what is left at the stated places: that of rounding
MIN_PLACED_POINTS = 4  # of a component, of which one may be wrong
MIN_POINT_MISFIT_RATIO = 6.0  # misfit with a point over that without it, and of the point as stated over that explained
MAX_POINT_MISFIT_RATIO = 25.0  # of an explained displacement over those of the others, which their motions reach farther
MIN_FREE_DISPLACEMENTS = 4  # of the points that are left in all modes, beyond their motions


@dataclass(frozen=True, eq=False)
class SuspectPoint:
    """Point without which a component moves as one body far better; misfit : of the others; ratio : of all over it; twist : by
    the others, (6, m)."""

    point: int
    misfit: float
    ratio: float
    twist: FloatArray


def find_suspect(part: Component) -> SuspectPoint | None:
    """Return the one point without which a component moves as one body; None where there is none, or more than one."""
    if len(part.points) < MIN_PLACED_POINTS:
        return None
    total = mean_square_misfit(part, SmallMotion().twists(part))
    rests = [leave_out_points(part, (point,)) for point in range(len(part.points))]
    misfits = np.array([misfit for misfit, _ in rests])
    order = np.argsort(misfits)
    suspect, second = int(order[0]), float(misfits[order[1]])
    min_misfit = MIN_POINT_MISFIT_RATIO * misfits[suspect]
    if not np.isfinite(min_misfit) or total < min_misfit or second < min_misfit / 2:
        return None
    return SuspectPoint(suspect, float(misfits[suspect]), total / max(float(misfits[suspect]), 1e-300), rests[suspect][1])


def point_weights(part: Component, rows: IndexArray) -> FloatArray:
    """Return one over the standard deviation (n, m) of displacements; over the size of each mode where it is not known."""
    if part.variance is not None:
        return np.asarray(1 / np.sqrt(part.variance[rows]))
    return np.ones((len(rows), 1)) / np.where(part.motion > 0, part.motion, 1.0)


def mean_square_misfit(part: Component, twist: FloatArray) -> float:
    """Return the mean square of what twists (6, m) leave, over the degrees of freedom; by the noise where that is known."""
    left = (part.values - part.rows @ twist) * point_weights(part, np.arange(len(part.rows)))
    return float((left**2).sum()) / max((len(part.rows) - 6) * part.values.shape[1], 1)


def without_points(part: Component, points: Collection[int]) -> Component:
    """Return the component without some of its points, by their indices."""
    kept = ~np.isin(np.arange(len(part.points)), list(points))
    rows = kept[part.owner]
    return replace(part, points=tuple(point for point, keep in zip(part.points, kept, strict=True) if keep), at=part.at[kept],
                   rows=part.rows[rows], places=part.places[rows], ways=part.ways[rows],
                   owner=(np.cumsum(kept) - 1)[part.owner[rows]], values=part.values[rows],
                   variance=None if part.variance is None else part.variance[rows])


def leave_out_points(part: Component, points: tuple[int, ...]) -> tuple[float, FloatArray]:
    """Return the misfit of the other points over its degrees of freedom, and their motions (6, m).

    The misfit is infinite where the others do not determine the motions with displacements to spare.
    """
    if not can_leave_out(part, points):
        return float("inf"), np.zeros((6, part.values.shape[1]))
    others = without_points(part, points)
    twist = SmallMotion().twists(others)
    return mean_square_misfit(others, twist), twist


def can_leave_out(part: Component, points: tuple[int, ...]) -> bool:
    """Whether the other points determine the motions with displacements to spare."""
    others = without_points(part, points)
    free = (len(others.rows) - 6) * part.values.shape[1]
    return free >= MIN_FREE_DISPLACEMENTS and determines_motion(others.ways, others.places, others.at)


def shift_of_point(part: Component, point: int, others: tuple[int, ...] = ()) -> tuple[float, float, FloatArray]:
    """Return the misfit of a point where it is stated and where the rest puts it, and the shift (3,) between, m.

    others : further points that are taken out.
    """
    rows = np.flatnonzero(part.owner == point)
    twist = leave_out_points(part, (point, *others))[1]
    weight = point_weights(part, rows)
    left = ((part.values[rows] - part.rows[rows] @ twist) * weight).ravel()
    slopes = (np.cross(part.ways[rows][:, None], twist[3:].T[None]) * weight[:, :, None]).reshape(-1, 3)
    shift = np.linalg.lstsq(slopes, left, rcond=1e-9)[0]
    return float(left @ left), float(((left - slopes @ shift) ** 2).sum()), np.asarray(shift)
