"""Regions: places on a solid that are no rectangle: surfaces and node sets that a mesh names, and several places together."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.sparse import csc_array

from toolpoint._check import FloatArray, IndexArray, fail, suggestion
from toolpoint.bodies.solid.face_parts import whole_faces
from toolpoint.bodies.solid.faces import outer_faces
from toolpoint.bodies.solid.mean_motion import AreaPiece, area_of, centre_of, mean_motion
from toolpoint.bodies.solid.model import SolidModel

_FACE_WIDTHS = (6, 8)  # nodes of a face
_MAX_FACE_SHARE = 1.001  # of a face's area that places take together: above, they overlap


class SolidPlace(Protocol):
    """A place on a solid where a joint, a load or a sensor holds on."""

    def centre_on(self, model: SolidModel) -> FloatArray: ...

    def averages(self, model: SolidModel) -> csc_array: ...

    def pieces(self, model: SolidModel) -> list[AreaPiece]: ...

    def note(self, model: SolidModel) -> str: ...


class FaceArea(ABC):
    """An area that is found on the model's outer faces; its centre is that of the area."""

    @abstractmethod
    def pieces(self, model: SolidModel) -> list[AreaPiece]:
        """Return the parts of faces that make it up; raises where there are none."""

    def centre_on(self, model: SolidModel) -> FloatArray:
        """Return the centre (3,) of its area, m."""
        return centre_of(self.pieces(model))

    def averages(self, model: SolidModel) -> csc_array:
        """Return W, shape (model.size, 6): the region's twist (v, w) about its centre is W^T u; v in m, w in rad."""
        pieces = self.pieces(model)
        return mean_motion(model.size, pieces, centre_of(pieces))

    def note(self, model: SolidModel) -> str:
        """Return what it covers, in words."""
        return f"{1e4 * area_of(self.pieces(model)):.4g} cm^2 of faces"


@dataclass(frozen=True)
class NamedSurface(FaceArea):
    """A surface that the mesh file names.

    Examples
    --------
    >>> from toolpoint.bodies.solid import NamedSurface
    >>> NamedSurface("RAM_REAR").name
    'RAM_REAR'
    """

    name: str

    def pieces(self, model: SolidModel) -> list[AreaPiece]:
        """Return its faces; raises ToolpointError for a name that the mesh does not have."""
        return whole_faces(model, model.surfaces[_key("surface", self.name, list(model.surfaces))])


@dataclass(frozen=True)
class NamedNodes(FaceArea):
    """The outer faces whose nodes all belong to a named node set; where there are none, the nodes alone, all counting alike.

    Examples
    --------
    >>> from toolpoint.bodies.solid import NamedNodes
    >>> NamedNodes("FIXED").name
    'FIXED'
    """

    name: str

    def nodes(self, model: SolidModel) -> IndexArray:
        """Return the numbers of its nodes, from 0."""
        return model.node_sets[_key("nodes", self.name, list(model.node_sets))]

    def pieces(self, model: SolidModel) -> list[AreaPiece]:
        """Return its faces, or its nodes as one piece; raises ToolpointError for a name that the mesh does not have."""
        faces = self._faces(model)
        if any(len(group) for group in faces):
            return whole_faces(model, faces)
        nodes = np.unique(self.nodes(model))
        return [AreaPiece(nodes, np.eye(len(nodes)), model.nodes[nodes], np.full(len(nodes), 1 / len(nodes)))]

    def note(self, model: SolidModel) -> str:
        """Return what it covers, and which nodes of the set lie on no face of it."""
        nodes, faces = np.unique(self.nodes(model)), self._faces(model)
        on_faces = np.unique(np.concatenate([group.ravel() for group in faces]))
        if not len(on_faces):
            return f"{len(nodes)} nodes that make up no face: all count alike, and it yields the more the finer the mesh"
        left_out = len(nodes) - len(on_faces)
        return FaceArea.note(self, model) + (f"; {left_out} of its {len(nodes)} nodes lie on none of them" if left_out else "")

    def _faces(self, model: SolidModel) -> list[IndexArray]:
        is_member = np.zeros(len(model.nodes), dtype=bool)
        is_member[self.nodes(model)] = True
        return [faces[is_member[faces].all(axis=1)] for faces in outer_faces(model)]


@dataclass(frozen=True, eq=False)
class JoinedPlaces(FaceArea):
    """Several places that hold on together, as one area: four feet, two rails.

    Examples
    --------
    >>> from toolpoint.bodies.solid import JoinedPlaces, NamedSurface
    >>> len(JoinedPlaces((NamedSurface("LEFT"), NamedSurface("RIGHT"))).parts)
    2
    """

    parts: tuple[SolidPlace, ...]

    def pieces(self, model: SolidModel) -> list[AreaPiece]:
        """Return the parts of all; raises ToolpointError where together they take more of a face than there is."""
        pieces = [piece for part in self.parts for piece in part.pieces(model)]
        area_of_face: dict[tuple[int, ...], float] = {}
        for piece in pieces:
            # Square values are nodes that count alike, which have no area and no face.
            if len(piece.nodes) in _FACE_WIDTHS and piece.values.shape[0] != piece.values.shape[1]:
                face = tuple(piece.nodes.tolist())
                area_of_face[face] = area_of_face.get(face, 0.0) + float(piece.weights.sum())
        for face, area in area_of_face.items():
            if area > _MAX_FACE_SHARE * area_of(whole_faces(model, [np.array([face])])):
                fail("together", f"two of its parts on one face, about {np.round(model.nodes[face[0]], 4).tolist()} m",
                     "must not overlap", remedy="what lies in both would count twice: leave it out of one")
        return pieces

    def note(self, model: SolidModel) -> str:
        """Return what all cover together, and what its parts have to say."""
        notes = [note for part in self.parts if (note := part.note(model)) and "count alike" in note]
        return "; ".join([FaceArea.note(self, model), *notes])


def _key(what: str, name: str, names: Sequence[str]) -> str:
    """Return the mesh's own spelling of a name, in which capitals do not count; refuse one that it does not have."""
    spelling = {key.upper(): key for key in names}
    if name.upper() not in spelling:
        fail(what, repr(name), f"must be of those that the mesh names: {', '.join(names) or 'none'}",
             remedy=suggestion(name, names) or suggestion(name.upper(), names))
    return spelling[name.upper()]
