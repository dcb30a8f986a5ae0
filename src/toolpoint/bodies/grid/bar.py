r"""Bar elements between two grid points: stiffness with shear, mass at the ends or along the bar, pins and offsets.

Coordinates of an element are x y z rx ry rz of its first end, then of its second. Its x axis runs from end to end; plane 1
holds the y axis, plane 2 the z axis. Sources: Przemieniecki, Theory of Matrix Structural Analysis, chapters 5 and 11.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.spatial.rotation import skew

# Rows of deflection and rotation at both ends. In plane 2 the slope of z has the sign of -ry.
_PLANE_1, _PLANE_2 = [1, 5, 7, 11], [2, 4, 8, 10]
_SIGN_1, _SIGN_2 = np.array([1.0, 1.0, 1.0, 1.0]), np.array([1.0, -1.0, 1.0, -1.0])
# Gauss points and weights over 0 .. 1: four integrate the square of a cubic exactly.
_GAUSS_PLACES, _GAUSS_WEIGHTS = (np.polynomial.legendre.leggauss(4)[0] + 1) / 2, np.polynomial.legendre.leggauss(4)[1] / 2
_MIN_DIRECTION_SINE = 1e-6  # between a bar and the vector that orients it: below, its planes are not known


@dataclass(frozen=True)
class BarSection:
    """Rigidities and inertia of a bar, in one consistent system of units; any of them may be zero.

    Parameters
    ----------
    axial, torsion : float
        E A and G J.
    bending_1, bending_2 : float
        E I in plane 1 (deflection along y) and in plane 2 (along z).
    shear_1, shear_2 : float
        K G A of both planes; infinite where the section does not shear.
    mass : float
        Mass a length, with what the section carries.
    inertia_1, inertia_2 : float
        rho I of both planes: rotary inertia; their sum turns with the twist.
    """

    axial: float
    torsion: float
    bending_1: float
    bending_2: float
    shear_1: float = np.inf
    shear_2: float = np.inf
    mass: float = 0.0
    inertia_1: float = 0.0
    inertia_2: float = 0.0


def bar_stiffness(section: BarSection, length: float) -> FloatArray:
    r"""Return the (12, 12) stiffness of a straight bar in its own axes, exact for loads at its ends.

    Shear softens bending by :math:`\phi = 12 E I / (K G A L^2)`: Przemieniecki, eq. 5.116.

    Examples
    --------
    A slender bar held at one end deflects by F L^3 / (3 E I) at the other:

    >>> import numpy as np
    >>> section = BarSection(axial=2e8, torsion=1e4, bending_1=3e4, bending_2=3e4)
    >>> tip = np.linalg.inv(bar_stiffness(section, 0.5)[6:, 6:])
    >>> round(float(tip[1, 1]) / (0.5**3 / (3 * 3e4)), 9)
    1.0
    """
    stiffness = np.zeros((12, 12))
    for rows, rigidity in (([0, 6], section.axial), ([3, 9], section.torsion)):
        stiffness[np.ix_(rows, rows)] = rigidity / length * np.array([[1.0, -1.0], [-1.0, 1.0]])
    for rows, signs, bending, shear in ((_PLANE_1, _SIGN_1, section.bending_1, section.shear_1),
                                        (_PLANE_2, _SIGN_2, section.bending_2, section.shear_2)):
        # Zero, as bulk data write it where it is left out, stands for a section that does not shear.
        phi, l = 12 * bending / (shear * length**2) if shear > 0 else 0.0, length
        plane = bending / ((1 + phi) * l**3) * np.array([
            [12.0, 6 * l, -12.0, 6 * l], [6 * l, (4 + phi) * l**2, -6 * l, (2 - phi) * l**2],
            [-12.0, -6 * l, 12.0, -6 * l], [6 * l, (2 - phi) * l**2, -6 * l, (4 + phi) * l**2]])
        stiffness[np.ix_(rows, rows)] = signs[:, None] * plane * signs
    return stiffness


def end_mass(section: BarSection, length: float) -> FloatArray:
    """Return the (12, 12) mass with half of the bar at each end, turning about its axis but without rotary inertia across."""
    half, polar = section.mass * length / 2, (section.inertia_1 + section.inertia_2) * length / 2
    # Without the polar inertia a free chain of bars could twist at no frequency at all: mass and stiffness singular together.
    return np.diag([half, half, half, polar, 0.0, 0.0] * 2)


def consistent_mass(section: BarSection, length: float) -> FloatArray:
    """Return the (12, 12) consistent mass with rotary inertia: Przemieniecki, chapter 11.

    Deflections and turns of the section are those of a bar bent by its ends, shear included, so that bars in series converge to
    the Timoshenko beam.
    """
    mass, l = np.zeros((12, 12)), length
    for rows, density in (([0, 6], section.mass), ([3, 9], section.inertia_1 + section.inertia_2)):
        mass[np.ix_(rows, rows)] = density * l / 6 * np.array([[2.0, 1.0], [1.0, 2.0]])
    for rows, signs, bending, shear, inertia in (
            (_PLANE_1, _SIGN_1, section.bending_1, section.shear_1, section.inertia_1),
            (_PLANE_2, _SIGN_2, section.bending_2, section.shear_2, section.inertia_2)):
        deflection, turn = _end_shapes(l, 12 * bending / (shear * l**2) if shear > 0 else 0.0)
        plane = l * (section.mass * (deflection.T * _GAUSS_WEIGHTS) @ deflection + inertia * (turn.T * _GAUSS_WEIGHTS) @ turn)
        mass[np.ix_(rows, rows)] += signs[:, None] * plane * signs
    return mass


def _end_shapes(l: float, phi: float) -> tuple[FloatArray, FloatArray]:
    """Return deflection and turn of the section at the Gauss points per deflection and turn of both ends, (points, 4) each."""
    x = _GAUSS_PLACES
    deflection = np.stack([1 - 3 * x**2 + 2 * x**3 + phi * (1 - x), l * (x - 2 * x**2 + x**3 + phi / 2 * (x - x**2)),
                           3 * x**2 - 2 * x**3 + phi * x, l * (x**3 - x**2 - phi / 2 * (x - x**2))], axis=1)
    turn = np.stack([6 * (x**2 - x) / l, 1 - 4 * x + 3 * x**2 + phi * (1 - x),
                     6 * (x - x**2) / l, 3 * x**2 - 2 * x + phi * x], axis=1)
    return deflection / (1 + phi), turn / (1 + phi)


def release_ends(stiffness: FloatArray, rows: list[int]) -> FloatArray:
    """Return the stiffness (12, 12) of a bar whose ends carry no force in some rows (0 .. 11): hinges, condensed."""
    if not rows:
        return stiffness
    kept = [k for k in range(12) if k not in rows]
    loose = stiffness[np.ix_(rows, rows)]
    released = np.zeros((12, 12))
    # A pinned bar may have several hinges that turn freely together: the pseudoinverse leaves their common motion free.
    released[np.ix_(kept, kept)] = stiffness[np.ix_(kept, kept)] - (
        stiffness[np.ix_(kept, rows)] @ np.linalg.pinv(loose, rcond=1e-12, hermitian=True) @ stiffness[np.ix_(rows, kept)])
    return released


def bar_frame(start: FloatArray, end: FloatArray, toward: FloatArray) -> FloatArray:
    """Return the axes (3, 3) of a bar in rows, x from end to end; the vector `toward` (3,) lies in plane 1.

    Raises ToolpointError where both ends lie at one place, or the vector along the bar.
    """
    along = end - start
    length = float(np.linalg.norm(along))
    if length == 0:
        fail("bar", "both ends at one place", "must have a length", remedy="tie such points by RBE2 or a spring")
    x = along / length
    across = toward - (toward @ x) * x
    if not np.linalg.norm(across) > _MIN_DIRECTION_SINE * np.linalg.norm(toward):
        fail("bar", "its orientation vector lies along it", "must point aside, into plane 1")
    y = across / np.linalg.norm(across)
    return np.stack([x, y, np.cross(x, y)])


def end_motion(axes: FloatArray, offsets: FloatArray) -> FloatArray:
    """Return the motion (12, 12) of a bar's ends, along its axes, per motion of its grid points; offsets (2, 3) from these."""
    result = np.zeros((12, 12))
    for k, offset in enumerate(offsets):
        rows = slice(6 * k, 6 * k + 6)
        result[rows, rows] = np.block([[axes, -axes @ skew(offset)], [np.zeros((3, 3)), axes]])
    return result
