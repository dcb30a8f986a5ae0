"""Robots in URDF as machines with rigid joints.

The root link is the ground. Links without inertia that are fixed become points; a moving one without inertia is a fault. Every
moving joint gets a frame whose z lies along its axis, and an axis of its own; a mimicking joint is driven by the axis that it
follows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail
from toolpoint.bodies.inertia import inertia_fault
from toolpoint.io.door import door
from toolpoint.io.urdf.audit import question_inertias
from toolpoint.io.urdf.robot import DIRECTION_OF_KIND, UrdfLink, UrdfRobot, parse_robot
from toolpoint.machine import description as d
from toolpoint.machine.description.frames import describe_frame
from toolpoint.spatial import rotation
from toolpoint.spatial import transform as tf


@door("URDF file")
def read_robot(path: str | Path, mass: float | None = None) -> UrdfRobot:
    """Return the links and joints of a URDF file with doubts about its inertias.

    mass : kg, of the whole robot by its catalogue, to compare with. Raises ToolpointError for a damaged file, cycles, several
    roots, joints of kinds that are not read, and links that move without inertia.

    >>> import tempfile
    >>> inertial = "<inertial><mass value='2'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "block.urdf")
    ...     _ = file.write_text(f"<robot name='block'><link name='base'>{inertial}</link></robot>")
    ...     list(read_robot(file).links)
    ['base']
    """
    robot = parse_robot(Path(path))
    return replace(robot, doubts=tuple(question_inertias(robot, mass)))


def read(path: str | Path, stiffness: Mapping[str, Mapping[str, float]] | None = None) -> d.MachineDescription:
    r"""Return the machine of a URDF file; joints are rigid unless `stiffness` names them (joint -> direction -> N m/rad, N/m).

    Doubts about its inertias stand among the assumptions. A link whose inertia no body can have is refused.

    >>> import tempfile
    >>> inertial = "<inertial><mass value='2'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>"
    >>> joint = "<joint name='q1' type='revolute'><parent link='base'/><child link='arm'/><axis xyz='0 0 1'/>" \
    ...         "<limit lower='-1' upper='1' effort='0' velocity='0'/></joint>"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "arm.urdf")
    ...     _ = file.write_text(f"<robot name='arm'><link name='base'/><link name='arm'>{inertial}</link>{joint}</robot>")
    ...     machine = read(file)
    >>> machine.axes["q1"].limits
    (-1.0, 1.0)
    """
    robot = read_robot(path)
    elastic = dict(stiffness or {})
    for name in elastic:
        if name not in robot.joints:
            fail("stiffness", f"no joint {name!r}", f"must be of {', '.join(robot.joints)}")
    frames = _frames(robot)
    body_of = _bodies_of(robot)
    bodies = {name: _body(link, frames[name]) for name, link in robot.links.items() if body_of[name] == name}
    joints: dict[str, d.JointDescription] = {}
    drives: dict[str, list[d.DrivenDirection]] = {}
    for joint in robot.joints.values():
        if body_of[joint.child] != joint.child:
            continue
        joint_frame = frames[joint.parent] @ joint.place @ tf.transform(_z_onto(joint.axis))
        joints[joint.name] = d.JointDescription(body_of[joint.parent], joint.child, describe_frame(joint_frame),
                                                dict(elastic.get(joint.name, {})))
        if joint.kind in DIRECTION_OF_KIND:
            leader, factor = joint.mimics or (joint.name, 1.0)
            drives.setdefault(leader, []).append(d.DrivenDirection(joint.name, DIRECTION_OF_KIND[joint.kind], factor))
    axes = {name: d.AxisDescription(limits=robot.joints[name].limits, drives=tuple(each)) for name, each in drives.items()}
    points = {name: _point(name, body_of[name], frames) for name in robot.links
              if body_of[name] != name and name != robot.root}
    return d.MachineDescription(robot.name, bodies, joints, axes, points, source=f"URDF file {Path(path).name}",
                                assumptions=robot.doubts)


def _frames(robot: UrdfRobot) -> dict[str, FloatArray]:
    frames: dict[str, FloatArray] = {robot.root: np.eye(4)}
    while len(frames) < len(robot.links):
        for joint in robot.joints.values():
            if joint.parent in frames and joint.child not in frames:
                frames[joint.child] = frames[joint.parent] @ joint.place
    return frames


def _bodies_of(robot: UrdfRobot) -> dict[str, str]:
    """The body of every link: itself where it has mass, else that of its parent; the root is the ground."""
    bodies = {robot.root: d.GROUND}
    while len(bodies) < len(robot.links):
        for joint in robot.joints.values():
            if joint.parent in bodies and joint.child not in bodies:
                has_mass = robot.links[joint.child].mass is not None
                bodies[joint.child] = joint.child if has_mass else bodies[joint.parent]
    return bodies


def _body(link: UrdfLink, frame: FloatArray) -> d.BodyDescription:
    fault = inertia_fault(link.inertia)
    if fault:
        raise ToolpointError(f"link {link.name}: {fault}; correct the file, its maker's other files may be wrong alike")
    i, (x, y, z) = link.inertia, (float(v) for v in link.centre)
    tensor = d.InertiaDescription(*(float(i[a, b]) for a, b in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))))
    return d.BodyDescription(link.mass, (x, y, z), tensor, frame=describe_frame(frame))


def _point(name: str, body: str, frames: Mapping[str, FloatArray]) -> d.PointDescription:
    place = frames[name] if body == d.GROUND else tf.inverse(frames[body]) @ frames[name]
    x, y, z = (float(v) for v in place[:3, 3])
    return d.PointDescription(body, (x, y, z))


def _z_onto(axis: FloatArray) -> FloatArray:
    cross = np.cross([0.0, 0.0, 1.0], axis)
    # Along z, or against it: any axis across turns the one into the other.
    if np.linalg.norm(cross) < 1e-12:
        return np.eye(3) if axis[2] > 0 else np.diag([1.0, -1.0, -1.0])
    angle = float(np.arctan2(np.linalg.norm(cross), axis[2]))
    return rotation.about(cross, angle)
