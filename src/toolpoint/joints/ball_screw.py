r"""Ball screw: nut, shaft and bearings in series along its axis; the shaft's compliance depends on the nut's position.

Shaft held at one end: :math:`k = E A / x`; at both: :math:`k = E A L / (x (L - x))`; twist of the shaft between motor and
nut adds :math:`k = (2 \pi / p)^2 G I_p / x`. Source: Altintas, Manufacturing Automation, 2nd ed., section 5.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._quantity import Quantity
from toolpoint.joints.guideway import AXES

SCREW_MODULUS, SCREW_SHEAR_MODULUS = 206e9, 79.4e9  # Pa, steel of shafts


@dataclass(frozen=True)
class BallScrewDescription:
    """A ball screw along `along`; `nut_at` is the distance of the nut from the thrust bearing at the described pose.

    `diameter` is the root diameter; with `lead` the shaft's twist between the motor, held at the bearing, and the nut counts.
    With `follows` the nut's distance changes as an axis drives the joint along + `along`: ``away`` from the thrust bearing, or
    ``towards`` it; without it the described distance stands for all positions.
    """

    nut: Annotated[float, Quantity("stiffness", "N/m", above=0)]
    bearing: Annotated[float, Quantity("stiffness", "N/m", above=0)]
    diameter: Annotated[float, Quantity("length", "m", above=0)]
    length: Annotated[float, Quantity("length", "m", above=0)]
    nut_at: Annotated[float, Quantity("length", "m", above=0)]
    held: Literal["one end", "both ends"] = "one end"
    along: Literal["x", "y", "z"] = "x"
    lead: Annotated[float, Quantity("length", "m", above=0)] | None = None
    modulus: Annotated[float, Quantity("pressure", "Pa", above=0)] = SCREW_MODULUS
    bracket: Annotated[float, Quantity("stiffness", "N/m", above=0)] | None = None
    follows: Literal["", "away", "towards"] = ""

    def axial(self, position: float | None = None) -> float:
        """Return the axial stiffness with the nut at a distance from the thrust bearing (m), N/m."""
        return float(self.axial_along(np.array([self.nut_at if position is None else position]))[0][0])

    def axial_along(self, position: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the axial stiffness (N/m) and its derivative (N/m^2) with the nut at distances from the thrust bearing, m."""
        beyond_shaft = (position <= 0) | (position > self.length) | ((position >= self.length) & (self.held == "both ends"))
        if beyond_shaft.any():
            fail("ball_screw.nut_at", f"{1e3 * float(position[beyond_shaft][0]):g} mm from the thrust bearing",
                 f"must be within the shaft, 0 .. {1e3 * self.length:g} mm")
        area, polar_moment = np.pi / 4 * self.diameter**2, np.pi / 32 * self.diameter**4
        rod = 1 / (self.modulus * area)
        side_a = rod * position + 1 / self.bearing
        compliance, slope = side_a, np.full_like(position, rod)
        if self.held == "both ends":
            # Each end has a bearing: two springs in parallel, whose compliances combine as a b/(a + b).
            side_b = rod * (self.length - position) + 1 / self.bearing
            compliance, slope = side_a * side_b / (side_a + side_b), rod * (side_b - side_a) / (side_a + side_b)
        compliance = compliance + 1 / self.nut + (0.0 if self.bracket is None else 1 / self.bracket)
        if self.lead is not None:
            # Held by the motor at the bearing's end, the shaft twists up to the nut alone, whichever end holds it axially.
            twist_compliance = (self.lead / (2 * np.pi)) ** 2 / (SCREW_SHEAR_MODULUS * polar_moment)
            compliance, slope = compliance + twist_compliance * position, slope + twist_compliance
        return 1 / compliance, -slope / compliance**2

    def along_travel(self, travel: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the axial stiffness (N/m) and its derivative (N/m^2) by the joint's travel along `along` (m)."""
        sign = -1.0 if self.follows == "towards" else 1.0
        stiffness, slope = self.axial_along(self.nut_at + sign * travel)
        return stiffness, sign * slope

    @property
    def stiffness(self) -> FloatArray:
        """Stiffness (6, 6): along its axis only."""
        result = np.zeros((6, 6))
        result[AXES[self.along], AXES[self.along]] = self.axial()
        return result
