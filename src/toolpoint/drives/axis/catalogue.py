"""Inertia and stiffness of feed-drive parts from their dimensions, by textbook formulas."""

from __future__ import annotations

import math

from toolpoint._check import positive

STEEL_MODULUS, STEEL_SHEAR, STEEL_DENSITY = 206e9, 79.4e9, 7850.0  # Pa, Pa, kg/m^3: screws and shafts of plain steel


def cylinder_inertia(diameter: float, length: float, density: float = STEEL_DENSITY) -> float:
    """Return J = pi rho l d^4/32 of a solid cylinder about its axis, kg m2."""
    return math.pi * positive("density", density) * positive("length", length) * positive("diameter", diameter)**4 / 32


def torsional_stiffness(diameter: float, length: float, shear_modulus: float = STEEL_SHEAR) -> float:
    """Return k = pi G d^4/(32 l) of a screw of root diameter d over its length, N m/rad."""
    return math.pi * shear_modulus * positive("diameter", diameter)**4 / (32 * positive("length", length))
