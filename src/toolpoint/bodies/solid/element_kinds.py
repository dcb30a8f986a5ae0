r"""The two solid elements: 20-node hexahedra (serendipity) and 10-node tetrahedra, their shape functions, rules and faces.

Node order: corners, then mid-sides; hexahedra: bottom 1-4, top 5-8, sides 1-2 2-3 3-4 4-1, 5-6 6-7 7-8 8-5, 1-5 2-6 3-7 4-8;
tetrahedra: sides 1-2 2-3 3-1 1-4 2-4 3-4. Source: Zienkiewicz, Taylor, The Finite Element Method, volume 1, chapter 6.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from toolpoint._check import FloatArray, IndexArray, fail, frozen

_HEX_CORNERS = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])
HEX_SIDES = np.array([[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]])
TET_SIDES = np.array([[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]])
_HEX_NODES = np.vstack([_HEX_CORNERS, _HEX_CORNERS[HEX_SIDES].mean(axis=1)]).astype(float)
# Corners counter-clockwise seen from outside, then the mid-sides between them.
_HEX_FACES = np.array([[0, 3, 2, 1, 11, 10, 9, 8], [4, 5, 6, 7, 12, 13, 14, 15], [0, 1, 5, 4, 8, 17, 12, 16],
                       [1, 2, 6, 5, 9, 18, 13, 17], [2, 3, 7, 6, 10, 19, 14, 18], [3, 0, 4, 7, 11, 16, 15, 19]])
_TET_FACES = np.array([[0, 2, 1, 6, 5, 4], [0, 1, 3, 4, 8, 7], [1, 2, 3, 5, 9, 8], [2, 0, 3, 6, 7, 9]])


@dataclass(frozen=True, eq=False)
class ElementKind:
    """One kind of element: nodes, faces, and integration points with weights (degree of the rule: see the module's tables)."""

    name: str
    nodes: FloatArray
    sides: IndexArray
    faces: IndexArray
    points: FloatArray
    weights: FloatArray
    mass_points: FloatArray
    mass_weights: FloatArray

    @property
    def node_count(self) -> int:
        """Nodes an element."""
        return len(self.nodes)

    @property
    def corner_count(self) -> int:
        """Corners an element."""
        return len(self.nodes) - len(self.sides)

    def values(self, points: FloatArray) -> FloatArray:
        """Return the shape functions at points (p, 3) of the parent element, shape (p, nodes)."""
        return _hex_values(points) if self.corner_count == 8 else _tet_values(points)

    def slopes(self, points: FloatArray) -> FloatArray:
        """Return their derivatives by the parent's coordinates, shape (p, nodes, 3)."""
        return _hex_slopes(points) if self.corner_count == 8 else _tet_slopes(points)

    @cached_property
    def rule_slopes(self) -> FloatArray:
        """Derivatives at the points of the stiffness rule."""
        return frozen(self.slopes(self.points))


def _hex_values(points: FloatArray) -> FloatArray:
    """Return the serendipity functions in signed coordinates: corners (1+x)(1+y)(1+z)(x+y+z-2)/8, sides (1-x^2)(1+y)(1+z)/4."""
    corner = np.ones((len(points), 8))
    factor_sum = np.full((len(points), 8), -2.0)
    for axis in range(3):
        signed = points[:, axis, None] * _HEX_NODES[:8, axis]
        corner, factor_sum = corner * (1 + signed), factor_sum + signed
    mid_sides = np.full((len(points), 12), 0.25)
    for axis in range(3):
        place, x = _HEX_NODES[8:, axis], points[:, axis, None]
        mid_sides = mid_sides * np.where(place == 0, 1 - x**2, 1 + x * place)
    return np.hstack([corner * factor_sum / 8, mid_sides])


def _hex_slopes(points: FloatArray) -> FloatArray:
    """Return the derivatives of the serendipity functions, (p, 20, 3)."""
    slopes = np.empty((len(points), 20, 3))
    ones = [1 + points[:, a, None] * _HEX_NODES[:8, a] for a in range(3)]
    factor_sum = sum(ones, np.full((len(points), 8), -5.0))
    factors = [np.where(_HEX_NODES[8:, a] == 0, 1 - points[:, a, None] ** 2, 1 + points[:, a, None] * _HEX_NODES[8:, a])
               for a in range(3)]
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        slopes[:, :8, axis] = _HEX_NODES[:8, axis] * ones[b] * ones[c] * (factor_sum + ones[axis]) / 8
        place = _HEX_NODES[8:, axis]
        slopes[:, 8:, axis] = np.where(place == 0, -2 * points[:, axis, None], place) * factors[b] * factors[c] / 4
    return slopes


def _barycentric(points: FloatArray) -> FloatArray:
    """Return the four barycentric coordinates of points (p, 3)."""
    return np.column_stack([1 - points.sum(axis=1), points])


def _tet_values(points: FloatArray) -> FloatArray:
    """Return the quadratic functions: corners b (2 b - 1), mid-sides 4 b_i b_j."""
    b = _barycentric(points)
    return np.hstack([b * (2 * b - 1), 4 * b[:, TET_SIDES[:, 0]] * b[:, TET_SIDES[:, 1]]])


def _tet_slopes(points: FloatArray) -> FloatArray:
    """Return their derivatives, (p, 10, 3)."""
    b = _barycentric(points)
    barycentric_slopes = np.array([[-1, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    corner = (4 * b - 1)[:, :, None] * barycentric_slopes
    i, j = TET_SIDES.T
    return np.concatenate([corner, 4 * (b[:, i, None] * barycentric_slopes[j] + b[:, j, None] * barycentric_slopes[i])], axis=1)


def _gauss_cube(order: int) -> tuple[FloatArray, FloatArray]:
    """Return points and weights of the product rule of Gauss."""
    x, w = np.polynomial.legendre.leggauss(order)
    points = np.stack(np.meshgrid(x, x, x, indexing="ij"), axis=-1).reshape(-1, 3)
    return points, np.einsum("i,j,k->ijk", w, w, w).ravel()


def _tet_rule(orbits: list[tuple[float, list[float]]]) -> tuple[FloatArray, FloatArray]:
    """Return points and weights (sum 1/6) of orbits: weight, and barycentric coordinates to permute."""
    from itertools import permutations

    points, weights = [], []
    for weight, place in orbits:
        for b in sorted(set(permutations(place))):
            points.append(b[1:])
            weights.append(weight)
    return np.array(points), np.array(weights) / 6


# Degree 2 (exact stiffness of straight-sided elements) and degree 4 (mass; curved sides); Keast, Comput. Methods Appl.
# Mech. Eng. 55 (1986), the degree-4 rule with 11 points computed from its moment equations in closed form.
_A, _B = (5 - np.sqrt(5)) / 20, (5 + 3 * np.sqrt(5)) / 20
_P, _Q = (1 + np.sqrt(5 / 14)) / 4, (1 - np.sqrt(5 / 14)) / 4
_TET_2 = _tet_rule([(0.25, [_A, _A, _A, _B])])
_TET_4 = _tet_rule([(-6 * 74 / 5625, [0.25] * 4), (6 * 343 / 45000, [11 / 14, 1 / 14, 1 / 14, 1 / 14]),
                    (6 * 56 / 2250, [_P, _P, _Q, _Q])])

# Three points a side: with two (reduced integration) six motions of an element would have no stiffness.
HEXAHEDRON = ElementKind("hexahedron", _HEX_NODES, HEX_SIDES, _HEX_FACES, *_gauss_cube(3), *_gauss_cube(3))
TETRAHEDRON = ElementKind(
    "tetrahedron", np.vstack([np.zeros(3), np.eye(3), np.vstack([np.zeros(3), np.eye(3)])[TET_SIDES].mean(axis=1)]), TET_SIDES,
    _TET_FACES, *_TET_4, *_TET_4)
# With straight sides the integrand of the stiffness is of degree 2.
STRAIGHT_TETRAHEDRON = ElementKind("tetrahedron", TETRAHEDRON.nodes, TET_SIDES, _TET_FACES, *_TET_2, *_TET_4)


def kind_of(node_count: int) -> ElementKind:
    """Return the kind of element with so many nodes."""
    if node_count == 20:
        return HEXAHEDRON
    if node_count == 10:
        return TETRAHEDRON
    fail("elements", f"{node_count} nodes an element", "must be 20 (hexahedra) or 10 (tetrahedra)",
         remedy="linear elements are far too stiff in bending: mesh again with mid-side nodes")
