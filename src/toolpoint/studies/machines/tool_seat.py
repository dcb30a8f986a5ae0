"""Doubts about what lies between a machine's tool and its table, before any limit is computed."""

from __future__ import annotations

from toolpoint._doubt import Doubt
from toolpoint.machine import Machine
from toolpoint.machine.description import ELASTIC_KINDS, GROUND, JointDescription

MAX_TOOL_MASS = 5.0  # kg, of a rigid body that may be a tool with its holder


def question_tool_seat(machine: Machine) -> list[Doubt]:
    """Return doubts about the bodies between tool and table.

    The grave doubt is that nothing elastic lies between them. The other is that the tool's tip is a point of a rigid head:
    spindle, holder and tool, which limit most cuts, do not vibrate.
    """
    description = machine.description
    if description.tool is None:
        return []
    body = description.points[description.tool].body
    table = GROUND if description.table is None else description.points[description.table].body
    # Joints below both bodies cancel: they move tool and table alike.
    between = _joints_to_ground(machine, body) ^ _joints_to_ground(machine, table)
    bodies = {body, table} | {name for joint in between for name in (description.joints[joint].parent,
                                                                    description.joints[joint].child)}
    is_elastic = any(_is_elastic(machine, name) for name in bodies)
    has_springs = any(_has_springs(description.joints[name]) for name in between) or any(
        _has_springs(joint) for name, joint in description.joints.items() if name not in _tree_joints(machine))
    if body == table and not is_elastic:
        return [Doubt("tool and table", f"points {description.tool} and {description.table} are both on body {body}, which is "
                      "rigid: nothing vibrates between them", "put the tool's point on the spindle's side, that of the table "
                      "on the work's", grave=True)]
    if not is_elastic and not has_springs:
        return [Doubt("tool and table", f"no joint between bodies {body} and {table} has a stiffness: nothing vibrates between "
                      "them", "give the joints between them a stiffness or a law", grave=True)]
    if body == GROUND or _is_elastic(machine, body):
        return []
    mass = float(machine.bodies[machine.link(body)].mass[0, 0])
    if mass <= MAX_TOOL_MASS:
        return []
    return [Doubt("tool", f"its point is fixed to body {body} of {mass:.3g} kg: no spindle, holder or tool vibrates between "
                  "head and tip, and their modes limit most cuts", "describe spindle and tool as bodies with a bearing and a "
                  "holder joint, or cut on the measured response of the tip", figure=mass)]


def _tree_joints(machine: Machine) -> set[str]:
    """Return the joints that carry bodies, the first of each body; the others close loops."""
    joints: dict[str, str] = {}
    for name, joint in machine.description.joints.items():
        joints.setdefault(joint.child, name)
    return set(joints.values())


def _joints_to_ground(machine: Machine, body: str) -> set[str]:
    """Return the joints from a body to the ground."""
    first: dict[str, str] = {}
    for name, joint in machine.description.joints.items():
        first.setdefault(joint.child, name)
    path: set[str] = set()
    while body != GROUND and body in first and first[body] not in path:
        path.add(first[body])
        body = machine.description.joints[first[body]].parent
    return path


def _is_elastic(machine: Machine, name: str) -> bool:
    described = machine.description.bodies.get(name)
    return described is not None and any(getattr(described, kind) is not None for kind in ELASTIC_KINDS)


def _has_springs(joint: JointDescription) -> bool:
    return bool(joint.stiffness or joint.stiffness_matrix is not None or joint.law)
