"""From a drive file to its servo: mechanics, friction, motors and controllers, on a machine's structure where it has ends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.drives import (
    Axis,
    Contact,
    Controller,
    Coulomb,
    Coupling,
    CurrentLoop,
    Encoders,
    Inverter,
    LuGre,
    MaxwellSlip,
    Mechanics,
    PositionLoop,
    Screw,
    Servo,
    Stribeck,
    Structure,
    SynchronousMotor,
    TorqueMotor,
    TwoExponential,
    VelocityLoop,
    Viscous,
    ball_screw_axis,
    four_dof_axis,
    linear_motor_axis,
    low_pass,
    low_pass_1,
    notch,
    plant,
    plausibility,
    rack_axis,
    rigid_axis,
    two_mass_axis,
)
from toolpoint.drives.controller.filters import Filter
from toolpoint.drives.friction.laws import FrictionLaw
from toolpoint.io.yaml.drive_schema import Current, DriveAxis, Drives, Friction, GuideFriction, Motor, TorqueFilter
from toolpoint.machine import Machine
from toolpoint.studies.servo_map import structure_at

_FREED = 1e-9


def servo_of(drives: Drives, machine: Machine | None = None, pose: Mapping[str, float] | None = None) -> Servo:
    """Return the servo that a drive file describes, on a machine's structure where its axes are ball screws.

    Doubtful friction warns with its critical feed.
    """
    return servo_on(drives, structure_of(drives, machine, pose))


def servo_on(drives: Drives, structure: Structure | None, warn: bool = True, nuts: Sequence[float] | None = None) -> Servo:
    """Return the servo of a drive file on a structure that is given; `nuts` (m, an axis each) in place of the file's."""
    places = [None] * len(drives.axes) if nuts is None else list(nuts)
    axes = [Axis(name, _motor(axis.motor), axis_mechanics(axis, place))
            for (name, axis), place in zip(drives.axes.items(), places, strict=True)]
    if warn:
        for axis in drives.axes.values():
            _judge(axis)
    return Servo(plant(axes, structure), tuple(_controller(axis) for axis in drives.axes.values()))


def structure_of(drives: Drives, machine: Machine | None, pose: Mapping[str, float] | None) -> Structure | None:
    """Return the modes of the machine at a pose with its driven directions free, and where the drives hold on to it."""
    if machine is None:
        ends = next((name for name, axis in drives.axes.items() if axis.ends is not None), None)
        if ends is not None:
            raise ToolpointError(f"--machine: missing; axis {ends} of the drive file ends at points of a machine")
        return None
    free, boundaries, tools = held_on(drives, machine)
    return structure_at(free, pose, boundaries, tools)


def held_on(drives: Drives, machine: Machine) -> tuple[Machine, dict[str, str], dict[str, str]]:
    """Return the machine with its driven directions free, and the Dofs of the drives' boundaries and of the tool."""
    ends = {name: axis.ends for name, axis in drives.axes.items() if axis.ends is not None}
    if not ends:
        raise ToolpointError("--machine: no axis of the drive file is a ball screw with 'ends' on a machine; leave it out, "
                             "or describe where the drives hold on")
    # The drives carry these directions now; a stiffness of zero would make them free and change the joint's kind.
    free = machine.with_values({end.replaces: _FREED * machine.value(end.replaces) for end in ends.values()})
    boundaries = {f"{name}.{side}": getattr(end, side) for name, end in ends.items() for side in ("base", "table")}
    return free, boundaries, {name: end.tool for name, end in ends.items()}


def lead_of(axis: DriveAxis) -> float:
    """Return the travel per motor angle, m/rad (1 for a linear motor)."""
    m = axis.mechanics
    if m.kind == "linear-motor":
        return 1.0
    if m.kind == "rack":
        return float(m.pinion_radius or 0.0) / m.gear_ratio
    return float(m.lead or 0.0) / (2 * np.pi)


def axis_mechanics(axis: DriveAxis, nut_position: float | None = None) -> Mechanics:
    """Return the mechanics of one axis; `nut_position` (m) in the place of the file's."""
    m: Any = axis.mechanics
    ratio, shaft, guide = lead_of(axis), friction_law(axis.friction), friction_law(axis.guide_friction)
    if m.kind == "rigid":
        return rigid_axis(m.inertia, ratio, m.motor_damping, shaft)
    if m.kind == "linear-motor":
        return linear_motor_axis(m.table_mass, m.guide_damping, guide)
    if m.kind == "rack":
        return rack_axis(m.inertia, m.table_mass, m.pinion_radius, m.gear_ratio, m.stiffness, m.damping,
                         backlash=m.backlash or 0.0, motor_damping=m.motor_damping, guide_friction=guide)
    if m.kind == "two-mass":
        return two_mass_axis(m.inertia, m.table_mass, ratio, m.stiffness, m.damping, motor_damping=m.motor_damping,
                             guide_friction=guide, shaft_friction=shaft, play=_contact(m, m.stiffness))
    if m.kind == "screw":
        return ball_screw_axis(
            m.inertia, Coupling(m.coupling_stiffness, m.coupling_damping), Screw(m.screw_diameter, m.lead, m.screw_length),
            m.table_mass, nut_position or m.nut_position, m.bearing_stiffness, m.end_bearing_stiffness,
            _contact(m, m.nut_stiffness) or m.nut_stiffness, motor_damping=m.motor_damping,
            bearing_damping=m.bearing_damping, nut_damping=m.nut_damping, guide_damping=m.guide_damping,
            guide_friction=guide, screw_friction=shaft)
    return four_dof_axis(m.inertia, m.screw_inertia, m.screw_mass, None, ratio, (m.coupling_stiffness, m.coupling_damping),
                         (m.bearing_stiffness, m.bearing_damping), (m.nut_stiffness, m.nut_damping),
                         motor_damping=m.motor_damping, guide_damping=m.guide_damping, shaft_friction=shaft)


def _contact(m: Any, stiffness: float) -> Contact | None:
    if m.backlash is not None:
        return Contact.with_backlash(stiffness, m.backlash)
    return Contact.preloaded(stiffness, m.preload) if m.preload is not None else None


def friction_law(part: Friction | GuideFriction) -> FrictionLaw | None:
    """Return the law of a file, None for none."""
    p: Any = part
    if p.law == "none":
        return None
    if p.law == "coulomb":
        return Coulomb(p.coulomb, p.viscous)
    if p.law == "viscous":
        return Viscous(p.viscous)
    if p.law == "two-exponential":
        return TwoExponential(p.coulomb, p.static, p.stribeck_velocity, p.coulomb_velocity, p.viscous)
    if p.law == "lugre":
        return LuGre(p.bristle_stiffness, p.bristle_damping, p.coulomb, p.static, p.stribeck_velocity, p.viscous, p.exponent)
    curve = Stribeck(p.coulomb, p.static, p.stribeck_velocity, p.viscous, p.exponent)
    return curve if p.law == "stribeck" else MaxwellSlip(p.element_stiffness, p.element_share, curve, p.attraction)


def _judge(axis: DriveAxis) -> None:
    ratio = lead_of(axis)
    for law, gain in ((friction_law(axis.friction), axis.velocity.gain),
                      (friction_law(axis.guide_friction), axis.velocity.gain / ratio**2)):
        if isinstance(law, (Stribeck, LuGre, TwoExponential, MaxwellSlip)):
            plausibility(law, gain, ratio if law is not None and gain == axis.velocity.gain else 1.0)


def _motor(part: Motor | None) -> SynchronousMotor | TorqueMotor:
    if part is None:
        return TorqueMotor()
    # Torque per A(rms) against flux linkage: T = 3/2 p psi i_q, i_q = sqrt(2) I.
    flux = part.flux if part.flux is not None else float(part.torque_constant or 0) * np.sqrt(2) / (3 * part.pole_pairs)
    return SynchronousMotor(part.pole_pairs, part.resistance, part.inductance_d, part.inductance_q or part.inductance_d, flux)


def _controller(axis: DriveAxis) -> Controller:
    v, p, e, c = axis.velocity, axis.position, axis.encoders, axis.current
    velocity = VelocityLoop(v.gain, v.integral_time or np.inf, v.sample_time, tuple(_filter(f) for f in v.filters), v.delay,
                            v.limit or np.inf)
    position = PositionLoop(p.gain, p.sample_time, p.velocity_feedforward, p.inertia_feedforward, p.friction_feedforward,
                            p.friction_velocity, p.feedback)
    inverter = Inverter() if c is None else Inverter(c.voltage, c.inverter, c.carrier)
    return Controller(position, velocity, lead_of(axis), None if c is None else _current(c, axis.motor),
                      Encoders(e.motor, e.scale, e.difference), inverter)


def _current(c: Current, motor: Motor | None) -> CurrentLoop:
    model: Any = _motor(c.model or motor)
    gain, integral = c.gain, c.integral or 0.0
    if c.bandwidth is not None:
        tuned = CurrentLoop.tuned(model, c.bandwidth)
        gain, integral = tuned.gain, tuned.integral
    return CurrentLoop(float(gain or 0.0), integral, model, c.sample_time, c.delay, c.decoupling, c.limit)


def _filter(part: TorqueFilter) -> Filter:
    f: Any = part
    if f.kind == "low-pass-1":
        return low_pass_1(f.time_constant)
    return notch(f.frequency, f.damping or 0.1, f.depth) if f.kind == "notch" else low_pass(f.frequency, f.damping or 0.7071)
