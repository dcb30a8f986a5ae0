r"""Sensitivity of frequencies to Young's modulus and density of every element, from the elements' energies in each mode.

:math:`\partial \lambda / \partial E_e = \phi^T K_e \phi / E_e`, :math:`\partial \lambda / \partial \rho_e = -\lambda \phi^T M_e
\phi / \rho_e` for :math:`\phi^T M \phi = 1`. Source: Fox, Kapoor, AIAA J. 6 (1968).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail, floats
from toolpoint._notebook import NotebookText
from toolpoint.bodies.solid import matrices
from toolpoint.bodies.solid.assembly import chunks
from toolpoint.bodies.solid.model import SolidModel
from toolpoint.vibration.sparse.beside_mode import CLUSTER_SQUARE_TOLERANCE

_HELD_FRACTION = 0.8  # share of a part's effect whose elements are counted


@dataclass(frozen=True, eq=False)
class ElementSensitivity(NotebookText):
    """Sensitivities of frequencies to relative changes of E or density of each element.

    Parameters
    ----------
    frequency : (k,) floats
        Hz.
    modulus, density : (k, e) floats
        Relative change of the frequency per relative change of the element's E or density; elements in the order of blocks.
    set_names : sequence of str
        Set of each element.
    notes : sequence of str
        Modes of nearly equal frequency: only the sum of their sensitivities is determined.
    """

    frequency: FloatArray
    modulus: FloatArray
    density: FloatArray
    set_names: tuple[str, ...]
    notes: tuple[str, ...] = ()

    def by_set(self) -> dict[str, tuple[FloatArray, FloatArray]]:
        """Return set to (modulus, density), each (k,): relative sensitivities summed over the elements of the set."""
        names = np.array(self.set_names)
        return {name: (self.modulus[:, names == name].sum(axis=1), self.density[:, names == name].sum(axis=1))
                for name in dict.fromkeys(self.set_names)}

    def hertz_a_kilogram(self, masses: FloatArray) -> FloatArray:
        """Return the gain of every frequency by a kilogram that thickens an element, (k, e), Hz/kg; masses (e,) in kg."""
        # A thicker wall has more stiffness and more mass by the same share.
        return self.frequency[:, None] * (self.modulus + self.density) / masses

    def holders(self, masses: FloatArray, mode: int) -> tuple[float, float]:
        """Return the share of the elements, and of their mass (e,), that hold 80 % of the effect of E on a mode (from 0)."""
        values = self.modulus[mode]
        # The elements with the largest effect first, until they hold the stated share.
        order = np.argsort(-values)
        count = int(np.searchsorted(np.cumsum(values[order]), _HELD_FRACTION * values.sum())) + 1
        return count / len(values), float(masses[order[:count]].sum() / masses.sum())

    def __repr__(self) -> str:
        return f"ElementSensitivity({len(self.frequency)} modes, {len(self.set_names)} elements)"


def frequency_sensitivity(model: SolidModel, squares: FloatArray, vectors: FloatArray) -> ElementSensitivity:
    """Return the sensitivities of modes to every element.

    Parameters
    ----------
    model : SolidModel
    squares : (k,) floats
        rad^2/s^2, above zero: rigid-body modes do not depend on E.
    vectors : (model.size, k) floats
        Of all coordinates (zero where held), unit modal mass.
    """
    values = floats("squares", squares, (None,))
    shapes = floats("vectors", vectors, (model.size, len(values)))
    if (values <= 0).any():
        fail("squares", f"{int((values <= 0).sum())} rigid-body modes", "must be above zero",
             remedy="leave the rigid-body modes out")
    strain, motion = element_energies(model, shapes, shapes)
    inseparable = [i for i in range(1, len(values)) if values[i] - values[i - 1] <= CLUSTER_SQUARE_TOLERANCE * values[i]]
    notes = tuple(f"modes {i} and {i + 1} lie together: the sum of their sensitivities holds, not each" for i in inseparable)
    return ElementSensitivity(np.sqrt(values) / (2 * np.pi), strain / (2 * values[:, None]), -motion / 2, element_sets(model),
                              notes)


def element_sets(model: SolidModel) -> tuple[str, ...]:
    """Return the set of every element, in the order of blocks."""
    return tuple(block.name for block in model.blocks for _ in range(len(block)))


def element_masses(model: SolidModel) -> FloatArray:
    """Return the mass of every element, (e,), kg."""
    # A unit translation along x: twice its kinetic energy is the mass.
    motion = np.zeros((model.size, 1))
    motion[::3] = 1.0
    return element_energies(model, motion, motion)[1][0]


def element_centres(model: SolidModel) -> FloatArray:
    """Return the mean of the corners of every element, (e, 3), m, in the order of blocks."""
    return np.concatenate([model.nodes[block.nodes[:, :block.kind.corner_count]].mean(axis=1) for block in model.blocks])


def element_energies(model: SolidModel, left: FloatArray, right: FloatArray) -> tuple[FloatArray, FloatArray]:
    r"""Return :math:`a_k^T K_e b_k` and :math:`a_k^T M_e b_k` of every element, (k, e) each; a of `left`, b of `right`.

    left, right : (model.size, k) floats
        Of all coordinates; the same array for the energies of shapes.
    """
    strain, motion = [], []
    a, b = (np.ascontiguousarray(u).reshape(len(model.nodes), 3, -1) for u in (left, right))
    for block in model.blocks:
        material = model.materials[block.name]
        for part in chunks(len(block)):
            nodes = block.nodes[part]
            u, v = a[nodes], b[nodes]
            k = matrices.stiffness(block.kind, model.nodes[nodes], material)
            m = matrices.scalar_mass(block.kind, model.nodes[nodes], material.density)
            flat = (len(nodes), -1, u.shape[-1])
            strain.append((u.reshape(flat) * (k @ v.reshape(flat))).sum(axis=1).T)
            motion.append((u * (m @ v.reshape(*v.shape[:2], -1)).reshape(v.shape)).sum(axis=(1, 2)).T)
    return np.hstack(strain), np.hstack(motion)
