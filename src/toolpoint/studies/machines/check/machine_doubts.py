"""Doubts about values of a machine file that are possible but hardly meant; `check` prints them, nothing is refused."""

from __future__ import annotations

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.kinematics import ClosedChain
from toolpoint.machine import Machine
from toolpoint.machine.description import GROUND, JointDescription
from toolpoint.machine.description.extent import body_span
from toolpoint.spatial import transform as tf
from toolpoint.studies.machines.check.elastic_doubts import question_elastic_bodies
from toolpoint.studies.machines.check.law_doubts import question_laws

MAX_BODY_MASS = 2e5  # kg; the bed of a large portal mill
MAX_INTERFACE_OFFSET = 5e-4  # m, between an interface and the joint that holds it
MAX_DRAWN_GAP_RATIO = 0.35  # lengths of the longer body, from drawn boxes to the joint between them
LOOP_RATE_TOLERANCE = 1e-6  # of the rate at which an axis opens a loop


def question_machine(machine: Machine) -> tuple[Doubt, ...]:
    """Return doubts about joints without a place, masses beyond machine tools, and a speed range that runs backwards."""
    description = machine.description
    lines = [Doubt(f"bodies.{name}", f"{body.mass[0, 0]:.4g} kg, more than any part of a machine tool ({MAX_BODY_MASS:g} kg)",
                   "check the unit", figure=body.mass[0, 0] / MAX_BODY_MASS)
             for name, body in zip(machine.body_names, machine.bodies, strict=True) if body.mass[0, 0] > MAX_BODY_MASS]
    lines += [Doubt(f"joints.{name}", "no place is given, so its springs stand at 0, 0, 0 of the machine",
                    "write 'at: [x, y, z]' unless that is where they are") for name, joint in description.joints.items()
              if _is_out_of_place(joint)]
    lines += far_joints(machine)
    lines += far_interfaces(machine)
    lines += tearing_axes(machine)
    lines += question_laws(machine)
    lines += question_elastic_bodies(machine)
    cut = description.cutting
    if cut is not None and description.tool is None:
        lines.append(Doubt("cutting", "given, but no point is the tool, so no lobes and no responses of the tool follow",
                           "write 'tool: POINT'"))
    if cut is not None and cut.speeds[0] >= cut.speeds[1]:
        lines.append(Doubt("cutting.speeds", f"from {cut.speeds[0]:g} to {cut.speeds[1]:g} rev/min runs backwards or is empty",
                           "write the lower speed first"))
    return tuple(lines)


def tearing_axes(machine: Machine) -> list[Doubt]:
    """Return doubts about axes that cannot move alone: no passive joint can follow what they do to a loop."""
    chain = machine.chain
    if not isinstance(chain, ClosedChain) or not chain.loops:
        return []
    rate = chain.closure.evaluate(np.asarray(chain.start), {})[1][0] / chain.closure.weights[:, None]
    passive = rate @ chain.closure.unknowns
    lines: list[Doubt] = []
    rows = [loop.name for loop in chain.loops for _ in loop.rows]
    for k, axis in enumerate(chain.driven_axes):
        axis_rate = rate @ chain.coupling[:, k]
        # Least squares: what no passive motion can take back remains.
        gap_rate = axis_rate - passive @ (np.linalg.pinv(passive) @ axis_rate) if passive.size else axis_rate
        if np.abs(gap_rate).max(initial=0.0) > LOOP_RATE_TOLERANCE * max(float(np.abs(axis_rate).max(initial=0.0)), 1e-300):
            loop = rows[int(np.argmax(np.abs(gap_rate)))]
            lines.append(Doubt(f"axes.{axis.name}", f"moved alone it tears loop joint {loop} open (or strains it)",
                               "let one axis drive both sides of the loop (drives: [...]), or free a direction of the loop"))
    return lines


def far_interfaces(machine: Machine) -> list[Doubt]:
    """Return doubts about joints whose springs are away from the interface of the elastic body that they hold."""
    lines: list[Doubt] = []
    for name, joint in machine.description.joints.items():
        for body, interface in ((joint.parent, joint.parent_interface), (joint.child, joint.child_interface)):
            if body == GROUND or interface is None:
                continue
            link = machine.link(body)
            held = machine.bodies[link].interfaces.get(interface)
            if held is None or held.slide is not None:
                continue
            place = tf.move(machine.body_frames[link], held.position[None])[0]
            offset = float(np.linalg.norm(place - np.array(joint.frame.at)))
            if offset > MAX_INTERFACE_OFFSET:
                coordinates = ", ".join(f"{1e3 * v:.4g}" for v in place)
                lines.append(Doubt(f"joints.{name}", f"its springs stand {1e3 * offset:.4g} mm from interface {interface} "
                                                     f"of {body}, "
                                   "on a rigid arm", f"write 'at: [{coordinates}] mm' unless that is meant", figure=offset))
    return lines


def far_joints(machine: Machine) -> list[Doubt]:
    """Return doubts about joints that lie farther from both of their bodies than the larger one is long."""
    lines, description = list[Doubt](), machine.description
    for name, joint in description.joints.items():
        place = np.array(joint.frame.at)
        bodies = [body for body in (joint.parent, joint.child) if body != GROUND]
        spans = [body_span(description.bodies[body], machine.body_frames[link := machine.link(body)], machine.bodies[link].mass)
                 for body in bodies]
        if joint.parent_interface or joint.child_interface or not joint.placed or not gives_way(joint) or not spans:
            continue
        gaps = [float(np.linalg.norm(np.maximum(0.0, np.abs(place - centre) - half))) for centre, half in spans]
        longest = max(2 * float(half.max()) for _, half in spans)
        drawn = all(description.bodies[body].shape is not None for body in bodies)
        if min(gaps) > max((MAX_DRAWN_GAP_RATIO if drawn else 1.0) * longest, 0.1):
            coordinates = ", ".join(f"{v:g}" for v in place)
            lines.append(Doubt(f"joints.{name}",
                               f"at {coordinates} m, {min(gaps):.3g} m away from both of its bodies, {longest:.3g} m "
                               "long at most", "check the place and its unit", figure=min(gaps)))
    return lines


def gives_way(joint: JointDescription) -> bool:
    """Return whether it matters where a joint is: one that locks both bodies together may be anywhere."""
    springs = joint.stiffness or joint.stiffness_matrix is not None or joint.law
    return bool(springs or joint.free or joint.passive or joint.screws)


def _is_out_of_place(joint: JointDescription) -> bool:
    """Return whether a joint has springs, and no place is written."""
    return gives_way(joint) and joint.parent_interface is None and joint.child_interface is None and not joint.placed
