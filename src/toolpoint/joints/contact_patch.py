r"""Bolted and other flat contacts: stiffness per area over patches, which may depend on the pressure.

Normal approach of machined surfaces under pressure: :math:`\lambda = C p^m`, so the stiffness per area is
:math:`p^{1-m}/(C m)`; shear by a ratio. Sources: Back, Burdekin, Cowley, Proc. 13th MTDR Conf. (1973) (m near 0.5 for
ground and scraped cast iron); Mindlin, J. Appl. Mech. 16 (1949) for the ratio 2 (1 - nu)/(2 - nu).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._quantity import Quantity
from toolpoint.joints.guideway import AXES, Place, move_stiffness

MINDLIN_RATIO = 2 * (1 - 0.3) / (2 - 0.3)  # shear stiffness over normal stiffness, nu = 0.3


@dataclass(frozen=True)
class ContactPatch:
    """Rectangle in contact.

    `at` is its middle in the joint's frame; `sides` are its lengths along the two directions after the normal (y, z after x; z,
    x after y; x, y after z).
    """

    at: Place
    sides: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.sides) != 2 or min(self.sides) <= 0:
            fail("patches.sides", f"{self.sides}", "must be two lengths above zero, m")


@dataclass(frozen=True)
class PatchContactDescription:
    """Patches of one surface with normal `normal`.

    Either `per_area` (N/m^3) normal stiffness, or `approach` C and `exponent` m of lambda = C p^m (m, Pa) with the mean
    `pressure` of the bolts' force over the patch. `shear_ratio` is the shear stiffness over the normal one.
    """

    patches: tuple[ContactPatch, ...]
    normal: Literal["x", "y", "z"] = "z"
    per_area: float | None = None
    approach: float | None = None
    exponent: float = 0.5
    pressure: Annotated[float, Quantity("pressure", "Pa", above=0)] | None = None
    shear_ratio: Annotated[float, Quantity("ratio", "1", above=0, most=2)] = MINDLIN_RATIO

    @property
    def normal_per_area(self) -> float:
        """Normal stiffness per area, N/m^3."""
        if self.per_area is not None:
            if self.per_area <= 0:
                fail("per_area", f"{self.per_area:g} N/m^3", "must be above zero")
            return self.per_area
        if self.approach is None or self.pressure is None:
            fail("per_area", "missing", "a contact needs it, or `approach` and `pressure`")
        if self.approach <= 0 or not 0 < self.exponent < 1:
            fail("approach", f"C {self.approach:g}, m {self.exponent:g}", "must be C above zero and m between 0 and 1")
        return float(self.pressure ** (1 - self.exponent) / (self.approach * self.exponent))

    @property
    def stiffness(self) -> FloatArray:
        """Stiffness (6, 6) about the joint's frame."""
        k_normal = self.normal_per_area
        k_shear = self.shear_ratio * k_normal
        n = AXES[self.normal]
        total = np.zeros((6, 6))
        for patch in self.patches:
            a, b = patch.sides
            area, moment_1, moment_2 = a * b, a * b**3 / 12, a**3 * b / 12
            # Axes 1, 2 in the plane, 3 normal: rotation about 1 presses over side b, so its second moment is a b^3/12.
            single = np.diag([k_shear * area, k_shear * area, k_normal * area, k_normal * moment_1, k_normal * moment_2,
                              k_shear * (moment_1 + moment_2)])
            frame = np.zeros((3, 3))
            frame[(n + 1) % 3, 0] = frame[(n + 2) % 3, 1] = frame[n, 2] = 1.0
            total += move_stiffness(single, frame, np.array(patch.at))
        return total
