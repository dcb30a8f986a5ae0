"""The schema of drive files: every key, its unit and its limits; also the source of the JSON schema for editors."""

# mypy: disable-error-code="valid-type"

from __future__ import annotations

from typing import Any, Literal

from toolpoint.io.quantities import electrical, units
from toolpoint.io.quantities.electrical import electrical_type
from toolpoint.io.yaml.machine_schema import Part, quantity_type

VERSION = 1
_q, _e = quantity_type, electrical_type
_DELAY = {"ge": 0, "lt": 8}
Laws = Literal["none", "coulomb", "viscous", "stribeck", "two-exponential", "lugre", "maxwell-slip"]


class Mechanics(Part):
    """What lies between motor and table; `kind` says which of the keys it needs.

    rigid: inertia at the motor. two-mass: motor and table joined by one axial spring. rack: the same with a pinion.
    linear-motor: the force acts on the table. screw: motor, coupling, screw front, middle and end, nut, table.
    ball-screw: motor, coupling, screw, nut between the machine's own bodies (see `Ends`).
    """

    kind: Literal["rigid", "two-mass", "rack", "linear-motor", "screw", "ball-screw"]
    lead: _q(units.LENGTH, gt=0) | None = None
    inertia: _q(units.AREA_MOMENT, gt=0) | None = None
    motor_damping: _q(units.TURNING_DAMPING, ge=0) = 0.0
    table_mass: _q(units.MASS, gt=0) | None = None
    stiffness: _q(units.STIFFNESS, gt=0) | None = None
    damping: _q(units.DAMPING, ge=0) = 0.0
    backlash: _q(units.LENGTH, gt=0) | None = None
    preload: _q(units.FORCE, gt=0) | None = None
    pinion_radius: _q(units.LENGTH, gt=0) | None = None
    gear_ratio: _q(units.RATIO, gt=0) = 1.0
    screw_inertia: _q(units.AREA_MOMENT, gt=0) | None = None
    screw_mass: _q(units.MASS, gt=0) | None = None
    screw_diameter: _q(units.LENGTH, gt=0) | None = None
    screw_length: _q(units.LENGTH, gt=0) | None = None
    nut_position: _q(units.LENGTH, gt=0) | None = None
    nut_moves: bool = False
    coupling_stiffness: _q(units.TURNING_STIFFNESS, gt=0) | None = None
    coupling_damping: _q(units.TURNING_DAMPING, ge=0) = 0.0
    bearing_stiffness: _q(units.STIFFNESS, gt=0) | None = None
    end_bearing_stiffness: _q(units.STIFFNESS, gt=0) | None = None
    bearing_damping: _q(units.DAMPING, ge=0) = 0.0
    nut_stiffness: _q(units.STIFFNESS, gt=0) | None = None
    nut_damping: _q(units.DAMPING, ge=0) = 0.0
    guide_damping: _q(units.DAMPING, ge=0) = 0.0


class Ends(Part):
    """Where a ball screw holds on to the machine: Dofs ``point:direction`` of base, table and tool, and the drive it replaces.

    `replaces` is the path of the machine's own drive stiffness, which the ball screw takes the place of.
    """

    base: str
    table: str
    tool: str
    replaces: str


class Friction(Part):
    """Friction at the motor shaft, N m over rad/s."""

    law: Laws
    coulomb: _q(units.MOMENT, ge=0) = 0.0
    static: _q(units.MOMENT, ge=0) | None = None
    stribeck_velocity: _q(units.ANGULAR_SPEED, gt=0) | None = None
    coulomb_velocity: _q(units.ANGULAR_SPEED, gt=0) | None = None
    exponent: _q(units.RATIO, gt=0) = 2.0
    viscous: _q(units.TURNING_DAMPING, ge=0) = 0.0
    bristle_stiffness: _q(units.TURNING_STIFFNESS, gt=0) | None = None
    bristle_damping: _q(units.TURNING_DAMPING, ge=0) = 0.0
    element_stiffness: tuple[_q(units.TURNING_STIFFNESS, gt=0), ...] = ()
    element_share: tuple[_q(units.RATIO, gt=0, le=1), ...] = ()
    attraction: _e("attraction", "N*m/s", gt=0) | None = None


class GuideFriction(Part):
    """Friction between table and base, N over m/s."""

    law: Laws
    coulomb: _q(units.FORCE, ge=0) = 0.0
    static: _q(units.FORCE, ge=0) | None = None
    stribeck_velocity: _q(units.FEED, gt=0) | None = None
    coulomb_velocity: _q(units.FEED, gt=0) | None = None
    exponent: _q(units.RATIO, gt=0) = 2.0
    viscous: _q(units.DAMPING, ge=0) = 0.0
    bristle_stiffness: _q(units.STIFFNESS, gt=0) | None = None
    bristle_damping: _q(units.DAMPING, ge=0) = 0.0
    element_stiffness: tuple[_q(units.STIFFNESS, gt=0), ...] = ()
    element_share: tuple[_q(units.RATIO, gt=0, le=1), ...] = ()
    attraction: _e("attraction", "N/s", gt=0) | None = None


class Position(Part):
    """Position P loop with feed-forward of velocity, inertia and friction; `feedback` chooses motor encoder or linear scale."""

    gain: _q(units.RATE, gt=0)
    sample_time: _q(units.TIME, gt=0) = 1e-3
    velocity_feedforward: _q(units.RATIO, ge=0, le=2) = 0.0
    inertia_feedforward: _q(units.AREA_MOMENT, ge=0) = 0.0
    friction_feedforward: _q(units.MOMENT, ge=0) = 0.0
    friction_velocity: _q(units.FEED, gt=0) = 1e-4
    feedback: Literal["motor", "scale"] = "motor"


class TorqueFilter(Part):
    """Filter of the torque command: notch and low-pass by frequency and damping, low-pass-1 by its time constant."""

    kind: Literal["notch", "low-pass", "low-pass-1"]
    frequency: _q(units.FREQUENCY, gt=0) | None = None
    damping: _q(units.RATIO, gt=0) | None = None
    depth: _q(units.RATIO, ge=0) = 0.0
    time_constant: _q(units.TIME, gt=0) | None = None


class Velocity(Part):
    """Velocity PI loop with filters of the torque command, delay in samples and torque limit."""

    gain: _q(units.TURNING_DAMPING, gt=0)
    integral_time: _q(units.TIME, gt=0) | None = None
    sample_time: _q(units.TIME, gt=0) = 2.5e-4
    filters: tuple[TorqueFilter, ...] = ()
    delay: int = 0
    limit: _q(units.MOMENT, gt=0) | None = None


class Motor(Part):
    """Permanent-magnet synchronous motor: phase resistance, inductances and flux linkage, or its catalogue's torque constant.

    `flux` (peak, a phase) or `torque_constant` (N m per A rms) is given, not both.
    """

    pole_pairs: _q(units.RATIO, gt=0)
    resistance: _e(*electrical.RESISTANCE, gt=0)
    inductance_d: _e(*electrical.INDUCTANCE, gt=0)
    inductance_q: _e(*electrical.INDUCTANCE, gt=0) | None = None
    flux: _e(*electrical.FLUX, gt=0) | None = None
    torque_constant: _e(*electrical.TORQUE_CONSTANT, gt=0) | None = None


class Current(Part):
    """Current PI loop by its bandwidth (pole cancellation) or by gain and integral; decoupling, delay, limits, inverter.

    `model` is what the controller believes of the motor; the motor itself where left out.
    """

    bandwidth: _q(units.FREQUENCY, gt=0) | None = None
    gain: _e(*electrical.CURRENT_GAIN, gt=0) | None = None
    integral: _e(*electrical.CURRENT_INTEGRAL, ge=0) | None = None
    sample_time: _q(units.TIME, gt=0) = 1.25e-4
    delay: int = 1
    decoupling: bool = True
    limit: _e(*electrical.CURRENT, gt=0) = 60.0
    voltage: _e(*electrical.VOLTAGE, gt=0) = 320.0
    inverter: Literal["averaged", "six-pulse"] = "averaged"
    carrier: int = 1
    model: Motor | None = None


class Resolution(Part):
    """Resolution of the motor encoder and the linear scale; `difference` takes the velocity from angle differences."""

    motor: _q(units.ANGLE, ge=0) = 0.0
    scale: _q(units.LENGTH, ge=0) = 0.0
    difference: bool = False


class DriveAxis(Part):
    """One axis; `motor` and `current` together put a current loop under the velocity loop."""

    mechanics: Mechanics
    friction: Friction = Friction(law="none")
    guide_friction: GuideFriction = GuideFriction(law="none")
    position: Position
    velocity: Velocity
    motor: Motor | None = None
    current: Current | None = None
    encoders: Resolution = Resolution()
    ends: Ends | None = None
    source: str = ""


class Limits(Part):
    """Limits of the set points along the path."""

    speed: _q(units.FEED, gt=0)
    acceleration: _q(units.ACCELERATION, gt=0)
    jerk: _q(units.JERK, gt=0)


class Drives(Part):
    """A drive file: at least one axis, the limits of the set points, and what was assumed.

    `substeps` plant steps are taken for each current (or velocity) sample. `corner` says how corners between lines are
    rounded within the tolerance: a tangent arc, or a clothoid whose jerk is bounded.
    """

    toolpoint: int
    name: str
    axes: dict[str, DriveAxis]
    limits: Limits = Limits(speed=0.5, acceleration=3.0, jerk=100.0)
    corner_tolerance: _q(units.LENGTH, ge=0) = 0.0
    corner: Literal["arc", "clothoid"] = "arc"
    substeps: int = 1
    source: str = ""
    assumptions: tuple[str, ...] = ()


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of drive files, for editors that check YAML while it is typed."""
    schema = Drives.model_json_schema()
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    schema["title"] = "toolpoint drive file"
    return schema
