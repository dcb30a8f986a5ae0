"""CuttingCoefficients: the linear-edge cutting force coefficients of a work and tool material pair."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray, ToolpointWarning, fail, scalar
from toolpoint._notebook import NotebookText

MIN_PLAUSIBLE_KT = 1e6

@dataclass(frozen=True)
class CuttingCoefficients(NotebookText):
    r"""Linear-edge force law: per metre of edge :math:`F_t = K_t h + K_{te}`, :math:`F_n = K_n h + K_{ne}`, and axial.

    Parameters
    ----------
    kt, kn, ka : float
        Tangential, normal (radial) and axial cutting coefficient, Pa (N/m^2); kt above zero, the others not negative.
    edge_t, edge_n, edge_a : float
        Edge coefficients, N/m.
    source : str
        Where the numbers come from.

    Source: Altintas, Manufacturing Automation, 2nd ed., section 2.4 (his radial index r is n here).

    Examples
    --------
    >>> CuttingCoefficients(kt=600e6, kn=200e6)
    CuttingCoefficients(kt 600, kn 200, ka 0 N/mm^2)
    """

    kt: float
    kn: float
    ka: float = 0.0
    edge_t: float = 0.0
    edge_n: float = 0.0
    edge_a: float = 0.0
    source: str = ""

    def __post_init__(self) -> None:
        for name in ("kt", "kn", "ka", "edge_t", "edge_n", "edge_a"):
            value = scalar(f"CuttingCoefficients.{name}", getattr(self, name))
            if value < 0:
                fail(f"CuttingCoefficients.{name}", f"{value:g}", "must not be negative",
                     remedy="forces on the tool oppose the cut; check the sign convention of the source")
            object.__setattr__(self, name, value)
        if self.kt <= 0:
            fail("CuttingCoefficients.kt", f"{self.kt:g}", "must be above zero")
        # A warning, not an error: wax, foam and numbers made dimensionless are softer than any metal.
        if self.kt < MIN_PLAUSIBLE_KT:
            warnings.warn(f"CuttingCoefficients.kt: {self.kt:g} Pa is below 1 N/mm^2, less than any work material has; "
                          "coefficients are in Pa: multiply those in N/mm^2 by 1e6", ToolpointWarning, stacklevel=3)

    @property
    def cutting(self) -> FloatArray:
        """(kt, kn, ka), Pa."""
        return np.array([self.kt, self.kn, self.ka])

    @property
    def edge(self) -> FloatArray:
        """(edge_t, edge_n, edge_a), N/m."""
        return np.array([self.edge_t, self.edge_n, self.edge_a])

    def scaled(self, factor: float) -> CuttingCoefficients:
        """Return the same material with all coefficients multiplied."""
        names = ("kt", "kn", "ka", "edge_t", "edge_n", "edge_a")
        return replace(self, **{name: getattr(self, name) * factor for name in names})

    def __repr__(self) -> str:
        edge = "" if not self.edge.any() else ", edge " + "/".join(f"{v / 1e3:g}" for v in self.edge) + " N/mm"
        return (f"CuttingCoefficients(kt {self.kt / 1e6:g}, kn {self.kn / 1e6:g}, ka {self.ka / 1e6:g} N/mm^2{edge}"
                + (f", {self.source}" if self.source else "") + ")")


def force_direction(coefficients: CuttingCoefficients, angle: FloatArray) -> FloatArray:
    """Return k(phi) = [Kt cos + Kn sin, -Kt sin + Kn cos], Pa, shape (..., 2): the force on the tool is -w h k."""
    s, c = np.sin(angle), np.cos(angle)
    kt, kn = coefficients.kt, coefficients.kn
    return np.stack([kt * c + kn * s, -kt * s + kn * c], axis=-1)


def chip_direction(angle: FloatArray) -> FloatArray:
    """Return n(phi) = [sin, cos], shape (..., 2): the outward normal of a tooth at angle phi, clockwise from y."""
    return np.stack([np.sin(angle), np.cos(angle)], axis=-1)


def edge_matrix(coefficients: CuttingCoefficients, angle: FloatArray, kappa: FloatArray | float = np.pi / 2) -> FloatArray:
    r"""Return :math:`k n^T` of an edge element, Pa, shape (..., 3, 3): the force on the tool is -du k n^T times the vibration.

    :math:`n = [\sin\phi \sin\kappa, \cos\phi \sin\kappa, -\cos\kappa]` is the outward normal of the tool's envelope at the
    axial immersion angle kappa (90 degrees on a cylinder, 0 at a ball's tip), :math:`t = [\cos\phi, -\sin\phi, 0]`,
    :math:`m = [\sin\phi \cos\kappa, \cos\phi \cos\kappa, \sin\kappa]` its meridian; k = K_t t + K_n n - K_a m, du the length of
    edge along the meridian (dz/sin kappa).

    Source: Engin, Altintas, Int. J. Machine Tools Manufacture 41 (2001) 2195, in the convention of this package.
    """
    phi, kap = np.broadcast_arrays(np.asarray(angle, float), np.asarray(kappa, float))
    s, c, sk, ck = np.sin(phi), np.cos(phi), np.sin(kap), np.cos(kap)
    n = np.stack([s * sk, c * sk, -ck], axis=-1)
    t = np.stack([c, -s, np.zeros_like(s)], axis=-1)
    m = np.stack([s * ck, c * ck, sk], axis=-1)
    k = coefficients.kt * t + coefficients.kn * n - coefficients.ka * m
    return k[..., :, None] * n[..., None, :]


def mean_matrix(coefficients: CuttingCoefficients, entry: float, exit: float, *, teeth: int, size: int = 2) -> FloatArray:
    r"""Return the mean directional matrix :math:`N/2\pi \int k n^T d\phi`, Pa, in closed form, shape (2, 2).

    With `size` 3 a row for the axial force (K_a) and a column of zeros for the axial vibration are added (a cylinder).

    Source: Altintas, Budak, CIRP Annals 44 (1995) 357, in the convention of this package.
    """
    def rising(p: float) -> FloatArray:
        ss, cc, sc = p / 2 - np.sin(2 * p) / 4, p / 2 + np.sin(2 * p) / 4, np.sin(p) ** 2 / 2
        kt, kn = coefficients.kt, coefficients.kn
        plane = [[kt * sc + kn * ss, kt * cc + kn * sc], [-kt * ss + kn * sc, -kt * sc + kn * cc]]
        if size == 2:
            return np.array(plane)
        axial = [coefficients.ka * np.cos(p), -coefficients.ka * np.sin(p), 0.0]
        return np.array([[*plane[0], 0.0], [*plane[1], 0.0], axial])

    return teeth / (2 * np.pi) * (rising(exit) - rising(entry))
