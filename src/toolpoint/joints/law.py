"""Laws of joints: numbers of guideways, screws, bearings and contacts, beside and behind each other, as one stiffness."""

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

NEGLIGIBLE = 1e-9


@dataclass(frozen=True)
class LawDescription:
    """What a joint is of; parts that are named act beside each other between the same two bodies.

    `loss_factor` is the structural one of all of them.
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
        # Terms that cancel leave rounding: a direction that nothing holds must read as one that nothing holds.
        size = np.sqrt(np.repeat([np.diag(total)[:3].max(), np.diag(total)[3:].max()], 3))
        return np.where(np.abs(total) < NEGLIGIBLE * np.outer(size, size), 0.0, total)


def join_parallel(parts: Iterable[FloatArray]) -> FloatArray:
    """Return the stiffness (6, 6) of parts between the same two bodies, all about one frame."""
    return sum((symmetric("stiffness", floats("stiffness", part, (6, 6))) for part in parts), np.zeros((6, 6)))


def join_series(parts: Iterable[FloatArray]) -> FloatArray:
    """Return the stiffness (6, 6) of parts behind each other without mass between, all about one frame.

    A direction that one part leaves free is free in the whole; parts are condensed one by one, K1 - K1 (K1 + K2)^+ K1.
    """
    total: FloatArray | None = None
    for part in parts:
        matrix = symmetric("stiffness", floats("stiffness", part, (6, 6)))
        if total is None:
            total = matrix
            continue
        both = total + matrix
        size = np.sqrt(np.maximum(np.diag(both), 1e-300))
        inverse = np.linalg.pinv(both / np.outer(size, size), rcond=1e-12, hermitian=True) / np.outer(size, size)
        total = total - total @ inverse @ total
        total = (total + total.T) / 2
    if total is None:
        fail("parts", "none", "must be at least one")
    return total
