"""Mass properties of a rigid body: given, moved, combined, or as a 6x6 spatial inertia."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, ToolpointError, fail, floats, positive, symmetric
from toolpoint._notebook import NotebookText
from toolpoint.spatial.rotation import skew

_MOMENT_TOLERANCE = 1e-6  # of the largest principal moment: rounding of written numbers


@dataclass(frozen=True, eq=False)
class MassProperties(NotebookText):
    """Mass, centre of mass and inertia of a rigid body in its own frame.

    Parameters
    ----------
    mass : float
        kg, above zero.
    centre : (3,) floats
        Centre of mass, m.
    inertia : (3, 3) floats
        Inertia tensor about the centre of mass, kg m^2 (products of inertia enter with their minus sign).

    Raises
    ------
    ToolpointError
        For a mass that is not positive, an unsymmetric inertia, or principal moments that no body can have (negative,
        or the largest above the sum of the two others).

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.bodies import MassProperties
    >>> box = MassProperties(12.0, [0.0, 0.0, 0.5], np.diag([0.1, 0.1, 0.02]))
    >>> float(box.about([0, 0, 0])[0, 0])  # parallel axes: 0.1 + 12 * 0.5^2
    3.1
    """

    mass: float
    centre: FloatArray
    inertia: FloatArray

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "mass", positive("mass", self.mass))
        put(self, "centre", floats("centre", self.centre, (3,)))
        inertia = symmetric("inertia", floats("inertia", self.inertia, (3, 3)))
        put(self, "inertia", inertia)
        fault = inertia_fault(inertia)
        if fault:
            raise ToolpointError(f"inertia: {fault}")

    @classmethod
    def of_matrix(cls, matrix: FloatArray) -> MassProperties:
        """Return the properties in a (6, 6) mass matrix of twists (v, w) about the frame's origin."""
        mass = float(matrix[0, 0])
        arm = matrix[3:6, :3] / mass
        inertia = matrix[3:6, 3:6] + mass * arm @ arm
        return cls(mass, np.array([arm[2, 1], arm[0, 2], arm[1, 0]]), (inertia + inertia.T) / 2)

    def moved(self, transform: FloatArray) -> MassProperties:
        """Return the properties in another frame; `transform` (4, 4) carries body coordinates to it."""
        r, t = transform[:3, :3], transform[:3, 3]
        return MassProperties(self.mass, r @ self.centre + t, r @ self.inertia @ r.T)

    def about(self, point: ArrayLike) -> FloatArray:
        """Return the inertia tensor about a point (m), kg m^2, by the parallel-axis theorem, shape (3, 3)."""
        arm = skew(self.centre - floats("point", point, (3,)))
        return self.inertia - self.mass * arm @ arm

    @property
    def spatial(self) -> FloatArray:
        """Spatial inertia about the frame's origin for twists (v, w), shape (6, 6)."""
        first_moment = self.mass * skew(self.centre)
        return np.block([[self.mass * np.eye(3), -first_moment], [first_moment, self.about(np.zeros(3))]])

    def __repr__(self) -> str:
        return f"MassProperties({self.mass:.6g} kg at {np.array2string(self.centre, precision=4)} m)"


def inertia_fault(inertia: FloatArray) -> str:
    """Return the reason why no rigid body can have this inertia tensor, or an empty text."""
    moments = np.linalg.eigvalsh(inertia)
    tolerance = _MOMENT_TOLERANCE * max(float(np.abs(moments).max()), 1e-300)
    if moments[0] < -tolerance:
        return f"principal moments {_write_moments(moments)} kg m^2; none may be negative"
    if moments[2] > moments[0] + moments[1] + tolerance:
        return (f"principal moments {_write_moments(moments)} kg m^2; the largest must not exceed the sum of the two others "
                "(triangle inequality); check units and the sign of the products of inertia")
    return ""


def _write_moments(values: FloatArray) -> str:
    """Return principal moments as text."""
    return ", ".join(f"{v:.6g}" for v in values)


def combine(*parts: MassProperties) -> MassProperties:
    """Return the mass properties of several bodies fixed to each other, all given in one frame."""
    if not parts:
        fail("combine", "no parts", "must be at least one")
    mass = sum(part.mass for part in parts)
    centre = sum((part.mass * part.centre for part in parts), np.zeros(3)) / mass
    return MassProperties(mass, centre, sum((part.about(centre) for part in parts), np.zeros((3, 3))))


def without(body: MassProperties, part: MassProperties) -> MassProperties:
    """Return the mass properties of a body without a part of it, both given in one frame.

    Raises ToolpointError where no body is left: the part is heavier, or does not fit inside.
    """
    mass = body.mass - part.mass
    if mass <= 0:
        fail("part", f"mass {part.mass:g} kg", f"must be below that of the whole, {body.mass:g} kg")
    centre = (body.mass * body.centre - part.mass * part.centre) / mass
    return MassProperties(mass, centre, body.about(centre) - part.about(centre))
