"""Doubts about places that the bodies around contradict: tool tips, bodies far from their joints, travel beyond rails.

Asked of drawn bodies only: a box that is equal in inertia has no edges.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.machine import Machine
from toolpoint.machine.description import GROUND
from toolpoint.machine.description.extent import body_span
from toolpoint.studies.machines.check.machine_doubts import gives_way

# Index of the machine's x, y or z along which an axis of this name moves (ISO 841).
LINEAR_AXIS_INDEX = {"X": 0, "Y": 1, "Z": 2, "U": 0, "V": 1, "W": 2}
MAX_TIP_BODY_RATIO = 1.5  # distance of a tool's tip from its body, over the length of that body
MAX_TIP_MACHINE_RATIO = 0.2  # the same distance over the size of the machine; doubted where both are exceeded
MIN_INSIDE_FRACTION = 0.1  # depth of a tip inside the box of a body that carries it, over the half size of that
MIN_OWN_INSIDE_FRACTION = 0.25  # the same in the tip's own body, which may be drawn together with its tool
MAX_UNREACHED_RATIO = 0.2  # distance of tip and table that travel cannot close, over the machine's size: height of a work
MAX_JOINT_DISTANCE_RATIO = 0.6  # distance of a body's box from its nearest joint, over the body's length
MAX_TRAVEL_RATIO = 1.0  # travel of a linear axis over the lengths of both bodies together
Span = tuple[FloatArray, FloatArray]  # centre and half size (3,) of a body's box along the machine's axes, m


def question_places(machine: Machine) -> list[Doubt]:
    """Return doubts about the tip of the tool, bodies far from their joints, and travel beyond what slides."""
    description = machine.description
    spans: dict[str, Span] = {name: body_span(description.bodies[name], machine.body_frames[i], machine.bodies[i].mass)
                              for i, name in enumerate(machine.body_names)
                              if description.bodies[name].shape is not None or description.bodies[name].mesh is not None}
    return [*_question_tip(machine, spans), *_question_held_bodies(machine, spans), *_question_slides(machine, spans)]


def _place_of_point(machine: Machine, point: str) -> tuple[str, FloatArray]:
    """Return the body of a point, and its place (3,) at the reference pose in the machine frame, m."""
    described = machine.description.points[point]
    frame = np.eye(4) if described.body == GROUND else machine.body_frames[machine.link(described.body)]
    return described.body, frame[:3, :3] @ np.array(described.at) + frame[:3, 3]


def _distance_outside(place: FloatArray, span: Span) -> float:
    """Return the distance of a place from a box, m; 0 inside."""
    return float(np.linalg.norm(np.maximum(0.0, np.abs(place - span[0]) - span[1])))


def _question_tip(machine: Machine, spans: Mapping[str, Span]) -> Iterator[Doubt]:
    """Yield at most one doubt about the tip of the tool: far off its body, inside a carrying body, or out of reach."""
    name = machine.description.tool
    if name is None or machine.description.points[name].interface is not None or len(spans) < 2:
        return
    body, place = _place_of_point(machine, name)
    if body not in spans:
        return
    corners = np.array([[centre - half, centre + half] for centre, half in spans.values()])
    size = float((corners[:, 1].max(axis=0) - corners[:, 0].min(axis=0)).max())
    distance, length = _distance_outside(place, spans[body]), 2 * float(spans[body][1].max())
    carrier = next((other for other in (body, *_carriers(machine, body)) if other in spans
                    and (np.abs(place - spans[other][0]) < (1 - (MIN_OWN_INSIDE_FRACTION if other == body
                                                                 else MIN_INSIDE_FRACTION)) * spans[other][1]
                         ).all()), None)
    gap = _unreachable_distance(machine, place, size)
    if distance > max(MAX_TIP_BODY_RATIO * length, MAX_TIP_MACHINE_RATIO * size):
        yield Doubt(f"points.{name}",
                    f"the tip of the tool is {distance:.3g} m off its body {body}, which is {length:.3g} m long",
                    "check the place and its unit", figure=distance / length)
    elif carrier is not None and (carrier == body or _distance_outside(place, spans[body]) > 0):
        yield Doubt(f"points.{name}", f"the tip of the tool lies inside {carrier}, which carries it",
                    "check the place of the tip", figure=1.0)
    elif gap > MAX_UNREACHED_RATIO * size:
        yield Doubt(f"points.{name}", f"no travel brings the tip of the tool nearer than {gap:.3g} m to the point of the work",
                    "check the places of both and the travel of the axes", figure=gap / size)


def _carriers(machine: Machine, body: str) -> Iterator[str]:
    """Yield the bodies between a body and the ground, except those that carry the work too."""
    def ancestors(start: str) -> list[str]:
        chain, link = list[str](), machine.chain.parents[machine.link(start)]
        while link >= 0:
            chain.append(machine.body_names[link])
            link = machine.chain.parents[link]
        return chain
    table = machine.description.table
    work = GROUND if table is None else machine.description.points[table].body
    shared = set() if work == GROUND else {work, *ancestors(work)}
    yield from (name for name in ancestors(body) if name not in shared)


def _unreachable_distance(machine: Machine, tip: FloatArray, size: float) -> float:
    """Return the distance between tip (3,) and table that travel of the linear axes cannot close, m.

    It is 0 where not known: without a table, with less than two linear axes, or with one of another name than X to W.
    """
    table, axes = machine.description.table, machine.chain.axes
    linear = {axis.name: axis for axis in axes if not axis.is_rotary and axis.name in LINEAR_AXIS_INDEX
              and axis.name in machine.description.axes and np.isfinite([axis.lower, axis.upper]).all()}
    if table is None or len(linear) < 2 or any(not axis.is_rotary and axis.name not in linear for axis in axes):
        return 0.0
    offset = _place_of_point(machine, table)[1] - tip
    for name, axis in linear.items():
        way = LINEAR_AXIS_INDEX[name]
        lower, upper = axis.lower - axis.reference_position, axis.upper - axis.reference_position
        offset[way] -= np.clip(offset[way], min(lower, 0.0), max(upper, 0.0))
    return float(np.linalg.norm(offset))


def _question_held_bodies(machine: Machine, spans: Mapping[str, Span]) -> Iterator[Doubt]:
    """Yield doubts about bodies whose drawn box is far from every joint that holds them.

    Bodies with a joint that states no place, or that is rigid, are left out.
    """
    joints = machine.description.joints.values()
    for name, span in spans.items():
        around = [joint for joint in joints if name in (joint.parent, joint.child)]
        if not around or any(not joint.placed or joint.parent_interface or joint.child_interface or not gives_way(joint)
                             for joint in around):  # what is bolted on rigidly may be anywhere
            continue
        distance = min(_distance_outside(np.array(joint.frame.at), span) for joint in around)
        length = 2 * float(span[1].max())
        if distance > MAX_JOINT_DISTANCE_RATIO * length:
            yield Doubt(f"bodies.{name}", f"{length:.3g} m long, and {distance:.3g} m from the nearest joint that holds it",
                        "check its centre and size, or the place of the joint", figure=distance / length)


def _question_slides(machine: Machine, spans: Mapping[str, Span]) -> Iterator[Doubt]:
    """Yield doubts about travel longer than both bodies of the joint together: at its ends one would be off the other."""
    description = machine.description
    for axis in machine.chain.axes:
        if axis.is_rotary or axis.name not in LINEAR_AXIS_INDEX or axis.name not in description.axes:
            continue
        travel = axis.upper - axis.lower
        for drive in description.axes[axis.name].moved:
            joint = description.joints[drive.joint]
            if not np.isfinite(travel) or joint.parent not in spans or joint.child not in spans:
                continue
            bodies = (joint.parent, joint.child)
            way = machine.chain.frames[machine.joint_names.index(drive.joint)][:3, "xyz".index(drive.direction[-1])]
            length = sum(2 * float(np.abs(way) @ spans[body][1]) for body in bodies)
            if travel > MAX_TRAVEL_RATIO * length:
                yield Doubt(f"axes.{axis.name}", f"travels {travel:.3g} m, {' and '.join(bodies)} are {length:.3g} m long "
                            "together along it: one would be off the other", "check the unit of its limits",
                            figure=travel / length)
                break
