"""Solid models with known answers: boxes of hexahedra and of tetrahedra, a sphere."""

from __future__ import annotations

from itertools import permutations

import numpy as np

from toolpoint.bodies.solid import STEEL, Casting, Cuboid, ElementBlock, Material, SolidModel
from toolpoint.bodies.solid.element_kinds import TET_SIDES


def brick(size, parts, material: Material = STEEL) -> SolidModel:
    """A box of hexahedra, `parts` along each axis."""
    planes = [np.linspace(0, s, n + 1) for s, n in zip(size, parts, strict=True)]
    return Casting([Cuboid([0, 0, 0], size)], {"body": material}).meshed(max(size), planes=planes)


def tetrahedral_brick(size, parts, material: Material = STEEL) -> SolidModel:
    """The same box, every cell cut into six 10-node tetrahedra along one diagonal (Kuhn)."""
    fine = [np.linspace(0, s, 2 * n + 1) for s, n in zip(size, parts, strict=True)]
    shape = [len(p) for p in fine]
    cells = np.stack(np.meshgrid(*[np.arange(n) for n in parts], indexing="ij"), axis=-1).reshape(-1, 3)
    tetrahedra = []
    for order in permutations(range(3)):
        steps = np.cumsum(np.vstack([np.zeros(3, int), np.eye(3, dtype=int)[list(order)]]), axis=0)
        if np.linalg.det(steps[1:] - steps[0]) < 0:
            steps = steps[[0, 2, 1, 3]]
        corners = 2 * (cells[:, None, :] + steps)
        tetrahedra.append(np.concatenate([corners, (corners[:, TET_SIDES[:, 0]] + corners[:, TET_SIDES[:, 1]]) // 2], axis=1))
    at = np.concatenate(tetrahedra)
    code = (at[..., 0] * shape[1] + at[..., 1]) * shape[2] + at[..., 2]
    unique, elements = np.unique(code, return_inverse=True)
    grid = np.unravel_index(unique, shape)
    nodes = np.column_stack([p[k] for p, k in zip(fine, grid, strict=True)])
    return SolidModel(nodes, [ElementBlock(elements.reshape(-1, 10))], {"body": material})


def ball(parts: int, material: Material) -> SolidModel:
    """A unit ball of curved hexahedra: a cube whose points are drawn out to the sphere."""
    cube = brick([2.0, 2, 2], [parts] * 3, material)
    x, y, z = (cube.nodes - 1).T
    nodes = np.column_stack([a * np.sqrt(1 - b * b / 2 - c * c / 2 + b * b * c * c / 3) for a, b, c in ((x, y, z), (y, x, z),
                                                                                                      (z, x, y))])
    return SolidModel(nodes, cube.blocks, cube.materials)
