"""Exact step of a plant over one interval, in coordinates in which its linear part is a chain of two by two blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from toolpoint._check import FloatArray
from toolpoint.drives.axis.plant import Plant
from toolpoint.drives.friction.records import STATIC
from toolpoint.drives.simulation.arrays import StepArrays
from toolpoint.vibration.state_space import hold_matrices

# Cosine between left and right eigenvector of a pole; below it the pole is nearly defective and stays in the dense core.
_MIN_EIGENVECTOR_COSINE = 1e-4
_MAX_COUPLING_ROUNDING = 1e-10  # elements outside core and blocks that are rounding
_VECTOR_WIDTH = 4  # doubles of a vector register: arrays are filled up to whole ones


@dataclass(frozen=True, eq=False)
class StepMatrices:
    """Exact step z1 = phi z + held (u, d) + first w0 + last w1 with x = basis z; all matrices by columns for the kernel.

    last = shift + jump (jump: the laws that hold their end value). `inputs` are the columns (held, first + phi shift) that
    act on z - shift w; outputs are reading (z - shift w) + direct w, and so are the loads of laws with `loads` and
    `load_direct` (empty where no law is loaded); gain is the scalars' part of last.

    phi is a dense `core` of the first coordinates and then, for coordinate i of each half of the rest, the two by two
    block `pairs[:, i]` = (p11, p12, p21, p22). Coordinates and scalars are filled with zeros to whole vector lengths.
    """

    step: float
    core: FloatArray
    pairs: FloatArray
    inputs: FloatArray
    shift: FloatArray
    jump: FloatArray
    scalars: FloatArray
    gain: FloatArray
    reading: FloatArray
    direct: FloatArray
    loads: FloatArray
    load_direct: FloatArray
    basis: FloatArray
    inverse: FloatArray

    @property
    def arrays(self) -> StepArrays:
        """The matrices as the compiled run takes them."""
        return StepArrays(self.step, self.core, self.pairs, self.inputs, self.shift, self.jump, self.scalars, self.gain,
                          self.reading, self.direct, self.loads, self.load_direct)

    def inward(self, x: FloatArray) -> FloatArray:
        """Return the coordinates z of a state x."""
        return self.inverse @ x

    def outward(self, z: FloatArray) -> FloatArray:
        """Return the state x of coordinates z."""
        return self.basis @ z


def step_matrices(plant: Plant, step: float, *, dense: bool = False) -> StepMatrices:
    """Return the matrices of one step, all from one matrix exponential.

    Friction, contact and bilinear terms are linear over the step (first-order hold); a set-valued static law holds its
    end value, because a held multiplier is the one that does not chatter. The coordinates are those of `coordinates`;
    `dense` keeps the states themselves.
    """
    phi, first, shift, jump, held = _held_parts(plant, step)
    states: tuple[FloatArray, FloatArray, int] = np.eye(len(phi)), np.eye(len(phi)), len(phi)
    basis, inverse, core = states if dense else coordinates(plant.a)
    # The blocks are those of A: the exponential, a series in A, has the same ones up to rounding.
    turned: FloatArray = inverse @ phi @ basis
    # Ill-conditioned eigenvectors smear the blocks: then the states themselves are kept, slower and exact.
    if not dense and not _is_split(turned, core):
        (basis, inverse, core), turned = states, phi
    half = (len(phi) - core) // 2
    # Whole vector registers: a remainder of one to three elements would run as a scalar loop in every step.
    spare = -half % _VECTOR_WIDTH if half else -core % _VECTOR_WIDTH
    place = _places(core, half, spare)
    ordered = np.ascontiguousarray
    pad = lambda rows: _rows_at(rows, place, core + 2 * (half + spare) if half else core + spare)
    a, b = np.arange(core, core + half), np.arange(core + half, core + 2 * half)
    pairs = np.zeros((4, half + spare if half else 0))
    pairs[:, :half] = turned[a, a], turned[a, b], turned[b, a], turned[b, b]
    core_size = core if half else core + spare
    dense_core = np.zeros((core_size, core_size))
    dense_core[:core, :core] = turned[:core, :core].T
    inputs = ordered(pad(inverse @ np.hstack([held, first + phi @ shift])).T)
    scalars = np.pad(plant.scalars @ basis, ((0, -plant.scalars.shape[0] % _VECTOR_WIDTH), (0, 0)))
    outputs = np.pad(plant.outputs @ basis, ((0, -plant.outputs.shape[0] % _VECTOR_WIDTH), (0, 0)))
    loads = plant.loads if np.any(plant.laws["load_arm"]) else np.zeros((0, len(phi)))
    return StepMatrices(step, dense_core, pairs, np.pad(inputs, ((0, -inputs.shape[0] % _VECTOR_WIDTH), (0, 0))),
                        ordered(pad(inverse @ shift).T), ordered(pad(inverse @ jump).T), pad(scalars.T),
                        ordered(plant.scalars @ (shift + jump)),
                        pad(outputs.T), ordered((outputs @ (inverse @ shift)).T),
                        pad((loads @ basis).T), ordered((loads @ shift).T), ordered(pad(basis.T).T), pad(inverse))


def coordinates(a: FloatArray) -> tuple[FloatArray, FloatArray, int]:
    """Return (basis T, its inverse, size of the core): T^-1 A T is a dense core and two by two blocks.

    Poles with well separated eigenvectors give the blocks: a conjugate pair the coordinates Re and Im, real poles two
    by two. The rest (rigid motion without damping, repeated defective poles) spans the core, which is the space that the
    left eigenvectors of the others do not see. The states are balanced first.
    """
    # Currents, angles and displacements differ by many orders, which would cost the eigenvectors their digits.
    balanced, scale = scipy.linalg.matrix_balance(np.array(a), permute=False)
    poles, left, right = scipy.linalg.eig(balanced, left=True, right=True)
    cosine = np.abs(np.einsum("ij,ij->j", left.conj(), right))
    pair = np.flatnonzero((poles.imag > 0) & (cosine > _MIN_EIGENVECTOR_COSINE))
    real = np.flatnonzero((poles.imag == 0) & (cosine > _MIN_EIGENVECTOR_COSINE))
    # Real poles share blocks two by two; of an odd number the last goes to the core.
    real = real[:real.size - real.size % 2]
    first = np.hstack([right[:, pair].real, right[:, real[0::2]].real])
    second = np.hstack([right[:, pair].imag, right[:, real[1::2]].real])
    others_left = np.hstack([left[:, pair].real, left[:, pair].imag, left[:, real].real])
    n, core = len(poles), len(poles) - 2 * first.shape[1]
    # Left and right eigenvectors of different poles are orthogonal: what is orthogonal to the left ones is the invariant
    # rest.
    core_basis = np.linalg.qr(others_left, mode="complete").Q[:, n - core:]
    basis = np.hstack([core_basis, first, second])
    return scale @ basis, np.linalg.solve(scale @ basis, np.eye(n)), core


def _held_parts(plant: Plant, step: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return phi, and the columns of w at the start, at the end, at the end of held laws, and of inputs and forces."""
    nu, nf = plant.b_input.shape[1], plant.b_force.shape[1]
    phi, g1, g2 = hold_matrices(plant.a, np.hstack([plant.b_input, plant.b_force, plant.b_scalar]), step)
    n_inputs = nu + nf
    first, shift, jump = g1[:, n_inputs:] - g2[:, n_inputs:], g2[:, n_inputs:].copy(), np.zeros_like(g2[:, n_inputs:])
    for k in np.flatnonzero(plant.laws["kind"] == STATIC):
        first[:, k], shift[:, k], jump[:, k] = 0.0, 0.0, g1[:, n_inputs + k]
    return phi, first, shift, jump, g1[:, :n_inputs]


def _is_split(turned: FloatArray, core: int) -> bool:
    """Whether nothing but rounding is left outside the core and the blocks."""
    n, half = len(turned), (len(turned) - core) // 2
    inside = np.zeros((n, n), bool)
    inside[:core, :core] = True
    a, b = np.arange(core, core + half), np.arange(core + half, n)
    for i, j in ((a, a), (a, b), (b, a), (b, b)):
        inside[i, j] = True
    return bool(np.abs(np.where(inside, 0.0, turned)).max(initial=0.0) < _MAX_COUPLING_ROUNDING)


def _places(core: int, half: int, spare: int) -> np.ndarray:
    """Return the padded index of every coordinate: the second half begins after the first one's spare places."""
    return np.concatenate([np.arange(core + half), core + half + spare + np.arange(half)])


def _rows_at(rows: FloatArray, place: np.ndarray, total: int) -> FloatArray:
    out = np.zeros((total, rows.shape[1]))
    out[place] = rows
    return out
