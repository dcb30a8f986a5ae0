"""TotalEnergy: cutting energy per volume that falls with the chip thickness, and two force ratios."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail, positive, scalar
from toolpoint.cutting.cut.coefficients import CuttingCoefficients, chip_direction, force_direction
from toolpoint.cutting.cut.tool import Engagement

_ARC_ANGLES = 2000  # of the arc, at whose middles the slope is taken
_THINNEST_SHARE = 1e-6  # of the feed: thinner chips, at the ends of an arc, are taken as so thick
REFERENCE_CHIP = 1e-3  # m: chip thickness at which the energy is stated


@dataclass(frozen=True)
class TotalEnergy:
    r"""Total cutting energy per volume with force ratios: :math:`F_t/b = u h`, :math:`u = u_0 (h/h_0)^{-m}`, h_0 = 1 mm,
    :math:`F_n = r_1 F_t`, :math:`F_a = r_2 F_t`.

    Parameters
    ----------
    energy : float
        u_0, J/m^3 (Pa), at 1 mm chip thickness.
    exponent : float
        m, 0 .. 1.
    normal_ratio, axial_ratio : float
        r_1, r_2, not negative.

    Examples
    --------
    >>> law = TotalEnergy(1.2e9, exponent=0.2, normal_ratio=0.4)
    >>> float(round(law.specific(0.1e-3) / 1e6))  # N/mm^2 at a chip of 0.1 mm
    1902.0
    """

    energy: float
    exponent: float = 0.0
    normal_ratio: float = 0.3
    axial_ratio: float = 0.0

    def __post_init__(self) -> None:
        positive("TotalEnergy.energy", self.energy)
        if not 0 <= scalar("TotalEnergy.exponent", self.exponent) < 1:
            fail("TotalEnergy.exponent", f"{self.exponent:g}", "must be at least 0 and below 1")
        for name in ("normal_ratio", "axial_ratio"):
            if scalar(f"TotalEnergy.{name}", getattr(self, name)) < 0:
                fail(f"TotalEnergy.{name}", f"{getattr(self, name):g}", "must not be negative")

    @property
    def ratios(self) -> FloatArray:
        """(1, r_1, r_2): tangential, normal and axial force over the tangential one."""
        return np.array([1.0, self.normal_ratio, self.axial_ratio])

    def specific(self, chip: float) -> float:
        """Return the energy per volume u at a chip thickness (m), Pa."""
        return float(self.energy * (positive("chip", chip) / REFERENCE_CHIP) ** -self.exponent)

    def per_length(self, chip: FloatArray) -> FloatArray:
        """Return (F_t, F_n, F_a) per metre of edge, N/m, shape (..., 3), zero where the chip is not above zero."""
        h = np.maximum(np.asarray(chip, float), 0.0)
        return np.asarray(self.energy * effective_chip(h, self.exponent)[..., None] * self.ratios)

    def linearised(self, chip: float) -> CuttingCoefficients:
        """Return the tangent at this chip thickness (m) as linear-edge coefficients: slopes (1 - m) u, edges m u h."""
        u = self.specific(chip)
        (kt, kn, ka), (te, ne, ae) = ((share * self.ratios).tolist() for share in
                                      ((1 - self.exponent) * u, self.exponent * u * chip))
        return CuttingCoefficients(kt, kn, ka, te, ne, ae, f"total energy {u / 1e6:.4g} N/mm^2, tangent at a chip of "
                                   f"{1e3 * chip:.3g} mm")


def linearise_over(law: TotalEnergy, engagement: Engagement, feed: float) -> tuple[CuttingCoefficients, float]:
    r"""Return linear-edge coefficients that stand for a law over an arc of cut, and how far they are from it, relative.

    Along the arc the law's slope :math:`(1 - m) u(f \sin\phi)` changes, that of coefficients does not. Theirs is the one whose
    mean directional matrix :math:`\int k n^T d\phi` is nearest to that of the law; their edges keep the force at the mean chip.
    What is left between both matrices is the second value: a limit of stability changes by as much at the most, about.
    """
    ends = np.linspace(engagement.entry, engagement.exit, _ARC_ANGLES + 1)
    angle = (ends[1:] + ends[:-1]) / 2
    mean = feed * (np.cos(engagement.entry) - np.cos(engagement.exit)) / engagement.arc
    tangent = law.linearised(float(mean))
    slope = (np.maximum(feed * np.sin(angle), _THINNEST_SHARE * feed) / mean) ** -law.exponent
    k, n = force_direction(tangent, angle), chip_direction(angle)
    of_law, of_tangent = np.einsum("a,ai,aj->ij", slope, k, n), np.einsum("ai,aj->ij", k, n)
    factor = float((of_law * of_tangent).sum() / (of_tangent**2).sum())
    deviation = float(np.linalg.norm(of_law - factor * of_tangent) / np.linalg.norm(factor * of_tangent))
    cutting, force = factor * tangent.cutting, tangent.cutting * mean + tangent.edge
    edge = np.maximum(force - cutting * mean, 0.0)
    (kt, kn, ka), (te, ne, ae) = cutting.tolist(), edge.tolist()
    words = (f"total energy {law.specific(float(mean)) / 1e6:.4g} N/mm^2 at the mean chip of {1e3 * mean:.3g} mm, slope "
             "over the arc")
    return CuttingCoefficients(kt, kn, ka, te, ne, ae, words), deviation


def effective_chip(chip: FloatArray, exponent: float) -> FloatArray:
    r"""Return :math:`h (h/h_0)^{-m}`, m: the thickness to which the forces of a total-energy law are proportional."""
    return np.asarray(REFERENCE_CHIP**exponent * np.asarray(chip, float) ** (1 - exponent))
