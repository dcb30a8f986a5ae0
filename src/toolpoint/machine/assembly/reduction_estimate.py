r"""Bound of the rise of a machine's natural frequencies by the reduction of elastic bodies, at a pose: Kato and Temple.

A reduced mode is taken into the whole machine, every finite element of its bodies. There it leaves forces r in the elastic
bodies alone. Joints and rigid bodies only add stiffness and mass to those of the free bodies, so
:math:`\rho^2 = \sum_b r_b^T (K_b + s_b M_b)^{-1} r_b` is no less than the same in the whole machine with
:math:`s \ge s_b`, whichever wrenches the joints pass on; those of the reduced mode itself make it small. They follow from
balance: what a joint carries is the sum of the inertial wrenches beyond it, and loop joints bring theirs.
The bound is that of `substructuring.estimate`, and holds where no mode is missing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._notebook import NotebookText
from toolpoint.bodies import Body
from toolpoint.machine.assembly import preload
from toolpoint.machine.assembly.joint_terms import joint_matrices, loop_directions, loop_frame, loop_motion
from toolpoint.machine.assembly.mesh_estimate import mesh_errors
from toolpoint.machine.assembly.shapes import RIGID_FREQUENCY_FRACTION
from toolpoint.machine.assembly.system import loop_basis, mass_matrix
from toolpoint.machine.parts.model import LoopJoint, Machine
from toolpoint.machine.pose.placement import Placement, body_coordinates, place_machine
from toolpoint.spatial import transform as tf
from toolpoint.substructuring.estimate import MAX_TRUSTED_ERROR, bound_errors
from toolpoint.substructuring.reach import MIN_TRUSTED_REACH_RATIO
from toolpoint.vibration.eigen import mass_normalised, natural_omega


@dataclass(frozen=True, eq=False)
class ReductionEstimate(NotebookText):
    """Estimates of how much too high the lowest natural frequencies at a pose are, by the reduction of elastic bodies.

    frequency : (modes,), Hz; error : (modes,), relative, at least the true one where `is_sure`; sure_to : Hz, up to which no
    mode can be missing; is_sure : (modes,) bool, whether the mode is below that, and the estimate small enough to be believed;
    mesh : (modes,), by how much the meshes raise each frequency besides, about, relative; None where they are not known.
    """

    frequency: FloatArray
    error: FloatArray
    sure_to: float
    mesh: FloatArray | None = None

    @property
    def largest(self) -> float:
        """Largest error by reduction or mesh; infinite where one is not to be believed."""
        mesh = 0.0 if self.mesh is None else float(self.mesh.max(initial=0.0))
        return max(mesh, float(np.where(self.is_sure, self.error, np.inf).max(initial=0.0)))

    @property
    def is_sure(self) -> np.ndarray:
        """Whether each estimate is to be believed."""
        return (self.frequency <= self.sure_to) & (self.error <= MAX_TRUSTED_ERROR)

    def __repr__(self) -> str:
        sure = self.is_sure
        return (f"ReductionEstimate({sure.sum()} of {sure.size} modes sure, within "
                f"{100 * self.error[sure].max(initial=0.0):.2g} %)")


def can_estimate(machine: Machine) -> bool:
    """Return whether the machine has reduced bodies, and all of them keep what an estimate needs."""
    elastic = [body for body in machine.bodies if body.modal_count]
    return bool(elastic) and all(body.residual is not None for body in elastic)


def estimate_reduction(machine: Machine, pose: Mapping[str, float] | None = None, modes: int = 10) -> ReductionEstimate | None:
    """Return the estimates at one pose (m, rad), at standstill; None where `can_estimate` is false.

    What meshes err by stands beside it (`mesh`). What the tables of sliding places do between their entries is not in it; nor,
    where gravity or loads act, what these do through motions finer than the reduced ones.
    """
    if not can_estimate(machine):
        return None
    place = place_machine(machine, pose)
    mass, stiffness, geometric = _tree_matrices(place)
    basis = loop_basis(place) if machine.loops else None
    basis_vectors = np.eye(machine.size) if basis is None else basis[0]
    reduced = basis_vectors.T @ mass @ basis_vectors, basis_vectors.T @ (stiffness + geometric) @ basis_vectors
    squares, shapes = mass_normalised(*reduced)
    omega = natural_omega(squares, *reduced)
    vectors = basis_vectors @ shapes
    # What locked loops carry, in the tree's coordinates
    forces = (stiffness + geometric) @ vectors - (mass @ vectors) * squares
    wrenches = _ModeWrenches.balanced(place, vectors, squares, forces=forces)
    residual, tables = np.zeros((2, len(squares)))
    shift, reach = 0.0, np.inf
    for link, body in enumerate(machine.bodies):
        if body.residual is not None and body.modal_count:
            squared, work = _body_residual(place, link, wrenches)
            residual, tables = residual + squared, tables + work
            shift, reach = max(shift, body.residual.shift), min(reach, body.residual.reach)
    shifted = basis_vectors.T @ (stiffness + shift * mass) @ basis_vectors
    residual = residual / max(1 - _softening_fraction(basis_vectors.T @ geometric @ basis_vectors, shifted), 1e-300)
    # What tables of sliding places leave out is work as well: it adds to the square, so to the bound.
    error = bound_errors(squares, residual, shift) + tables / np.maximum(squares, 1e-300)
    count = min(modes, len(squares))
    frequency = omega[:count] / (2 * np.pi)
    is_held = frequency > RIGID_FREQUENCY_FRACTION * frequency.max(initial=0.0)
    return ReductionEstimate(frequency, np.where(is_held, error[:count], 0.0), reach / MIN_TRUSTED_REACH_RATIO,
                             mesh_errors(machine, omega[:count], vectors[:, :count]))


def _tree_matrices(place: Placement) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return mass, stiffness and geometric stiffness at the pose in the tree's coordinates, (n, n) each."""
    mass = mass_matrix(place)[0]
    extra = np.broadcast_to(preload.geometric_stiffness(place), (place.poses, *mass.shape))[0]
    return mass, joint_matrices(place)[0][0], extra


def _softening_fraction(extra: FloatArray, bare: FloatArray) -> float:
    """Return the largest share of the shifted stiffness that preload takes away: the flexibility is larger by it."""
    if not extra.any():
        return 0.0
    return max(0.0, -float(mass_normalised(bare, extra)[0][0]))


@dataclass(frozen=True, eq=False)
class _ModeWrenches:
    """Vectors (n, modes) and squares (modes,) of all modes, with the wrenches that they put on the joints.

    joints : (n_links, 6, modes), of every link, the wrench that it and all beyond it ask of its joint; loops : of every loop
    joint, the wrench (6, modes) on its child; in machine axes about the machine's origin.
    """

    vectors: FloatArray
    squares: FloatArray
    joints: FloatArray
    loops: list[FloatArray]

    @classmethod
    def balanced(cls, place: Placement, vectors: FloatArray, squares: FloatArray, *, forces: FloatArray) -> _ModeWrenches:
        """Return the wrenches in balance with the inertia of all links and with the loop joints."""
        machine = place.machine
        loops = _loop_wrenches(place, vectors, forces)
        joints = np.zeros((len(machine.bodies), 6, len(squares)))
        for link, body in enumerate(machine.bodies):
            inertial = -(body.mass[:6] @ body_coordinates(place, link)[0] @ vectors) * squares
            joints[link] += tf.adjoint(tf.inverse(place.frames[0, link])).T @ inertial
        for loop, wrench in zip(machine.loops, loops, strict=True):
            for link, sign in ((loop.child, 1.0), (loop.parent, -1.0)):
                if link >= 0:
                    joints[link] += sign * wrench
        # Children have larger numbers: from the tips inwards every joint has all that hangs on it.
        for link in reversed(range(len(joints))):
            if machine.chain.parents[link] >= 0:
                joints[machine.chain.parents[link]] += joints[link]
        return cls(vectors, squares, joints, loops)


def _loop_wrenches(place: Placement, vectors: FloatArray, forces: FloatArray) -> list[FloatArray]:
    """Return the wrenches of loop joints on their children; those of locked directions balance the tree's forces."""
    machine = place.machine
    motions = [loop_motion(place, loop)[0] for loop in machine.loops]
    locked = [[way for way in range(6) if loop.law.states[way] == "locked"] for loop in machine.loops]
    rows = np.concatenate([motion[ways] for motion, ways in zip(motions, locked, strict=True)] or [np.zeros((0, machine.size))])
    # Forces of metres and of radians are compared by the acceleration that they give: the square root of the inertia.
    scale = 1 / np.sqrt(np.diagonal(mass_matrix(place)[0]))[:, None]
    multipliers = np.linalg.lstsq(scale * rows.T, -scale * forces, rcond=1e-12)[0] if len(rows) else rows @ vectors
    result, first = [], 0
    for loop, motion, ways in zip(machine.loops, motions, locked, strict=True):
        local = loop.law.stiffness @ motion @ vectors
        local[ways] += multipliers[first:first + len(ways)]
        first += len(ways)
        result.append(_from_loop(place, loop) @ local)
    return result


def _from_loop(place: Placement, loop: LoopJoint) -> FloatArray:
    """Return the map (6, 6) of forces along a loop joint's directions to wrenches in machine axes about the origin."""
    to_frame = tf.adjoint(tf.inverse(loop_frame(place, loop)))[0]
    directions = loop_directions(place, loop)
    return to_frame.T if directions is None else to_frame.T @ np.linalg.inv(directions[0]).T


def _body_residual(place: Placement, link: int, modes: _ModeWrenches) -> tuple[FloatArray, FloatArray]:
    """Return rho^2 (modes,) of one elastic body, and the work (modes,) of its sliding places over the error of their tables."""
    body = place.machine.bodies[link]
    residual_form = body.residual
    assert residual_form is not None
    amplitudes = body_coordinates(place, link)[0] @ modes.vectors
    rigid, elastic = amplitudes[:6], amplitudes[6:]
    loads, tables = np.zeros((residual_form.load_count, len(modes.squares))), np.zeros(len(modes.squares))
    elastic_forces = body.stiffness @ elastic - (body.mass[6:] @ amplitudes) * modes.squares
    for name, joint_place, wrench in _acting_places(place, link, modes):
        position, participation, way = _interface(body, name, place, link, joint_place)
        local_wrench = tf.adjoint(place.frames[0, link] @ tf.transform(None, position)).T @ wrench
        loads += residual_form.loads(name, local_wrench, way)
        elastic_forces += participation.T @ local_wrench
        if way is not None and (slide := body.interfaces[name].slide) is not None:
            tables += np.abs(np.einsum("im,eij,jm->em", local_wrench, slide.deviation(way), elastic)).max(axis=0)
    # Preload's forces through finer motions are not known: what is left over is taken as spread like inertia.
    unbalanced = np.linalg.solve(body.mass[6:, 6:], elastic_forces)
    return residual_form.squared(-rigid * modes.squares, elastic, heavy=-elastic * modes.squares - unbalanced,
                                 loads=loads), tables


def _acting_places(place: Placement, link: int, modes: _ModeWrenches) -> list[tuple[str, FloatArray, FloatArray]]:
    """Return the interfaces of a body through which joints act, the place (3,) of each joint, and its wrench about the
    origin."""
    machine, result = place.machine, []
    for i, parent in enumerate(machine.chain.parents):
        above, below = machine.interfaces[i]
        joint_place = place.joint_frames[0, i, :3, 3]
        if parent == link and above is not None:
            result.append((above, joint_place, modes.joints[i]))
        if i == link and below is not None:
            result.append((below, joint_place, -modes.joints[i]))
    for loop, wrench in zip(machine.loops, modes.loops, strict=True):
        joint_place = loop_frame(place, loop)[0, :3, 3]
        for side, name, sign in ((loop.child, loop.child_interface, 1.0), (loop.parent, loop.parent_interface, -1.0)):
            if side == link and name is not None:
                result.append((name, joint_place, sign * wrench))
    return result


def _interface(body: Body, name: str, place: Placement, link: int, joint_place: FloatArray
               ) -> tuple[FloatArray, FloatArray, float | None]:
    """Return position (3,) and participation (6, m) of an interface, and its travel to the joint's place, m."""
    interface_part = body.interfaces[name]
    if interface_part.slide is None or interface_part.along is None:
        return interface_part.position, body.participation(name), None
    local = tf.move(tf.inverse(place.frames[0, link]), joint_place[None])
    position, participation = interface_part.slid_to(local)
    return position[0], participation[0], float((local[0] - interface_part.position) @ interface_part.along)
