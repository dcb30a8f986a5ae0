"""Faults of a description that need no computing: how its bodies hang together, and what its axes drive."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from toolpoint._check import suggestion
from toolpoint.machine.description.machine import GROUND, JointDescription, MachineDescription


def tree_faults(description: MachineDescription) -> list[tuple[str, str]]:
    """Return (path, message) of every fault in how the bodies hang together; empty where they form a tree."""
    tree = {name: joint for name, joint in description.joints.items() if not joint.closes_loop}
    faults: list[tuple[str, str]] = []
    parent_of: dict[str, str] = {}
    body_names = [GROUND, *description.bodies]
    for name, joint in description.joints.items():
        for role in ("parent", "child"):
            body = getattr(joint, role)
            if body not in body_names:
                hint = suggestion(body, body_names)
                faults.append((f"joints.{name}.{role}",
                               f"joint {name}: there is no body {body!r}" + (f"; {hint}" if hint else "")))
        if joint.child == GROUND and not joint.closes_loop:
            faults.append((f"joints.{name}.child", f"joint {name}: the ground cannot be a child; swap parent and child"))
    exchanged = _exchanged_joints(tree)
    for name in exchanged:
        joint = tree[name]
        faults.append((f"joints.{name}.parent", f"joint {name}: parent and child are the wrong way round: {joint.child} is "
                       f"carried already, {joint.parent} by nothing; write parent: {joint.child} and child: {joint.parent}"))
    tree = {name: replace(joint, parent=joint.child, child=joint.parent) if name in exchanged else joint
            for name, joint in tree.items()}
    for name, joint in tree.items():
        if joint.child in parent_of:
            faults.append((f"joints.{name}.child",
                           f"joint {name}: body {joint.child} already hangs on joint {parent_of[joint.child]}; "
                           "mark one of them with closes_loop: true, or change its child"))
        parent_of.setdefault(joint.child, name)
    return faults + _circle_faults(description, tree, parent_of)


def _exchanged_joints(tree: Mapping[str, JointDescription]) -> list[str]:
    """Return the joints with parent and child exchanged: the child hangs on another too, nothing carries the parent."""
    carried = [joint.child for joint in tree.values()]
    return [name for name, joint in tree.items()
            if carried.count(joint.child) > 1 and joint.parent != GROUND and joint.parent not in carried]


def _circle_faults(
    description: MachineDescription, tree: Mapping[str, JointDescription], parent_of: Mapping[str, str]
) -> list[tuple[str, str]]:
    faults: list[tuple[str, str]] = []
    for body in description.bodies:
        if body not in parent_of:
            faults.append((f"bodies.{body}", f"body {body} hangs on no joint; give it one, to the ground if it stands alone"))
            continue
        path_bodies, carrier = [body], tree[parent_of[body]].parent
        while carrier != GROUND and carrier in parent_of and carrier not in path_bodies:
            path_bodies.append(carrier)
            carrier = tree[parent_of[carrier]].parent
        if carrier == body:
            circle = " -> ".join([*path_bodies, body])
            faults.append((f"joints.{parent_of[body]}.parent", f"body {body} hangs on itself: {circle}; break the circle "
                           "with a joint to the ground"))
    return faults


def axis_faults(description: MachineDescription) -> list[tuple[str, str]]:
    """Return (path, message) of every axis that drives nothing, no tree joint, or the same directions as another."""
    faults = []
    tree = [name for name, joint in description.joints.items() if not joint.closes_loop]
    rows: dict[tuple[str, str], dict[str, float]] = {}
    for name, axis in description.axes.items():
        if not axis.moved:
            faults.append((f"axes.{name}", "drives nothing; give joint and direction, or drives"))
        for drive in axis.moved:
            if drive.joint in description.joints and drive.joint not in tree:
                faults.append((f"axes.{name}", f"joint {drive.joint} closes a loop; an axis must drive a tree joint"))
            elif drive.joint not in tree:
                hint = suggestion(drive.joint, tree)
                faults.append((f"axes.{name}", f"there is no joint {drive.joint!r}" + (f"; {hint}" if hint else "")))
            way = drive.direction.lstrip("-")
            rows.setdefault((drive.joint, way), {})[name] = -drive.factor if drive.direction[0] == "-" else drive.factor
    names = list(description.axes)
    matrix = np.array([[row.get(name, 0.0) for name in names] for row in rows.values()])
    if names and not faults and np.linalg.matrix_rank(matrix) < len(names):
        (joint, way), users = next(((key, row) for key, row in rows.items() if len(row) > 1), (("", ""), {}))
        path = f"axes.{list(users)[-1]}" if users else "axes"
        faults.append((path, f"{' and '.join(users)} drive direction {way} of joint {joint} alike; remove one of the axes, or "
                             "let each drive a direction of its own"))
    return faults
