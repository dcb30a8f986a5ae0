r"""Straight beams of stepped sections: Timoshenko or slender (Euler-Bernoulli), hollow, of several materials, spinning.

The beam lies along its own x axis. Elements with a cubic deflection and a quadratic turn of the section, Hermite's where the
section does not shear; consistent mass with rotary inertia, and the gyroscopic matrix of a spin about the axis. Frequencies
converge with the fourth power of the element's length. Sources: Przemieniecki, Theory of Matrix Structural Analysis, chapters
5 and 11; Nelson, J. Mech. Des. 102 (1980) 793 (spinning Timoshenko shaft); Craig, Bampton, AIAA J. 6 (1968).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.linalg import eigh

from toolpoint._check import FloatArray, count, fail, floats, nonnegative, positive
from toolpoint.bodies.body import Body, Interface
from toolpoint.spatial.rotation import skew

# Gauss points and weights over 0 .. 1: four integrate the square of a cubic exactly.
_POINTS, _WEIGHTS = (np.polynomial.legendre.leggauss(4)[0] + 1) / 2, np.polynomial.legendre.leggauss(4)[1] / 2
_INTERIOR_SIZE = 8  # coordinates of an element beside those of its ends


@dataclass(frozen=True)
class BeamSection:
    """Rigidities and inertia of a cross section; sections of several materials are sums.

    Parameters
    ----------
    axial : float
        E A, N.
    bending_y, bending_z : float
        E I about the section's y and z axes, N m^2.
    torsion : float
        G J, N m^2.
    shear_y, shear_z : float
        kappa G A against shear along y and z, N; infinite for a slender beam.
    mass : float
        rho A, kg/m.
    inertia_y, inertia_z : float
        rho I about y and z, kg m: rotary inertia in bending (zero for a slender beam).
    polar : float
        rho (I_y + I_z), kg m: inertia in torsion and of a spin.
    """

    axial: float
    bending_y: float
    bending_z: float
    torsion: float
    shear_y: float
    shear_z: float
    mass: float
    inertia_y: float
    inertia_z: float
    polar: float

    def __post_init__(self) -> None:
        for name in ("axial", "bending_y", "bending_z", "torsion", "mass", "polar"):
            positive(f"BeamSection.{name}", getattr(self, name))
        for name in ("inertia_y", "inertia_z"):
            nonnegative(f"BeamSection.{name}", floats(f"BeamSection.{name}", getattr(self, name)))
        for name in ("shear_y", "shear_z"):
            if not getattr(self, name) > 0:
                fail(f"BeamSection.{name}", getattr(self, name), "must be above zero", remedy="infinite for a slender beam")

    def __add__(self, other: BeamSection) -> BeamSection:
        """Return the section of both, bonded to each other about the same axis."""
        return BeamSection(*(getattr(self, n) + getattr(other, n) for n in self.__dataclass_fields__))

    @property
    def slender(self) -> BeamSection:
        """The section without shear and rotary inertia (Euler-Bernoulli)."""
        return replace(self, shear_y=np.inf, shear_z=np.inf, inertia_y=0.0, inertia_z=0.0)


def rectangle(width: float, height: float, modulus: float, *, density: float, poisson: float = 0.3) -> BeamSection:
    """Return a rectangular section: width along y, height along z, m; modulus in Pa, density in kg/m^3.

    Torsion constant by the series of Saint-Venant with its first terms, within 0.5 % (Roark, table 10.7); shear coefficient of
    Cowper, J. Appl. Mech. 33 (1966), 10 (1 + nu) / (12 + 11 nu).
    """
    b, h = positive("width", width), positive("height", height)
    longer, shorter = max(b, h), min(b, h)
    # Saint-Venant's series for a rectangle, after its usual closed form: within 0.5 % for all ratios of the sides.
    torsion_constant = longer * shorter**3 * (1 / 3 - 0.21 * shorter / longer * (1 - shorter**4 / (12 * longer**4)))
    return _section(b * h, b * h**3 / 12, h * b**3 / 12, torsion_constant, modulus=modulus, density=density, poisson=poisson,
                    shear=10 * (1 + poisson) / (12 + 11 * poisson))


def ring(diameter: float, bore: float, modulus: float, *, density: float, poisson: float, shear: float) -> BeamSection:
    """Return a round section, bored where `bore` (m) is not zero; `shear` is Timoshenko's shear coefficient."""
    outer_diameter, inner_diameter = positive("diameter", diameter), float(nonnegative("bore", floats("bore", bore)))
    if inner_diameter >= outer_diameter:
        fail("bore", f"{inner_diameter:g} m", f"must be below the diameter, {outer_diameter:g} m")
    area, second = np.pi / 4 * (outer_diameter**2 - inner_diameter**2), np.pi / 64 * (outer_diameter**4 - inner_diameter**4)
    return _section(area, second, second, 2 * second, modulus=modulus, density=density, poisson=poisson, shear=shear)


def _section(area: float, about_y: float, about_z: float, torsion_constant: float, *, modulus: float, density: float,
             poisson: float,
             shear: float) -> BeamSection:
    """Return the section of one material from its area, second moments (m^4), torsion constant (m^4) and shear coefficient."""
    e, rho = positive("modulus", modulus), positive("density", density)
    g = e / (2 * (1 + poisson))
    return BeamSection(e * area, e * about_y, e * about_z, g * torsion_constant, shear * g * area, shear * g * area, rho * area,
                       rho * about_y, rho * about_z, rho * (about_y + about_z))


@dataclass(frozen=True, eq=False)
class BeamMatrices:
    """Matrices of a free beam.

    places : (n,) floats, m along x, of the nodes. mass, stiffness, gyroscopic (per rad/s of spin about x) : (size, size)
    floats, six coordinates (x y z rx ry rz) a node, then the interior ones of the elements.
    """

    places: FloatArray
    mass: FloatArray
    stiffness: FloatArray
    gyroscopic: FloatArray

    @property
    def rigid(self) -> FloatArray:
        """Rigid motions: twists (v, w) about the beam's beginning, (size, 6)."""
        blocks = [np.block([[np.eye(3), -skew(np.array([x, 0.0, 0.0]))], [np.zeros((3, 3)), np.eye(3)]]) for x in self.places]
        return np.concatenate([*blocks, np.zeros((len(self.mass) - 6 * len(blocks), 6))])

    @property
    def centres(self) -> FloatArray:
        """Position of every coordinate along x, m, (size,); interior ones are taken at the middle of their element."""
        interior_count = len(self.mass) - 6 * len(self.places)
        middles = (self.places[1:] + self.places[:-1]) / 2
        return np.concatenate([np.repeat(self.places, 6), np.repeat(middles, _INTERIOR_SIZE)[:interior_count]])


def join_elements(places: FloatArray, sections: Sequence[BeamSection | None]) -> BeamMatrices:
    """Return the matrices of a beam of elements, one section between each place (m) and the next.

    None in place of a section leaves its element out of the sums, as of a part of a beam whose sections all shear.
    """
    if len(places) != len(sections) + 1 or len(sections) < 1:
        fail("sections", f"{len(sections)} for {len(places)} places", "must be one fewer than the places, at least one")
    parts = [np.zeros((3, 12 + _INTERIOR_SIZE, 12 + _INTERIOR_SIZE)) if section is None
             else beam_element(section, positive("distance of places", float(b - a)))
             for (a, b), section in zip(pairwise(places), sections, strict=True)]
    row_end = 6 * len(places)
    size = row_end + sum(part.shape[1] - 12 for part in parts)
    total = np.zeros((3, size, size))
    for i, part in enumerate(parts):
        interior_count = part.shape[1] - 12
        rows = np.r_[6 * i:6 * i + 12, row_end:row_end + interior_count]
        total[np.ix_(range(3), rows, rows)] += part
        row_end += interior_count
    return BeamMatrices(np.asarray(places, float), *total)


def beam_element(section: BeamSection, length: float) -> FloatArray:
    """Return mass, stiffness and gyroscopic matrix (per rad/s about x) of one element.

    (3, 20, 20), both ends and eight interior coordinates, where the section shears; (3, 12, 12) of a slender one.
    """
    is_slender = not (np.isfinite(section.shear_y) and np.isfinite(section.shear_z))
    # A quadratic turn and a cubic deflection need coordinates inside; with linear ones an element locks in shear as it gets
    # slender.
    size = 12 if is_slender else 12 + _INTERIOR_SIZE
    mass, stiffness, gyroscopic = np.zeros((3, size, size))

    def add(index: list[int], shapes: FloatArray, *, rigidities: tuple[float, ...], inertias: tuple[float, ...]) -> None:
        integrals = np.einsum("g,kga,kgb->kab", length * _WEIGHTS, shapes, shapes)
        entries, n = np.ix_(index, index), len(inertias)
        mass[entries] += np.einsum("k,kab->ab", inertias, integrals[:n])
        stiffness[entries] += np.einsum("k,kab->ab", rigidities, integrals[n:n + len(rigidities)])

    axial_shapes = _axial_shapes(length)[:, :, :2 if is_slender else 3]
    add([0, 6, 12][:axial_shapes.shape[2]], axial_shapes, rigidities=(section.axial,), inertias=(section.mass,))
    add([3, 9, 13][:axial_shapes.shape[2]], axial_shapes, rigidities=(section.torsion,), inertias=(section.polar,))
    bending_shapes = _hermite_shapes(length) if is_slender else _timoshenko_shapes(length)
    section_rotations = np.zeros((2, _POINTS.size, size))
    # y with rz, and z with ry, whose slope has the other sign: z' = -ry.
    for k, (index, bending, shear, inertia, sign) in enumerate((
            ([1, 5, 7, 11, 14, 15, 16], section.bending_z, section.shear_y, section.inertia_z, 1.0),
            ([2, 4, 8, 10, 17, 18, 19], section.bending_y, section.shear_z, section.inertia_y, -1.0))):
        index, shapes = index[:bending_shapes.shape[2]], bending_shapes * np.array([1, sign, 1, sign, 1, 1,
                                                                                    sign])[:bending_shapes.shape[2]]
        add(index, shapes, rigidities=(bending,) if is_slender else (bending, shear), inertias=(section.mass, inertia))
        section_rotations[k][:, index] = sign * shapes[1]
    # Gyroscopic moment omega x h of the spin's angular momentum: across the axis only.
    coupling = np.einsum("g,ga,gb->ab", length * _WEIGHTS * section.polar, section_rotations[1], section_rotations[0])
    return np.stack([mass, stiffness, gyroscopic + coupling - coupling.T])


def _axial_shapes(length: float) -> FloatArray:
    """Return displacement along (or twist about) the axis and its slope at the Gauss points, (2, points, 3), with a bubble."""
    x, ones = _POINTS, np.ones_like(_POINTS)
    return np.stack([np.stack([1 - x, x, x * (1 - x)], axis=1), np.stack([-ones, ones, 1 - 2 * x], axis=1) / length])


def _timoshenko_shapes(length: float) -> FloatArray:
    """Return deflection, rotation, curvature and shear strain at the Gauss points, (4, points, 7).

    Deflection is cubic and the rotation quadratic, so the shear strain can vanish anywhere: nothing locks. Coordinates:
    deflection and rotation at both ends, two bubbles of the deflection, one of the rotation.
    """
    x, ones, zeros = _POINTS, np.ones_like(_POINTS), np.zeros_like(_POINTS)
    bubble, skew_bubble = x * (1 - x), x * (1 - x) * (1 - 2 * x)
    deflection = np.stack([1 - x, zeros, x, zeros, bubble, skew_bubble, zeros], axis=1)
    slope = np.stack([-ones, zeros, ones, zeros, 1 - 2 * x, 1 - 6 * x + 6 * x**2, zeros], axis=1) / length
    rotation = np.stack([zeros, 1 - x, zeros, x, zeros, zeros, bubble], axis=1)
    curvature = np.stack([zeros, -ones, zeros, ones, zeros, zeros, 1 - 2 * x], axis=1) / length
    return np.stack([deflection, rotation, curvature, slope - rotation])


def _hermite_shapes(length: float) -> FloatArray:
    """Return deflection, slope, curvature and no shear strain at the Gauss points by Hermite's cubics, (4, points, 4)."""
    x, l = _POINTS, length
    deflection = np.stack([1 - 3 * x**2 + 2 * x**3, l * (x - 2 * x**2 + x**3), 3 * x**2 - 2 * x**3, l * (x**3 - x**2)], axis=1)
    slope = np.stack([6 * (x**2 - x) / l, 1 - 4 * x + 3 * x**2, 6 * (x - x**2) / l, 3 * x**2 - 2 * x], axis=1)
    curvature = np.stack([(12 * x - 6) / l**2, (6 * x - 4) / l, (6 - 12 * x) / l**2, (6 * x - 2) / l], axis=1)
    return np.stack([deflection, slope, curvature, np.zeros_like(deflection)])


def beam(section: BeamSection, length: float, elements: int = 20, *, modes: int = 6) -> Body:
    """Return a beam body with interfaces ``root`` and ``tip``.

    Modal coordinates: the six motions of the tip relative to the root's rigid motion, then the amplitudes of the
    lowest `modes` vibration modes with both ends held (mass-normalised); Craig, Bampton.

    Examples
    --------
    >>> from toolpoint.bodies.beam import beam, rectangle
    >>> beam(rectangle(0.05, 0.05, 210e9, density=7850.0), 0.5, elements=4, modes=2)
    Body(8 modal coordinates, mass 9.8125 kg, 2 interfaces)
    """
    places = np.linspace(0.0, positive("length", length), count("elements", elements) + 1)
    matrices = join_elements(places, [section] * elements)
    mass, stiffness = matrices.mass, matrices.stiffness
    tip = np.arange(6 * elements, 6 * elements + 6)
    interior = np.setdiff1d(np.arange(6, len(mass)), tip)
    k_interior = stiffness[np.ix_(interior, interior)]
    size = len(mass)
    basis = np.zeros((size, 6 + 6 + modes))
    basis[:, :6] = matrices.rigid
    basis[tip, 6:12] = np.eye(6)
    if len(interior):
        # Static shapes of the tip's motions beside fixed-interface modes (Craig, Bampton): joints at the tip see the exact
        # stiffness.
        basis[np.ix_(interior, np.arange(6, 12))] = -np.linalg.solve(k_interior, stiffness[np.ix_(interior, tip)])
        squares, vectors = eigh(k_interior, mass[np.ix_(interior, interior)])
        keep = min(modes, len(squares))
        basis[np.ix_(interior, np.arange(12, 12 + keep))] = vectors[:, :keep]
        basis = basis[:, :12 + keep]
    reduced_mass, reduced_stiffness = basis.T @ mass @ basis, basis.T @ stiffness @ basis
    modal = basis.shape[1] - 6
    at_tip = np.zeros((6, modal))
    at_tip[:, :6] = np.eye(6)
    # The beam's twist order (x y z, rx ry rz) is the twist (v, w) of each node, so no reordering is needed.
    return Body((reduced_mass + reduced_mass.T) / 2,
                (reduced_stiffness[6:, 6:] + reduced_stiffness[6:, 6:].T) / 2,
                interfaces={"root": Interface(np.zeros(3)), "tip": Interface(np.array([length, 0, 0]), at_tip)})
