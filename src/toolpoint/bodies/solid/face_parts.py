"""Parts of outer faces: a convex polygon cut out of the flat faces of a plane, and whole faces, flat or curved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import permutations

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.bodies.solid.element_kinds import HEXAHEDRON, TETRAHEDRON
from toolpoint.bodies.solid.faces import outer_faces
from toolpoint.bodies.solid.mean_motion import AreaPiece
from toolpoint.bodies.solid.model import SolidModel

# Triangle rule of degree 6 (12 points): quadratic shape functions times arms are of degree 3, squares of arms 2; curved
# parents add. Dunavant, Int. J. Numer. Methods Eng. 21 (1985).
_TRIANGLE_ORBITS = ((0.116786275726379, (0.501426509658179, 0.249286745170910, 0.249286745170910)),
           (0.050844906370207, (0.873821971016996, 0.063089014491502, 0.063089014491502)),
           (0.082851075618374, (0.053145049844817, 0.310352451033784, 0.636502499121399)))
_PLANE_TOLERANCE = 1e-7  # of the model's extent: corners so near a plane lie in it


@dataclass(frozen=True, eq=False)
class Footprint:
    """A convex polygon in the plane of two unit directions at right angles through `centre` (3,), m.

    corners : (k, 2) along both directions, anticlockwise, m.
    """

    centre: FloatArray
    along: FloatArray
    across: FloatArray
    corners: FloatArray

    def pieces(self, model: SolidModel, faces: Sequence[IndexArray]) -> list[AreaPiece]:
        """Return the common part of the polygon and of each face in its plane, as triangles with their rule."""
        directions, result = np.vstack([self.along, self.across]), []
        barycentric, rule_weights = triangle_rule()
        for face in faces:
            plane = (model.nodes[face] - self.centre) @ directions.T
            polygon = clip_polygon(plane[:len(face) // 2], self.corners)
            triangles = np.array([polygon[[0, i, i + 1]] for i in range(1, len(polygon) - 1)])
            if not len(triangles):
                continue
            first, second = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
            area = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
            place = (barycentric @ triangles[area > 0]).reshape(-1, 2)
            if len(place):
                result.append(AreaPiece(face, _face_values(plane, place), self.centre + place @ directions,
                                        np.outer(area[area > 0], rule_weights).ravel()))
        return result

    def faces(self, model: SolidModel) -> list[IndexArray]:
        """Return the outer faces, (8,) or (6,) nodes, in the plane that may overlap the polygon; either side of them."""
        tolerance = _PLANE_TOLERANCE * float(np.ptp(model.nodes, axis=0).max())
        arms = model.nodes - self.centre
        height = np.abs(arms @ np.cross(self.along, self.across))
        (low_s, low_t), (high_s, high_t) = self.corners.min(axis=0), self.corners.max(axis=0)
        s, t = arms @ self.along, arms @ self.across
        return [face for faces in outer_faces(model)
                for face in faces[(height[faces] < tolerance).all(axis=1)
                                  & (s[faces].min(axis=1) < high_s) & (s[faces].max(axis=1) > low_s)
                                  & (t[faces].min(axis=1) < high_t) & (t[faces].max(axis=1) > low_t)]]


def whole_faces(model: SolidModel, faces: Sequence[IndexArray]) -> list[AreaPiece]:
    """Return whole faces with the points of their rule; faces are arrays (f, 8) or (f, 6) of nodes, flat or curved."""
    result = []
    for group in faces:
        if not len(group):
            continue
        parents, weights = _square_rule() if group.shape[1] == 8 else _parent_triangle_rule()
        values, slopes = (_quadrilateral if group.shape[1] == 8 else _triangle)(parents)
        corners = model.nodes[group]
        places = np.einsum("pk,fka->fpa", values, corners)
        sides = np.einsum("pkb,fka->fpba", slopes, corners)
        areas = np.linalg.norm(np.cross(sides[:, :, 0], sides[:, :, 1]), axis=2) * weights
        result += [AreaPiece(nodes, values, place, area) for nodes, place, area in zip(group, places, areas, strict=True)]
    return result


def flat_area(model: SolidModel, face: IndexArray) -> float:
    """Return the area of a flat face by its corners, m^2."""
    corners = model.nodes[face[:len(face) // 2]]
    turns = np.cross(corners[1:-1] - corners[0], corners[2:] - corners[0])
    return float(np.linalg.norm(turns.sum(axis=0))) / 2


@cache
def triangle_rule() -> tuple[FloatArray, FloatArray]:
    """Return barycentric points (12, 3) and weights (sum 1) of the rule."""
    points = [(b, w) for w, orbit in _TRIANGLE_ORBITS for b in sorted(set(permutations(orbit)))]
    return np.array([b for b, _ in points]), np.array([w for _, w in points])


def _parent_triangle_rule() -> tuple[FloatArray, FloatArray]:
    """Return points (12, 2) of the parent triangle and weights that sum to its area, 1/2."""
    barycentric, weights = triangle_rule()
    return barycentric[:, 1:], weights / 2


def _square_rule() -> tuple[FloatArray, FloatArray]:
    """Return Gauss points (16, 2) of the parent square and weights that sum to its area, 4."""
    x, w = np.polynomial.legendre.leggauss(4)
    points = np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1).reshape(-1, 2)
    return points, np.outer(w, w).ravel()


def clip_polygon(polygon: FloatArray, window: FloatArray) -> FloatArray:
    """Return the part (k, 2) of a convex polygon inside a convex window (m, 2), anticlockwise; empty where there is none.

    Source: Sutherland, Hodgman, Commun. ACM 17 (1974).
    """
    corners = [np.asarray(p) for p in polygon]
    for start, end in zip(window, np.roll(window, -1, axis=0), strict=True):
        side = end - start
        inside = [float(side[0] * (p - start)[1] - side[1] * (p - start)[0]) for p in corners]
        result = []
        for i, p in enumerate(corners):
            j = (i + 1) % len(corners)
            if inside[i] >= 0:
                result.append(p)
            if (inside[i] >= 0) != (inside[j] >= 0):
                result.append(p + inside[i] / (inside[i] - inside[j]) * (corners[j] - p))
        corners = result
        if not corners:
            break
    return np.array(corners).reshape(-1, 2)


def _face_values(plane: FloatArray, place: FloatArray) -> FloatArray:
    """Return the shape functions (p, nodes) of a face with nodes at `plane` (8 or 6, 2) at places (p, 2).

    Newton's method finds the parent coordinates; one step is exact on a face with straight parallel sides.
    """
    parent = np.zeros_like(place) if len(plane) == 8 else np.full_like(place, 1 / 3)
    functions = _quadrilateral if len(plane) == 8 else _triangle
    for _ in range(20):
        values, slopes = functions(parent)
        residual = place - values @ plane
        if float(np.abs(residual).max()) <= 1e-13 * float(np.abs(plane).max()):
            break
        parent = parent + np.linalg.solve(np.einsum("pna,nb->pba", slopes, plane), residual[..., None])[..., 0]
    return functions(parent)[0]


def _quadrilateral(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return shape functions (p, 8) and slopes (p, 8, 2) of the 8-node face: the top of the hexahedron."""
    # The top face of the hexahedron, zeta = 1.
    top_nodes = [4, 5, 6, 7, 12, 13, 14, 15]
    parent_points = np.column_stack([points, np.ones(len(points))])
    return HEXAHEDRON.values(parent_points)[:, top_nodes], HEXAHEDRON.slopes(parent_points)[:, top_nodes, :2]


def _triangle(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return shape functions (p, 6) and slopes (p, 6, 2) of the 6-node face: a side of the tetrahedron."""
    # The face of nodes 1, 2, 3 of the tetrahedron.
    nodes = [0, 1, 2, 4, 5, 6]
    parent_points = np.column_stack([points, np.zeros(len(points))])
    return TETRAHEDRON.values(parent_points)[:, nodes], TETRAHEDRON.slopes(parent_points)[:, nodes, :2]
