r"""One point of a rigid component that was measured elsewhere than stated: its place by the motions of the other points.

Without a point p the others determine the motions :math:`v_r, w_r` of all modes. A point that is really at :math:`p + \delta`
then shows

.. math:: u_{pr} - d \cdot (v_r + w_r \times p) = d \cdot (w_r \times \delta)

which is linear in :math:`\delta`, however large it is. It is misplaced where the others move as one body far better without
it, and where one shift of it explains what it shows in all modes, but for noise. Such a point is left out of the motion of its
component, which the others determine; what needs its place (a driving point) takes it where they put it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.joint_identification.motion.body_misfit import (
    MAX_POINT_MISFIT_RATIO,
    MAX_ROUNDING_MISFIT,
    MIN_POINT_MISFIT_RATIO,
    find_suspect,
    shift_of_point,
)
from toolpoint.joint_identification.motion.measured import Component, Point

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
        suspect = find_suspect(part)
        if suspect is None:
            continue
        as_stated, moved, shift = shift_of_point(part, suspect.point)
        freedom = max(int((part.owner == suspect.point).sum()) * part.values.shape[1] - 3, 1)
        # A point of another body moves otherwise wherever it is put: its best place leaves far more than noise.
        is_explained = moved / freedom < max(MAX_POINT_MISFIT_RATIO * suspect.misfit, MAX_ROUNDING_MISFIT * as_stated)
        if as_stated < MIN_POINT_MISFIT_RATIO * moved or not is_explained or (
                np.linalg.norm(shift) < MIN_SHIFT_RATIO * part.size):
            continue
        words = _doubt_of(part, suspect.point, shift, ratio=suspect.ratio)
        misplaced.append(MisplacedPoint(name, part.points[suspect.point], part.at[suspect.point] + shift, words))
    return misplaced


def _doubt_of(part: Component, suspect: int, shift: FloatArray, *, ratio: float) -> Doubt:
    """Return the doubt about a misplaced point."""
    size = float(np.linalg.norm(shift))
    x, y, z = 1e3 * shift
    return Doubt(f"point {part.points[suspect]}", f"it moves as a point of {part.name} that lies {1e3 * size:.3g} mm "
                 f"from where it is stated, by ({x:.0f}, {y:.0f}, {z:.0f}) mm: without it {part.name} moves as one body "
                 f"{ratio:.2g} times better. It is left out of the motion of {part.name}", "measure its place again",
                 figure=size)
