"""Regions that are drawn: walls of bores and journals, rings, and whole planes of a solid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, IndexArray, fail, floats, positive
from toolpoint.bodies.solid.face_parts import Footprint, whole_faces
from toolpoint.bodies.solid.faces import outer_faces
from toolpoint.bodies.solid.mean_motion import AreaPiece, area_of
from toolpoint.bodies.solid.model import SolidModel
from toolpoint.bodies.solid.region import FaceArea

_DISC_CORNERS = 64  # of the polygon of a circle's area that stands for it
_MAX_WALL_DEVIATION = 0.02  # of a bore's radius: corners of faces so near lie on it, also where the mesh is of chords
_MIN_RADIAL_SHARE = 0.7  # of a unit normal along the radius: below, a face is an end of the bore, not its wall
_PLANE_DEVIATION = 1e-6  # of the model's extent: corners so near a plane lie in it
_MIN_RING_COVER = 0.98  # of a ring on outer faces: below, it leaves them



@dataclass(frozen=True, eq=False)
class CylinderFaces(FaceArea):
    """The wall of a bore or a journal: the outer faces on a cylinder about `axis` (3,) through `centre` (3,), m.

    diameter, length : m; half the length lies on each side of the centre. A face that reaches beyond an end is left out.

    Examples
    --------
    >>> from toolpoint.bodies.solid import STEEL, CylinderFaces, RoundCasting, RoundPart
    >>> tube = RoundCasting((RoundPart(0.0, 0.2, 0.1), RoundPart(0.0, 0.2, 0.06, is_window=True)), "z", (0.0, 0.0, 0.0),
    ...                     {"body": STEEL})
    >>> bore = CylinderFaces((0, 0, 0.1), (0, 0, 1), diameter=0.06, length=0.2)
    >>> bore.note(tube.meshed(0.02))  # a round casting keeps the volume by bulging its eight faces around
    '379.4 cm^2 of faces, 101 % of the cylinder'
    """

    centre: FloatArray
    axis: FloatArray
    diameter: float
    length: float

    def __post_init__(self) -> None:
        _set_directions(self, "axis")
        positive("CylinderFaces.diameter", self.diameter)
        positive("CylinderFaces.length", self.length)

    def pieces(self, model: SolidModel) -> list[AreaPiece]:
        """Return the faces of the wall; raises ToolpointError where there are none."""
        arms = model.nodes - self.centre
        height = arms @ self.axis
        radial = arms - height[:, None] * self.axis
        radius, reach = np.linalg.norm(radial, axis=1), self.length / 2 * (1 + 1e-6)
        is_on_wall = np.abs(radius - self.diameter / 2) <= _MAX_WALL_DEVIATION * self.diameter / 2
        is_on_wall &= np.abs(height) <= reach
        chosen = []
        for faces in outer_faces(model):
            corners = faces[:, :faces.shape[1] // 2]
            group = faces[is_on_wall[corners].all(axis=1)]
            corners = group[:, :group.shape[1] // 2]
            mean_radial = radial[corners].mean(axis=1)
            is_wall = np.abs((_normals(model, corners) * mean_radial).sum(axis=1)) > (
                _MIN_RADIAL_SHARE * np.linalg.norm(mean_radial, axis=1))
            chosen.append(group[is_wall])
        if not any(len(group) for group in chosen):
            fail("cylinder", f"no outer face on {1e3 * self.diameter:.4g} mm about {np.round(self.axis, 4).tolist()} through "
                 f"{np.round(self.centre, 5).tolist()} m", "must be the wall of a bore or a journal",
                 remedy="look at centre, axis and diameter; a mesh with fewer than 16 faces around a bore has no wall there")
        return whole_faces(model, chosen)

    def note(self, model: SolidModel) -> str:
        """Return what it covers, and how much of the cylinder that is."""
        share = area_of(self.pieces(model)) / (np.pi * self.diameter * self.length)
        return f"{FaceArea.note(self, model)}, {100 * share:.3g} % of the cylinder"


@dataclass(frozen=True, eq=False)
class RingFaces(FaceArea):
    """A ring on a flat face, about `normal` (3,) through `centre` (3,), m: between two diameters, m; inner 0 for a disc.

    Circles are polygons of 64 corners and the circle's area.

    Examples
    --------
    >>> from toolpoint.bodies.solid import STEEL, Casting, Cuboid, RingFaces
    >>> plate = Casting([Cuboid((0, 0, 0), (0.2, 0.2, 0.02))], {"body": STEEL}).meshed(0.05)
    >>> RingFaces((0.1, 0.1, 0.02), (0, 0, 1), outer=0.1, inner=0.05).note(plate)  # pi (0.1^2 - 0.05^2) / 4 m^2
    '58.9 cm^2 of faces'
    """

    centre: FloatArray
    normal: FloatArray
    outer: float
    inner: float = 0.0

    def __post_init__(self) -> None:
        _set_directions(self, "normal")
        positive("RingFaces.outer", self.outer)
        if not 0 <= self.inner < self.outer:
            fail("RingFaces.inner", f"{self.inner:g} m", f"must be from 0 to below the outer diameter, {self.outer:g} m")

    def pieces(self, model: SolidModel) -> list[AreaPiece]:
        """Return the parts of faces between the circles; raises ToolpointError where the ring leaves them."""
        result = self._disc(model, self.outer, 1.0)
        if self.inner:
            result += self._disc(model, self.inner, -1.0)
        ring_area = np.pi * (self.outer**2 - self.inner**2) / 4
        cover = area_of(result) / ring_area
        if not cover >= _MIN_RING_COVER:
            fail("ring", f"{100 * cover:.4g} % of its {1e4 * ring_area:.4g} cm^2 lie on outer faces in its plane",
                 f"must be at least {100 * _MIN_RING_COVER:g} %", remedy="a hole that it covers has an inner diameter")
        return result

    def _disc(self, model: SolidModel, diameter: float, sign: float) -> list[AreaPiece]:
        along = np.cross(self.normal, np.eye(3)[int(np.argmin(np.abs(self.normal)))])
        along /= np.linalg.norm(along)
        angle = 2 * np.pi * np.arange(_DISC_CORNERS) / _DISC_CORNERS
        # As large as the circle: n/2 r^2 sin(2 pi / n) = pi d^2 / 4.
        radius = diameter / 2 * np.sqrt(2 * np.pi / (_DISC_CORNERS * np.sin(2 * np.pi / _DISC_CORNERS)))
        corners = radius * np.column_stack([np.cos(angle), np.sin(angle)])
        footprint = Footprint(self.centre, along, np.cross(self.normal, along), corners)
        pieces = footprint.pieces(model, footprint.faces(model))
        return [AreaPiece(piece.nodes, piece.values, piece.places, sign * piece.weights) for piece in pieces]


@dataclass(frozen=True, eq=False)
class PlaneFaces(FaceArea):
    """All outer faces in a plane: through `centre` (3,), m, at right angles to `normal` (3,).

    Examples
    --------
    >>> from toolpoint.bodies.solid import STEEL, Casting, Cuboid, PlaneFaces
    >>> plate = Casting([Cuboid((0, 0, 0), (0.2, 0.1, 0.02))], {"body": STEEL}).meshed(0.05)
    >>> PlaneFaces((0, 0, 0.02), (0, 0, 1)).note(plate)
    '200 cm^2 of faces'
    """

    centre: FloatArray
    normal: FloatArray

    def __post_init__(self) -> None:
        _set_directions(self, "normal")

    def pieces(self, model: SolidModel) -> list[AreaPiece]:
        """Return its faces; raises ToolpointError where there are none."""
        height = np.abs((model.nodes - self.centre) @ self.normal)
        is_near = height <= _PLANE_DEVIATION * float(np.ptp(model.nodes, axis=0).max())
        faces = [group[is_near[group].all(axis=1)] for group in outer_faces(model)]
        if not any(len(group) for group in faces):
            fail("plane", f"no outer face through {np.round(self.centre, 5).tolist()} m", "must hold at least one",
                 remedy=f"the nearest node is {1e3 * float(height.min()):.4g} mm away")
        return whole_faces(model, faces)


def _set_directions(region: CylinderFaces | RingFaces | PlaneFaces, name: str) -> None:
    """Check the centre, and make the direction a unit vector."""
    label = type(region).__name__
    object.__setattr__(region, "centre", floats(f"{label}.centre", region.centre, (3,)))
    direction = floats(f"{label}.{name}", getattr(region, name), (3,))
    object.__setattr__(region, name, direction / positive(f"length of {label}.{name}", float(np.linalg.norm(direction))))


def _normals(model: SolidModel, corners: IndexArray) -> FloatArray:
    """Return the unit normals (f, 3) of faces by three of their corners (f, 3 or 4)."""
    normals = np.cross(model.nodes[corners[:, 1]] - model.nodes[corners[:, 0]],
                       model.nodes[corners[:, 2]] - model.nodes[corners[:, 0]])
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300))
