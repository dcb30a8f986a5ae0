r"""Energy of the error of a mesh: of the difference between the strain of the elements and one that is smooth over them.

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

_STRAIN_COLUMNS = 8  # shapes whose strains at all points are held at once, for memory


def mesh_energy(model: SolidModel, shapes: FloatArray) -> dict[str, FloatArray]:
    """Return for each set the matrix (m, m) of the mesh error's energy in shapes (model.size, m): J for shapes in m.

    A combination c of the shapes has the energy ``c^T E c``. It is proportional to the set's Young's modulus.
    """
    motion = floats("shapes", shapes, (model.size, None)).reshape(len(model.nodes), 3, -1)
    return {name: _energy_of_set(model, name, motion) for name in model.set_names}


def _energy_of_set(model: SolidModel, name: str, motion: FloatArray) -> FloatArray:
    """Return the energy (m, m) of one set for motions (nodes, 3, m)."""
    blocks, to_nodes = blocks_of(model, name), recovery(model, name)
    # Single precision halves the largest array; an estimate needs no more digits.
    nodal = np.empty((len(model.nodes), 6, motion.shape[2]), dtype=np.float32)
    for first in range(0, motion.shape[2], _STRAIN_COLUMNS):
        part = motion[:, :, first:first + _STRAIN_COLUMNS]
        strain = np.concatenate([_strains(block, model.nodes, part, chunk) for block in blocks for chunk in chunks(len(block))])
        nodal[:, :, first:first + _STRAIN_COLUMNS] = (to_nodes @ strain).reshape(len(nodal), 6, -1)
    lower = np.linalg.cholesky(_elasticity(model.materials[name]))
    total = np.zeros((motion.shape[2],) * 2)
    for block in blocks:
        for chunk in chunks(len(block)):
            total += _energy_of_difference(block.kind, model.nodes[block.nodes[chunk]], motion[block.nodes[chunk]],
                                           nodal[block.nodes[chunk]], lower)
    return total


def _strains(block: ElementBlock, nodes: FloatArray, motion: FloatArray, chunk: slice) -> FloatArray:
    """Return the strains of a chunk of elements at their best points, (e p, 6 m), for motions (nodes, 3, m)."""
    chosen = block.nodes[chunk]
    strain = _strains_at(block.kind, nodes[chosen], motion[chosen], best_points(block.kind))[0]
    return strain.reshape(len(chosen) * strain.shape[1], -1)


def _energy_of_difference(kind: ElementKind, corners: FloatArray, motion: FloatArray, nodal: FloatArray,
                          lower: FloatArray) -> FloatArray:
    """Return the energy (m, m) of the difference between strains of elements and those interpolated from their nodes.

    corners : (e, n, 3) of all nodes; motion : (e, n, 3, m); nodal : (e, n, 6, m) strains; lower : (6, 6) Cholesky factor of
    Hooke's matrix, so that the energy is a sum of squares.
    """
    points, weights = (kind.points, kind.weights) if kind.corner_count == 8 else (best_points(kind), np.full(4, 1 / 24))
    strain, volume = _strains_at(kind, corners, motion, points)
    e, p, _, m = strain.shape
    smooth = np.matmul(kind.values(points), nodal.reshape(e, kind.node_count, -1)).reshape(strain.shape)
    # Rows whose products are the energy: one matrix product for all pairs of shapes.
    energy = lower.T @ (smooth - strain) * np.sqrt(volume * weights)[:, :, None, None]
    rows = energy.reshape(e * p * 6, m)
    return rows.T @ rows


def _strains_at(kind: ElementKind, corners: FloatArray, motion: FloatArray, points: FloatArray) -> tuple[FloatArray,
                                                                                                         FloatArray]:
    """Return strains xx yy zz xy yz zx (e, p, 6, m) of motions (e, n, 3, m), and Jacobian determinants (e, p)."""
    slopes = kind.slopes(points)
    jacobian = np.einsum("pna,enb->epab", slopes, corners, optimize=True)
    slope = np.einsum("pna,epba->epbn", slopes, np.linalg.inv(jacobian), optimize=True)
    e, p, _, n = slope.shape
    gradient = (slope.reshape(e, 3 * p, n) @ motion.reshape(e, n, -1)).reshape(e, p, 3, 3,
                                                                               -1)  # derivative by coordinate b of motion a
    strain = np.empty((e, p, 6, gradient.shape[-1]))
    for row in range(3):
        following = (row + 1) % 3
        strain[:, :, row] = gradient[:, :, row, row]
        strain[:, :, 3 + row] = gradient[:, :, row, following] + gradient[:, :, following, row]
    return strain, np.linalg.det(jacobian)


def _elasticity(material: Material) -> FloatArray:
    """Return Hooke's matrix (6, 6) for strains xx yy zz xy yz zx."""
    result = np.diag([material.shear_modulus] * 6)
    result[:3, :3] += material.lame + np.diag([material.shear_modulus] * 3)
    return result
