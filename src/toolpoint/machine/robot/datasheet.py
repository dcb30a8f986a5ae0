"""Published data of a robot and the choices beside it: plain frozen data, one to one with a datasheet file, SI units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from toolpoint._check import suggestion
from toolpoint._quantity import Key, Quantity, limit_faults
from toolpoint.joints import Reducer
from toolpoint.machine.description.elastic import PatchDescription

Place = Annotated[float, Quantity("length", "m")]
Turn = Annotated[float, Quantity("angle", "rad")]
PositivePlace = Annotated[float, Quantity("length", "m", above=0)]
PositiveWeight = Annotated[float, Quantity("mass", "kg", above=0)]
PositiveTorque = Annotated[float, Quantity("moment", "N*m", above=0)]
PositiveTurning = Annotated[float, Quantity("angular speed", "rad/s", above=0)]
PositiveSpeed = Annotated[float, Quantity("spindle speed", "rpm", above=0)]
SmallInertia = Annotated[float, Quantity("moment of inertia", "kg*m^2", above=0)]
PositiveModulus = Annotated[float, Quantity("pressure", "Pa", above=0)]
PositiveShare = Annotated[float, Quantity("ratio", "1", above=0)]
Gravity = Annotated[float, Quantity("acceleration", "m/s^2", least=0)]
StopTime = Annotated[float, Quantity("time", "s", above=0)]
ManualForce = Annotated[float, Quantity("force", "N", least=0)]
Bending = Literal[False, True, "rigid", "beam", "finite elements"]
ManualMoment = Annotated[float, Quantity("moment", "N*m", least=0)]


@dataclass(frozen=True)
class PrintedGearing:
    """Gearing of an axis as its source prints it, compared with the computed one; left out where it prints nothing."""

    total_ratio: float | None = None
    reducer_ratio: float | None = None
    torque: PositiveTorque | None = None


@dataclass(frozen=True)
class RobotAxis:
    """An axis: its Denavit-Hartenberg row (standard), travel, and what drives it.

    coupled : further axes that move its joint, by factor. largest_speed : rad/s. motor, reducer : by name; without a reducer
    the one of the nearest ratio is chosen among those of the `size` (diameter, m, seen in drawings). stage : ratio of the belt
    or gear between motor and reducer.
    """

    name: str
    largest_speed: PositiveTurning
    motor: str
    theta: Turn = 0.0
    d: Place = 0.0
    a: Place = 0.0
    alpha: Turn = 0.0
    coupled: Mapping[str, float] = field(default_factory=dict)
    lower: Turn = -6.283185307179586
    upper: Turn = 6.283185307179586
    load_moment: PositiveTorque | None = None
    stage: float = 1.0
    reducer: str = ""
    size: PositivePlace | None = None
    printed: PrintedGearing = PrintedGearing()
    source: str = ""


@dataclass(frozen=True)
class RobotMotor:
    """A motor: stall torque N m, speed rev/min, mass kg, rotor inertia kg m^2 where known; a cylinder when it is placed."""

    stall_torque: PositiveTorque
    speed: PositiveSpeed
    mass: PositiveWeight
    inertia: SmallInertia | None = None
    diameter: PositivePlace = 0.06
    length: PositivePlace = 0.09
    source: str = ""


@dataclass(frozen=True)
class MotorPlace:
    """Place of the motor of an axis: the link that carries it (0 is the base), its centre (m) and axis at the reference
    pose."""

    axis: str
    link: int
    at: tuple[Place, ...]
    along: Literal["x", "y", "z"] = "z"
    source: str = ""


@dataclass(frozen=True)
class RobotMember:
    """A part of a link (0 is the base, 1 the first that moves): a box, a cylinder or a mesh in the machine frame at rest.

    fill : share of the calibrated density, below 1 for a hollow casting; mass : in its place, where it is known. elastic :
    how it bends, along `along` (the first member of its link), hollow with a `wall` (m), of a `modulus` (Pa, Poisson's ratio
    0.33) and a loss factor: ``rigid``, ``beam`` (a box or a cylinder) or ``finite elements``; false is rigid, true a beam. A
    mesh by finite elements is held at its flat faces `near` and `far`, that of the next joint.
    """

    link: int
    kind: Literal["box", "cylinder", "mesh"] = "box"
    at: tuple[Place, ...] = (0.0, 0.0, 0.0)
    size: tuple[PositivePlace, ...] = ()
    diameter: PositivePlace | None = None
    length: PositivePlace | None = None
    along: Literal["x", "y", "z"] = "z"
    bore: Annotated[float, Quantity("length", "m", least=0)] = 0.0
    mesh: str = ""
    mesh_unit: PositivePlace = 1.0
    mesh_size: PositivePlace | None = None
    near: PatchDescription | None = None
    far: PatchDescription | None = None
    elastic: Bending = False
    wall: PositivePlace | None = None
    modulus: PositiveModulus = 70e9
    loss_factor: Annotated[float, Quantity("ratio", "1", least=0, most=0.5)] = 0.005
    fill: PositiveShare = 1.0
    mass: PositiveWeight | None = None
    source: str = ""

    @property
    def bending(self) -> str:
        """``rigid``, ``beam`` or ``finite elements``."""
        if isinstance(self.elastic, str):
            return self.elastic
        return "beam" if self.elastic else "rigid"


@dataclass(frozen=True)
class RobotPayload:
    """Load of the last link: a cylinder from the flange outwards, its mass, and the distance of the tool's tip from the
    flange."""

    mass: PositiveWeight
    diameter: PositivePlace
    length: PositivePlace
    tip: PositivePlace
    source: str = ""


@dataclass(frozen=True)
class PublishedLoad:
    """Base reaction of the maker's manual: vertical and horizontal force (N), moment about a horizontal and the vertical
    axis."""

    vertical_force: ManualForce
    vertical_moment: ManualMoment
    horizontal_force: ManualForce = 0.0
    horizontal_moment: ManualMoment = 0.0
    source: str = ""


@dataclass(frozen=True)
class RobotDatasheet:
    """A robot as published, and what was chosen beside it.

    weight : kg, of the robot without payload, to which the density of the members is calibrated. floor : m, height of the
    mounting face in the machine frame. stop_time : s, in which the axes
    come to rest at a power-off stop. Every `source` begins with published, computed or chosen.
    """

    name: str
    axes: tuple[RobotAxis, ...]
    motors: Mapping[str, RobotMotor]
    catalogue: Mapping[str, Reducer]
    members: Mapping[str, RobotMember]
    weight: PositiveWeight
    payload: RobotPayload
    motor_places: tuple[MotorPlace, ...] = ()
    reach: PositivePlace | None = None
    floor: Place = 0.0
    gravity: Gravity = 9.80665
    stop_time: StopTime = 0.1
    stillness: PublishedLoad | None = None
    power_off: PublishedLoad | None = None
    damping_ratio: Annotated[float, Quantity("ratio", "1", above=0, most=0.5)] | None = None
    source: str = ""
    assumptions: tuple[str, ...] = ()


_SHEET_ORIGINS = ("published", "computed", "chosen")


def find_datasheet_faults(sheet: RobotDatasheet) -> Iterator[tuple[Key, str]]:
    """Yield place and text of every fault of a datasheet, in file order."""
    outside = list(limit_faults(sheet))
    if outside:
        yield from outside
        return
    names = [axis.name for axis in sheet.axes]
    if not names:
        yield ("axes",), "none; a robot needs at least one"
    for i, axis in enumerate(sheet.axes):
        yield from _axis_faults(sheet, ("axes", i), axis, names)
    for i, place in enumerate(sheet.motor_places):
        if place.axis not in names:
            yield ("motor_places", i, "axis"), f"no axis {place.axis!r}; must be of {', '.join(names)}"
        yield from _place_faults(("motor_places", i), place.link, place.at, len(names))
    for name, member in sheet.members.items():
        yield from _place_faults(("members", name), member.link, member.at, len(names))
        yield from _shape_faults(("members", name), member)
    yield from _origin_faults(sheet)


def _axis_faults(sheet: RobotDatasheet, key: Key, axis: RobotAxis, names: list[str]) -> Iterator[tuple[Key, str]]:
    if names.count(axis.name) > 1:
        yield (*key, "name"), f"axis {axis.name} appears twice; every row needs an axis of its own"
    if not axis.lower < axis.upper:
        yield (*key,
               "lower"), f"limits {axis.lower:g} .. {axis.upper:g} rad; the lower must be below the upper (are they reversed?)"
    if axis.motor not in sheet.motors:
        hint = suggestion(axis.motor, sheet.motors)
        yield (*key, "motor"), f"no motor {axis.motor!r}; must be of {', '.join(sheet.motors)}" + (f"; {hint}" if hint else "")
    if axis.reducer and axis.reducer not in sheet.catalogue:
        hint = suggestion(axis.reducer, sheet.catalogue)
        yield (*key, "reducer"), (f"no {axis.reducer!r} in the catalogue; must be of {', '.join(sheet.catalogue)}"
                                  + (f"; {hint}" if hint else ""))
    if not axis.stage > 0:
        yield (*key, "stage"), f"{axis.stage:g}; must be above 0"
    for name in axis.coupled:
        if name not in names:
            yield (*key, "coupled", name), f"no axis {name!r}; must be of {', '.join(names)}"


def _place_faults(key: Key, link: int, coordinates: tuple[float, ...], links: int) -> Iterator[tuple[Key, str]]:
    if not 0 <= link <= links:
        yield (*key, "link"), f"{link}; must be 0 (the base) to {links}"
    if len(coordinates) != 3:
        yield (*key, "at"), f"{len(coordinates)} numbers; must be 3"


def _shape_faults(key: Key, member: RobotMember) -> Iterator[tuple[Key, str]]:
    if member.kind == "box" and len(member.size) != 3:
        yield (*key, "size"), "a box needs three sizes"
    if member.kind == "cylinder" and (member.diameter is None or member.length is None):
        yield (*key, "diameter"), "a cylinder needs diameter and length"
    if member.bending == "beam" and member.kind == "mesh":
        yield (*key, "elastic"), "a mesh; only boxes and cylinders bend as beams"
    if member.bending == "finite elements" and member.bore:
        yield (*key, "bore"), "a bore through both ends; finite elements are held by them: give the tube a wall instead"
    if member.kind == "mesh" and not member.mesh:
        yield (*key, "mesh"), "missing; the STL file beside this one"
    if member.kind == "mesh" and member.bending == "finite elements":
        yield from _solid_faults(key, member)


def _solid_faults(key: Key, member: RobotMember) -> Iterator[tuple[Key, str]]:
    if member.mesh.lower().endswith(".stl"):
        yield (*key, "mesh"), (f"{member.mesh} is a surface alone; finite elements need a STEP solid, or a mesh of 10-node "
                               "tetrahedra or 20-node hexahedra (.inp, .cdb, .bdf)")
    for name in ("near", "far"):
        if getattr(member, name) is None:
            yield (*key, name), ("missing; a mesh by finite elements needs the flat faces that hold it: centre, along, across, "
                                 "length, width")


def _origin_faults(sheet: RobotDatasheet) -> Iterator[tuple[Key, str]]:
    parts: list[tuple[Key, str]] = [(("axes", i), axis.source) for i, axis in enumerate(sheet.axes)]
    for room in ("motors", "catalogue", "members"):
        parts += [((room, name), part.source) for name, part in getattr(sheet, room).items()]
    parts += [(("motor_places", i), place.source) for i, place in enumerate(sheet.motor_places)]
    parts += [(("payload",), sheet.payload.source)]
    for key, source in parts:
        if not source.startswith(_SHEET_ORIGINS):
            text = f"{source!r}; must begin with published, computed or chosen: where its numbers come from"
            yield (*key, "source"), text
