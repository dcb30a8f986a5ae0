"""Drive files in YAML: mechanics, friction and control of the axes of a machine; read with all faults at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from toolpoint.io import units
from toolpoint.io.faults import FileFaults
from toolpoint.io.machine_schema import Part, quantity_type
from toolpoint.io.yaml_document import parsed, validated

VERSION = 1
_q = quantity_type


class Mechanics(Part):
    """A rigid axis (inertia at the motor), motor and table joined by one axial spring, or a ball screw on a machine.

    A ball screw (motor, coupling, screw, nut) ends at the machine's own bodies: see `Ends`.
    """

    kind: Literal["rigid", "two-mass", "ball-screw"]
    lead: _q(units.LENGTH, gt=0)  # type: ignore[valid-type]
    inertia: _q(units.AREA_MOMENT, gt=0)  # type: ignore[valid-type]
    table_mass: _q(units.MASS, gt=0) | None = None  # type: ignore[valid-type]
    stiffness: _q(units.STIFFNESS, gt=0) | None = None  # type: ignore[valid-type]
    damping: _q(units.DAMPING, ge=0) = 0.0  # type: ignore[valid-type]
    screw_inertia: _q(units.AREA_MOMENT, gt=0) | None = None  # type: ignore[valid-type]
    screw_mass: _q(units.MASS, gt=0) | None = None  # type: ignore[valid-type]
    coupling_stiffness: _q(units.TURNING_STIFFNESS, gt=0) | None = None  # type: ignore[valid-type]
    coupling_damping: _q(units.TURNING_DAMPING, ge=0) = 0.0  # type: ignore[valid-type]
    bearing_stiffness: _q(units.STIFFNESS, gt=0) | None = None  # type: ignore[valid-type]
    bearing_damping: _q(units.DAMPING, ge=0) = 0.0  # type: ignore[valid-type]
    nut_stiffness: _q(units.STIFFNESS, gt=0) | None = None  # type: ignore[valid-type]
    nut_damping: _q(units.DAMPING, ge=0) = 0.0  # type: ignore[valid-type]
    guide_damping: _q(units.DAMPING, ge=0) = 0.0  # type: ignore[valid-type]


class Ends(Part):
    """Where a ball screw holds on to the machine: Dofs ``point:direction`` of base, table and tool, and the drive it replaces.

    `replaces` is the path of the machine's own drive stiffness, which the ball screw takes the place of.
    """

    base: str
    table: str
    tool: str
    replaces: str


class Friction(Part):
    """Friction at the motor shaft."""

    law: Literal["none", "coulomb", "stribeck", "lugre"]
    coulomb: _q(units.MOMENT, ge=0) = 0.0  # type: ignore[valid-type]
    static: _q(units.MOMENT, ge=0) | None = None  # type: ignore[valid-type]
    stribeck_velocity: _q(units.ANGULAR_SPEED, gt=0) | None = None  # type: ignore[valid-type]
    viscous: _q(units.TURNING_DAMPING, ge=0) = 0.0  # type: ignore[valid-type]
    bristle_stiffness: _q(units.TURNING_STIFFNESS, gt=0) | None = None  # type: ignore[valid-type]
    bristle_damping: _q(units.TURNING_DAMPING, ge=0) = 0.0  # type: ignore[valid-type]


class Position(Part):
    """Position P loop."""

    gain: _q(units.RATE, gt=0)  # type: ignore[valid-type]
    sample_time: _q(units.TIME, gt=0) = 1e-3  # type: ignore[valid-type]
    velocity_feedforward: _q(units.RATIO, ge=0, le=2) = 0.0  # type: ignore[valid-type]
    feedback: Literal["motor", "scale"] = "motor"


class Velocity(Part):
    """Velocity PI loop."""

    gain: _q(units.TURNING_DAMPING, gt=0)  # type: ignore[valid-type]
    integral_time: _q(units.TIME, gt=0) | None = None  # type: ignore[valid-type]
    sample_time: _q(units.TIME, gt=0) = 2.5e-4  # type: ignore[valid-type]
    limit: _q(units.MOMENT, gt=0) | None = None  # type: ignore[valid-type]


class DriveAxis(Part):
    """One axis."""

    mechanics: Mechanics
    friction: Friction = Friction(law="none")
    position: Position
    velocity: Velocity
    ends: Ends | None = None
    source: str = ""


class Limits(Part):
    """Limits of the set points along the path."""

    speed: _q(units.FEED, gt=0)  # type: ignore[valid-type]
    acceleration: _q(units.ACCELERATION, gt=0)  # type: ignore[valid-type]
    jerk: _q(units.JERK, gt=0)  # type: ignore[valid-type]


class Drives(Part):
    """A drive file: at least one axis, the limits of the set points, and what was assumed."""

    toolpoint: int
    name: str
    axes: dict[str, DriveAxis]
    limits: Limits = Limits(speed=0.5, acceleration=3.0, jerk=100.0)
    corner_tolerance: _q(units.LENGTH, ge=0) = 0.0  # type: ignore[valid-type]
    source: str = ""
    assumptions: tuple[str, ...] = ()


def read(path: str | Path) -> Drives:
    """Return the drives of a YAML file, SI; raises FileFaults with every fault of the file."""
    document = parsed(Path(path))
    if document.data.get("toolpoint") != VERSION:
        document.fault(("toolpoint",), f"file version {document.data.get('toolpoint')!r}; this program reads version {VERSION}")
    found: Drives | None = validated(Drives, document.data, (), document)
    axes: Any = found.axes if found is not None else {}
    if found is not None and not axes:
        document.fault(("axes",), "missing; a drive file needs at least one axis")
    for name, axis in axes.items():
        _complete(name, axis, document)
    if document.faults or found is None:
        raise FileFaults(str(path), document.text, document.faults)
    return found


def _complete(name: str, axis: DriveAxis, document: Any) -> None:
    screw = ("screw_inertia", "screw_mass", "coupling_stiffness", "bearing_stiffness", "nut_stiffness")
    needed = {"two-mass": ("table_mass", "stiffness"), "ball-screw": screw}.get(axis.mechanics.kind, ())
    if axis.mechanics.kind == "ball-screw" and axis.ends is None:
        document.fault(("axes", name), "'ends' is missing; a ball screw needs base, table, tool and the stiffness it replaces")
    for key in needed:
        if getattr(axis.mechanics, key) is None:
            document.fault(("axes", name, "mechanics"), f"{key!r} is missing; a {axis.mechanics.kind} axis needs it")
    more = {"stribeck": ("static", "stribeck_velocity"), "lugre": ("static", "stribeck_velocity", "bristle_stiffness")}
    for key in more.get(axis.friction.law, ()):
        if getattr(axis.friction, key) is None:
            document.fault(("axes", name, "friction"), f"{key!r} is missing; the law {axis.friction.law!r} needs it")
