r"""Patch: a rectangle on a plane of a solid model, and its motion as consistent weighted averages.

The motion of a patch A is the rigid motion nearest to the surface's in the mean over its area,
:math:`v = \frac1A \int u\,dA`, :math:`w = J^{-1} \int r \times u\,dA`, :math:`J = \int (r \cdot r) I - r r^T dA`, with u by the
elements' shape functions, so weights change smoothly as the patch moves over the mesh. A wrench on the patch is spread by
the transposed map: its resultants are kept, and nothing is stiffened.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array

from toolpoint._check import FloatArray, IndexArray, fail, floats, positive
from toolpoint.bodies.solid.faces import outer_faces
from toolpoint.bodies.solid.model import SolidModel

MIN_PATCH_RATIO = 1e-3  # area of a patch over that of the faces that it lies on: below, it is a point

# Triangle rule of degree 6 (12 points): quadratic shape functions times arms are of degree 3, squares of arms 2; curved
# parents add. Dunavant, Int. J. Numer. Methods Eng. 21 (1985).
_TRIANGLE_ORBITS = ((0.116786275726379, (0.501426509658179, 0.249286745170910, 0.249286745170910)),
           (0.050844906370207, (0.873821971016996, 0.063089014491502, 0.063089014491502)),
           (0.082851075618374, (0.053145049844817, 0.310352451033784, 0.636502499121399)))


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

    def averages(self, model: SolidModel) -> csc_array:
        """Return W, shape (model.size, 6): the patch's twist (v, w) about its centre is W^T u, and W f spreads a wrench f.

        u are the displacements of all coordinates, m; v in m and w in rad are in the body's frame.

        Raises ToolpointError where less than the whole rectangle lies on outer faces in its plane.
        """
        integrals: dict[int, FloatArray] = {}
        moments, area = np.zeros((2, 2)), 0.0
        face_area = 0.0
        for face in _flat_faces(model, self):
            face_area += _extent(model, face)
            for values, place, weight in _pieces(model, self, face):
                area += float(weight.sum())
                moments += (place * weight[:, None]).T @ place
                for node, integral in zip(face, _integrals(values, place, weight).T, strict=True):
                    integrals[int(node)] = integrals.get(int(node), np.zeros(3)) + integral
        self._check_cover(area, face_area)
        return self._weights(model, integrals, area, moments)

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

    def _weights(self, model: SolidModel, integrals_of: dict[int, FloatArray], area: float, moments: FloatArray) -> csc_array:
        """Return W of `averages`: v = sum of (int N / A) u, w = J^-1 sum of (int r N) x u, over nodes.

        integrals_of : node to the integrals of N, s N and t N; area : A, m^2; moments : (2, 2) second moments of s, t, m^4.
        """
        nodes = np.array(sorted(integrals_of), dtype=np.int64)
        integrals = np.array([integrals_of[int(node)] for node in nodes])
        frame = np.column_stack([self.along, self.across, np.cross(self.along, self.across)])
        inertia = np.array([[moments[1, 1], -moments[0, 1], 0], [-moments[0, 1], moments[0, 0], 0],
                            [0, 0, moments[0, 0] + moments[1, 1]]])
        inverse_inertia = frame @ np.linalg.inv(inertia) @ frame.T
        rows, values = [], []
        for node, (integral, moment_s, moment_t) in zip(nodes, integrals, strict=True):
            arm = moment_s * self.along + moment_t * self.across
            cross = np.cross(arm, np.eye(3)).T
            values.append(np.hstack([integral / area * np.eye(3), (inverse_inertia @ cross).T]))
            rows.append(3 * node + np.arange(3))
        block = np.vstack(values)
        row = np.concatenate(rows)
        return csc_array((block.ravel(), (np.repeat(row, 6), np.tile(np.arange(6), len(row)))), shape=(model.size, 6))


def _integrals(values: FloatArray, place: FloatArray, weight: FloatArray) -> FloatArray:
    """Return the integrals of the shape functions, and of them times s and times t, (3, nodes), m^2 and m^3.

    values : (p, nodes); place : (p, 2) s and t, m; weight : (p,) m^2.
    """
    return np.vstack([weight @ values, (weight * place[:, 0]) @ values, (weight * place[:, 1]) @ values])


def _extent(model: SolidModel, face: IndexArray) -> float:
    """Return the area of a flat face by its corners, m^2."""
    corners = model.nodes[face[:len(face) // 2]]
    turns = np.cross(corners[1:-1] - corners[0], corners[2:] - corners[0])
    return float(np.linalg.norm(turns.sum(axis=0))) / 2


def _flat_faces(model: SolidModel, patch: Patch) -> Iterator[IndexArray]:
    """Yield the outer faces, (8,) or (6,) nodes, that lie in the patch's plane and may overlap its rectangle.

    The sense of the normal does not count.
    """
    normal = np.cross(patch.along, patch.across)
    tolerance = 1e-7 * float(np.ptp(model.nodes, axis=0).max())
    height = (model.nodes - patch.centre) @ normal
    s, t = ((model.nodes - patch.centre) @ d for d in (patch.along, patch.across))
    for faces in outer_faces(model):
        reaches_in = ((np.abs(height[faces]) < tolerance).all(axis=1)
                & (s[faces].min(axis=1) < patch.length / 2) & (s[faces].max(axis=1) > -patch.length / 2)
                & (t[faces].min(axis=1) < patch.width / 2) & (t[faces].max(axis=1) > -patch.width / 2))
        yield from faces[reaches_in]


def _pieces(model: SolidModel, patch: Patch, face: IndexArray) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
    """Yield shape functions (12, nodes), places s, t (12, 2), m, and weights (12,), m^2, at points of triangles.

    The triangles make up the common part of the face and the rectangle.
    """
    arms = model.nodes[face] - patch.centre
    plane = np.column_stack([arms @ patch.along, arms @ patch.across])
    polygon = _clip_polygon(plane[:len(face) // 2], patch.length / 2, patch.width / 2)
    for i in range(1, len(polygon) - 1):
        corners = polygon[[0, i, i + 1]]
        sides = corners[1:] - corners[0]
        twice = abs(float(sides[0, 0] * sides[1, 1] - sides[0, 1] * sides[1, 0]))
        if twice > 0:
            barycentric, weights = _triangle_rule()
            place = barycentric @ corners
            yield _face_values(plane, place), place, weights * twice / 2


def _triangle_rule() -> tuple[FloatArray, FloatArray]:
    """Return barycentric points (12, 3) and weights (sum 1) of the rule."""
    from itertools import permutations

    points = [(b, w) for w, orbit in _TRIANGLE_ORBITS for b in sorted(set(permutations(orbit)))]
    return np.array([b for b, _ in points]), np.array([w for _, w in points])


def _clip_polygon(polygon: FloatArray, half_length: float, half_width: float) -> FloatArray:
    """Return the part (k, 2) of a convex polygon inside a rectangle about the origin, empty where there is none.

    Source: Sutherland, Hodgman, Commun. ACM 17 (1974).
    """
    corners = [np.asarray(p) for p in polygon]
    for axis, sign, limit in ((0, 1, half_length), (0, -1, half_length), (1, 1, half_width), (1, -1, half_width)):
        inside = [sign * p[axis] <= limit for p in corners]
        result = []
        for i, p in enumerate(corners):
            q, is_in, next_in = corners[(i + 1) % len(corners)], inside[i], inside[(i + 1) % len(corners)]
            if is_in:
                result.append(p)
            if is_in != next_in:
                result.append(p + (sign * limit - p[axis]) / (q[axis] - p[axis]) * (q - p))
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
    from toolpoint.bodies.solid.element_kinds import HEXAHEDRON

    # The top face of the hexahedron, zeta = 1.
    top_nodes = [4, 5, 6, 7, 12, 13, 14, 15]
    parent_points = np.column_stack([points, np.ones(len(points))])
    return HEXAHEDRON.values(parent_points)[:, top_nodes], HEXAHEDRON.slopes(parent_points)[:, top_nodes, :2]


def _triangle(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return shape functions (p, 6) and slopes (p, 6, 2) of the 6-node face: a side of the tetrahedron."""
    from toolpoint.bodies.solid.element_kinds import TETRAHEDRON

    # The face of nodes 1, 2, 3 of the tetrahedron.
    nodes = [0, 1, 2, 4, 5, 6]
    parent_points = np.column_stack([points, np.zeros(len(points))])
    return TETRAHEDRON.values(parent_points)[:, nodes], TETRAHEDRON.slopes(parent_points)[:, nodes, :2]
