"""Doubts about places that the bodies around contradict: tips of tools, bodies far from what holds them, travel beyond rails.

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

LINEAR = {"X": 0, "Y": 1, "Z": 2, "U": 0, "V": 1, "W": 2}  # ISO 841
OFF_ITS_BODY = 1.5  # lengths of its body, from there to the tip of a tool
OFF_THE_MACHINE = 0.2  # sizes of the machine, the same distance at least
INSIDE = 0.1  # of a body's size, by which a tip is inside it
INSIDE_OWN = 0.25  # of its own body's size, the same: a body may be drawn with its tool
OUT_OF_REACH = 0.2  # sizes of the machine that travel leaves between tip and work: as tall may a work be
HELD_FROM = 0.6  # lengths of a body, from its box to the nearest joint
SLIDES_OFF = 1.0  # lengths of both bodies together, that a linear axis may travel
Span = tuple[FloatArray, FloatArray]


def question_places(machine: Machine) -> list[Doubt]:
    """Return doubts about the tip of the tool, bodies far from their joints, and travel beyond what slides."""
    description = machine.description
    spans: dict[str, Span] = {name: body_span(description.bodies[name], machine.body_frames[i], machine.bodies[i].mass)
                              for i, name in enumerate(machine.body_names)
                              if description.bodies[name].shape is not None or description.bodies[name].mesh is not None}
    return [*_tip(machine, spans), *_held(machine, spans), *_slides(machine, spans)]


def _place(machine: Machine, point: str) -> tuple[str, FloatArray]:
    described = machine.description.points[point]
    frame = np.eye(4) if described.body == GROUND else machine.body_frames[machine.link(described.body)]
    return described.body, frame[:3, :3] @ np.array(described.at) + frame[:3, 3]


def _outside(place: FloatArray, span: Span) -> float:
    return float(np.linalg.norm(np.maximum(0.0, np.abs(place - span[0]) - span[1])))


def _tip(machine: Machine, spans: Mapping[str, Span]) -> Iterator[Doubt]:
    """Doubt the tip of the tool: one of its remarks, the plainest first."""
    name = machine.description.tool
    if name is None or machine.description.points[name].interface is not None or len(spans) < 2:
        return
    body, place = _place(machine, name)
    if body not in spans:
        return
    corners = np.array([[centre - half, centre + half] for centre, half in spans.values()])
    size = float((corners[:, 1].max(axis=0) - corners[:, 0].min(axis=0)).max())
    away, length = _outside(place, spans[body]), 2 * float(spans[body][1].max())
    carrier = next((other for other in (body, *_carriers(machine, body)) if other in spans
                    and (np.abs(place - spans[other][0]) < (1 - (INSIDE_OWN if other == body else INSIDE)) * spans[other][1]
                         ).all()), None)
    gap = _unreached(machine, place, size)
    if away > max(OFF_ITS_BODY * length, OFF_THE_MACHINE * size):
        yield Doubt(f"points.{name}", f"the tip of the tool is {away:.3g} m off its body {body}, which is {length:.3g} m long",
                    "check the place and its unit", figure=away / length)
    elif carrier is not None and (carrier == body or _outside(place, spans[body]) > 0):
        yield Doubt(f"points.{name}", f"the tip of the tool lies inside {carrier}, which carries it",
                    "check the place of the tip", figure=1.0)
    elif gap > OUT_OF_REACH * size:
        yield Doubt(f"points.{name}", f"no travel brings the tip of the tool nearer than {gap:.3g} m to the point of the work",
                    "check the places of both and the travel of the axes", figure=gap / size)


def _carriers(machine: Machine, body: str) -> Iterator[str]:
    """Yield the bodies that carry a body, but not what carries the work too."""
    def up(start: str) -> list[str]:
        chain, link = list[str](), machine.chain.parents[machine.link(start)]
        while link >= 0:
            chain.append(machine.body_names[link])
            link = machine.chain.parents[link]
        return chain
    table = machine.description.table
    work = GROUND if table is None else machine.description.points[table].body
    shared = set() if work == GROUND else {work, *up(work)}
    yield from (name for name in up(body) if name not in shared)


def _unreached(machine: Machine, tip: FloatArray, size: float) -> float:
    """Return the distance between tip and work that no linear axis covers, m; 0 where the machine is not one of linear axes."""
    table, axes = machine.description.table, machine.chain.axes
    linear = {axis.name: axis for axis in axes if not axis.is_rotary and axis.name in LINEAR
              and axis.name in machine.description.axes and np.isfinite([axis.lower, axis.upper]).all()}
    if table is None or len(linear) < 2 or any(not axis.is_rotary and axis.name not in linear for axis in axes):
        return 0.0
    apart = _place(machine, table)[1] - tip
    for name, axis in linear.items():
        way = LINEAR[name]
        low, high = axis.lower - axis.reference_position, axis.upper - axis.reference_position
        apart[way] -= np.clip(apart[way], min(low, 0.0), max(high, 0.0))
    return float(np.linalg.norm(apart))


def _held(machine: Machine, spans: Mapping[str, Span]) -> Iterator[Doubt]:
    """Doubt bodies whose drawn box is far from every joint that has a place and holds them."""
    joints = machine.description.joints.values()
    for name, span in spans.items():
        around = [joint for joint in joints if name in (joint.parent, joint.child)]
        if not around or any(not joint.placed or joint.parent_interface or joint.child_interface or not gives_way(joint)
                             for joint in around):  # what is bolted on rigidly may be anywhere
            continue
        away = min(_outside(np.array(joint.frame.at), span) for joint in around)
        length = 2 * float(span[1].max())
        if away > HELD_FROM * length:
            yield Doubt(f"bodies.{name}", f"{length:.3g} m long, and {away:.3g} m from the nearest joint that holds it",
                        "check its centre and size, or the place of the joint", figure=away / length)


def _slides(machine: Machine, spans: Mapping[str, Span]) -> Iterator[Doubt]:
    """Doubt travel beyond both lengths along the axis: at its ends the carriage would be off its rail."""
    description = machine.description
    for axis in machine.chain.axes:
        if axis.is_rotary or axis.name not in LINEAR or axis.name not in description.axes:
            continue
        travel = axis.upper - axis.lower
        for drive in description.axes[axis.name].moved:
            joint = description.joints[drive.joint]
            if not np.isfinite(travel) or joint.parent not in spans or joint.child not in spans:
                continue
            bodies = (joint.parent, joint.child)
            way = machine.chain.frames[machine.joint_names.index(drive.joint)][:3, "xyz".index(drive.direction[-1])]
            length = sum(2 * float(np.abs(way) @ spans[body][1]) for body in bodies)
            if travel > SLIDES_OFF * length:
                yield Doubt(f"axes.{axis.name}", f"travels {travel:.3g} m, {' and '.join(bodies)} are {length:.3g} m long "
                            "together along it: one would be off the other", "check the unit of its limits",
                            figure=travel / length)
                break
