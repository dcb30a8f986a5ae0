r"""SparseModel: a large sparse model of parts that scale, for a fit: its lowest modes with exact derivatives.

:math:`K = K_0 + \sum_j p_j K_j`, :math:`M = M_0 + \sum_j p_j M_j` are never assembled anew. Derivatives of squares are
energies of the parts; those of shapes solve :math:`(K - \lambda M) x = -(K_j - \lambda M_j) \phi` beside each mode, all at
once, with the one factorisation of K (`vibration.sparse.beside_mode`). Source: Nelson, AIAA J. 14 (1976).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import csc_array

from toolpoint._check import FloatArray, count, fail, positive
from toolpoint.updating.models.prediction import Prediction
from toolpoint.vibration import Dof, Modes
from toolpoint.vibration.sparse import factorise, modes
from toolpoint.vibration.sparse.beside_mode import polish, solve_beside


@dataclass(frozen=True, eq=False)
class SparseModel:
    """A model for `Problem`.

    Parameters
    ----------
    stiffness, mass : (n, n) sparse
        What does not scale; may be zero, but their sums with the parts must be positive definite.
    motion : (n, n_dofs) sparse
        From a shape to the Dofs that are measured, transposed: shape = motion.T @ vector.
    dofs : sequence of Dof
    number : int
        Modes that are predicted, more than are measured, so that crossings can be followed.
    stiffness_parts, mass_parts : mapping of number to (n, n) sparse
        Per unit of each number.
    damping_ratio : float
        Of every mode; it does not enter unless damping is a target.
    coordinates : (n, 3), optional
        Places of the rows, for the ordering of large models.
    """

    stiffness: csc_array
    mass: csc_array
    motion: csc_array
    dofs: tuple[Dof, ...]
    number: int
    stiffness_parts: Mapping[str, csc_array] = field(default_factory=dict)
    mass_parts: Mapping[str, csc_array] = field(default_factory=dict)
    damping_ratio: float = 0.01
    coordinates: FloatArray | None = None

    def __post_init__(self) -> None:
        count("SparseModel.number", self.number)
        positive("SparseModel.damping_ratio", self.damping_ratio)
        size = self.stiffness.shape[0]
        for name, part in (("mass", self.mass), *self.stiffness_parts.items(), *self.mass_parts.items()):
            if part.shape != (size, size):
                fail(f"SparseModel: {name}", f"shape {part.shape}", f"must be ({size}, {size}) as the stiffness")
        if self.motion.shape != (size, len(self.dofs)):
            fail("SparseModel.motion", f"shape {self.motion.shape}", f"must be ({size}, {len(self.dofs)})")

    def __call__(self, values: Mapping[str, float], names: Sequence[str] = ()) -> Prediction:
        """Return the lowest modes at these values, with derivatives to `names`."""
        k, m = _summed(self.stiffness, self.stiffness_parts, values), _summed(self.mass, self.mass_parts, values)
        inverse = factorise(k, coordinates=self.coordinates)
        # More than are predicted: what is beside the known modes converges by the gap from those to the last.
        pairs = modes(k, m, 2 * self.number, is_counted=False, coordinates=self.coordinates, inverse=inverse, shift=0)
        squares, vectors = polish(k, m, pairs, inverse=inverse)
        kept = vectors[:, :self.number]
        frequency = np.sqrt(squares[:self.number]) / (2 * np.pi)
        ratio = np.full(self.number, self.damping_ratio)
        result = Modes(frequency, ratio, self.motion.T @ kept, self.dofs, notes=(pairs.status,))
        if not names:
            return Prediction(result)
        slopes = self._slopes(names, squares, vectors)
        changes = solve_beside(k, m, squares, vectors=vectors, which=np.tile(np.arange(self.number), len(names)),
                               right=slopes.reshape(len(k.indptr) - 1, -1), inverse=inverse)
        turned = self._with_scale(names, changes.reshape(-1, len(names), self.number), kept)
        energies = -np.einsum("nr,npr->pr", kept, slopes)
        shape = np.stack([self.motion.T @ turned[:, p] for p in range(len(names))])
        return Prediction(result, None, energies / (8 * np.pi**2 * frequency), np.zeros_like(energies), shape)

    def _slopes(self, names: Sequence[str], squares: FloatArray, vectors: FloatArray) -> FloatArray:
        """Return -(K_j - lambda M_j) phi, (n, n_names, n_modes)."""
        kept = vectors[:, :self.number]
        columns = np.zeros((len(kept), len(names), self.number))
        for p, name in enumerate(names):
            if name not in self.stiffness_parts and name not in self.mass_parts:
                fail("names", repr(name), f"must be of {', '.join({**self.stiffness_parts, **self.mass_parts})}")
            if name in self.stiffness_parts:
                columns[:, p] -= self.stiffness_parts[name] @ kept
            if name in self.mass_parts:
                columns[:, p] += (self.mass_parts[name] @ kept) * squares[:self.number]
        return columns

    def _with_scale(self, names: Sequence[str], changes: FloatArray, kept: FloatArray) -> FloatArray:
        """Return changes of shapes at unit modal mass: where the mass changes, so does the scale."""
        for p, name in enumerate(names):
            if name in self.mass_parts:
                changes[:, p] -= 0.5 * kept * (kept * (self.mass_parts[name] @ kept)).sum(axis=0)
        return changes


def _summed(base: csc_array, parts: Mapping[str, csc_array], values: Mapping[str, float]) -> csc_array:
    total = base
    for name, part in parts.items():
        if name not in values:
            fail("values", f"no {name!r}", "must hold every number that scales a part")
        total = total + part * values[name]
    return csc_array(total)
