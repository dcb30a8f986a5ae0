r"""Straight slender beam (Euler-Bernoulli) with both ends as interfaces, reduced to static and fixed-interface modes.

The beam lies along its own x axis from ``root`` (the body's frame) to ``tip``. Hermite elements with consistent mass;
Craig-Bampton reduction. Sources: Przemieniecki, Theory of Matrix Structural Analysis, chapters 5 and 11; Craig,
Bampton, AIAA J. 6 (1968).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from toolpoint._check import FloatArray, count, positive
from toolpoint.bodies.body import Body, Interface
from toolpoint.spatial.rotation import skew


@dataclass(frozen=True)
class BeamSection:
    """Cross section and material of a beam.

    Parameters
    ----------
    area : float
        m^2.
    bending_y, bending_z : float
        Second moments of area about the section's y and z axes, m^4.
    torsion : float
        Torsion constant, m^4.
    modulus, shear_modulus : float
        Pa.
    density : float
        kg/m^3.
    """

    area: float
    bending_y: float
    bending_z: float
    torsion: float
    modulus: float
    shear_modulus: float
    density: float

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            positive(f"BeamSection.{name}", getattr(self, name))


def rectangle(width: float, height: float, modulus: float, *, density: float, poisson: float = 0.3) -> BeamSection:
    """Return a rectangular section: width along y, height along z, m; modulus in Pa, density in kg/m^3.

    Torsion constant by the series of Saint-Venant with its first terms, within 0.5 % (Roark, table 10.7).
    """
    b, h = positive("width", width), positive("height", height)
    long, short = max(b, h), min(b, h)
    torsion = long * short**3 * (1 / 3 - 0.21 * short / long * (1 - short**4 / (12 * long**4)))
    return BeamSection(b * h, b * h**3 / 12, h * b**3 / 12, torsion, modulus, modulus / (2 * (1 + poisson)), density)


def matrices(section: BeamSection, length: float, elements: int) -> tuple[FloatArray, FloatArray]:
    """Return mass and stiffness of the free beam, six coordinates (x y z rx ry rz) per node, shape (6 (n + 1),) * 2."""
    n = count("elements", elements)
    step = positive("length", length) / n
    m, k = _element(section, step)
    size = 6 * (n + 1)
    mass, stiffness = np.zeros((size, size)), np.zeros((size, size))
    for e in range(n):
        at = slice(6 * e, 6 * e + 12)
        mass[at, at] += m
        stiffness[at, at] += k
    return mass, stiffness


def _element(s: BeamSection, h: float) -> tuple[FloatArray, FloatArray]:
    mass, stiffness = np.zeros((12, 12)), np.zeros((12, 12))
    for at, rigidity, inertia in ((0, s.modulus * s.area, s.density * s.area),
                                  (3, s.shear_modulus * s.torsion, s.density * (s.bending_y + s.bending_z))):
        pair = np.ix_([at, at + 6], [at, at + 6])
        stiffness[pair] += rigidity / h * np.array([[1, -1], [-1, 1]])
        mass[pair] += inertia * h / 6 * np.array([[2, 1], [1, 2]])
    # y with rz, and z with ry, whose slope has the other sign: z' = -ry.
    for index, bending, sign in (([1, 5, 7, 11], s.bending_z, 1.0), ([2, 4, 8, 10], s.bending_y, -1.0)):
        turn = np.diag([1, sign, 1, sign])
        k = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2],
                      [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h**2, -6 * h, 4 * h**2]])
        m = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h**2, 13 * h, -3 * h**2],
                      [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h**2, -22 * h, 4 * h**2]])
        stiffness[np.ix_(index, index)] += s.modulus * bending / h**3 * turn @ k @ turn
        mass[np.ix_(index, index)] += s.density * s.area * h / 420 * turn @ m @ turn
    return mass, stiffness


def beam(section: BeamSection, length: float, elements: int = 20, *, modes: int = 6) -> Body:
    """Return a beam body with interfaces ``root`` and ``tip``.

    Modal coordinates: the six motions of the tip relative to the root's rigid motion, then the amplitudes of the
    lowest `modes` vibration modes with both ends held (mass-normalised).
    """
    mass, stiffness = matrices(section, length, elements)
    free = np.arange(6, 6 * elements)
    tip = np.arange(6 * elements, 6 * elements + 6)
    k_inner = stiffness[np.ix_(free, free)]
    size = len(mass)
    basis = np.zeros((size, 6 + 6 + modes))
    for node in range(elements + 1):
        offset = np.array([length * node / elements, 0, 0])
        basis[6 * node:6 * node + 6, :6] = np.block([[np.eye(3), -skew(offset)], [np.zeros((3, 3)), np.eye(3)]])
    basis[tip, 6:12] = np.eye(6)
    if len(free):
        basis[np.ix_(free, np.arange(6, 12))] = -np.linalg.solve(k_inner, stiffness[np.ix_(free, tip)])
        squares, vectors = eigh(k_inner, mass[np.ix_(free, free)])
        keep = min(modes, len(squares))
        basis[np.ix_(free, np.arange(12, 12 + keep))] = vectors[:, :keep]
        basis = basis[:, :12 + keep]
    reduced_mass, reduced_stiffness = basis.T @ mass @ basis, basis.T @ stiffness @ basis
    modal = basis.shape[1] - 6
    at_tip = np.zeros((6, modal))
    at_tip[:, :6] = np.eye(6)
    # The beam's twist order (x y z, rx ry rz) is the twist (v, w) of each node, so no reordering is needed.
    return Body((reduced_mass + reduced_mass.T) / 2,
                (reduced_stiffness[6:, 6:] + reduced_stiffness[6:, 6:].T) / 2,
                interfaces={"root": Interface(np.zeros(3)), "tip": Interface(np.array([length, 0, 0]), at_tip)})
