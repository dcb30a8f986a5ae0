"""Mass properties of uniform shapes from their size and density, about their own centre unless said otherwise."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, fail, floats, positive
from toolpoint.bodies.inertia import MassProperties


def box_inertia(mass: float, size: ArrayLike) -> FloatArray:
    """Return the inertia of a uniform box about its centre, m/12 (b^2 + c^2) ..., shape (3, 3)."""
    a, b, c = _check_size(size) ** 2
    return positive("mass", mass) / 12 * np.diag([b + c, a + c, a + b])


def box(size: ArrayLike, density: float, centre: ArrayLike = (0, 0, 0)) -> MassProperties:
    """Return the mass properties of a box; size (x, y, z) in m, density in kg/m^3."""
    mass = positive("density", density) * float(np.prod(_check_size(size)))
    return MassProperties(mass, np.asarray(centre, float), box_inertia(mass, size))


def cylinder(
    diameter: float, length: float, density: float, *, axis: str = "z", centre: ArrayLike = (0, 0, 0), bore: float = 0.0
) -> MassProperties:
    """Return the mass properties of a cylinder or tube along an axis; diameters, length in m, density in kg/m^3."""
    outer_radius, inner_radius = positive("diameter", diameter) / 2, bore / 2
    if not 0 <= inner_radius < outer_radius:
        fail("bore", f"{bore:g} m", f"must be within 0 .. diameter {diameter:g} m")
    area = np.pi * (outer_radius**2 - inner_radius**2)
    mass = positive("density", density) * area * positive("length", length)
    moment_along = mass * (outer_radius**2 + inner_radius**2) / 2
    moment_across = moment_along / 2 + mass * length**2 / 12
    moments = np.full(3, moment_across)
    moments["xyz".index(axis)] = moment_along
    return MassProperties(mass, np.asarray(centre, float), np.diag(moments))


def sphere(diameter: float, density: float, centre: ArrayLike = (0, 0, 0)) -> MassProperties:
    """Return the mass properties of a ball; diameter in m, density in kg/m^3."""
    radius = positive("diameter", diameter) / 2
    mass = positive("density", density) * 4 / 3 * np.pi * radius**3
    return MassProperties(mass, np.asarray(centre, float), 0.4 * mass * radius**2 * np.eye(3))


def _check_size(size: ArrayLike) -> FloatArray:
    """Return the three sides of a box after checking that they are above zero."""
    values = floats("size", size, (3,))
    if values.min() <= 0:
        fail("size", f"{values.min():g} m", "must be above zero")
    return values
