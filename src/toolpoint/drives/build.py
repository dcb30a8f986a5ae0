"""Servo from the description of a drive: mechanics, friction, motors and controllers, on a structure if there is one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import fail
from toolpoint.drives.axis.ball_screw import BallScrew, Coupling, ball_screw_axis, four_dof_axis
from toolpoint.drives.axis.mechanics import Mechanics
from toolpoint.drives.axis.motor import Inverter, SynchronousMotor, TorqueMotor
from toolpoint.drives.axis.plant import DriveAxis, Structure, build_plant
from toolpoint.drives.axis.simple_axes import linear_motor_axis, rack_axis, rigid_axis, two_mass_axis
from toolpoint.drives.controller.filters import Filter, low_pass, low_pass_1, notch
from toolpoint.drives.controller.servo import Servo
from toolpoint.drives.controller.settings import Controller, CurrentLoop, Encoders, PositionLoop, VelocityLoop
from toolpoint.drives.description import (
    CurrentDescription,
    DriveAxisDescription,
    DriveDescription,
    FrictionDescription,
    GuideFrictionDescription,
    MechanicsDescription,
    MotorDescription,
    TorqueFilterDescription,
)
from toolpoint.drives.faults import check_description
from toolpoint.drives.friction.contact import Contact
from toolpoint.drives.friction.identification import check_plausibility
from toolpoint.drives.friction.laws import (
    Coulomb,
    FrictionLaw,
    LuGre,
    MaxwellSlip,
    Stribeck,
    TwoExponential,
    Viscous,
)


def build_servo(drives: DriveDescription, structure: Structure | None = None, *, warn: bool = True,
                nuts: Sequence[float] | None = None) -> Servo:
    """Return the servo of a description.

    Parameters
    ----------
    drives : DriveDescription
    structure : Structure, optional
        What the axes push against; the ground where left out.
    warn : bool
        Warn of doubtful friction, with its critical feed.
    nuts : (n_axes,) floats, optional
        Nut positions (m) in the place of the description's.

    Raises
    ------
    ToolpointError
        With every fault of the description.

    Examples
    --------
    >>> from toolpoint.drives.description import PositionDescription, VelocityDescription
    >>> axis = DriveAxisDescription(mechanics=MechanicsDescription("rigid", lead=0.01, inertia=0.005),
    ...                             position=PositionDescription(gain=20.0), velocity=VelocityDescription(gain=1.0))
    >>> build_servo(DriveDescription("slide", {"X": axis}))
    Servo(X; loops at 250, 250, 1000 us; 2 states)
    """
    check_description(drives)
    places = [None] * len(drives.axes) if nuts is None else list(nuts)
    axes = [DriveAxis(name, build_motor(axis.motor), build_mechanics(axis, place))
            for (name, axis), place in zip(drives.axes.items(), places, strict=True)]
    if warn:
        for axis in drives.axes.values():
            warn_of_friction(axis)
    return Servo(build_plant(axes, structure), tuple(build_controller(axis) for axis in drives.axes.values()))


def travel_per_angle(m: MechanicsDescription) -> float:
    """Return the travel per motor angle, m/rad (1 for a linear motor), or rad/rad of a reducer."""
    if m.kind == "linear-motor":
        return 1.0
    if m.kind == "rack":
        return _number(m, "pinion_radius") / m.gear_ratio
    if m.kind == "reducer":
        return 1 / m.gear_ratio
    return _number(m, "lead") / (2 * np.pi)


def build_mechanics(axis: DriveAxisDescription, nut_position: float | None = None) -> Mechanics:
    """Return the mechanics of one axis; `nut_position` (m) in the place of the description's."""
    m, ratio = axis.mechanics, travel_per_angle(axis.mechanics)
    shaft, guide = build_friction(axis.friction), build_friction(axis.guide_friction)
    if m.kind == "rigid":
        return rigid_axis(_number(m, "inertia"), ratio, m.motor_damping, friction=shaft)
    if m.kind == "linear-motor":
        return linear_motor_axis(_number(m, "table_mass"), m.guide_damping, guide)
    if m.kind == "rack":
        return rack_axis(_number(m, "inertia"), _number(m, "table_mass"), _number(m, "pinion_radius"),
                         gear_ratio=m.gear_ratio, stiffness=_number(m, "stiffness"), damping=m.damping,
                         backlash=m.backlash or 0.0, preload=m.preload or 0.0, motor_damping=m.motor_damping,
                         guide_friction=guide)
    if m.kind == "reducer":
        return two_mass_axis(_number(m, "inertia"), _number(m, "load_inertia"), ratio, stiffness=_number(m, "torsion"),
                             damping=m.torsion_damping, motor_damping=m.motor_damping, shaft_friction=shaft)
    if m.kind == "two-mass":
        stiffness = _number(m, "stiffness")
        return two_mass_axis(_number(m, "inertia"), _number(m, "table_mass"), ratio, stiffness=stiffness, damping=m.damping,
                             motor_damping=m.motor_damping, guide_friction=guide, shaft_friction=shaft,
                             play=_contact(m, stiffness))
    if m.kind == "screw":
        return _screw_axis(m, nut_position or _number(m, "nut_position"), shaft, guide)
    nut = _number(m, "nut_stiffness")
    return four_dof_axis(
        _number(m, "inertia"), _number(m, "screw_inertia"), _number(m, "screw_mass"), table_mass=None, lead_ratio=ratio,
        coupling=_coupling(m),
        bearing=(_number(m, "bearing_stiffness"), m.bearing_damping), nut=(_contact(m, nut) or nut, m.nut_damping),
        motor_damping=m.motor_damping, guide_damping=m.guide_damping, shaft_friction=shaft,
        bearing_friction_arm=m.bearing_friction_arm)


def _screw_axis(m: MechanicsDescription, nut_position: float, shaft: FrictionLaw | None, guide: FrictionLaw | None
                ) -> Mechanics:
    """Return a ball screw in lumps with the friction of its shaft (N m) and guide (N); `nut_position` in m."""
    nut = _number(m, "nut_stiffness")
    return ball_screw_axis(
        _number(m, "inertia"), _coupling(m),
        BallScrew(_number(m, "screw_diameter"), _number(m, "lead"), _number(m, "screw_length")),
        table_mass=_number(m, "table_mass"), nut_position=nut_position, front_bearing=_number(m, "bearing_stiffness"),
        end_bearing=m.end_bearing_stiffness, nut=_contact(m, nut) or nut, motor_damping=m.motor_damping,
        bearing_damping=m.bearing_damping, nut_damping=m.nut_damping, guide_damping=m.guide_damping, guide_friction=guide,
        screw_friction=shaft, bearing_friction_arm=m.bearing_friction_arm)


def _coupling(m: MechanicsDescription) -> Coupling:
    """Return the coupling between motor and screw, progressive where the twist that doubles its torque is given."""
    return Coupling(_number(m, "coupling_stiffness"), m.coupling_damping, doubling_twist=m.coupling_doubling_twist)


def _contact(m: MechanicsDescription, stiffness: float) -> Contact | None:
    """Return the nut with backlash or preload, of a stiffness in N/m; None for a linear one."""
    if m.backlash is not None:
        return Contact.with_backlash(stiffness, m.backlash)
    return Contact.preloaded(stiffness, m.preload) if m.preload is not None else None


def build_friction(part: FrictionDescription | GuideFrictionDescription) -> FrictionLaw | None:
    """Return the friction law of a description, None for none."""
    if part.law == "none":
        return None
    if part.law == "coulomb":
        return Coulomb(part.coulomb, part.viscous)
    if part.law == "viscous":
        return Viscous(part.viscous)
    static, slow = _number(part, "static"), _number(part, "stribeck_velocity")
    if part.law == "two-exponential":
        return TwoExponential(part.coulomb, static, slow, _number(part, "coulomb_velocity"), part.viscous)
    if part.law == "lugre":
        return LuGre(_number(part, "bristle_stiffness"), part.bristle_damping, part.coulomb, static, slow, part.viscous,
                     part.exponent)
    curve = Stribeck(part.coulomb, static, slow, part.viscous, part.exponent)
    if part.law == "stribeck":
        return curve
    return MaxwellSlip(part.element_stiffness, part.element_share, curve, _number(part, "attraction"))


def warn_of_friction(axis: DriveAxisDescription) -> None:
    """Warn where the friction of an axis is doubtful in its velocity loop."""
    ratio, gain = travel_per_angle(axis.mechanics), axis.velocity.gain
    # A law at the guide sees the loop's gain through the lead, twice; its speeds are feeds already.
    for part, loop_gain, lead in ((axis.friction, gain, ratio), (axis.guide_friction, gain / ratio**2, 1.0)):
        law = build_friction(part)
        if isinstance(law, (Stribeck, LuGre, TwoExponential, MaxwellSlip)):
            check_plausibility(law, loop_gain, lead)


def build_motor(part: MotorDescription | None) -> SynchronousMotor | TorqueMotor:
    """Return the motor of a description; one whose torque follows at once where none is described."""
    return TorqueMotor() if part is None else _synchronous(part)


def _synchronous(part: MotorDescription) -> SynchronousMotor:
    """Return a synchronous motor; without a second inductance it has none that differs (L_q = L_d)."""
    # Torque per A(rms) against flux linkage: T = 3/2 p psi i_q, i_q = sqrt(2) I.
    flux = part.flux if part.flux is not None else _number(part, "torque_constant") * np.sqrt(2) / (3 * part.pole_pairs)
    return SynchronousMotor(part.pole_pairs, part.resistance, part.inductance_d, part.inductance_q or part.inductance_d, flux)


def build_controller(axis: DriveAxisDescription) -> Controller:
    """Return the controller of one axis."""
    v, p, e, c = axis.velocity, axis.position, axis.encoders, axis.current
    velocity = VelocityLoop(v.gain, v.integral_time or np.inf, v.sample_time, tuple(build_filter(f) for f in v.filters),
                            v.delay, v.limit or np.inf, v.damping_gain, v.damping_sensor)
    position = PositionLoop(p.gain, p.sample_time, p.velocity_feedforward, p.inertia_feedforward, p.friction_feedforward,
                            p.friction_velocity, p.feedback)
    inverter = Inverter() if c is None else Inverter(c.voltage, c.inverter, c.carrier)
    current = None if c is None or axis.motor is None else _current_loop(c, axis.motor)
    return Controller(position, velocity, travel_per_angle(axis.mechanics), current,
                      Encoders(e.motor, e.scale, e.difference), inverter)


def _current_loop(c: CurrentDescription, motor: MotorDescription) -> CurrentLoop:
    """Return the current loop: of a bandwidth by pole cancellation, else of gain and integral as they stand."""
    model = _synchronous(c.model or motor)
    if c.bandwidth is not None:
        return CurrentLoop.from_bandwidth(model, c.bandwidth, sample_time=c.sample_time, delay=c.delay,
                                          decoupling=c.decoupling, limit=c.limit)
    return CurrentLoop(c.gain or 0.0, c.integral or 0.0, model, c.sample_time, c.delay, c.decoupling, c.limit)


def build_filter(part: TorqueFilterDescription) -> Filter:
    """Return the filter of a description."""
    if part.kind == "low-pass-1":
        return low_pass_1(_number(part, "time_constant"))
    frequency = _number(part, "frequency")
    if part.kind == "notch":
        return notch(frequency, part.damping or 0.1, part.depth)
    # Butterworth's, where nothing is stated: flat as far as it can be, as drives set it by default.
    return low_pass(frequency, part.damping or 0.7071)


def _number(part: object, name: str) -> float:
    """Return a number that the kind of the part needs; raise where it is missing."""
    value = getattr(part, name)
    if not isinstance(value, (int, float)):
        fail(f"{type(part).__name__}.{name}", "missing", "this kind needs it")
    return float(value)
