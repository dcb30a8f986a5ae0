"""Natural frequencies of a machine at many poses, without shapes: a NumPy path and a compiled path, same results."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from toolpoint._check import FloatArray, count, fail, one_of
from toolpoint._threads import on_one_thread
from toolpoint.kinematics import Pose
from toolpoint.machine.assembly.gyroscopics import elastic_spins, gyroscopic_matrix, spins
from toolpoint.machine.assembly.joint_terms import has_travelling_stiffness, joint_matrices
from toolpoint.machine.assembly.system import equations, freedoms, mass_matrix
from toolpoint.machine.frequencies.closed import POSE_CHUNK_SIZE, solve_closed
from toolpoint.machine.frequencies.tree_arrays import POSE_BLOCK_SIZE, tree_arrays
from toolpoint.machine.parts.model import Machine
from toolpoint.machine.pose.placement import place_machine
from toolpoint.vibration.eigen import natural_omega, natural_squares
from toolpoint.vibration.gyroscopic import whirl_omega

_MAX_MASS_ENTRIES = 2**21  # of all mass matrices that are held at once: 16 MB


@on_one_thread
def natural_frequencies(machine: Machine, poses: Pose, modes: int = 6, *, path: str = "numpy") -> FloatArray:
    r"""Return the lowest undamped natural frequencies, Hz, shape (n_poses, modes).

    The stiffness of a tree does not depend on the pose: with :math:`K = L L^T` the largest eigenvalues of
    :math:`L^{-1} M L^{-T}` are :math:`1/\omega^2`, a standard problem. Loops, preload and free directions take the
    general problem instead.

    Parameters
    ----------
    machine : Machine
    poses : mapping of axis name to (n_poses,) positions, m or rad
    modes : int
        At most the number of coordinates.
    path : str
        ``numpy``, or ``compiled`` (trees, and closed machines of rigid bodies, without preload; others are refused with the
        reason). With elastic bodies the eigenvalues alone are compiled: nine tenths of the time are theirs.

    >>> import numpy as np
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> table = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> guide = JointDescription("ground", "table", stiffness={"x": 1e7})
    >>> frequencies = natural_frequencies(build(MachineDescription("slide", {"table": table}, {"guide": guide})), {}, modes=1)
    >>> np.allclose(frequencies, np.sqrt(1e7 / 100) / (2 * np.pi))
    True
    """
    one_of("path", path, ("numpy", "compiled"))
    number = min(count("modes", modes), freedoms(machine))
    if spins(machine) or elastic_spins(machine):
        return _whirl_frequencies(machine, poses, number, path)
    if path == "compiled" and machine.loops:
        return _closed_frequencies(machine, poses, number)
    factor = _inverse_factor(machine)
    if path == "compiled":
        return _compiled_frequencies(machine, poses, number, factor)
    return np.concatenate([
        _general_frequencies(machine, chunk, number) if factor is None
        else _constant_frequencies(machine, chunk, number, factor)
        for chunk in machine.chain.chunks(poses, _chunk_size(machine))])


def _chunk_size(machine: Machine) -> int:
    """Return how many poses are taken at once: thousands of a rigid machine, fewer of one with many coordinates."""
    blocks = _MAX_MASS_ENTRIES // machine.size**2 // POSE_BLOCK_SIZE
    return int(np.clip(blocks * POSE_BLOCK_SIZE, POSE_BLOCK_SIZE, POSE_CHUNK_SIZE))


def _whirl_frequencies(machine: Machine, poses: Pose, number: int, path: str) -> FloatArray:
    """Return the frequencies of a machine with spinning bodies: forward and backward whirl, by the gyroscopic pencil."""
    if path == "compiled":
        fail("path", "'compiled' for a machine with spinning bodies", "needs a machine at standstill",
             remedy="use path='numpy'")
    parts = []
    for chunk in machine.chain.chunks(poses, _chunk_size(machine)):
        place = place_machine(machine, chunk)
        mass, stiffness, _, _, basis = equations(place)
        gyroscopic = gyroscopic_matrix(place)
        assert gyroscopic is not None
        if basis is not None:
            gyroscopic = np.swapaxes(basis, -1, -2) @ gyroscopic @ basis
        parts.append(whirl_omega(mass, gyroscopic, stiffness)[:, :number] / (2 * np.pi))
    return np.concatenate(parts)


def _closed_frequencies(machine: Machine, poses: Pose, number: int) -> FloatArray:
    """Return the frequencies by the kernels of closed chains; NumPy takes the poses that they do not settle, and gives the
    reason."""
    values, settled = solve_closed(machine, poses, number)
    if not settled.all():
        unsettled_poses = {name: positions[~settled] for name, positions in machine.chain.batch(poses).items()}
        values[~settled] = natural_frequencies(machine, unsettled_poses, number)
    return values


def _constant_frequencies(machine: Machine, poses: Pose, number: int, factor: FloatArray) -> FloatArray:
    """Return the frequencies of a machine of constant stiffness, by the eigenvalues of L^-1 M L^-T."""
    mass = mass_matrix(place_machine(machine, poses))
    scale = np.diag(factor)
    # A machine without coupled springs has a diagonal factor: scaling in place of two products of matrices.
    values = np.linalg.eigvalsh(mass * (scale[:, None] * scale) if _is_diagonal(factor) else factor @ mass @ factor.T)
    return 1 / (2 * np.pi * np.sqrt(values[:, ::-1][:, :number]))


def _general_frequencies(machine: Machine, poses: Pose, number: int) -> FloatArray:
    """Return the frequencies by the general symmetric problem."""
    mass, stiffness, *_ = equations(place_machine(machine, poses))
    return natural_omega(natural_squares(mass, stiffness), mass, stiffness)[..., :number] / (2 * np.pi)


def _inverse_factor(machine: Machine) -> FloatArray | None:
    """Return L^-1 of the pose-independent stiffness, or None where the stiffness is singular or depends on the pose."""
    description = machine.description
    if machine.loops or description.gravity is not None or description.loads or has_travelling_stiffness(machine):
        return None
    stiffness = joint_matrices(place_machine(machine))[0][0]
    try:
        # Cholesky is the test, too: a free direction has no stiffness, and the factor does not exist.
        return np.linalg.inv(np.linalg.cholesky(stiffness))
    except np.linalg.LinAlgError:
        return None


def _compiled_frequencies(machine: Machine, poses: Pose, number: int, factor: FloatArray | None) -> FloatArray:
    """Return the frequencies by compiled eigenvalues of L^-1 M L^-T."""
    if factor is None:
        fail("path", "'compiled' for a machine with loops, preload, free directions or a joint that follows an axis",
             "needs a constant, positive definite stiffness", remedy="use path='numpy'")
    from toolpoint.machine.frequencies import kernel

    diagonal, parts = _is_diagonal(factor), []
    for mass in _elastic_masses(machine, poses) if _has_elastic_bodies(machine) else _rigid_masses(machine, poses):
        values = np.empty((len(mass), number))
        kernel.largest_scaled_eigenvalues(mass, factor, diagonal, number, values)
        parts.append(values)
    return 1 / (2 * np.pi * np.sqrt(np.concatenate(parts)))


def _has_elastic_bodies(machine: Machine) -> bool:
    return any(body.modal_count for body in machine.bodies)


def _elastic_masses(machine: Machine, poses: Pose) -> Iterator[FloatArray]:
    """Yield mass matrices of poses, a chunk at a time, by NumPy: most of an elastic machine's time goes to its eigenvalues."""
    for chunk in machine.chain.chunks(poses, _chunk_size(machine)):
        yield np.ascontiguousarray(mass_matrix(place_machine(machine, chunk)))


def _rigid_masses(machine: Machine, poses: Pose) -> Iterator[FloatArray]:
    """Yield mass matrices of poses of a tree of rigid bodies, a chunk at a time, by composite inertias."""
    from toolpoint.machine.frequencies import kernel

    step_values, data = machine.chain.step_values(poses), tree_arrays(machine)
    matrices = np.empty((min(len(step_values), POSE_CHUNK_SIZE), machine.size, machine.size))
    for start in range(0, len(step_values), POSE_CHUNK_SIZE):
        chunk = np.ascontiguousarray(step_values[start:start + POSE_CHUNK_SIZE])
        kernel.tree_mass_matrices(*data, chunk, matrices[:len(chunk)])
        yield matrices[:len(chunk)]


def _is_diagonal(factor: FloatArray) -> bool:
    return bool(np.count_nonzero(factor) == np.count_nonzero(np.diag(factor)))
