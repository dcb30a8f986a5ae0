"""Patch: a rectangle on a plane of a solid model; its weights change smoothly as it moves over the mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array

from toolpoint._check import FloatArray, fail, floats, positive
from toolpoint.bodies.solid.face_parts import Footprint, flat_area
from toolpoint.bodies.solid.mean_motion import AreaPiece, area_of, mean_motion
from toolpoint.bodies.solid.model import SolidModel

MIN_PATCH_RATIO = 1e-3  # area of a patch over that of the faces that it lies on: below, it is a point


@dataclass(frozen=True, eq=False)
class Patch:
    """Rectangle on a flat outer face of a solid model.

    Parameters
    ----------
    centre : (3,) floats
        m, in the body's frame.
    along, across : (3,) floats
        Directions of its sides, at right angles; the normal is along x across.
    length, width : float
        Sides along and across, m.

    Raises
    ------
    ToolpointError
        For sides that are not positive, or directions not at right angles.

    Examples
    --------
    >>> from toolpoint.bodies.solid import STEEL, Casting, Cuboid, Patch
    >>> model = Casting([Cuboid((0, 0, 0), (0.2, 0.1, 0.05))], {"body": STEEL}).meshed(0.1)
    >>> patch = Patch((0.1, 0.05, 0.05), along=(1, 0, 0), across=(0, 1, 0), length=0.08, width=0.04)
    >>> patch.averages(model).shape  # three rows a node, six columns of the patch's twist
    (96, 6)
    """

    centre: FloatArray
    along: FloatArray
    across: FloatArray
    length: float
    width: float

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "centre", floats("Patch.centre", self.centre, (3,)))
        for name in ("along", "across"):
            direction = floats(f"Patch.{name}", getattr(self, name), (3,))
            put(self, name, direction / positive(f"length of Patch.{name}", float(np.linalg.norm(direction))))
        if abs(float(self.along @ self.across)) > 1e-9:
            fail("Patch.across", f"{self.across} to along {self.along}", "must be at right angles")
        positive("Patch.length", self.length)
        positive("Patch.width", self.width)

    def moved(self, by: FloatArray) -> Patch:
        """Return the patch moved by a vector, m."""
        return Patch(self.centre + by, self.along, self.across, self.length, self.width)

    def centre_on(self, model: SolidModel) -> FloatArray:
        """Return its centre (3,), m, wherever the model's faces are."""
        return self.centre

    def note(self, model: SolidModel) -> str:
        """Return nothing: a rectangle that is accepted lies on the model whole."""
        return ""

    def averages(self, model: SolidModel) -> csc_array:
        """Return W, shape (model.size, 6): the patch's twist (v, w) about its centre is W^T u, and W f spreads a wrench f.

        u are the displacements of all coordinates, m; v in m and w in rad are in the body's frame.

        Raises ToolpointError where less than the whole rectangle lies on outer faces in its plane.
        """
        return mean_motion(model.size, self.pieces(model), self.centre)

    def pieces(self, model: SolidModel) -> list[AreaPiece]:
        """Return the parts of outer faces that make it up; raises as `averages`."""
        sides = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.array([self.length, self.width]) / 2
        footprint = Footprint(self.centre, self.along, self.across, sides)
        faces = footprint.faces(model)
        pieces = footprint.pieces(model, faces)
        self._check_cover(area_of(pieces), sum(flat_area(model, face) for face in faces))
        return pieces

    def _check_cover(self, area: float, face_area: float) -> None:
        """Refuse a patch that leaves the outer faces, and one that is a point beside them; both areas in m^2.

        area : of the patch on faces; face_area : of all faces that it touches.
        """
        patch_area = self.length * self.width
        if abs(area - patch_area) > 1e-6 * patch_area:
            fail("Patch", f"{100 * area / patch_area:.4g} % of its {patch_area:.4g} m^2 lie on outer faces in its plane",
                 "must lie on them whole", remedy="a carriage that leaves its rail, or a patch off the surface?")
        if area < MIN_PATCH_RATIO * face_area:
            fail("Patch", f"{1e3 * self.length:.3g} by {1e3 * self.width:.3g} mm, a point beside elements of "
                 f"{1e3 * float(np.sqrt(face_area)):.3g} mm", f"must be at least {MIN_PATCH_RATIO:g} of their area",
                 remedy="a point yields the more the finer the mesh: write the area that carries, or mesh it finer")
