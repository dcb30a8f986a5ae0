"""Springs that are not linear: a nut or a gear with preload or backlash, a progressive coupling; records for the kernel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, positive, scalar
from toolpoint.drives.friction.records import CONTACT, LAW


@dataclass(frozen=True)
class Contact:
    """Two one-sided springs face to face: F = k max(s + d, 0) - k max(d - s, 0).

    Parameters
    ----------
    stiffness : float
        k of one side, N/m (or N m/rad).
    preload_deflection : float
        d, m: positive for a preloaded nut (both sides carry until ``|s| = d``, stiffness 2 k), negative for backlash
        (free play ``2 |d|`` in all).

    Examples
    --------
    A nut of 200 N/um preloaded by 1 kN loses one side at 10 um; beyond, its stiffness is half as large:

    >>> nut = Contact.preloaded(stiffness=2e8, preload=1000.0)
    >>> [round(float(nut.force(s)), 6) for s in (5e-6, 10e-6, 20e-6)]
    [1000.0, 2000.0, 3000.0]
    """

    stiffness: float
    preload_deflection: float

    def __post_init__(self) -> None:
        positive("Contact.stiffness", self.stiffness)
        scalar("Contact.preload_deflection", self.preload_deflection)

    @classmethod
    def preloaded(cls, stiffness: float, preload: float) -> Contact:
        """Return the contact of a nut of total `stiffness` (N/m) preloaded by `preload` (N): one side k = stiffness/2."""
        return cls(stiffness / 2, preload / (positive("stiffness", stiffness) / 2))

    @classmethod
    def with_backlash(cls, stiffness: float, backlash: float) -> Contact:
        """Return the contact with `backlash` (m, whole free play) and `stiffness` (N/m) once it carries."""
        return cls(stiffness, -positive("backlash", backlash) / 2)

    @property
    def reference_stiffness(self) -> float:
        """Stiffness that enters the linear part: 2 k where preloaded, else k."""
        # The slope at rest of a preloaded nut, where both sides carry; with backlash there is none at rest, and that of
        # contact stands in.
        return 2 * self.stiffness if self.preload_deflection > 0 else self.stiffness

    def force(self, deflection: FloatArray | float) -> FloatArray:
        """Return the force at a deflection, N."""
        s, d = np.asarray(deflection, float), self.preload_deflection
        return self.stiffness * (np.maximum(s + d, 0) - np.maximum(d - s, 0))

    @property
    def record(self) -> np.ndarray:
        """The contact as the record (`records.LAW`, shape ()) that the simulation kernel reads."""
        record = np.zeros((), LAW)
        record["kind"], record["contact_stiffness"] = CONTACT, self.stiffness
        record["contact_reference"], record["contact_preload"] = self.reference_stiffness, self.preload_deflection
        return record


@dataclass(frozen=True)
class ProgressiveSpring:
    """Spring that stiffens with its deflection: F = k s (1 + (s / s_2)^2), as the spider of an elastomer coupling.

    Parameters
    ----------
    stiffness : float
        k at rest, N m/rad (or N/m).
    doubling : float
        s_2, rad (or m): deflection at which it carries twice the force of k alone.

    Examples
    --------
    >>> spider = ProgressiveSpring(stiffness=2000.0, doubling=0.01)
    >>> [round(float(spider.force(s)), 6) for s in (0.001, 0.01)]
    [2.02, 40.0]
    """

    stiffness: float
    doubling: float

    def __post_init__(self) -> None:
        positive("ProgressiveSpring.stiffness", self.stiffness)
        positive("ProgressiveSpring.doubling", self.doubling)

    @property
    def reference_stiffness(self) -> float:
        """Stiffness that enters the linear part: k."""
        return self.stiffness

    @property
    def cubic(self) -> float:
        """k / s_2^2, N m/rad^3 (or N/m^3)."""
        return self.stiffness / self.doubling**2

    def force(self, deflection: FloatArray | float) -> FloatArray:
        """Return the force at a deflection, N m (or N)."""
        s = np.asarray(deflection, float)
        return self.stiffness * s + self.cubic * s**3

    @property
    def record(self) -> np.ndarray:
        """The spring as the record (`records.LAW`, shape ()) that the simulation kernel reads."""
        record = np.zeros((), LAW)
        # The linear part stands in the plant; the law is what exceeds it.
        record["kind"], record["contact_cubic"] = CONTACT, self.cubic
        return record
