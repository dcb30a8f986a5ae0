"""Axis: a driven direction of a joint, linear or rotary, with its limits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail, one_of, scalar

AXES = ("x", "y", "z", "rx", "ry", "rz")
DIRECTIONS = AXES + tuple("-" + axis for axis in AXES)


@dataclass(frozen=True)
class Axis:
    """A driven direction: positions in m or rad, zero at the reference pose.

    Parameters
    ----------
    name : str
        For example X, Y, Z, A, B, C.
    joint : int
        The joint of the chain that it moves.
    direction : str
        ``x y z`` or ``rx ry rz`` of the joint's frame, with a minus sign for the opposite sense.
    lower, upper : float
        Limits of travel, m or rad.
    """

    name: str
    joint: int
    direction: str
    lower: float = -np.inf
    upper: float = np.inf

    def __post_init__(self) -> None:
        one_of(f"axis {self.name}: direction", self.direction, DIRECTIONS)
        if not self.lower < self.upper:
            fail(f"axis {self.name}: limits", f"{self.lower:g} .. {self.upper:g}", "the lower must be below the upper")

    @property
    def is_rotary(self) -> bool:
        """Whether the axis turns."""
        return "r" in self.direction

    @property
    def twist(self) -> FloatArray:
        """Unit twist (v, w) in the joint's frame, shape (6,)."""
        unit = np.zeros(6)
        unit[AXES.index(self.direction.lstrip("-"))] = -1.0 if self.direction[0] == "-" else 1.0
        return unit

    def checked(self, position: FloatArray) -> FloatArray:
        """Return positions after checking them against the limits of travel."""
        slack = 1e-9 * max(1.0, abs(self.lower) if np.isfinite(self.lower) else 1.0)
        for value in (float(np.min(position)), float(np.max(position))):
            if not self.lower - slack <= scalar(f"pose {self.name}", value) <= self.upper + slack:
                unit = "rad" if self.is_rotary else "m"
                fail(f"pose {self.name}", f"{value:g} {unit}", f"must be within {self.lower:g} .. {self.upper:g} {unit}")
        return position
