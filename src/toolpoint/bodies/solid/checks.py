"""Checks of a solid model before it is solved: size and mass, pieces, shape of elements, six rigid motions."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from toolpoint._check import FloatArray, ToolpointWarning, fail
from toolpoint._notebook import NotebookText
from toolpoint.bodies.solid import matrices
from toolpoint.bodies.solid.assembly import chunks
from toolpoint.bodies.solid.model import SolidModel

# A part of a machine tool is between a small insert and a large gantry.
SIZE_LIMITS = (2e-3, 30.0)  # m, of the largest extent
_MASS_LIMITS = (1e-4, 1e6)  # kg
_MIN_JACOBIAN = 0.1  # smallest over largest Jacobian determinant inside an element: below, it is poor
_MAX_RIGID_FORCE = 1e-9  # nodal force of a rigid motion of the part's size, over the largest diagonal stiffness


@dataclass(frozen=True, eq=False)
class SolidCheck(NotebookText):
    """Size, mass and quality of a solid model.

    Parameters
    ----------
    size : (3,) floats
        Extent along x, y, z, m.
    mass : float
        kg.
    jacobian_ratio : float
        Of the worst element, smallest over largest Jacobian determinant: 1 for bricks, below 0.1 poor.
    rigid_residual : float
        Largest nodal force of a unit rigid motion over the largest diagonal stiffness; rotations are by one over the extent.
    notes : sequence of str
        Remarks on poor elements.
    """

    size: FloatArray
    mass: float
    jacobian_ratio: float
    rigid_residual: float
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        size = " x ".join(f"{s:.4g}" for s in self.size)
        return f"SolidCheck({size} m, {self.mass:.6g} kg, Jacobian ratio {self.jacobian_ratio:.2g}, {len(self.notes)} notes)"


def check_solid(model: SolidModel) -> SolidCheck:
    """Return size, mass and quality of a model; refuse what cannot be solved.

    Raises ToolpointError for a size or mass that no part has (a drawing in mm read as m), several bodies in one mesh, elements
    inside out, and a stiffness that resists rigid motion. Warns of poor elements.
    """
    size = np.ptp(model.nodes, axis=0)
    check_size(size)
    check_pieces(model)
    ratio = _jacobian_ratio(model)
    mass = model.mass_properties.mass
    if not _MASS_LIMITS[0] <= mass <= _MASS_LIMITS[1]:
        fail("mass", f"{mass:.4g} kg", f"must be within {_MASS_LIMITS[0]:g} .. {_MASS_LIMITS[1]:g} kg",
             remedy="look at the units")
    stiffness = model.stiffness()
    force = stiffness @ (model.rigid_motion(model.nodes.mean(axis=0)) / np.array([1, 1, 1, *[size.max()] * 3]))
    residual = float(np.abs(force).max() / np.abs(stiffness.diagonal()).max())
    if residual > _MAX_RIGID_FORCE:
        fail("stiffness", f"rigid motion meets {residual:.2g} of the largest stiffness", f"must be below {_MAX_RIGID_FORCE:g}")
    notes = (f"worst element: Jacobian ratio {ratio:.2g}, below {_MIN_JACOBIAN}: mesh it finer there",
             ) if ratio < _MIN_JACOBIAN else ()
    for note in notes:
        warnings.warn(note, ToolpointWarning, stacklevel=2)
    return SolidCheck(size, mass, ratio, residual, notes)


def check_size(size: FloatArray) -> None:
    """Refuse a size (3,), m, whose largest extent is beyond `SIZE_LIMITS`."""
    largest = float(np.max(size))
    if not SIZE_LIMITS[0] <= largest <= SIZE_LIMITS[1]:
        unit = "mm" if largest > SIZE_LIMITS[1] else "m"
        remedy = f"is the file in {unit}? read it with unit='{unit}'"
        fail("size", f"{largest:.4g} m", f"must be within {SIZE_LIMITS[0]:g} .. {SIZE_LIMITS[1]:g} m", remedy=remedy)


def check_pieces(model: SolidModel) -> None:
    """Refuse a mesh of several bodies: nodes that no chain of elements joins."""
    first = np.concatenate([np.repeat(b.nodes[:, 0], b.nodes.shape[1] - 1) for b in model.blocks])
    other = np.concatenate([b.nodes[:, 1:].ravel() for b in model.blocks])
    graph = coo_array((np.ones(len(first), dtype=np.int8), (first, other)), shape=(len(model.nodes),) * 2)
    count, labels = connected_components(graph, directed=False)
    if count > 1:
        sizes = np.sort(np.bincount(labels))[::-1]
        fail("mesh", f"{count} bodies of {', '.join(map(str, sizes[:4]))} nodes", "must be one",
             remedy="read each body alone, or merge the nodes where they touch")


def _jacobian_ratio(model: SolidModel) -> float:
    """Return, for the worst element, the smallest over the largest Jacobian determinant at its integration points."""
    smallest = 1.0
    for block in model.blocks:
        for part in chunks(len(block)):
            kind = block.kind
            _, volume = matrices.gradients(kind, model.nodes[block.nodes[part]])
            # Volumes hold the weights of the rule, which are taken out again.
            local = volume / (kind.weights if volume.shape[1] == len(kind.weights) else volume.mean(axis=1, keepdims=True))
            smallest = min(smallest, float((local.min(axis=1) / local.max(axis=1)).min()))
    return smallest
