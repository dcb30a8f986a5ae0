"""DriveDescription: a drive as plain frozen data, one to one with the drive file, each number with SI unit and limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

from toolpoint._quantity import Quantity

PositiveLength = Annotated[float, Quantity("length", "m", above=0)]
PositiveInertia = Annotated[float, Quantity("moment of inertia", "kg*m^2", above=0)]
RotationalDamping = Annotated[float, Quantity("rotational damping", "N*m*s/rad", least=0)]
SignedRotationalDamping = Annotated[float, Quantity("rotational damping", "N*m*s/rad")]
PositiveMass = Annotated[float, Quantity("mass", "kg", above=0)]
PositiveStiffness = Annotated[float, Quantity("stiffness", "N/m", above=0)]
Damping = Annotated[float, Quantity("damping", "N*s/m", least=0)]
PositiveForce = Annotated[float, Quantity("force", "N", above=0)]
PositiveRatio = Annotated[float, Quantity("ratio", "1", above=0)]
GearRatio = Annotated[float, Quantity("gear ratio", "1", above=0)]
PositiveRotationalStiffness = Annotated[float, Quantity("rotational stiffness", "N*m/rad", above=0)]
Moment = Annotated[float, Quantity("moment", "N*m", least=0)]
PositiveAngularSpeed = Annotated[float, Quantity("angular speed", "rad/s", above=0)]
Share = Annotated[float, Quantity("ratio", "1", above=0, most=1)]
PositiveTorqueRate = Annotated[float, Quantity("attraction", "N*m/s", above=0)]
Force = Annotated[float, Quantity("force", "N", least=0)]
PositiveFeed = Annotated[float, Quantity("speed", "m/s", above=0)]
PositiveForceRate = Annotated[float, Quantity("attraction", "N/s", above=0)]
PositiveRate = Annotated[float, Quantity("gain", "1/s", above=0)]
PositiveTime = Annotated[float, Quantity("time", "s", above=0)]
FeedforwardShare = Annotated[float, Quantity("ratio", "1", least=0, most=2)]
Inertia = Annotated[float, Quantity("moment of inertia", "kg*m^2", least=0)]
PositiveFrequency = Annotated[float, Quantity("frequency", "Hz", above=0)]
Ratio = Annotated[float, Quantity("ratio", "1", least=0)]
PositiveRotationalDamping = Annotated[float, Quantity("rotational damping", "N*m*s/rad", above=0)]
PositiveMoment = Annotated[float, Quantity("moment", "N*m", above=0)]
PositiveResistance = Annotated[float, Quantity("resistance", "ohm", above=0)]
PositiveInductance = Annotated[float, Quantity("inductance", "H", above=0)]
PositiveFlux = Annotated[float, Quantity("flux linkage", "V*s", above=0)]
PositiveTorqueConstant = Annotated[float, Quantity("torque constant", "N*m/A", above=0)]
PositiveCurrentGain = Annotated[float, Quantity("current gain", "V/A", above=0)]
CurrentIntegral = Annotated[float, Quantity("integral current gain", "V/(A*s)", least=0)]
PositiveCurrent = Annotated[float, Quantity("current", "A", above=0)]
PositiveVoltage = Annotated[float, Quantity("voltage", "V", above=0)]
Angle = Annotated[float, Quantity("angle", "rad", least=0)]
PositiveAngle = Annotated[float, Quantity("angle", "rad", above=0)]
Length = Annotated[float, Quantity("length", "m", least=0)]
PositiveAcceleration = Annotated[float, Quantity("acceleration", "m/s^2", above=0)]
PositiveJerk = Annotated[float, Quantity("jerk", "m/s^3", above=0)]
Laws = Literal["none", "coulomb", "viscous", "stribeck", "two-exponential", "lugre", "maxwell-slip"]


@dataclass(frozen=True)
class MechanicsDescription:
    """Mechanics between motor and table; `kind` says which of the keys it needs.

    rigid: inertia at the motor. two-mass: motor and table joined by one axial spring. rack: the same with a pinion.
    linear-motor: the force acts on the table. screw: motor, coupling, screw front, middle and end, nut, table.
    ball-screw: motor, coupling, screw, nut between the machine's own bodies (see `ends`). reducer: a rotary axis,
    motor and load (`load_inertia`) joined by the reducer's `torsion`, at the axis, through `gear_ratio`; it travels in rad.
    """

    kind: Literal["rigid", "two-mass", "rack", "linear-motor", "screw", "ball-screw", "reducer"]
    lead: PositiveLength | None = None
    inertia: PositiveInertia | None = None
    motor_damping: RotationalDamping = 0.0
    table_mass: PositiveMass | None = None
    stiffness: PositiveStiffness | None = None
    damping: Damping = 0.0
    backlash: PositiveLength | None = None
    preload: PositiveForce | None = None
    pinion_radius: PositiveLength | None = None
    gear_ratio: GearRatio = 1.0
    load_inertia: PositiveInertia | None = None
    torsion: PositiveRotationalStiffness | None = None
    torsion_damping: RotationalDamping = 0.0
    screw_inertia: PositiveInertia | None = None
    screw_mass: PositiveMass | None = None
    screw_diameter: PositiveLength | None = None
    screw_length: PositiveLength | None = None
    nut_position: PositiveLength | None = None
    nut_moves: bool = False
    coupling_stiffness: PositiveRotationalStiffness | None = None
    coupling_damping: RotationalDamping = 0.0
    coupling_doubling_twist: PositiveAngle | None = None
    bearing_stiffness: PositiveStiffness | None = None
    end_bearing_stiffness: PositiveStiffness | None = None
    bearing_damping: Damping = 0.0
    bearing_friction_arm: Length = 0.0
    nut_stiffness: PositiveStiffness | None = None
    nut_damping: Damping = 0.0
    guide_damping: Damping = 0.0


@dataclass(frozen=True)
class EndsDescription:
    """Ends of a ball screw at the machine: Dofs ``point:direction`` of base, table and tool, and the drive it replaces.

    `replaces` is the path of the machine's own drive stiffness, which the ball screw takes the place of.
    """

    base: str
    table: str
    tool: str
    replaces: str


@dataclass(frozen=True)
class FrictionDescription:
    """Friction at the motor shaft, N m over rad/s."""

    law: Laws
    coulomb: Moment = 0.0
    static: Moment | None = None
    stribeck_velocity: PositiveAngularSpeed | None = None
    coulomb_velocity: PositiveAngularSpeed | None = None
    exponent: PositiveRatio = 2.0
    viscous: RotationalDamping = 0.0
    bristle_stiffness: PositiveRotationalStiffness | None = None
    bristle_damping: RotationalDamping = 0.0
    element_stiffness: tuple[PositiveRotationalStiffness, ...] = ()
    element_share: tuple[Share, ...] = ()
    attraction: PositiveTorqueRate | None = None


@dataclass(frozen=True)
class GuideFrictionDescription:
    """Friction between table and base, N over m/s."""

    law: Laws
    coulomb: Force = 0.0
    static: Force | None = None
    stribeck_velocity: PositiveFeed | None = None
    coulomb_velocity: PositiveFeed | None = None
    exponent: PositiveRatio = 2.0
    viscous: Damping = 0.0
    bristle_stiffness: PositiveStiffness | None = None
    bristle_damping: Damping = 0.0
    element_stiffness: tuple[PositiveStiffness, ...] = ()
    element_share: tuple[Share, ...] = ()
    attraction: PositiveForceRate | None = None


@dataclass(frozen=True)
class PositionDescription:
    """Position P loop with feed-forward of velocity, inertia and friction; `feedback` chooses motor encoder or linear scale."""

    gain: PositiveRate
    sample_time: PositiveTime = 1e-3
    velocity_feedforward: FeedforwardShare = 0.0
    inertia_feedforward: Inertia = 0.0
    friction_feedforward: Moment = 0.0
    friction_velocity: PositiveFeed = 1e-4
    feedback: Literal["motor", "scale"] = "motor"


@dataclass(frozen=True)
class TorqueFilterDescription:
    """Filter of the torque command: notch and low-pass by frequency and damping, low-pass-1 by its time constant."""

    kind: Literal["notch", "low-pass", "low-pass-1"]
    frequency: PositiveFrequency | None = None
    damping: PositiveRatio | None = None
    depth: Ratio = 0.0
    time_constant: PositiveTime | None = None


@dataclass(frozen=True)
class VelocityDescription:
    """Velocity PI loop with filters of the torque command, delay in samples, torque limit, and active damping by the drive.

    `damping_gain` times the speed of the sensor beyond the motor's is added to the torque before its filters.
    """

    gain: PositiveRotationalDamping
    integral_time: PositiveTime | None = None
    sample_time: PositiveTime = 2.5e-4
    filters: tuple[TorqueFilterDescription, ...] = ()
    delay: int = 0
    limit: PositiveMoment | None = None
    damping_gain: SignedRotationalDamping = 0.0
    damping_sensor: Literal["scale", "tool"] = "scale"


@dataclass(frozen=True)
class MotorDescription:
    """Permanent-magnet synchronous motor: phase resistance, inductances and flux linkage, or its catalogue's torque constant.

    `flux` (peak, a phase) or `torque_constant` (N m per A rms) is given, not both.
    """

    pole_pairs: PositiveRatio
    resistance: PositiveResistance
    inductance_d: PositiveInductance
    inductance_q: PositiveInductance | None = None
    flux: PositiveFlux | None = None
    torque_constant: PositiveTorqueConstant | None = None


@dataclass(frozen=True)
class CurrentDescription:
    """Current PI loop by its bandwidth (pole cancellation) or by gain and integral; decoupling, delay, limits, inverter.

    `model` is what the controller believes of the motor; the motor itself where left out.
    """

    bandwidth: PositiveFrequency | None = None
    gain: PositiveCurrentGain | None = None
    integral: CurrentIntegral | None = None
    sample_time: PositiveTime = 1.25e-4
    delay: int = 1
    decoupling: bool = True
    limit: PositiveCurrent = 60.0
    voltage: PositiveVoltage = 320.0
    inverter: Literal["averaged", "six-pulse"] = "averaged"
    carrier: int = 1
    model: MotorDescription | None = None


@dataclass(frozen=True)
class ResolutionDescription:
    """Resolution of the motor encoder and the linear scale; `difference` takes the velocity from angle differences."""

    motor: Angle = 0.0
    scale: Length = 0.0
    difference: bool = False


@dataclass(frozen=True, kw_only=True)
class DriveAxisDescription:
    """One axis; `motor` and `current` together put a current loop under the velocity loop."""

    mechanics: MechanicsDescription
    friction: FrictionDescription = FrictionDescription(law="none")
    guide_friction: GuideFrictionDescription = GuideFrictionDescription(law="none")
    position: PositionDescription
    velocity: VelocityDescription
    motor: MotorDescription | None = None
    current: CurrentDescription | None = None
    encoders: ResolutionDescription = ResolutionDescription()
    ends: EndsDescription | None = None
    source: str = ""


@dataclass(frozen=True)
class LimitsDescription:
    """Limits of the set points along the path: speed (m/s), acceleration (m/s^2), jerk (m/s^3)."""

    speed: PositiveFeed
    acceleration: PositiveAcceleration
    jerk: PositiveJerk


@dataclass(frozen=True)
class DriveDescription:
    """A drive file: at least one axis, the limits of the set points, and what was assumed.

    `substeps` plant steps are taken for each current (or velocity) sample. `corner` says how corners between lines are
    rounded within the tolerance: a tangent arc, or a clothoid whose jerk is bounded. `look_ahead`: blocks beyond the one
    under way that the control knows, by whose end it must be able to stop; None for as many as it needs.

    Examples
    --------
    >>> axis = DriveAxisDescription(mechanics=MechanicsDescription("rigid", lead=0.01, inertia=0.005),
    ...                             position=PositionDescription(gain=20.0), velocity=VelocityDescription(gain=1.0))
    >>> DriveDescription("slide", {"X": axis}).limits.speed
    0.5
    """

    name: str
    axes: Mapping[str, DriveAxisDescription]
    limits: LimitsDescription = LimitsDescription(speed=0.5, acceleration=3.0, jerk=100.0)
    corner_tolerance: Length = 0.0
    corner: Literal["arc", "clothoid"] = "arc"
    look_ahead: int | None = None
    substeps: int = 1
    source: str = ""
    assumptions: tuple[str, ...] = ()
