"""AxialTravel: a stiffness along one direction of a joint that changes as an axis moves the joint along it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray

TravelLaw = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


@dataclass(frozen=True, eq=False)
class AxialTravel:
    """Change of a joint's stiffness along one direction, relative to that of the described pose.

    Parameters
    ----------
    way : int
        Direction of the joint's frame, 0 .. 2.
    law : callable
        Travel from the described pose (P,), m -> stiffness, N/m, and its derivative, N/m^2.
    loss_factor : float
        Of this stiffness.
    """

    way: int
    law: TravelLaw
    loss_factor: float = 0.0

    def gain(self, travel: FloatArray) -> FloatArray:
        """Return the stiffness beyond that of the described pose, N/m, (P,)."""
        return self.law(travel)[0] - self.law(np.zeros(1))[0]
