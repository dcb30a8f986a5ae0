r"""Static equilibrium under gravity and loads, and the geometric stiffness that preload gives, also through ideal joints.

The described pose is taken as the place where the loads have come to rest: springs carry them as preload, free
directions must be in balance. Every joint moves by one exponential of its coordinates, so the second derivative of a
point on the path is :math:`\partial^2 p/\partial q_a \partial q_b = \omega_a \times u_b` (a nearer to the ground, u_b the
point's velocity), and the second derivative of a loop's closure is half a Lie bracket of twists.
Source: for the second-order kinematics, Murray, Li, Sastry, chapter 3; for semi-tangential moments, Argyris et al.,
Comput. Methods Appl. Mech. Eng. 14 (1978).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.kinematics import Pose
from toolpoint.machine.assembly.joint_terms import joint_matrices, loop_directions, loop_frame, loop_motion
from toolpoint.machine.parts.model import LoopJoint, Machine
from toolpoint.machine.pose.placement import Placement, place_machine
from toolpoint.spatial import transform as tf
from toolpoint.spatial.rotation import skew


@dataclass(frozen=True, eq=False)
class StaticEquilibrium:
    """Linear static equilibrium at one pose.

    coordinates : (n,), static deflection of the tree's coordinates, m and rad.
    points : point name to its static displacement (v, w), m and rad.
    reactions : joint name to the wrench (f, m) that the parent side exerts on the child side, machine axes, about the joint.
    """

    coordinates: FloatArray
    points: dict[str, FloatArray]
    reactions: dict[str, FloatArray]


@dataclass(frozen=True, eq=False)
class _Force:
    """Force and moment on a link, at a place (P, 3), in machine axes; `interface` where the body is elastic there."""

    link: int
    interface: str | None
    place: FloatArray
    force: FloatArray
    moment: FloatArray


def geometric_stiffness(place: Placement) -> FloatArray | float:
    """Return the geometric stiffness of gravity, loads and loop preload in the tree's coordinates, (P, n, n), or 0.0."""
    forces = _forces(place)
    if not forces:
        return 0.0
    total = np.zeros((place.poses, place.machine.size, place.machine.size))
    for force in forces:
        total += _force_stiffness(place, force)
    _, wrenches = _balance(place, forces)
    for loop, wrench in zip(place.machine.loops, wrenches, strict=True):
        total += _loop_stiffness(place, loop, wrench)
    return total


def static_equilibrium(machine: Machine, pose: Pose | None = None) -> StaticEquilibrium:
    """Return deflections and joint reactions under the machine's gravity and loads, linear, at one pose.

    Raises ToolpointError where free directions are out of balance, or where there is neither gravity nor a load.

    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> table = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> guide = JointDescription("ground", "table", stiffness={"z": 1e7})
    >>> machine = build(MachineDescription("slide", {"table": table}, {"guide": guide}, gravity=(0.0, 0.0, -10.0)))
    >>> static_equilibrium(machine).reactions["guide"][2].item()  # N, the weight
    1000.0
    """
    place = place_machine(machine, pose)
    if place.poses != 1:
        fail("pose", f"{place.poses} poses", "must be one")
    forces = _forces(place)
    if not forces:
        fail("machine", "neither gravity nor loads", "must have one of them",
             remedy="add gravity: [0, 0, -9.80665] to the file")
    deflection, wrenches = _balance(place, forces)
    points: dict[str, FloatArray] = {
        name: (place.point_jacobian(name) @ deflection[..., None])[0, :, 0] for name in machine.description.points}
    return StaticEquilibrium(deflection[0], points, _reactions(place, forces, wrenches))


def _forces(place: Placement) -> list[_Force]:
    machine = place.machine
    result = []
    gravity = machine.description.gravity
    if gravity is not None and np.any(gravity):
        g = np.asarray(gravity, float)
        for i, body in enumerate(machine.bodies):
            mass = body.mass[0, 0]
            if mass <= 0:
                continue
            first_moment = body.mass[3:6, :3] / mass
            # The lower left block of a spatial inertia is m [c]: its entries are the centre of mass.
            centre = np.array([first_moment[2, 1], first_moment[0, 2], first_moment[1, 0]])
            centre_place = tf.move(place.frames[:, i], centre[None])[:, 0]
            result.append(_Force(i, None, centre_place, mass * g, np.zeros(3)))
    for load in machine.description.loads:
        if load.point not in machine.description.points:
            fail("loads.point", f"no point {load.point!r}", f"must be of {', '.join(machine.description.points)}")
        point = machine.description.points[load.point]
        result.append(_Force(machine.link(point.body), point.interface, place.position(point),
                             np.asarray(load.force, float), np.asarray(load.moment, float)))
    return [force for force in result if force.link >= 0]


def _body_jacobian(place: Placement, force: _Force) -> FloatArray:
    """Return the Jacobian (P, 6, n) of the body, or of the interface, at which a force acts."""
    if force.interface is None:
        return place.jacobians[:, force.link]
    return place.jacobian(force.link, force.interface)


def _generalised(place: Placement, forces: list[_Force]) -> FloatArray:
    """Return the generalised forces (P, n) of weights and loads."""
    total = np.zeros((place.poses, place.machine.size))
    gravity = place.machine.description.gravity
    for force in forces:
        jacobian = _body_jacobian(place, force)
        velocity = tf.point_velocity(force.place) @ jacobian
        total += force.force @ velocity + force.moment @ jacobian[:, 3:]
    for i, body in enumerate(place.machine.bodies):
        if body.modal_count and gravity is not None:
            # Gravity acts on the modal coordinates through their coupling with the body's translation.
            local = np.swapaxes(place.frames[:, i, :3, :3], -1, -2) @ np.asarray(gravity, float)
            total[:, list(place.machine.modal_columns[i])] += local @ body.mass[:3, 6:]
    return total


def _force_stiffness(place: Placement, force: _Force) -> FloatArray:
    """Return the geometric stiffness of one force and its semi-tangential moment, (P, n, n)."""
    jacobian = _body_jacobian(place, force)
    turn, velocity = jacobian[:, 3:], tf.point_velocity(force.place) @ jacobian
    pull = np.swapaxes(skew(force.force) @ turn, -1, -2) @ velocity
    # Half of each order of turning: a moment by weights on cords, which has a potential, where a fixed one has none.
    twist = 0.5 * np.swapaxes(skew(force.moment) @ turn, -1, -2) @ turn
    return -_symmetrised(pull + twist, place.machine.groups)


def _symmetrised(form: FloatArray, groups: np.ndarray) -> FloatArray:
    """Return the symmetric matrix whose entries are form[a, b] with a nearer to the ground; the mean inside a group."""
    is_nearer = groups[:, None] < groups[None, :]
    is_same_group = groups[:, None] == groups[None, :]
    upper = np.where(is_nearer, form, 0.0)
    mean = np.where(is_same_group, (form + np.swapaxes(form, -1, -2)) / 2, 0.0)
    return upper + np.swapaxes(upper, -1, -2) + mean


def _balance(place: Placement, forces: list[_Force]) -> tuple[FloatArray, list[FloatArray]]:
    """Return the static deflection (P, n) and the wrench on the child of every loop joint (machine axes, origin)."""
    machine, n = place.machine, place.machine.size
    load = _generalised(place, forces)
    stiffness = joint_matrices(place)[0]
    motions = [loop_motion(place, loop) for loop in machine.loops]
    locked = [[i for i in range(6) if loop.law.states[i] == "locked"] for loop in machine.loops]
    constraints = np.concatenate([m[:, ways] for m, ways in zip(motions, locked, strict=True)]
                                 or [np.zeros((place.poses, 0, n))], axis=1)
    count = constraints.shape[1]
    scale = float(np.abs(stiffness).max()) or 1.0
    # Stiffness and constraints in one matrix, scaled alike, so that one cut-off of singular values serves both.
    kkt = np.zeros((place.poses, n + count, n + count))
    kkt[:, :n, :n], kkt[:, :n, n:], kkt[:, n:, :n] = stiffness / scale, np.swapaxes(constraints, -1, -2), constraints
    right_side = np.concatenate([load / scale, np.zeros((place.poses, count))], axis=1)
    # A free machine has motions that no force resists, and loops that hold it twice: both leave the matrix singular.
    solution = (np.linalg.pinv(kkt, rcond=1e-12, hermitian=True) @ right_side[..., None])[..., 0]
    _check_balance(place, kkt, solution, right_side, scale)
    deflection, multipliers = solution[:, :n], solution[:, n:] * scale
    wrenches, offset = [], 0
    for loop, motion, locked_ways in zip(machine.loops, motions, locked, strict=True):
        local = (loop.law.stiffness @ motion @ deflection[..., None])[..., 0]
        local[:, locked_ways] += multipliers[:, offset:offset + len(locked_ways)]
        offset += len(locked_ways)
        wrenches.append(local)
    return deflection, wrenches


def _check_balance(place: Placement, kkt: FloatArray, solution: FloatArray, right_side: FloatArray, scale: float) -> None:
    """Refuse a pose whose free directions are pulled: the solution then misses the load there."""
    error = np.abs((kkt @ solution[..., None])[..., 0] - right_side)[:, :place.machine.size] * scale
    # Where there is no load rounding must not count as one.
    limit = 1e-6 * max(float(np.abs(right_side).max()) * scale, 1e-9)
    if (error > limit).any():
        worst_coordinate = int(np.argmax(error.max(axis=0)))
        fail("pose", f"coordinate {place.machine.coordinates[worst_coordinate]} is pulled by {error.max():.4g} N or N m",
             "free directions must be in balance at the described pose", remedy="move the pose to its equilibrium, or give the "
             "direction a stiffness")


def _loop_stiffness(place: Placement, loop: LoopJoint, local: FloatArray) -> FloatArray:
    """Return the second derivative of the closure, weighted with the loop's wrench; see the module's first lines."""
    # Wrench about the machine's origin, dual to twists there: W = Ad(T)^-T w.
    directions = loop_directions(place, loop)
    dual = local if directions is None else np.linalg.solve(np.swapaxes(directions, -1, -2), local[..., None])[..., 0]
    wrench = (np.swapaxes(tf.adjoint(tf.inverse(loop_frame(place, loop))), -1, -2) @ dual[..., None])[..., 0]
    child = place.jacobian(loop.child, loop.child_interface)
    parent = place.jacobian(loop.parent, loop.parent_interface)
    # A coordinate that moves both sides alike moves nothing in the joint: its rounding would be taken for a motion.
    is_shared = np.isclose(child, parent).all(axis=(0, 1)) & (np.abs(child).max(axis=(0, 1)) > 0)
    child, parent = np.where(is_shared, 0.0, child), np.where(is_shared, 0.0, parent)
    groups = place.machine.groups
    child_form = _bracket_form(wrench, child, child)
    parent_form = _bracket_form(wrench, parent, parent)
    is_nearer = groups[:, None] < groups[None, :]
    upper = np.where(is_nearer, 0.5 * (child_form - parent_form), 0.0)
    mixed_form = 0.5 * _bracket_form(wrench, child, parent)
    total = upper + np.swapaxes(upper, -1, -2) + mixed_form + np.swapaxes(mixed_form, -1, -2)
    return total if directions is None else total + _order_stiffness(place, loop, directions, dual)


def _order_stiffness(place: Placement, loop: LoopJoint, directions: FloatArray, wrench: FloatArray) -> FloatArray:
    """Return the stiffness that the order of a loop joint's free motions adds.

    exp(aX) exp(bY) is exp(aX + bY + ab[X, Y]/2) to second order.
    """
    motion = loop_motion(place, loop)
    total = np.zeros((place.poses, place.machine.size, place.machine.size))
    for number, first in enumerate(loop.free):
        for second in loop.free[number + 1:]:
            bracket = tf.twist_bracket(directions[:, :, first], directions[:, :, second])
            weight = 0.5 * (wrench * bracket).sum(axis=-1)[:, None, None]
            form = motion[:, first, :, None] * motion[:, second, None, :]
            total -= weight * (form + np.swapaxes(form, -1, -2))
    return total


def _bracket_form(wrench: FloatArray, first: FloatArray, second: FloatArray) -> FloatArray:
    """Return W . [X_a, Y_b] for all columns a of first and b of second, shape (P, n, n)."""
    x, y = np.swapaxes(first, -1, -2)[:, :, None, :], np.swapaxes(second, -1, -2)[:, None, :, :]
    return (tf.twist_bracket(*np.broadcast_arrays(x, y)) * wrench[:, None, None, :]).sum(axis=-1)


def _reactions(place: Placement, forces: list[_Force], wrenches: list[FloatArray]) -> dict[str, FloatArray]:
    """Return the wrench on the child of every joint, about its place: what it carries balances all loads beyond it."""
    machine = place.machine
    carried = np.zeros((len(machine.bodies), 6))
    for force in forces:
        force_place = force.place[0]
        carried[force.link] += np.concatenate([force.force, np.cross(force_place, force.force) + force.moment])
    result = {}
    for loop, local in zip(machine.loops, wrenches, strict=True):
        frame = loop_frame(place, loop)[0]
        # `local` is the gradient of the energy, so the force on the child is its opposite.
        directions = loop_directions(place, loop)
        dual = local[0] if directions is None else np.linalg.solve(directions[0].T, local[0])
        at_origin = -tf.wrench_map(frame) @ dual
        if loop.child >= 0:
            carried[loop.child] += at_origin
        if loop.parent >= 0:
            carried[loop.parent] -= at_origin
        result[loop.name] = _about(at_origin, frame[:3, 3])
    for i in reversed(range(len(machine.bodies))):
        result[machine.joint_names[i]] = _about(-carried[i], place.joint_frames[0, i, :3, 3])
        if machine.chain.parents[i] >= 0:
            carried[machine.chain.parents[i]] += carried[i]
    return result


def _about(wrench: FloatArray, point: FloatArray) -> FloatArray:
    """Return a wrench about the origin as one about a point."""
    return np.concatenate([wrench[:3], wrench[3:] - np.cross(point, wrench[:3])])
