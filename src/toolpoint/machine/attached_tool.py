"""Machine with another tool: a described shaft as beams on the spindle, in place of what the file has there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, fail, suggestion
from toolpoint._doubt import Doubt
from toolpoint.kinematics.tool_frame import smallest_turn
from toolpoint.machine.description.beam import BeamDescription, BeamSegment
from toolpoint.machine.description.body import BodyDescription, FrameDescription
from toolpoint.machine.description.frames import describe_frame
from toolpoint.machine.description.machine import JointDescription, MachineDescription, PointDescription
from toolpoint.machine.parts.model import Machine
from toolpoint.spatial import transform as tf
from toolpoint.substructuring.shaft import SegmentDescription, ShaftDescription

ATTACHED_BAND = 10e3  # Hz: up to which the beams of an attached tool are asked for
ATTACHED_NAME = "attached tool"  # of its bodies, joints and points
_TURNED_OVER = np.diag([1.0, -1.0, -1.0])  # from z along the spindle to the shaft, which runs to -z


def attach_tool(machine: Machine, point: str, shaft: ShaftDescription) -> Machine:
    """Return a machine whose tool is a shaft that begins at one of its points.

    The shaft is beams along the tool's axis, joined by its contacts; its tip is the tool point. The file's own tool is
    taken off as `detach_tool` does it. Damping ratios of the machine's modes become loss factors of its springs, so that the
    tool's modes have the damping that its own file states.

    Raises ToolpointError as `detach_tool` does, and for segments that shear by Hutchinson's coefficient, which beams do not
    have.

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import InertiaDescription
    >>> joint = JointDescription("ground", "head", stiffness={"x": 1e8, "y": 1e8, "z": 2e8})
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> nose = {"nose": PointDescription("head")}
    >>> bare = build(MachineDescription("mill", {"head": head}, {"way": joint}, points=nose))
    >>> rod = ShaftDescription({"rod": SegmentDescription(0.1, 0.02)}, name="rod")
    >>> attach_tool(bare, "nose", rod).description.tool
    'attached tool tip'
    """
    for name, segment in shaft.segments.items():
        if segment.shear != "cowper":
            fail(f"segments.{name}.shear", repr(segment.shear), "must be cowper for a tool on a machine")
    spindle = detach_tool(machine, point)
    bare = _with_spring_losses(spindle.description)
    start = _place_of(spindle, bare.points[point])
    turn = smallest_turn(np.array(bare.tool_axis)) @ _TURNED_OVER
    bodies, joints, reached = dict(bare.bodies), dict(bare.joints), 0.0
    parent, parent_interface = bare.points[point].body, bare.points[point].interface
    axis = turn[:, 2]
    parts = _rigid_parts(shaft)
    for number, part in enumerate(parts, 1):
        name = f"{ATTACHED_NAME} {number}"
        place = describe_frame(tf.transform(turn, start + reached * axis))
        length = sum(segment.length for segment in part.values())
        beam = BeamDescription({key: _beam_segment(segment) for key, segment in part.items()}, {"base": 0.0, "tip": length},
                               ATTACHED_BAND)
        bodies[name] = BodyDescription(beam=beam, frame=place)
        joints[name] = replace(_contact_joint(next(iter(part.values())), place), parent=parent, child=name,
                               parent_interface=parent_interface, child_interface="base")
        parent, parent_interface, reached = name, "tip", reached + length
    tip = f"{ATTACHED_NAME} tip"
    # Modes that were measured with another tool are no reference for this one.
    return spindle.rebuild(replace(
        bare, bodies=bodies, joints=joints, points={**bare.points, tip: PointDescription(parent, interface="tip")}, tool=tip,
        reference=(), doubts=(*bare.doubts, *_loss_doubts(shaft))))


def detach_tool(machine: Machine, point: str) -> Machine:
    """Return a machine without the tool that its file has at a point: the bodies that hang on the body of the point on the way
    to the tool point. A doubt names them; the machine stays as it is where there are none.

    Raises ToolpointError for a point that is not there, and where numbers of these bodies were identified.
    """
    points = machine.description.points
    if point not in points:
        fail("point", repr(point), f"must be of {', '.join(points)}", remedy=suggestion(point, points))
    bare = _without_own_tool(machine.description, point)
    return machine if bare is machine.description else machine.rebuild(bare)


def _with_spring_losses(description: MachineDescription) -> MachineDescription:
    """Return the description with loss factors of all springs in place of damping ratios of its modes.

    A ratio z of all modes and a loss factor 2 z of all springs damp every mode alike; ratios mode by mode are taken as their
    mean, with a doubt. Other elastic bodies than beams keep the ratio, which then damps the tool's modes too, with a doubt.
    """
    stated = description.modal_damping
    ratio = description.damping_ratio if isinstance(stated, str) else float(np.mean(stated))
    if ratio is None:
        return description
    if any(body.is_elastic and body.beam is None for body in description.bodies.values()):
        return replace(description, modal_damping="", damping_ratio=ratio, doubts=(*description.doubts, Doubt(
            "damping of the tool", f"the machine's ratio of {100 * ratio:.2g} % stands for the modes of the tool too",
            "give the machine's joints and materials loss factors", figure=ratio)))
    doubts = () if isinstance(stated, str) else (Doubt(
        "damping", f"the machine's ratios mode by mode are taken as their mean of {100 * ratio:.2g} %: its modes are others "
        "with this tool", "give its joints loss factors"),)
    bodies = {name: body if body.beam is None else replace(body, beam=replace(body.beam, segments={
        key: replace(segment, loss_factor=2 * ratio) for key, segment in body.beam.segments.items()}))
        for name, body in description.bodies.items()}
    joints = {name: replace(joint, loss_factor=2 * ratio, damping={}, damping_matrix=None)
              for name, joint in description.joints.items()}
    return replace(description, bodies=bodies, joints=joints, damping_ratio=None, modal_damping="",
                   doubts=(*description.doubts, *doubts))


def _loss_doubts(shaft: ShaftDescription) -> tuple[Doubt, ...]:
    """Return the doubt about a shaft whose file states no loss at all."""
    losses = [part.loss_factor for part in shaft.segments.values()]
    losses += [part.contact.loss_factor for part in shaft.segments.values() if part.contact is not None]
    if any(losses):
        return ()
    return (Doubt("damping of the tool", "its shaft file states no loss factor: the tool's own modes are damped by the machine "
                  "alone, and limits come out too low", "give its segments a loss factor (1 to 4 % with its clamping)"),)


def _rigid_parts(shaft: ShaftDescription) -> list[dict[str, SegmentDescription]]:
    """Return the segments of a shaft, parted where one holds on by an elastic contact."""
    parts: list[dict[str, SegmentDescription]] = []
    for name, segment in shaft.segments.items():
        if not parts or segment.contact is not None:
            parts.append({})
        parts[-1][name] = segment
    return parts


def _beam_segment(segment: SegmentDescription) -> BeamSegment:
    modulus, density, poisson = segment.numbers
    return BeamSegment(segment.length, segment.effective_diameter, segment.bore, modulus=modulus, density=density,
                       poisson=poisson, loss_factor=segment.loss_factor)


def _contact_joint(first: SegmentDescription, place: FrameDescription) -> JointDescription:
    """Return the joint before a segment: its contact across the axis, locked along it and without a contact."""
    contact = first.contact
    springs = {} if contact is None else {"x": contact.stiffness, "y": contact.stiffness, "rx": contact.rotational_stiffness,
                                          "ry": contact.rotational_stiffness}
    return JointDescription("", "", place, springs, loss_factor=0.0 if contact is None else contact.loss_factor)


def _place_of(machine: Machine, point: PointDescription) -> FloatArray:
    """Return where a point is at the reference pose, m, machine frame."""
    link = machine.link(point.body)
    own: Any = point.at
    if link < 0:
        return np.asarray(own, float)
    if point.interface is not None:
        own = machine.bodies[link].interfaces[point.interface].position
    placed = machine.body_frames[link]
    return np.asarray(placed[:3, :3] @ np.asarray(own, float) + placed[:3, 3])


def _without_own_tool(description: MachineDescription, point: str) -> MachineDescription:
    """Return the description without the bodies between the body of a point and the tool, with the doubt that names them."""
    holder = description.points[point].body
    by_child = {joint.child: name for name, joint in description.joints.items() if not joint.closes_loop}
    chain: list[str] = []
    body = None if description.tool is None else description.points[description.tool].body
    while body is not None and body != holder:
        chain.append(body)
        body = description.joints[by_child[body]].parent if body in by_child else None
    if body is None or not chain:
        return description
    first = chain[-1]
    removed = _hanging_on(description, first)
    removed_joints = {name for name, joint in description.joints.items()
                      if joint.child in removed or joint.parent in removed}
    paths = [] if description.identified is None else [
        path for path in description.identified.parameters if path.split(".")[1] in removed | removed_joints]
    if paths:
        fail("point", repr(point), f"holds the file's own tool ({', '.join(sorted(removed))}), whose numbers were identified: "
             f"{', '.join(paths)}", remedy="take a point of the last body that stays")
    kept_points = {name: part for name, part in description.points.items() if part.body not in removed}
    doubt = Doubt("tool", f"{', '.join(sorted(removed))} of the machine file taken off: another tool begins at point {point}",
                  "name another point where the tool begins")
    return replace(
        description, bodies=_others(description.bodies, removed), joints=_others(description.joints, removed_joints),
        points=kept_points, tool=None, table=description.table if description.table in kept_points else None,
        axes={name: axis for name, axis in description.axes.items()
              if not {way.joint for way in axis.moved} & removed_joints},
        loads=tuple(load for load in description.loads if load.point in kept_points), doubts=(*description.doubts, doubt))


def _hanging_on(description: MachineDescription, body: str) -> set[str]:
    """Return a body and all that hang on it by tree joints."""
    removed = {body}
    while children := {joint.child for joint in description.joints.values()
                   if not joint.closes_loop and joint.parent in removed} - removed:
        removed |= children
    return removed


def _others(parts: Mapping[str, Any], removed: set[str]) -> dict[str, Any]:
    return {name: part for name, part in parts.items() if name not in removed}
