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
    """Matrices at nodes of a path.

    length : (N,) m, increasing; mass, damping, stiffness : (N, n, n); input_map : (N, n, w), the first three columns the tip's
    force in the cutter's axes; output_map : (N, 6, n), tip motion in machine axes; momentum_map : (N, 6, n), momentum about
    the machine's origin per velocity.
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
        """Return the system at every other node (and the last): what its error is judged by."""
        pick = np.unique(np.append(np.arange(0, self.length.size, 2), self.length.size - 1))
        return VaryingSystem(self.length[pick], self.mass[pick], self.damping[pick], self.stiffness[pick], self.input_map[pick],
                             self.output_map[pick], self.momentum_map[pick])

    def blended(self, name: str, at: float) -> FloatArray:
        """Return one of the matrices at a length, between nodes."""
        i = int(np.clip(np.searchsorted(self.length, at, side="right") - 1, 0, self.length.size - 2))
        t = (at - self.length[i]) / (self.length[i + 1] - self.length[i])
        matrices = getattr(self, name)
        return matrices[i] + t * (matrices[i + 1] - matrices[i])


def reduce_system(system: VaryingSystem, *, most: int = 64, modes: int = 30, kept: int = 0) -> VaryingSystem:
    """Return a system of more than `most` coordinates on a basis of fewer, the same all along: undamped modes and static
    deflections to all inputs at five nodes; smaller systems stay as they are.

    The last `kept` coordinates (motors, controllers) stay, and what moves with them is in the basis. Below the highest of those
    modes it answers as the whole does.
    """
    count = system.size - kept
    if count <= most:
        return system
    rows = []
    for i in np.unique(np.linspace(0, system.length.size - 1, 5).astype(int)):
        mass, stiffness = system.mass[i, :count, :count], system.stiffness[i, :count, :count]
        factor = np.linalg.inv(np.linalg.cholesky(mass))
        _, shapes = np.linalg.eigh(factor @ stiffness @ factor.T)
        pulls = np.hstack([system.input_map[i, :count], system.stiffness[i, :count, count:]])
        static = np.linalg.solve(stiffness, pulls[:, np.abs(pulls).max(axis=0) > 0])
        rows += [factor.T @ shapes[:, :modes], static / np.linalg.norm(np.linalg.cholesky(mass).T @ static, axis=0)]
    middle = np.linalg.cholesky(system.mass[system.length.size // 2, :count, :count])
    u, size, _ = np.linalg.svd(middle.T @ np.hstack(rows), full_matrices=False)
    part = np.linalg.solve(middle.T, u[:, size > 1e-4 * size[0]][:, :most])
    if part.shape[1] >= count:
        return system
    basis = scipy.linalg.block_diag(part, np.eye(kept)) if kept else part
    mass, viscous, stiffness = (basis.T @ matrix @ basis for matrix in (system.mass, system.damping, system.stiffness))
    return VaryingSystem(system.length, mass, viscous, stiffness, basis.T @ system.input_map, system.output_map @ basis,
                         system.momentum_map @ basis)


@dataclass(frozen=True, eq=False)
class StepNodes:
    """Exact steps at the nodes, by columns for the kernel: transition, static deflection to unit inputs, output, momentum, loss
    and input motion."""

    step: float
    transition: FloatArray
    deflection: FloatArray
    reading: FloatArray
    moving: FloatArray
    dissipation: FloatArray
    load_map: FloatArray


class NodeArrays(NamedTuple):
    """What the kernel blends between nodes, by columns: transition (N, z, z), static deflection to unit inputs (N, w, n),
    motion of the tip (N, 6, n), momentum of the base per velocity (N, 6, n), form of the energy lost, tip in cutter axes
    (N, 3, n)."""

    transition: FloatArray
    deflection: FloatArray
    reading: FloatArray
    moving: FloatArray
    dissipation: FloatArray
    load_map: FloatArray
    mass: FloatArray
    stiffness: FloatArray


class CutArrays(NamedTuple):
    """Mean force of every step over a grid of feeds (F, m, 3), feedback of the chip (m, 3, 3), and its depth, m (0: none)."""

    table: FloatArray
    regeneration: FloatArray
    depth: float


class CourseArrays(NamedTuple):
    """By step: node before, share of the way to the next, feed over the largest of the table, other loads (k, w - 3)."""

    node: IndexArray
    share: FloatArray
    feed: FloatArray
    loads: FloatArray

    def at(self, steps: slice | IndexArray) -> CourseArrays:
        """Return some of the steps."""
        return CourseArrays(self.node[steps], self.share[steps], self.feed[steps], self.loads[steps])


class RunArrays(NamedTuple):
    """What a run carries from step to step: state (z), tip in cutter axes over the last period, and the sums of energies:
    work of the inputs, energy lost, sum of the sizes of the work, energy gained (none: empty)."""

    state: FloatArray
    delayed: FloatArray
    totals: FloatArray


def step_nodes(system: VaryingSystem, step: float, *, with_energy: bool = False) -> StepNodes:
    """Return the exact step of every node; with_energy also the quadratic form of the energy lost in it."""
    dt = positive("step", step)
    transition, loss = [], []
    for i in range(system.length.size):
        phi, form = _exact(system, i, dt, with_energy)
        transition.append(phi.T)
        loss.append(form)
    still = np.swapaxes(np.linalg.solve(system.stiffness, system.input_map), 1, 2)
    moving = system.momentum_map / dt
    pack = np.ascontiguousarray
    return StepNodes(dt, pack(transition), pack(still), pack(system.output_map), pack(moving), pack(loss),
                     pack(np.swapaxes(system.input_map, 1, 2)))


def _exact(system: VaryingSystem, i: int, dt: float, with_energy: bool) -> tuple[FloatArray, FloatArray]:
    """Transition of one node, and the form Q of its loss: [x; f]^T Q [x; f] (Van Loan's integral)."""
    n, w = system.size, system.input_map.shape[-1]
    solve = np.linalg.solve(system.mass[i], np.hstack([system.stiffness[i], system.damping[i], system.input_map[i]]))
    whole = np.zeros((2 * n + w, 2 * n + w))
    whole[:n, n:2 * n] = np.eye(n)
    whole[n:2 * n, :n], whole[n:2 * n, n:2 * n], whole[n:2 * n, 2 * n:] = -solve[:, :n], -solve[:, n:2 * n], solve[:, 2 * n:]
    phi = scipy.linalg.expm(whole * dt)
    if not with_energy:
        return phi[:2 * n, :2 * n], np.zeros((1, 1))
    rate = np.zeros_like(whole)
    rate[n:2 * n, n:2 * n] = system.damping[i]
    # Van Loan, IEEE Trans. Automatic Control 23 (1978): expm([[-A^T, Q], [0, A]] t) holds the integral of e^(A^T t) Q e^(A t).
    # Stiff parts would overflow backwards in time, so it is summed over halves: Q(2t) = Q(t) + Phi(t)^T Q(t) Phi(t).
    halvings = max(0, int(np.ceil(np.log2(max(np.abs(whole).sum(axis=0).max() * dt, 1e-300)))) + 1)
    small = dt / 2**halvings
    size = len(whole)
    block = scipy.linalg.expm(np.block([[-whole.T, rate], [np.zeros_like(whole), whole]]) * small)
    part = block[size:, size:]
    form = part.T @ block[:size, size:]
    for _ in range(halvings):
        form = form + part.T @ form @ part
        part = part @ part
    return phi[:2 * n, :2 * n], (form + form.T) / 2
