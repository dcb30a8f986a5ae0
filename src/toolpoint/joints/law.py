"""Laws of joints: guideways, screws, bearings and contacts, in parallel and in series, as one stiffness."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Annotated

import numpy as np

from toolpoint._check import FloatArray, fail, floats, symmetric
from toolpoint._quantity import Quantity
from toolpoint.joints.angular_contact import BearingDescription
from toolpoint.joints.ball_screw import BallScrewDescription
from toolpoint.joints.contact_patch import PatchContactDescription
from toolpoint.joints.guideway import GuidewayDescription

MIN_STIFFNESS_RATIO = 1e-9  # of the largest diagonal terms of row and column: below, a term is rounding


@dataclass(frozen=True)
class LawDescription:
    """Elements that a joint is made of; those named act in parallel between the same two bodies.

    `loss_factor` is the structural one of all of them.

    Examples
    --------
    >>> from toolpoint.joints import LawDescription
    >>> from toolpoint.joints.contact_patch import ContactPatch, PatchContactDescription
    >>> patch = ContactPatch(at=(0.0, 0.0, 0.0), sides=(0.1, 0.05))
    >>> law = LawDescription(contact=PatchContactDescription(patches=(patch,), per_area=1e12))
    >>> round(float(law.stiffness[2, 2]))  # N/m along the normal: 1e12 N/m^3 over 5e-3 m^2
    5000000000
    """

    guideway: GuidewayDescription | None = None
    ball_screw: BallScrewDescription | None = None
    bearing: BearingDescription | None = None
    contact: PatchContactDescription | None = None
    loss_factor: Annotated[float, Quantity("ratio", "1", least=0, most=2)] = 0.0

    @property
    def stiffness(self) -> FloatArray:
        """Stiffness (6, 6) about the joint's frame, N/m and N m/rad."""
        parts = [getattr(self, part.name) for part in fields(self) if part.name != "loss_factor"]
        if all(part is None for part in parts):
            fail("law", "empty", "must name a guideway, ball_screw, bearing or contact")
        total = join_parallel(part.stiffness for part in parts if part is not None)
        # Terms that cancel leave rounding: a direction without stiffness must be exactly zero.
        scale = np.sqrt(np.repeat([np.diag(total)[:3].max(), np.diag(total)[3:].max()], 3))
        return np.where(np.abs(total) < MIN_STIFFNESS_RATIO * np.outer(scale, scale), 0.0, total)


def join_parallel(parts: Iterable[FloatArray]) -> FloatArray:
    """Return the stiffness (6, 6) of parts between the same two bodies, all about one frame.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.joints import join_parallel
    >>> float(join_parallel([2e8 * np.eye(6), 1e8 * np.eye(6)])[0, 0])
    300000000.0
    """
    return sum((symmetric("stiffness", floats("stiffness", part, (6, 6))) for part in parts), np.zeros((6, 6)))


def join_series(parts: Iterable[FloatArray]) -> FloatArray:
    """Return the stiffness (6, 6) of parts behind each other without mass between, all about one frame.

    Parts are condensed one by one, K1 - K1 (K1 + K2)^+ K1: a direction that one part leaves free is free in the series.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.joints import join_series
    >>> float(join_series([3e8 * np.eye(6), 6e8 * np.eye(6)])[0, 0].round())  # 1/k = 1/k1 + 1/k2
    200000000.0
    """
    total: FloatArray | None = None
    for part in parts:
        matrix = symmetric("stiffness", floats("stiffness", part, (6, 6)))
        if total is None:
            total = matrix
            continue
        stiffness_sum = total + matrix
        # Translations (N/m) and rotations (N m/rad) are scaled to one diagonal: the pseudo-inverse's tolerance holds for both.
        scale = np.sqrt(np.maximum(np.diag(stiffness_sum), 1e-300))
        # Scaled first: N/m and N m/rad differ by many orders, and the cut-off would take turns for rounding.
        inverse = np.linalg.pinv(stiffness_sum / np.outer(scale, scale), rcond=1e-12, hermitian=True) / np.outer(scale, scale)
        total = total - total @ inverse @ total
        total = (total + total.T) / 2
    if total is None:
        fail("parts", "none", "must be at least one")
    return total
