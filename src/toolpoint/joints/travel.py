"""AxialTravel: a stiffness along one direction of a joint that changes as an axis moves the joint along it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray

Along = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


@dataclass(frozen=True, eq=False)
class AxialTravel:
    """What a joint's stiffness gains beside that of the described pose.

    way : direction of the joint's frame, 0 .. 2; law : travel from the described pose (P,), m -> stiffness, N/m, and its
    derivative, N/m^2; loss_factor : of this stiffness.
    """

    way: int
    law: Along
    loss_factor: float = 0.0

    def gain(self, travel: FloatArray) -> FloatArray:
        """Return the stiffness beyond that of the described pose, N/m, (P,)."""
        return self.law(travel)[0] - self.law(np.zeros(1))[0]
