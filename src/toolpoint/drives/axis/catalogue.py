"""Inertia, stiffness and damping of feed-drive parts from catalogue data, by textbook formulas."""

from __future__ import annotations

import math

from toolpoint._check import one_of, positive

STEEL_MODULUS, STEEL_SHEAR, STEEL_DENSITY = 206e9, 79.4e9, 7850.0


def cylinder_inertia(diameter: float, length: float, density: float = STEEL_DENSITY) -> float:
    """Return J = pi rho l d^4/32 of a solid cylinder about its axis, kg m2."""
    return math.pi * positive("density", density) * positive("length", length) * positive("diameter", diameter)**4 / 32


def torsional_stiffness(diameter: float, length: float, shear_modulus: float = STEEL_SHEAR) -> float:
    """Return k = pi G d^4/(32 l) of a screw of root diameter d over its length, N m/rad."""
    return math.pi * shear_modulus * positive("diameter", diameter)**4 / (32 * positive("length", length))


def axial_stiffness(diameter: float, length: float, position: float, *, mounting: str = "fixed-free",
                    modulus: float = STEEL_MODULUS) -> float:
    """Return the axial stiffness of a screw at the nut, N/m.

    ``fixed-free`` (or supported): E A / x; ``fixed-fixed``: E A / x + E A / (l - x), x from the fixed bearing.
    Source: ball-screw manufacturers' formula, e.g. Altintas, Manufacturing Automation, 2nd ed., section 5.2.
    """
    one_of("mounting", mounting, ("fixed-free", "fixed-fixed"))
    rod = modulus * math.pi * positive("diameter", diameter)**2 / 4
    x = positive("position", position, positive("length", length))
    return rod / x + (rod / (length - x) if mounting == "fixed-fixed" and x < length else 0.0)


def series(*stiffness: float) -> float:
    """Return the stiffness of springs in series."""
    return 1 / sum(1 / positive("stiffness", k) for k in stiffness)


def viscous_damping(stiffness: float, inertia: float, damping_ratio: float) -> float:
    """Return c = 2 zeta sqrt(k m) of a spring and the inertia it carries, N s/m or N m s/rad."""
    return 2 * damping_ratio * math.sqrt(positive("stiffness", stiffness) * positive("inertia", inertia))


def reflected_inertia(mass: float, lead: float) -> float:
    """Return the inertia of a table at the motor, m r^2 with r = lead/2 pi of a turn, kg m2."""
    return positive("mass", mass) * (positive("lead", lead) / (2 * math.pi))**2
