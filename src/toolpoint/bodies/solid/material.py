"""Material of a solid: elastic constants, density, loss factor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import fail, nonnegative, positive, scalar


@dataclass(frozen=True)
class Material:
    """Isotropic linear material.

    Parameters
    ----------
    modulus : float
        Young's modulus E, Pa.
    poisson : float
        Poisson's ratio, above -1 and below 0.4999.
    density : float
        kg/m^3.
    loss_factor : float
        Structural loss factor, not negative: imaginary over real part of the modulus.

    Raises
    ------
    ToolpointError
        For a modulus or density that is not positive, a negative loss factor, or a Poisson's ratio out of its limits.

    Examples
    --------
    >>> from toolpoint.bodies.solid import Material
    >>> float(Material(210e9, 0.25, 7850.0).shear_modulus)
    84000000000.0
    """

    modulus: float
    poisson: float
    density: float
    loss_factor: float = 0.0

    def __post_init__(self) -> None:
        positive("Material.modulus", self.modulus)
        positive("Material.density", self.density)
        nonnegative("Material.loss_factor", np.asarray(scalar("Material.loss_factor", self.loss_factor)))
        ratio = scalar("Material.poisson", self.poisson)
        # At a half the bulk modulus is infinite, and elements without pressure of their own lock long before.
        if not -1 < ratio < 0.4999:
            fail("Material.poisson", f"{ratio:g}", "must be above -1 and below 0.4999",
                 remedy="a material that keeps its volume (0.5) needs mixed elements; rubber is better a joint")

    @property
    def shear_modulus(self) -> float:
        """Shear modulus G = E / (2 (1 + nu)), Pa."""
        return self.modulus / (2 * (1 + self.poisson))

    @property
    def lame(self) -> float:
        """First constant of Lame, lambda = E nu / ((1 + nu) (1 - 2 nu)), Pa."""
        return self.modulus * self.poisson / ((1 + self.poisson) * (1 - 2 * self.poisson))


# Usual values (GJL-250 and structural steel) to begin with; none was measured on a certain casting.
CAST_IRON = Material(110e9, 0.26, 7200.0, 2e-3)
STEEL = Material(210e9, 0.3, 7850.0, 4e-4)
