r"""Slopes of mode shapes and of their MAC with a test to E and density of every element and to every joint.

:math:`MAC = |\psi^H \phi_S|^2 / (\psi^H \psi\ \phi_S^T \phi_S)` is a function of the shape at the measured Dofs; so is the
motion of any Dof at unit modal mass. Each has one adjoint a mode (`vibration.sparse.beside_mode`), and every element its
share of it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array

from toolpoint._check import Array, FloatArray, IndexArray, fail
from toolpoint._notebook import NotebookText
from toolpoint.bodies.solid.sensitivity import element_energies, element_sets
from toolpoint.studies.finite_elements.whole_machine import FiniteElementMachine
from toolpoint.vibration import Dof
from toolpoint.vibration.sparse import EigenPairs
from toolpoint.vibration.sparse.beside_mode import CLUSTER_SQUARE_TOLERANCE, polish, solve_beside

# From all shapes to the values of functions (k,) and their gradients by the shape of their mode (size, k).
Functions = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


@dataclass(frozen=True, eq=False)
class PartSlopes(NotebookText):
    """Change of every function for a relative change of E or density of every element of a part, (k, e) each."""

    modulus: FloatArray
    density: FloatArray
    set_names: tuple[str, ...]

    def by_set(self) -> dict[str, tuple[FloatArray, FloatArray]]:
        """Return (modulus, density), each (k,), summed over the elements of every set."""
        names = np.array(self.set_names)
        return {name: (self.modulus[:, names == name].sum(axis=1), self.density[:, names == name].sum(axis=1))
                for name in dict.fromkeys(self.set_names)}


@dataclass(frozen=True, eq=False)
class ShapeSensitivity(NotebookText):
    """Slopes of functions of mode shapes.

    names : of the functions; modes : (k,) mode of each; values : (k,) of the functions; parts : part to its slopes; joints :
    joint to (k,), per relative change of all its stiffness; notes.
    """

    names: tuple[str, ...]
    modes: IndexArray
    values: FloatArray
    parts: Mapping[str, PartSlopes]
    joints: Mapping[str, FloatArray]
    notes: tuple[str, ...] = ()

    def by_part(self) -> dict[str, tuple[FloatArray, FloatArray]]:
        """Return (modulus, density), each (k,), summed over every part."""
        return {name: (p.modulus.sum(axis=1), p.density.sum(axis=1)) for name, p in self.parts.items()}

    def __repr__(self) -> str:
        modes = len(set(self.modes.tolist()))
        return f"ShapeSensitivity({len(self.names)} functions of {modes} modes, {len(self.parts)} parts)"


def accumulate(values: FloatArray) -> FloatArray:
    """Return the values summed from the largest size to the smallest along the last axis."""
    order = np.argsort(-np.abs(values), axis=-1)
    return np.cumsum(np.take_along_axis(values, order, axis=-1), axis=-1)


def mac_sensitivity(machine: FiniteElementMachine, pairs: EigenPairs, dofs: Sequence[Dof], *, measured: Array,
                    which: Sequence[int]) -> ShapeSensitivity:
    """Return the slopes of the MAC of modes with measured shapes.

    Parameters
    ----------
    machine : FiniteElementMachine
    pairs : EigenPairs
        Its lowest modes, some more than are asked for.
    dofs : sequence of Dof
        At nodes (numbers from 1, over all parts).
    measured : (n_dofs, k), real or complex
        Shapes of the test at these Dofs.
    which : (k,) ints
        Mode of the model that each belongs to, from 0.
    """
    modes = np.asarray(which, dtype=np.int64)
    if np.shape(measured) != (len(dofs), len(modes)):
        fail("measured", f"shape {np.shape(measured)}", f"must be ({len(dofs)}, {len(modes)})")
    motion = machine.motion_of(dofs)

    def functions(vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
        shape = motion.T @ vectors[:, modes]
        cross = (measured.conj() * shape).sum(axis=0)
        norms = (np.abs(measured) ** 2).sum(axis=0), (shape**2).sum(axis=0)
        values = np.abs(cross) ** 2 / (norms[0] * norms[1])
        # Slope of the MAC by the shape; that along the shape drops out.
        slope = 2 * (cross.conj() * measured.conj()).real / (norms[0] * norms[1]) - 2 * values * shape / norms[1]
        return values, motion @ slope

    return _solve_slopes(machine, pairs, tuple(f"MAC of mode {i + 1}" for i in modes), modes, functions)


def motion_sensitivity(machine: FiniteElementMachine, pairs: EigenPairs, motions: Mapping[str, csc_array], *,
                       which: Sequence[int]) -> ShapeSensitivity:
    """Return the slopes of motions in modes at unit modal mass.

    motions : name to weights (size, 1) whose product with a shape is the motion, for example a column of
        `FiniteElementMachine.spread`; every one
    is taken in every mode of `which`.
    """
    weights = np.column_stack([w.toarray().ravel() for w in motions.values()])
    modes = np.repeat(np.asarray(which, dtype=np.int64), len(motions))
    # The functions are linear: their gradients are the weights, whatever the shapes.
    gradients = np.tile(weights, (1, len(which)))

    def functions(vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
        return (gradients * vectors[:, modes]).sum(axis=0), gradients

    names = tuple(f"{name} in mode {i + 1}" for i in which for name in motions)
    return _solve_slopes(machine, pairs, names, modes, functions)


def _solve_slopes(machine: FiniteElementMachine, pairs: EigenPairs, names: tuple[str, ...], modes: IndexArray,
                  functions: Functions) -> ShapeSensitivity:
    if modes.size and modes.max() >= pairs.count - 1:
        fail("pairs", f"{pairs.count} modes", f"must be at least {int(modes.max()) + 2}, one more than the highest studied",
             remedy="solve for some more; it converges faster too")
    stiffness, mass = machine.matrices
    inverse = machine.inverse
    # Adjoints need shapes that are exacter than frequencies ask for.
    squares, vectors = polish(stiffness, mass, pairs, inverse=inverse)
    values, gradients = functions(vectors)
    adjoint = solve_beside(stiffness, mass, squares, vectors=vectors, which=modes, right=gradients, inverse=inverse)
    shapes, level = vectors[:, modes], squares[modes]
    # The part of a gradient along the shape: its length follows from unit modal mass.
    along = (gradients * shapes).sum(axis=0)
    parts = {}
    for name, model in machine.parts.items():
        rows = slice(machine.starts[name], machine.starts[name] + model.size)
        # An element's share needs its own rows of the adjoint and of the shape only.
        strain, cross = element_energies(model, adjoint[rows], shapes[rows])
        motion = element_energies(model, shapes[rows], shapes[rows])[1] if along.any() else np.zeros_like(cross)
        parts[name] = PartSlopes(-strain, level[:, None] * cross - 0.5 * along[:, None] * motion, element_sets(model))
    joints = {joint.name: -(joint.stiffness[:, None] * (machine.joint_motions[joint.name].T @ adjoint)
                            * (machine.joint_motions[joint.name].T @ shapes)).sum(axis=0) for joint in machine.joints}
    return ShapeSensitivity(names, modes, values, parts, joints, _cluster_notes(squares, modes))


def _cluster_notes(squares: FloatArray, modes: IndexArray) -> tuple[str, ...]:
    notes = []
    for i in sorted(set(modes.tolist())):
        gap = np.abs(np.delete(squares, i) / squares[i] - 1).min()
        if gap < 100 * CLUSTER_SQUARE_TOLERANCE:
            notes.append(f"mode {i + 1} lies together with another (squares apart by {gap:.1g}): its shape has no slope of its "
                         "own")
        elif gap < 0.02:
            notes.append(f"mode {i + 1} lies {50 * gap:.2g} % of frequency from a neighbour: its shape turns fast, slopes hold "
                         "for small changes only")
    return tuple(notes)
