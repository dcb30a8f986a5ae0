r"""What a mesh errs by: the energy of the difference between the strain of the elements and one that is smooth over them.

For a natural mode of unit modal mass :math:`\lambda_h - \lambda \approx \|u - u_h\|_K^2`, which the energy :math:`\eta^2 =
\int (\epsilon^* - \epsilon_h)^T D (\epsilon^* - \epsilon_h)` estimates, with :math:`\epsilon^*` of `recovery`. It is a
quadratic form of the shapes, so that of a reduced body is one small matrix. An estimate, no bound.
"""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, floats
from toolpoint.bodies.solid.assembly import chunks
from toolpoint.bodies.solid.element_kinds import ElementKind
from toolpoint.bodies.solid.material import Material
from toolpoint.bodies.solid.model import ElementBlock, SolidModel
from toolpoint.bodies.solid.recovery import best_points, blocks_of, recovery

_COLUMNS = 8  # shapes whose strains at all points are held at once


def mesh_energy(model: SolidModel, shapes: FloatArray) -> dict[str, FloatArray]:
    """Return by set the matrix (m, m), J, of the energy that the mesh errs by in combinations of shapes (model.size, m), m.

    It is proportional to the set's Young's modulus.
    """
    moved = floats("shapes", shapes, (model.size, None)).reshape(len(model.nodes), 3, -1)
    return {name: _of_set(model, name, moved) for name in model.set_names}


def _of_set(model: SolidModel, name: str, moved: FloatArray) -> FloatArray:
    blocks, smooth = blocks_of(model, name), recovery(model, name)
    nodal = np.empty((len(model.nodes), 6, moved.shape[2]), dtype=np.float32)
    for first in range(0, moved.shape[2], _COLUMNS):
        part = moved[:, :, first:first + _COLUMNS]
        strain = np.concatenate([_strains(block, model.nodes, part, cut) for block in blocks for cut in chunks(len(block))])
        nodal[:, :, first:first + _COLUMNS] = (smooth @ strain).reshape(len(nodal), 6, -1)
    lower = np.linalg.cholesky(_elasticity(model.materials[name]))
    total = np.zeros((moved.shape[2],) * 2)
    for block in blocks:
        for cut in chunks(len(block)):
            total += _apart(block.kind, model.nodes[block.nodes[cut]], moved[block.nodes[cut]], nodal[block.nodes[cut]], lower)
    return total


def _strains(block: ElementBlock, nodes: FloatArray, moved: FloatArray, cut: slice) -> FloatArray:
    """Return the strains of elements at their best points, (e p, 6 m)."""
    chosen = block.nodes[cut]
    strain = _strains_at(block.kind, nodes[chosen], moved[chosen], best_points(block.kind))[0]
    return strain.reshape(len(chosen) * strain.shape[1], -1)


def _apart(kind: ElementKind, corners: FloatArray, moved: FloatArray, nodal: FloatArray, lower: FloatArray) -> FloatArray:
    """Return the energy (m, m) of what the strains of some elements differ by from those between their nodes (e, n, 6, m)."""
    points, weights = (kind.points, kind.weights) if kind.corner_count == 8 else (best_points(kind), np.full(4, 1 / 24))
    strain, volume = _strains_at(kind, corners, moved, points)
    e, p, _, m = strain.shape
    over = np.matmul(kind.values(points), nodal.reshape(e, kind.node_count, -1)).reshape(strain.shape)
    energy = lower.T @ (over - strain) * np.sqrt(volume * weights)[:, :, None, None]
    flat = energy.reshape(e * p * 6, m)
    return flat.T @ flat


def _strains_at(kind: ElementKind, corners: FloatArray, moved: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return strains xx yy zz xy yz zx (e, p, 6, m) of motions (e, n, 3, m), and the volume of the parent's unit (e, p)."""
    slopes = kind.slopes(points)
    jacobian = np.einsum("pna,enb->epab", slopes, corners, optimize=True)
    slope = np.einsum("pna,epba->epbn", slopes, np.linalg.inv(jacobian), optimize=True)
    e, p, _, n = slope.shape
    turned = (slope.reshape(e, 3 * p, n) @ moved.reshape(e, n, -1)).reshape(e, p, 3, 3, -1)  # by place b, of motion a
    strain = np.empty((e, p, 6, turned.shape[-1]))
    for row in range(3):
        after = (row + 1) % 3
        strain[:, :, row] = turned[:, :, row, row]
        strain[:, :, 3 + row] = turned[:, :, row, after] + turned[:, :, after, row]
    return strain, np.linalg.det(jacobian)


def _elasticity(material: Material) -> FloatArray:
    result = np.diag([material.shear_modulus] * 6)
    result[:3, :3] += material.lame + np.diag([material.shear_modulus] * 3)
    return result
