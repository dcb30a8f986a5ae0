r"""Gyroscopic matrix of spinning bodies: the moment that a spin with angular momentum h takes to be turned.

A body that is symmetric about the axis of its spin keeps its mass matrix while it turns. With :math:`h = I_s \Omega a` the
moment of its inertia is :math:`\omega \times h`, so :math:`G = \sum J_\omega^T (-[h]) J_\omega`, which is skew. Source: Genta,
Dynamics of Rotating Systems, 2005, chapter 4.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray, fail, scalar
from toolpoint.bodies import Body
from toolpoint.machine.description.machine import MachineDescription
from toolpoint.machine.parts.model import Machine
from toolpoint.machine.pose.placement import Placement, body_coordinates
from toolpoint.spatial.rotation import skew

SYMMETRY_TOLERANCE = 1e-6  # of the moment of inertia: deviation of a body from symmetry about its axis


def gyroscopic_matrix(place: Placement) -> FloatArray | None:
    """Return the gyroscopic matrix in the tree's coordinates, N m s/rad, shape (P, n, n); None where nothing spins."""
    machine = place.machine
    parts = []
    for link, momentum in spins(machine).items():
        momentum_now = (place.displacements[:, link, :3, :3] @ momentum[..., None])[..., 0]
        rotations = place.jacobians[:, link, 3:]
        parts.append(-np.swapaxes(rotations, -1, -2) @ skew(momentum_now) @ rotations)
    for link, speed in elastic_spins(machine).items():
        motion, gyroscopic = body_coordinates(place, link), machine.bodies[link].gyroscopic
        assert gyroscopic is not None
        parts.append(np.swapaxes(motion, -1, -2) @ (speed * gyroscopic) @ motion)
    return sum(parts[1:], parts[0]) if parts else None


def spins(machine: Machine) -> dict[int, FloatArray]:
    """Return the angular momentum of every rigid spinning link at the reference pose, machine frame, kg m^2/s, shape (3,)."""
    result: dict[int, FloatArray] = {}
    for link, name, speed, axis in _spinning(machine):
        if machine.bodies[link].gyroscopic is None:
            result[link] = _polar_inertia(name, machine.bodies[link], axis) * speed * machine.body_frames[link, :3, :3] @ axis
    return result


def elastic_spins(machine: Machine) -> dict[int, float]:
    """Return the speed (rad/s) of every elastic spinning link about the axis that its gyroscopic matrix is for."""
    result = {}
    for link, name, speed, axis in _spinning(machine):
        beam_axis = machine.bodies[link].spin_axis
        if beam_axis is None:
            continue
        cosine = float(beam_axis @ axis)
        if abs(cosine) < 1 - SYMMETRY_TOLERANCE:
            fail(f"bodies.{name}.spin.axis", f"{np.degrees(np.arccos(abs(cosine))):.3g} degrees off the beam",
                 "must be along it", remedy="a beam spins about its own axis only")
        result[link] = float(np.sign(cosine)) * speed
    return result


def _spinning(machine: Machine) -> Iterator[tuple[int, str, float, FloatArray]]:
    """Yield (link, name, speed in rad/s, axis in the body's frame) of everything that spins."""
    for link, name in enumerate(machine.body_names):
        spin = machine.description.bodies[name].spin
        if spin is not None and spin.speed != 0:
            yield link, name, spin.speed, machine.body_frames[link, :3, :3].T @ np.array(spin.axis)


def _polar_inertia(name: str, body: Body, axis: FloatArray) -> FloatArray:
    """Return the moment of inertia about the axis of spin through the centre of mass, of a body symmetric about it."""
    if body.modal_count:
        fail(f"bodies.{name}.spin", "an elastic body", "must be rigid", remedy="take the spin away, or the reduced body")
    mass = body.mass[0, 0]
    first_moment = body.mass[3:6, :3] / mass
    # Parallel axes: [c]^2 is negative, so the sum is the inertia about the centre of mass.
    inertia = body.mass[3:, 3:] + mass * first_moment @ first_moment
    polar = float(axis @ inertia @ axis)
    across = np.linalg.svd(axis[None])[2][1:]
    transverse = across @ inertia @ across.T
    scale = max(polar, float(np.abs(transverse).max()))
    # About the axis a body must be balanced, with equal moments and no product of inertia across it.
    asymmetry = max(float(np.abs(inertia @ axis - polar * axis).max()), abs(transverse[0, 0] - transverse[1, 1]),
                    2 * abs(transverse[0, 1])) / scale
    if asymmetry > SYMMETRY_TOLERANCE:
        fail(f"bodies.{name}.spin", f"a body that differs from symmetric about its axis by {100 * asymmetry:.2g} %",
             "must be symmetric about the axis that it spins about (its equations would change as it turns)",
             remedy="give it a cylinder about that axis, or equal moments across it")
    return np.asarray(polar)


def run_at_speed(machine: Machine, speed: float) -> Machine:
    """Return the machine with its fastest body spinning at a speed (rad/s), the others in proportion."""
    return machine.rebuild(set_speed(machine.description, speed))


def set_speed(description: MachineDescription, speed: float) -> MachineDescription:
    """Return the description with its fastest body spinning at a speed (rad/s), the others in proportion."""
    nominal = fastest_spin(description)
    if nominal == 0:
        fail("machine", "no body that spins", "must have one",
             remedy="give the spindle's body spin: {speed: 12000 rpm, axis: z}")
    factor = scalar("speed", speed) / nominal
    bodies = {
        name: body if body.spin is None else replace(body, spin=replace(body.spin, speed=body.spin.speed * factor))
        for name, body in description.bodies.items()}
    return replace(description, bodies=bodies)


def fastest_spin(description: MachineDescription) -> float:
    """Return the greatest speed of a spinning body, rad/s, zero where none spins."""
    return max((abs(body.spin.speed) for body in description.bodies.values() if body.spin is not None), default=0.0)
