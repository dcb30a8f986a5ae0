"""Natural frequencies of closed machines of rigid bodies by compiled kernels; refuses what these cannot solve."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import qr

from toolpoint._check import BoolArray, FloatArray, IndexArray, fail
from toolpoint.kinematics import ClosedChain, Pose
from toolpoint.kinematics.closure import Solution
from toolpoint.kinematics.reach import first_fault, limit_reasons
from toolpoint.machine.assembly.joint_terms import has_travelling_stiffness, joint_matrices, loop_directions, loop_motion
from toolpoint.machine.assembly.system import loop_basis
from toolpoint.machine.frequencies.tree_arrays import body_moments, paths_of
from toolpoint.machine.parts.model import Machine
from toolpoint.machine.pose.placement import place_machine

POSE_CHUNK_SIZE = 4096  # poses whose matrices are held at once


@dataclass(frozen=True, eq=False)
class _Arrays:
    """Arrays of a closed machine for the kernels."""

    tree: tuple[Any, ...]
    ways: IndexArray
    loops: tuple[Any, ...]
    passive: IndexArray
    balls: IndexArray
    scale: FloatArray
    start: FloatArray
    determinant_sign: float


def solve_closed(machine: Machine, poses: Pose, mode_count: int) -> tuple[FloatArray, BoolArray]:
    """Return the lowest natural frequencies, Hz, (n_poses, number), and which poses the kernels settled.

    Raises ToolpointError for what the kernels cannot do, and for poses beyond the limits of joints.
    """
    from toolpoint.machine.frequencies import closed_kernel, condense_kernel, kernel

    chain = machine.chain
    assert isinstance(chain, ClosedChain)
    _check(machine, chain)
    arrays, parts = _arrays(chain), _parts(machine)
    goals = chain.driven_values(chain.positions(poses))[:, :arrays.passive[0]]
    values, settled = np.empty((len(goals), len(chain.steps))), np.zeros(len(goals), bool)
    closed_kernel.settle_poses(arrays.tree, arrays.ways, arrays.loops, arrays.passive, arrays.balls, arrays.scale,
                               arrays.start, np.ascontiguousarray(goals), arrays.determinant_sign, values, settled)
    _check_limits(chain, poses, values, settled)
    size = parts[2].size
    mass, stiffness = np.empty((POSE_CHUNK_SIZE, size, size)), np.empty((POSE_CHUNK_SIZE, size, size))
    result, identity = np.empty((len(goals), mode_count)), np.eye(size)
    tree_stiffness = _tree_stiffness(machine)
    elastic = np.array([loop.law.stiffness for loop in machine.loops])
    moments, columns, places = body_moments(machine), _columns(machine), (*_row_places(machine, parts[0]), parts[1], parts[2])
    for start in range(0, len(goals), POSE_CHUNK_SIZE):
        chunk = slice(start, start + POSE_CHUNK_SIZE)
        count = len(values[chunk])
        condense_kernel.condense_matrices(arrays.tree, arrays.ways, arrays.loops, values[chunk], moments, columns, elastic,
                                          places, tree_stiffness, mass[:count], stiffness[:count], settled[chunk])
        condense_kernel.scale_by_stiffness(mass[:count], stiffness[:count], settled[chunk])
        # Poses that the kernels left out get a matrix with eigenvalues: NumPy answers for them afterwards.
        mass[:count][~settled[chunk]] = identity
        kernel.largest_scaled_eigenvalues(mass[:count], identity, True, mode_count, result[chunk])
    return 1 / (2 * np.pi * np.sqrt(result)), settled


def _check(machine: Machine, chain: ClosedChain) -> None:
    """Refuse machines that the kernels cannot solve, with the reason."""
    if any(body.modal_count for body in machine.bodies):
        fail("path", "'compiled' for a machine with elastic bodies", "needs rigid bodies", remedy="use path='numpy'")
    if has_travelling_stiffness(machine):
        fail("path", "'compiled' for a machine with a joint that follows an axis", "needs a stiffness that stands",
             remedy="use path='numpy'")
    if machine.description.gravity is not None or machine.description.loads:
        fail("path", "'compiled' for a machine with preload", "needs a stiffness without preload", remedy="use path='numpy'")
    place = place_machine(machine)
    if not chain.passive or chain.closure.solved_as != "square" or any(
            loop_directions(place, loop) is not None for loop in machine.loops):
        fail("path", "'compiled' for these loops", "needs as many passive joints as closed directions, and loop joints that "
             "are hinges, balls or fixed", remedy="use path='numpy'")


def _check_limits(chain: ClosedChain, poses: Pose, values: FloatArray, settled: BoolArray) -> None:
    """Raise for the first pose beyond a limit of a joint."""
    if not chain.limits and not any(np.isfinite(loop.largest_tilt) for loop in chain.loops):
        return
    solution = Solution(values, settled.astype(float), ("",) * len(values))
    reasons = [reason if good else "" for reason, good in zip(limit_reasons(chain, solution), settled, strict=True)]
    first_fault(chain, poses, Solution(values, solution.part, tuple(reasons)))


def _arrays(chain: ClosedChain) -> _Arrays:
    """Return chain, loops and start of a closed chain as arrays."""
    first, order, ball = [0], [], []
    for sequence in chain.sequences:
        for group in sequence:
            order += list(group)
            ball += [len(group) == 3] * len(group)
        first.append(len(order))
    tree = (np.array(chain.parents, np.int64), np.ascontiguousarray(chain.frames[:, :3, :3]),
            np.ascontiguousarray(chain.frames[:, :3, 3]), np.array(first), np.array(order), np.array(ball))
    closure = chain.closure
    loops, rows = chain.loops, [(i, way) for i, loop in enumerate(chain.loops) for way in loop.rows]
    turning = np.array([[len(loop.turning), *loop.turning, 0, 0, 0][:4] for loop in loops])
    frames = np.array([loop.frame for loop in loops])
    described = (np.array([loop.parent for loop in loops]), np.array([loop.child for loop in loops]),
                 np.ascontiguousarray(frames[:, :3, :3]), np.ascontiguousarray(frames[:, :3, 3]), turning,
                 np.array([row[0] for row in rows]), np.array([row[1] for row in rows]), np.ascontiguousarray(closure.weights),
                 np.ascontiguousarray(closure.signs))
    start = np.array(chain.start)
    hand = float(closure.determinant_sign(closure.evaluate(start, {})[1])[0])
    return _Arrays(tree, np.array([step.way for step in chain.steps]), described, np.array(chain.passive_steps),
                   np.array(chain.balls, np.int64).reshape(-1, 3), np.array(closure.scale), start[0].copy(), hand)


def _parts(machine: Machine) -> tuple[IndexArray, IndexArray, IndexArray]:
    """Return the independent rows of the locked directions, and dependent and independent coordinates, at the reference
    pose."""
    place = place_machine(machine)
    basis = loop_basis(place)
    n = machine.size
    free = n if basis is None else int(basis.shape[-1])
    rows = np.concatenate([loop_motion(place, loop)[0, _locked(loop.law.states)] for loop in machine.loops])
    rank = n - free
    # Pivoting takes the rows farthest from dependent first; the same of the columns gives coordinates that the loops
    # determine well.
    kept = np.sort(qr(rows.T, pivoting=True)[2][:rank])
    dependent = np.sort(qr(rows[kept], pivoting=True)[2][:rank]) if rank else np.zeros(0, int)
    return kept, dependent, np.setdiff1d(np.arange(n), dependent)


def _locked(states: tuple[str, ...]) -> list[int]:
    return [i for i in range(6) if states[i] == "locked"]


def _row_places(machine: Machine, kept_rows: IndexArray) -> tuple[IndexArray, IndexArray]:
    """Return loop and direction of the rows kept."""
    locked_rows = np.array([(i, way) for i,
                            loop in enumerate(machine.loops) for way in _locked(loop.law.states)]).reshape(-1, 2)
    return np.ascontiguousarray(locked_rows[kept_rows, 0]), np.ascontiguousarray(locked_rows[kept_rows, 1])


def _tree_stiffness(machine: Machine) -> FloatArray:
    """Return the stiffness of the joints of the tree alone, (n, n): that of the loops depends on the pose."""
    place = place_machine(machine)
    total = joint_matrices(place)[0][0].copy()
    for loop in machine.loops:
        motion = loop_motion(place, loop)[0]
        total -= motion.T @ loop.law.stiffness @ motion
    return np.where(np.abs(total) < 1e-9 * np.abs(total).max(), 0.0, total)


def _columns(machine: Machine) -> tuple[Any, ...]:
    """Return link, motion, step (of a second passive rotation, else -1) of every coordinate; paths; carriers of the springs."""
    link = np.concatenate([[i] * len(law.freedoms) for i, law in enumerate(machine.joints)]).astype(np.int64)
    way = np.concatenate([list(law.freedoms) for law in machine.joints]).astype(np.int64)
    step = np.full(link.size, -1)
    for k in range(link.size):
        passive_turns = machine.passive_turns[link[k]]
        if way[k] in passive_turns:
            step[k] = next(s for s, chain_step in enumerate(machine.chain.steps)
                           if (chain_step.joint, chain_step.way) == (link[k], way[k]))
    motion = np.ascontiguousarray(np.concatenate([law.basis.T for law in machine.joints]))
    return link, motion, step, paths_of(machine), np.array(machine.elastic_at_child)
