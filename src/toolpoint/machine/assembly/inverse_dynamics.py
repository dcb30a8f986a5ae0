r"""Rigid dynamics along the axes: mass matrix, gravity torque, and the axis forces that a motion takes.

Recursive Newton-Euler over the steps of all joints: velocities and accelerations outwards, with gravity as an acceleration of
the ground, forces inwards. Loops are condensed with the rates of the passive steps, whose accelerations follow from the second
derivative of closure. Source: Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 5 and 8.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, fail, floats
from toolpoint.kinematics import ClosedChain, Pose
from toolpoint.kinematics.steps import advance
from toolpoint.machine.parts.model import Machine
from toolpoint.spatial import transform as tf


def axis_mass_matrix(machine: Machine, pose: Pose | None = None) -> FloatArray:
    """Return the mass matrix of the rigid machine along its driven axes, kg, kg m, kg m^2, shape (n_poses, n_axes, n_axes)."""
    values, twists, inertia = _state(machine, pose)
    rates = _rates(machine, values)
    total = np.zeros((len(values), rates.shape[-1], rates.shape[-1]))
    for link in range(len(machine.bodies)):
        jacobian = np.swapaxes(twists * machine.chain.on_path[link][:, None], -1, -2) @ rates
        total += np.swapaxes(jacobian, -1, -2) @ inertia[:, link] @ jacobian
    return total


def gravity_force(machine: Machine, pose: Pose | None = None, gravity: ArrayLike | None = None) -> FloatArray:
    """Return the axis forces (N, N m) that hold the machine against gravity, shape (n_poses, n_axes).

    gravity : (3,), m/s^2; that of the machine where left out.
    """
    zero = np.zeros(len(machine.chain.driven_axes))
    return inverse_dynamics(machine, pose, zero, acceleration=zero, gravity=gravity)


def inverse_dynamics(machine: Machine, pose: Pose | None, velocity: ArrayLike, *, acceleration: ArrayLike,
                     gravity: ArrayLike | None = None) -> FloatArray:
    """Return the axis forces (N, N m) of a motion of the rigid machine, shape (n_poses, n_axes).

    Parameters
    ----------
    machine : Machine
        Rigid bodies; springs are left out.
    pose : mapping of axis name to positions
    velocity, acceleration : (n_axes,) or (n_poses, n_axes) floats
        Of the driven axes, m/s or rad/s and m/s^2 or rad/s^2.
    gravity : (3,) floats, optional
        m/s^2; that of the machine, or none, where left out.
    """
    wrench, twists, rates = _motion_wrenches(machine, pose, velocity, acceleration=acceleration, gravity=gravity)
    chain = machine.chain
    for i in reversed(range(len(machine.bodies))):
        if chain.parents[i] >= 0:
            wrench[:, chain.parents[i]] += wrench[:, i]
    joints = [step.joint for step in chain.steps]
    forces = np.einsum("psk,psk->ps", twists, wrench[:, joints]) if joints else np.zeros((len(wrench), 0))
    return (np.swapaxes(rates, -1, -2) @ forces[..., None])[..., 0]


def base_reaction(machine: Machine, pose: Pose | None, velocity: ArrayLike | None = None, *,
                  acceleration: ArrayLike | None = None,
                  gravity: ArrayLike | None = None, about: ArrayLike = (0.0, 0.0, 0.0)) -> FloatArray:
    """Return force (N) and moment (N m, about a point of the machine frame) of the ground on the rigid machine, (n_poses, 6).

    Arguments are those of `inverse_dynamics`; at rest where velocity and acceleration are left out.
    """
    zero = np.zeros(len(machine.chain.driven_axes))
    wrench = _motion_wrenches(machine, pose, zero if velocity is None else velocity,
                              acceleration=zero if acceleration is None else acceleration, gravity=gravity)[0].sum(axis=1)
    moment = wrench[:, 3:] - np.cross(floats("about", about, (3,)), wrench[:, :3])
    return np.concatenate([wrench[:, :3], moment], axis=-1)


def _motion_wrenches(machine: Machine, pose: Pose | None, velocity: ArrayLike, *, acceleration: ArrayLike,
                     gravity: ArrayLike | None) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the wrenches of the bodies' motion (P, n_links, 6), the unit twists of the steps, and their rates per axis."""
    values, twists, inertia = _state(machine, pose)
    count = len(machine.chain.driven_axes)
    rates = _rates(machine, values)
    qd, qdd = (np.broadcast_to(floats(name, v, (count,)), (len(values), count))
               for name, v in (("velocity", velocity), ("acceleration", acceleration)))
    gravity_field = machine.description.gravity if gravity is None else gravity
    g = np.zeros(3) if gravity_field is None else floats("gravity", gravity_field, (3,))
    sd = (rates @ qd[..., None])[..., 0]
    sdd = (rates @ qdd[..., None])[..., 0] + _bias(machine, values, sd)
    return _body_wrenches(machine, twists, inertia, sd, sdd, g), twists, rates


def _state(machine: Machine, pose: Pose | None) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return step values, unit twists of the steps, and inertias of the bodies about the machine's origin, (P, n_links, 6,
    6)."""
    if any(body.modal_count for body in machine.bodies):
        fail("machine", "elastic bodies", "must be rigid here", remedy="use assemble for elastic ones")
    chain = machine.chain
    values = chain.step_values(pose or {})
    moved = chain.displacements_of(chain.motions_of(values))
    frames = moved @ machine.body_frames
    # All inertias about one origin: wrenches and twists of different bodies can then be added.
    to_body = tf.adjoint(tf.inverse(frames))
    masses = np.stack([body.mass for body in machine.bodies])
    return values, chain.twists_of(values, moved), np.swapaxes(to_body, -1, -2) @ masses @ to_body


def _rates(machine: Machine, values: FloatArray) -> FloatArray:
    """Return the rates of all steps per driven axis, (P, n_steps, n_axes)."""
    rates = machine.chain.rates_at(values)
    return np.broadcast_to(rates, (len(values), *rates.shape[1:]))


def _body_wrenches(machine: Machine, twists: FloatArray, inertia: FloatArray, sd: FloatArray, sdd: FloatArray, g: FloatArray
                   ) -> FloatArray:
    """Return the wrench that each body's motion takes, (P, n_links, 6), in machine axes about the machine's origin."""
    chain, poses = machine.chain, len(twists)
    links = len(machine.bodies)
    velocity, acceleration = np.zeros((poses, links, 6)), np.zeros((poses, links, 6))
    for i, parent in enumerate(chain.parents):
        v = np.zeros((poses, 6)) if parent < 0 else velocity[:, parent]
        # Featherstone's device: the ground accelerates against gravity, and no weight is added to any body.
        a = np.concatenate([np.broadcast_to(-g, (poses, 3)), np.zeros((poses, 3))], axis=-1) if parent < 0 else acceleration[
            :, parent]
        for group in chain.sequences[i]:
            # The three of a ball turn together: none of them carries the others.
            carrier = v
            for k in group:
                unit = twists[:, k]
                v = v + unit * sd[:, k, None]
                a = a + unit * sdd[:, k, None] + tf.twist_bracket(carrier, unit) * sd[:, k, None]
        velocity[:, i], acceleration[:, i] = v, a
    momentum = (inertia @ velocity[..., None])[..., 0]
    return (inertia @ acceleration[..., None])[..., 0] + _force_bracket(velocity, momentum)


def _force_bracket(twist: FloatArray, wrench: FloatArray) -> FloatArray:
    """Return the rate of a wrench (f, m) carried with a twist (v, w), about the fixed origin: (w x f, w x m + v x f)."""
    v, w, f, m = twist[..., :3], twist[..., 3:], wrench[..., :3], wrench[..., 3:]
    return np.concatenate([np.cross(w, f), np.cross(w, m) + np.cross(v, f)], axis=-1)


def _bias(machine: Machine, values: FloatArray, sd: FloatArray) -> FloatArray:
    """Return the accelerations of the steps at constant axis rates: zero for a tree, of the passive steps by closure for loops.

    The derivative of the rates along the motion is a central difference of exact Jacobians.
    """
    chain = machine.chain
    if not isinstance(chain, ClosedChain) or not chain.loops or not chain.passive or not np.any(sd):
        return np.zeros_like(sd)
    largest_rate = max(float(np.abs(sd).max()), 1e-300)
    # The step turns no joint by more than 1e-4: truncation and rounding of a central difference are then both near 1e-8.
    h = 1e-4 / largest_rate
    rates_forward, rates_backward = (chain.closure.rates(advance(chain.steps, chain.balls, values, change=s * h * sd))
                                     for s in (1, -1))
    rates = chain.closure.rates(values)
    # Axis rates of the given step rates: driven steps are among them, so the solution is exact.
    qd = (np.linalg.pinv(rates) @ sd[..., None])[..., 0]
    return ((rates_forward - rates_backward) @ qd[..., None])[..., 0] / (2 * h)
