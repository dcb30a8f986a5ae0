r"""Element matrices of many solid elements at once.

With gradients g of the shape functions, :math:`K_{ia,jb} = \int \lambda g_{ia} g_{jb} + \mu g_{ib} g_{ja} + \mu \delta_{ab} g_i
\cdot g_j`. Source: Bathe, Finite Element Procedures, section 5.3, written for an isotropic material.
"""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.bodies.solid.element_kinds import STRAIGHT_TETRAHEDRON, ElementKind
from toolpoint.bodies.solid.material import Material


def gradients(kind: ElementKind, corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return gradients (e, p, nodes, 3) in 1/m and weights times volume (e, p) in m^3 at the points of the stiffness rule.

    `corners` (e, nodes, 3) are the coordinates of all nodes of each element, m. Raises ToolpointError for an element that is
    turned inside out at any point.
    """
    if kind.corner_count == 4 and _is_straight(kind, corners):
        kind = STRAIGHT_TETRAHEDRON
    slopes = kind.rule_slopes
    jacobian = np.einsum("pna,enb->epab", slopes, corners, optimize=True)
    determinant = np.linalg.det(jacobian)
    if (determinant <= 0).any():
        element = int(np.argwhere(determinant <= 0)[0, 0])
        fail("elements",
             f"element {element} of {len(corners)} ({int((determinant <= 0).any(axis=1).sum())} in all) is inside out",
             "must have a positive volume at every integration point",
             remedy="turn the order of its nodes, or mesh again where curved mid-sides fold it")
    return np.einsum("pna,epba->epnb", slopes, np.linalg.inv(jacobian), optimize=True), determinant * kind.weights


def _is_straight(kind: ElementKind, nodes: FloatArray) -> bool:
    """Whether all mid-side nodes lie in the middle of their sides."""
    middles = nodes[:, kind.sides].mean(axis=2)
    scale = np.abs(nodes[:, kind.sides[:, 0]] - nodes[:, kind.sides[:, 1]]).max(initial=0.0)
    return bool(np.abs(nodes[:, kind.corner_count:] - middles).max(initial=0.0) <= 1e-9 * scale)


def stiffness(kind: ElementKind, corners: FloatArray, material: Material) -> FloatArray:
    """Return element stiffnesses, shape (e, 3 nodes, 3 nodes), N/m; coordinates x, y, z of node 1, then of node 2, ..."""
    return stiffness_at(*gradients(kind, corners), material)


def stiffness_at(slope: FloatArray, volume: FloatArray, material: Material) -> FloatArray:
    """Return stiffnesses (e, 3 nodes, 3 nodes), N/m, by any rule: gradients (e, p, nodes, 3), 1/m, and volumes (e, p), m^3."""
    e, p, n, _ = slope.shape
    rows = slope.transpose(0, 2, 3, 1).reshape(e, 3 * n, p)
    product = ((rows * volume[:, None, :]) @ rows.transpose(0, 2, 1)).reshape(e, n, 3, n, 3)
    result = material.lame * product + material.shear_modulus * product.transpose(0, 1, 4, 3, 2)
    trace = material.shear_modulus * np.einsum("einjn->eij", product.transpose(0, 1, 2, 3, 4))
    for a in range(3):
        result[:, :, a, :, a] += trace
    return result.reshape(e, 3 * n, 3 * n)


def scalar_mass(kind: ElementKind, corners: FloatArray, density: float) -> FloatArray:
    """Return consistent masses of one direction, shape (e, nodes, nodes), kg; the same for x, y and z."""
    values, slopes = kind.values(kind.mass_points), kind.slopes(kind.mass_points)
    determinant = np.linalg.det(np.einsum("pna,enb->epab", slopes, corners, optimize=True))
    weights = density * determinant * kind.mass_weights
    return (values.T[None] * weights[:, None, :]) @ values
