"""Datasheet -> machine: links from members of a calibrated density, motors and reducers as masses, reducers as elastic
joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail, one_of
from toolpoint.cutting.description import CuttingDescription
from toolpoint.joints import Reducer
from toolpoint.kinematics.arms.denavit_hartenberg import ArmRow, arm_frames
from toolpoint.machine import description as d
from toolpoint.machine.description.elastic import SolidBody
from toolpoint.machine.description.frames import describe_frame, frame
from toolpoint.machine.parts.mass import mass_properties
from toolpoint.machine.robot.datasheet import RobotDatasheet, RobotMember, find_datasheet_faults
from toolpoint.machine.robot.gearing import compute_gearing, reducers_of
from toolpoint.machine.robot.lumped_beam import beam_springs, split
from toolpoint.machine.robot.solid_member import FAR_FACE, NEAR_FACE, mesh_member, middle_of, solid_member, surface_of
from toolpoint.spatial import transform as tf

REDUCER_LENGTH = 0.4  # of its diameter, as a cylinder of uniform density (chosen)
Meshes = Mapping[str, d.MeshDescription]
Holder = tuple[str, str | None]  # a body, and its interface where it is of finite elements


def rigid_members(sheet: RobotDatasheet) -> RobotDatasheet:
    """Return the datasheet with all members rigid."""
    return replace(sheet, members={name: replace(part, elastic="rigid") for name, part in sheet.members.items()})


def bending_members(sheet: RobotDatasheet, bending: str) -> RobotDatasheet:
    """Return the datasheet with every member that bends doing so as a ``beam`` or by ``finite elements``: those that can."""
    one_of("bending", bending, ("beam", "finite elements"))

    def bends(part: RobotMember) -> bool:
        return part.bending != "rigid" and (part.kind != "mesh" if bending == "beam" else not part.bore)

    return replace(sheet, members={name: replace(part, elastic=bending) if bends(part) else part  # type: ignore[arg-type]
                                   for name, part in sheet.members.items()})


def robot_machine(sheet: RobotDatasheet, *, cutting: CuttingDescription | None = None, meshes: Meshes | None = None,
                  solids: Mapping[str, SolidBody] | None = None, loads: Mapping[str, float] | None = None,
                  pose: Mapping[str, float] | None = None) -> d.MachineDescription:
    """Return the machine of a datasheet.

    Parameters
    ----------
    sheet : RobotDatasheet
    cutting : CuttingDescription, optional
    meshes : mapping of member to MeshDescription
        Of members that are meshes.
    solids : mapping of member to SolidBody
        Of members that are meshes by finite elements, in the machine frame.
    loads : mapping of axis to N m, optional
        Torque about which the torsion of each reducer is linearised, no load of an axis left out of it; that of gravity at
        `pose` where not given.
    pose : mapping of axis to rad, optional
        The pose of interest; the reference pose where left out.

    Raises
    ------
    ToolpointError
        With all faults of the datasheet; for a link without mass, or a weight that leaves nothing for the members.
    """
    faults = [f"{'.'.join(map(str, key))}: {text}" for key, text in find_datasheet_faults(sheet)]
    if faults:
        raise ToolpointError("\n".join(faults))
    rows = arm_rows(sheet)
    joints, links = arm_frames(rows)
    all_meshes = _all_meshes(meshes, solids)
    density = calibrate_density(sheet, all_meshes)
    gathered = _Gathered(sheet, density, all_meshes, dict(solids or {}), flange=links[-1])
    torques = gravity_loads(sheet, pose, meshes=all_meshes) if loads is None else loads
    gathered.add_links(joints, torques)
    gathered.add_masses(joints)
    tip = gathered.add_payload(links[-1])
    drives: dict[str, list[d.DrivenDirection]] = {row.axis: [] for row in rows}
    for row in rows:
        drives[row.axis].insert(0, d.DrivenDirection(f"joint_{row.axis}", "rz"))
        for name, factor in row.coupled.items():
            drives[name].append(d.DrivenDirection(f"joint_{row.axis}", "rz", factor))
    axes = {row.axis: d.AxisDescription(drives=tuple(drives[row.axis]), limits=(row.lower, row.upper)) for row in rows}
    outward = links[-1][:3, 2]
    return d.MachineDescription(
        sheet.name, gathered.bodies, gathered.joints, axes,
        {"tip": d.PointDescription("payload", _vector(tip)), "flange": d.PointDescription("payload", _vector(links[-1][:3, 3])),
         "wrist": d.PointDescription(f"link{len(rows)}", _vector(joints[-1][:3, 3]), gathered.starts[-1][1]),
         "base": d.PointDescription("link0", (0.0, 0.0, sheet.floor), gathered.starts[0][1])},
        tool="tip", damping_ratio=sheet.damping_ratio, cutting=cutting, source=sheet.source,
        assumptions=(*sheet.assumptions,
                     f"computed: members have {density:.1f} kg/m^3 times their fill, so that the robot weighs "
                     f"{sheet.weight:g} kg", *_unplaced(sheet),
                     *_slope_words(sheet, torques, pose, has_loads=loads is not None)),
        tool_axis=_vector(-outward))


def gravity_loads(sheet: RobotDatasheet, pose: Mapping[str, float] | None = None, *, meshes: Meshes | None = None
                  ) -> dict[str, float]:
    """Return the torque (N m) that gravity puts on the reducer of every axis at a pose (rad), the arm at rest.

    With coupled axes it is that of the joint, which is not the torque of the axis.
    """
    rows = arm_rows(sheet)
    positions = {name: float(value) for name, value in (pose or {}).items()}
    unknown = next((name for name in positions if name not in {row.axis for row in rows}), None)
    if unknown is not None:
        fail("pose", f"no axis {unknown!r}", f"must be of {', '.join(row.axis for row in rows)}")
    joints, links = arm_frames(rows)
    rigid = _Gathered(rigid_members(sheet), calibrate_density(sheet, meshes), dict(meshes or {}), {}, flange=links[-1])
    rigid.add_links(joints, {})
    rigid.add_masses(joints)
    rigid.add_payload(links[-1])
    turned = [positions.get(row.axis, 0.0) + sum(factor * positions.get(name, 0.0) for name, factor in row.coupled.items())
              for row in rows]
    moved = [replace(row, theta=float((row.theta + q + np.pi) % (2 * np.pi) - np.pi))
             for row, q in zip(rows, turned, strict=True)]
    joint_places, ends = arm_frames(moved)
    moments = np.zeros((len(rows) + 1, 4))  # of every link: mass, and mass times its centre at the pose
    for name, body in rigid.bodies.items():
        link = name if name.startswith("link") else rigid.joints[f"fixing_{name}"].parent
        number = int(link.removeprefix("link"))
        properties = mass_properties(body).moved(frame(body.frame))
        carried = np.eye(4) if number == 0 else ends[number - 1] @ tf.inverse(links[number - 1])
        moments[number] += properties.mass * np.array([1.0, *(carried[:3, :3] @ properties.centre + carried[:3, 3])])
    carried_moments = np.cumsum(moments[:0:-1], axis=0)[::-1]  # of joint i: all links from the i-th on
    lever = carried_moments[:, 1:] - carried_moments[:, :1] * joint_places[:, :3, 3]
    torque = np.einsum("ni,ni->n", joint_places[:, :3, 2], np.cross(lever, [0.0, 0.0, -sheet.gravity]))
    return {row.axis: float(np.round(value, 9)) + 0.0 for row, value in zip(rows, torque, strict=True)}


def _all_meshes(meshes: Meshes | None, solids: Mapping[str, SolidBody] | None) -> dict[str, d.MeshDescription]:
    """Return the surfaces of all members that are meshes, those by finite elements too."""
    return {**{name: surface_of(solid) for name, solid in (solids or {}).items()}, **(meshes or {})}


def _unplaced(sheet: RobotDatasheet) -> list[str]:
    """Return the assumption on motors and reducers that have a mass and no place or size."""
    unplaced = [f"motor of {axis.name}" for axis in sheet.axes if not _is_placed(sheet, axis.name)]
    unplaced += [f"reducer of {axis}" for axis, part in reducers_of(sheet).items() if part.mass and part.diameter is None]
    return [f"chosen: no place or size is given of the {', '.join(unplaced)}: the members carry that mass"] if unplaced else []


def _slope_words(sheet: RobotDatasheet, loads: Mapping[str, float], pose: Mapping[str, float] | None, *, has_loads: bool
                 ) -> list[str]:
    """Return the assumptions on reducers whose torsion has several slopes, or a hysteresis that is neglected."""
    lines = []
    sloped_reducers = {axis: part for axis, part in reducers_of(sheet).items() if part.has_slopes}
    if sloped_reducers:
        rows = [f"{axis} {part.linearise(loads.get(axis, 0.0)).stiffness:.4g} N m/rad at {abs(loads.get(axis, 0.0)):.3g} N m"
                for axis, part in sloped_reducers.items()]
        load_words = "the loads given" if has_loads else "gravity's load at the " + ("pose given" if pose else "reference pose")
        lines.append(f"computed: torsion of several slopes is linearised about {load_words}: {', '.join(rows)}")
    hysteretic = [axis for axis, part in reducers_of(sheet).items() if part.hysteresis > 0]
    if hysteretic:
        lines.append(f"chosen: the hysteresis of the reducers of {', '.join(hysteretic)} is left out of the machine: vibration "
                     "much smaller than it sees more stiffness and a loss")
    return lines


def arm_rows(sheet: RobotDatasheet) -> list[ArmRow]:
    """Return the Denavit-Hartenberg table of a datasheet."""
    return [ArmRow(a.name, a.theta, a.d, a.a, a.alpha, coupled=a.coupled, lower=a.lower, upper=a.upper) for a in sheet.axes]


def calibrate_density(sheet: RobotDatasheet, meshes: Meshes | None = None) -> float:
    """Return the density (kg/m^3) of a member of fill 1 that makes robot, motors and reducers weigh what the datasheet says."""
    known_weight = sum(sheet.motors[axis.motor].mass for axis in sheet.axes if _is_placed(sheet, axis.name))
    known_weight += sum(part.mass or 0.0 for part in reducers_of(sheet).values() if part.diameter is not None)
    known_weight += sum(member.mass or 0.0 for member in sheet.members.values())
    volume = sum(_filled_volume(name, member, dict(meshes or {})) for name, member in sheet.members.items()
                 if member.mass is None)
    if volume == 0:
        fail("members", "none of unknown mass", "at least one must take up the rest of the weight",
             remedy="leave the mass of one out")
    if sheet.weight <= known_weight:
        fail("weight", f"{sheet.weight:g} kg",
             f"must be above that of motors, reducers and known members, {known_weight:.3g} kg")
    return (sheet.weight - known_weight) / volume


def _is_placed(sheet: RobotDatasheet, axis: str) -> bool:
    """Whether the datasheet says where the motor of an axis is."""
    return any(place.axis == axis for place in sheet.motor_places)


def _filled_volume(name: str, member: RobotMember, meshes: Meshes) -> float:
    """Return the volume of a member times its fill, m^3: its mass at a density of one."""
    return mass_properties(_body(name, member, 1.0, meshes)).mass


def _body(name: str, member: RobotMember, density: float, meshes: Meshes) -> d.BodyDescription:
    """Return the rigid body of a member of stated mass, or of a density (kg/m^3) times its fill."""
    shape = None
    if member.kind == "mesh":
        if name not in meshes:
            fail(f"members.{name}.mesh", member.mesh or "none", "its triangles must be given",
                 remedy="read the datasheet from its file")
    elif member.kind == "box":
        shape = d.ShapeDescription("box", size=_vector(np.array(member.size)))
    else:
        shape = d.ShapeDescription("cylinder", diameter=member.diameter, length=member.length, axis=member.along,
                                   bore=member.bore)
    return d.BodyDescription(member.mass, _vector(np.array(member.at)), shape=shape, mesh=meshes.get(name),
                             density=density * member.fill if member.mass is None else None, source=member.source)


class _Gathered:
    """Bodies and joints of the machine while they are gathered."""

    def __init__(self, sheet: RobotDatasheet, density: float, meshes: Meshes, solids: Mapping[str, SolidBody], *,
                 flange: FloatArray) -> None:
        self.sheet, self.density, self.meshes, self.solids, self.flange = sheet, density, meshes, solids, flange
        self.ends: list[Holder] = []  # of every link, what carries the next joint
        self.starts: list[Holder] = []  # and what its own joint holds
        self.cuts: list[tuple[int, float, float] | None] = []  # of an elastic one: direction, sense and place of its middle
        self.bodies: dict[str, d.BodyDescription] = {}
        self.joints: dict[str, d.JointDescription] = {}

    def add_links(self, frames: FloatArray, loads: Mapping[str, float]) -> None:
        """Add the base, the links and the reducers' joints; the first member of a link gives its body, others are fixed to
        it."""
        reducers = reducers_of(self.sheet)
        for number in range(len(self.sheet.axes) + 1):
            members = {name: part for name, part in self.sheet.members.items() if part.link == number}
            if not members:
                fail("members", f"none of link {number}", "every link needs at least one", remedy="a small one will do")
            link = f"link{number}"
            (name, first), *others = members.items()
            outward = (frames[number] if number < len(frames) else self.flange)[:3, 3] - np.array(first.at)
            self._add_link(link, name, first, outward)
            for other, part in others:
                self._fix(other, self._holder_at(number, np.array(part.at)), _body(other, part, self.density, self.meshes))
            if number == 0:
                self.joints["fixing"] = d.JointDescription("ground", link, child_interface=self.starts[0][1],
                                                           source="chosen: rigid floor")
            else:
                axis = self.sheet.axes[number - 1]
                self.joints[f"joint_{axis.name}"] = _reducer_joint(
                    self.ends[number - 1], self.starts[number], frames[number - 1], reducer=reducers[axis.name],
                    load=loads.get(axis.name, 0.0))

    def _add_link(self, link: str, name: str, member: RobotMember, outward: FloatArray) -> None:
        """Add the body of a link, rigid or by finite elements, or its two halves on the springs of a beam."""
        if member.bending == "rigid":
            self.bodies[link] = replace(_body(name, member, self.density, self.meshes), source=f"{name}: {member.source}")
            self._hold((link, None), (link, None), None)
            return
        along = "xyz".index(member.along)
        middle, way = middle_of(member)
        sense = 1.0 if (way if way.any() else outward)[along] >= 0 else -1.0
        cut = (along, sense, float(middle[along]))
        if member.bending == "finite elements":
            mass = mass_properties(_body(name, member, self.density, self.meshes)).mass
            self.bodies[link] = (mesh_member(name, member, self._solid(name), mass=mass) if member.kind == "mesh" else
                                 solid_member(name, member, mass, sense=sense))
            self._hold((link, NEAR_FACE), (link, FAR_FACE), cut)
            return
        for body, part in zip((link, f"{link}_end"), split(member, sense), strict=True):
            self.bodies[body] = replace(_body(name, part, self.density, self.meshes), source=f"half of {name}: {member.source}")
        self.joints[f"member_{name}"] = d.JointDescription(
            link, f"{link}_end", d.FrameDescription(_vector(np.array(member.at))), beam_springs(name, member),
            loss_factor=member.loss_factor, source=f"computed: a beam of {member.modulus / 1e9:g} GPa")
        self._hold((link, None), (f"{link}_end", None), cut)

    def _solid(self, name: str) -> SolidBody:
        """Return the finite elements of a member; raises where they are not given."""
        if name not in self.solids:
            fail(f"members.{name}.mesh", "no finite elements", "must be given", remedy="read the datasheet from its file")
        return self.solids[name]

    def _hold(self, start: Holder, end: Holder, cut: tuple[int, float, float] | None) -> None:
        """Keep the bodies at the start and the end of a link, and the cut (way, sense, place) between its halves."""
        self.starts.append(start)
        self.ends.append(end)
        self.cuts.append(cut)

    def _holder_at(self, number: int, place: FloatArray) -> Holder:
        """Return the holder of a part at a place of a link: the half, or the end of finite elements, on whose side it is."""
        cut = self.cuts[number]
        is_beyond = cut is not None and (place[cut[0]] - cut[2]) * cut[1] > 0
        return self.ends[number] if is_beyond else self.starts[number]

    def _fix(self, name: str, holder: Holder, body: d.BodyDescription) -> None:
        """Fix a body to the half of a link or the face that holds it."""
        self.bodies[name] = body
        self.joints[f"fixing_{name}"] = d.JointDescription(holder[0], name, parent_interface=holder[1], source="fixed")

    def add_masses(self, frames: FloatArray) -> None:
        """Add motors where they are placed and reducers around their axes, on the link before."""
        for place in self.sheet.motor_places:
            axis = next(axis for axis in self.sheet.axes if axis.name == place.axis)
            motor = self.sheet.motors[axis.motor]
            shape = d.ShapeDescription("cylinder", diameter=motor.diameter, length=motor.length, axis=place.along)
            self._fix(f"motor_{axis.name}", self._holder_at(place.link, np.array(place.at)), d.BodyDescription(
                mass=motor.mass, centre=_vector(np.array(place.at)), shape=shape,
                source=f"mass {motor.source}; place {place.source}"))
        for number, (row, part) in enumerate(zip(compute_gearing(self.sheet), reducers_of(self.sheet).values(), strict=True)):
            if part.mass is None or part.diameter is None:
                continue
            shape = d.ShapeDescription("cylinder", diameter=part.diameter, length=REDUCER_LENGTH * part.diameter)
            self._fix(f"reducer_{row.axis}", self._holder_at(number, frames[number][:3, 3]), d.BodyDescription(
                mass=part.mass, shape=shape, frame=describe_frame(frames[number]), source=f"{row.reducer}: {part.source}"))

    def add_payload(self, flange: FloatArray) -> FloatArray:
        """Add the payload to the last link; return where the tool's tip is."""
        load = self.sheet.payload
        middle = flange @ tf.transform(None, [0.0, 0.0, load.length / 2])
        body = d.BodyDescription(
            mass=load.mass, shape=d.ShapeDescription("cylinder", diameter=load.diameter, length=load.length),
            frame=describe_frame(middle), source=load.source)
        # Points of the payload are in the machine frame like all others: its own frame would hide the tip's place.
        self._fix("payload", self.ends[-1], _in_machine_frame(body))
        return flange[:3, 3] + load.tip * flange[:3, 2]


def _in_machine_frame(body: d.BodyDescription) -> d.BodyDescription:
    """Return a body with mass, centre and inertia in the machine frame at the reference pose."""
    properties = mass_properties(body).moved(frame(body.frame))
    tensor = properties.inertia
    inertia = d.InertiaDescription(float(tensor[0, 0]), float(tensor[1, 1]), float(tensor[2, 2]), float(tensor[0, 1]),
                                   float(tensor[0, 2]), float(tensor[1, 2]))
    return d.BodyDescription(mass=properties.mass, centre=_vector(properties.centre), inertia=inertia, source=body.source)


def _reducer_joint(parent: Holder, child: Holder, place: FloatArray, *, reducer: Reducer, load: float) -> d.JointDescription:
    """Return the joint of a reducer: torsion linearised about a load (N m), bending, and dampers."""
    torsion = reducer.linearise(load)
    assert reducer.bending is not None
    dampers = {"rx": reducer.bending_damping, "ry": reducer.bending_damping, "rz": reducer.damping}
    return d.JointDescription(parent[0], child[0], describe_frame(place),
                              {"rx": reducer.bending, "ry": reducer.bending, "rz": torsion.stiffness},
                              {way: value for way, value in dampers.items() if value > 0},
                              parent_interface=parent[1], child_interface=child[1], source=reducer.source)


def _vector(values: FloatArray) -> d.Vector:
    """Return three numbers as plain floats, as descriptions hold them."""
    x, y, z = (float(v) for v in values)
    return x, y, z
