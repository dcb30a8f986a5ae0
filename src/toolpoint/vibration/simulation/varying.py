r"""Systems whose matrices change slowly along a path: exact steps at nodes, blended between them.

:math:`M(s) \ddot u + C(s) \dot u + K(s) u = \sum_j b_j(s) f_j`. At every node of the path the step of length dt is exact for
inputs held over it: :math:`x_{k+1} = x_s + \Phi (x_k - x_s)` about the static deflection x_s of the inputs; between two nodes
the transition and the static deflections are blended linearly in s. They are then continuous in time, so
nothing recurs with the nodes, which could beat with a periodic input, and the error falls with the square of their distance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from toolpoint._check import FloatArray, IndexArray, fail, floats, increasing, positive


@dataclass(frozen=True, eq=False)
class VaryingSystem:
    """Matrices of a system at nodes of a path.

    Parameters
    ----------
    length : (N,) floats
        Position of each node along the path, m, increasing, at least two.
    mass, damping, stiffness : (N, n, n) floats
    input_map : (N, n, w) floats
        Generalised forces; the first three columns are the tip's force in the cutter's axes.
    output_map : (N, 6, n) floats
        Motion of the tip in machine axes.
    momentum_map : (N, 6, n) floats
        Momentum about the machine's origin per velocity.
    """

    length: FloatArray
    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    input_map: FloatArray
    output_map: FloatArray
    momentum_map: FloatArray

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "length", increasing("VaryingSystem.length", floats("VaryingSystem.length", self.length, (None,))))
        nodes, n = self.length.size, self.mass.shape[-1]
        if nodes < 2:
            fail("VaryingSystem.length", f"{nodes} nodes", "must be at least two")
        for name in ("mass", "damping", "stiffness"):
            put(self, name, floats(f"VaryingSystem.{name}", getattr(self, name), (n, n)))
        for name in ("input_map", "output_map", "momentum_map"):
            put(self, name, floats(f"VaryingSystem.{name}", getattr(self, name)))

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return int(self.mass.shape[-1])

    def thinned(self) -> VaryingSystem:
        """Return the system at every other node (and the last), for the error of its blending."""
        nodes = np.unique(np.append(np.arange(0, self.length.size, 2), self.length.size - 1))
        return VaryingSystem(self.length[nodes], self.mass[nodes], self.damping[nodes], self.stiffness[nodes],
                             self.input_map[nodes],
                             self.output_map[nodes], self.momentum_map[nodes])

    def blended(self, name: str, position: float) -> FloatArray:
        """Return one of the matrices at a position along the path (m), linear between nodes."""
        node = int(np.clip(np.searchsorted(self.length, position, side="right") - 1, 0, self.length.size - 2))
        fraction = (position - self.length[node]) / (self.length[node + 1] - self.length[node])
        matrices = getattr(self, name)
        return matrices[node] + fraction * (matrices[node + 1] - matrices[node])


def reduce_system(system: VaryingSystem, *, max_size: int = 64, modes: int = 30, kept_count: int = 0) -> VaryingSystem:
    """Return a large system on a basis of at most `max_size` shapes, the same along the whole path.

    The basis holds undamped modes and static deflections to all inputs at five nodes; systems of at most `max_size` coordinates
    stay as they are. The last `kept_count` coordinates (motors, controllers) are kept, and the static deflections to them are
    in the basis. Below the highest of its modes the reduced system answers as the full one.
    """
    reducible = system.size - kept_count
    if reducible <= max_size:
        return system
    shapes_of_nodes = []
    for i in np.unique(np.linspace(0, system.length.size - 1, 5).astype(int)):
        mass, stiffness = system.mass[i, :reducible, :reducible], system.stiffness[i, :reducible, :reducible]
        factor = np.linalg.inv(np.linalg.cholesky(mass))
        _, shapes = np.linalg.eigh(factor @ stiffness @ factor.T)
        forces = np.hstack([system.input_map[i, :reducible], system.stiffness[i, :reducible, reducible:]])
        static = np.linalg.solve(stiffness, forces[:, np.abs(forces).max(axis=0) > 0])
        # Static deflections in the length of the mass, as the modes have it: the cut-off below compares all of them.
        shapes_of_nodes += [factor.T @ shapes[:, :modes], static / np.linalg.norm(np.linalg.cholesky(mass).T @ static, axis=0)]
    factor_half_way = np.linalg.cholesky(system.mass[system.length.size // 2, :reducible, :reducible])
    # Orthonormal in the mass half way along the path; shapes that the others hold (ratio below 1e-4) would make it singular.
    u, singular, _ = np.linalg.svd(factor_half_way.T @ np.hstack(shapes_of_nodes), full_matrices=False)
    reduced = np.linalg.solve(factor_half_way.T, u[:, singular > 1e-4 * singular[0]][:, :max_size])
    if reduced.shape[1] >= reducible:
        return system
    basis = scipy.linalg.block_diag(reduced, np.eye(kept_count)) if kept_count else reduced
    mass, viscous, stiffness = (basis.T @ matrix @ basis for matrix in (system.mass, system.damping, system.stiffness))
    return VaryingSystem(system.length, mass, viscous, stiffness, basis.T @ system.input_map, system.output_map @ basis,
                         system.momentum_map @ basis)


@dataclass(frozen=True, eq=False)
class StepNodes:
    """Exact steps at the nodes, by columns for the kernel.

    Transition, static deflection to unit inputs, tip motion, momentum over the step, form of the energy lost, and motion of the
    inputs; `step` is the time step, s.
    """

    step: float
    transition: FloatArray
    deflection: FloatArray
    reading: FloatArray
    moving: FloatArray
    dissipation: FloatArray
    load_map: FloatArray


class NodeArrays(NamedTuple):
    """Matrices that the kernel blends between nodes, by columns.

    transition (N, z, z); deflection to unit inputs (N, w, n); reading, motion of the tip (N, 6, n); moving, momentum of the
    base per velocity over the step (N, 6, n); dissipation, form of the energy lost (N, z + w, z + w); load_map, motion of the
    inputs (N, w, n), the tip in cutter axes first; mass, stiffness (N, n, n).
    """

    transition: FloatArray
    deflection: FloatArray
    reading: FloatArray
    moving: FloatArray
    dissipation: FloatArray
    load_map: FloatArray
    mass: FloatArray
    stiffness: FloatArray


class CutArrays(NamedTuple):
    """Cutting force: mean of every step over a grid of feeds (F, m, 3), feedback of the chip (m, 3, 3), depth, m (0: none)."""

    table: FloatArray
    regeneration: FloatArray
    depth: float


class CourseArrays(NamedTuple):
    """Course of a run, by step.

    node : the node before; share : fraction of the way to the next; feed : over the largest of the table; loads : other inputs
    (k, w - 3).
    """

    node: IndexArray
    share: FloatArray
    feed: FloatArray
    loads: FloatArray

    @property
    def size(self) -> int:
        """Number of steps."""
        return self.share.size

    def at(self, steps: slice | IndexArray) -> CourseArrays:
        """Return some of the steps."""
        return CourseArrays(self.node[steps], self.share[steps], self.feed[steps], self.loads[steps])


class RunArrays(NamedTuple):
    """Values that a run carries from step to step.

    state (z,); delayed : tip in cutter axes over the last period; totals : sums of energy, J: work of the inputs, energy lost,
    sum of the sizes of the work, energy gained (empty: not summed).
    """

    state: FloatArray
    delayed: FloatArray
    totals: FloatArray


def step_nodes(system: VaryingSystem, step: float, *, with_energy: bool = False) -> StepNodes:
    """Return the exact step of every node; `with_energy` also the quadratic form of the energy lost in it."""
    dt = positive("step", step)
    transitions, losses = [], []
    for i in range(system.length.size):
        phi, form = _exact_step(system, i, dt, with_energy)
        transitions.append(phi.T)
        losses.append(form)
    deflection = np.swapaxes(np.linalg.solve(system.stiffness, system.input_map), 1, 2)
    momentum = system.momentum_map / dt
    contiguous = np.ascontiguousarray
    return StepNodes(dt, contiguous(transitions), contiguous(deflection), contiguous(system.output_map), contiguous(momentum),
                     contiguous(losses),
                     contiguous(np.swapaxes(system.input_map, 1, 2)))


def _exact_step(system: VaryingSystem, node: int, dt: float, with_energy: bool) -> tuple[FloatArray, FloatArray]:
    """Return the transition of one node, and the form Q of its loss: [x; f]^T Q [x; f] (Van Loan's integral)."""
    n, w = system.size, system.input_map.shape[-1]
    rates = np.linalg.solve(system.mass[node],
                            np.hstack([system.stiffness[node], system.damping[node], system.input_map[node]]))
    generator = np.zeros((2 * n + w, 2 * n + w))
    generator[:n, n:2 * n] = np.eye(n)
    generator[n:2 * n, :n], generator[n:2 * n, n:2 * n], generator[n:2 * n,
                                                                   2 * n:] = -rates[:, :n], -rates[:, n:2 * n], rates[:, 2 * n:]
    phi = scipy.linalg.expm(generator * dt)
    if not with_energy:
        return phi[:2 * n, :2 * n], np.zeros((1, 1))
    loss_rate = np.zeros_like(generator)
    loss_rate[n:2 * n, n:2 * n] = system.damping[node]
    # Van Loan, IEEE Trans. Automatic Control 23 (1978): expm([[-A^T, Q], [0, A]] t) holds the integral of e^(A^T t) Q e^(A t).
    # Stiff parts would overflow backwards in time, so it is summed over halves: Q(2t) = Q(t) + Phi(t)^T Q(t) Phi(t).
    # To a norm of one half, where the exponential with its reversed part is free of cancellation.
    halvings = max(0, int(np.ceil(np.log2(max(np.abs(generator).sum(axis=0).max() * dt, 1e-300)))) + 1)
    short_step = dt / 2**halvings
    n_states = len(generator)
    van_loan = scipy.linalg.expm(np.block([[-generator.T, loss_rate], [np.zeros_like(generator), generator]]) * short_step)
    power = van_loan[n_states:, n_states:]
    # The upper right block of Van Loan's matrix is e^(-A^T t) Q(t): the lower right one takes its factor off.
    form = power.T @ van_loan[:n_states, n_states:]
    for _ in range(halvings):
        form = form + power.T @ form @ power
        power = power @ power
    return phi[:2 * n, :2 * n], (form + form.T) / 2
