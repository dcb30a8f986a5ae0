"""Drawing of a machine in words, as `check` shows it: tree of bodies, masses and sizes, travel, assumptions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping

import numpy as np

from toolpoint.machine.description import GROUND, AxisDescription, JointDescription
from toolpoint.machine.description.extent import equal_box, shape_size
from toolpoint.machine.parts.model import Machine

# Order in which the directions of a joint are named.
DIRECTION_NAMES = ("x", "y", "z", "rx", "ry", "rz")


def draw_chain(machine: Machine) -> tuple[str, ...]:
    """Return the tree of bodies from the ground up, a line for each: its joint, its mass and size, the points it carries."""
    description = machine.description
    carried: dict[str, list[str]] = {}
    for name, joint in description.joints.items():
        carried.setdefault(joint.parent, []).append(name)
    marks = {description.tool: "tool", description.table: "table"}
    points: dict[str, list[str]] = {}
    for name, point in description.points.items():
        points.setdefault(point.body, []).append(name + (f" ({marks[name]})" if name in marks else ""))
    total = sum(float(body.mass[0, 0]) for body in machine.bodies)
    point_words = f"; {', '.join(points[GROUND])}" if GROUND in points else ""
    return (f"{description.name}: {len(machine.bodies)} bodies of {total:.4g} kg in all, {machine.size} coordinates",
            f"ground{point_words}", *_branches(machine, carried, points, GROUND, 1))


def _branches(machine: Machine, carried: Mapping[str, list[str]], points: Mapping[str, list[str]], parent: str, depth: int
              ) -> Iterator[str]:
    """Yield the lines of the tree above a body, each indented by its depth, from the ground at 0.

    carried : body to the joints that it carries; points : body to the names of its points.
    """
    for name in carried.get(parent, ()):
        joint = machine.description.joints[name]
        lead = "   " * depth + f"{name} ({joint_words(machine, name)}): "
        # The body behind a joint that closes a loop is in the tree already.
        if joint.closes_loop:
            yield lead + f"closes a loop to {joint.child}"
            continue
        point_words = f"; {', '.join(points[joint.child])}" if joint.child in points else ""
        yield lead + f"{joint.child}, {body_words(machine, joint.child)}{point_words}"
        yield from _branches(machine, carried, points, joint.child, depth + 1)


def body_words(machine: Machine, name: str) -> str:
    """Return mass (kg) and size (m) of a body in words, with its spin and its kind.

    Without a drawn shape the size is that of the box of equal mass and inertia, and marked ``about``.
    """
    link, body = machine.body_names.index(name), machine.description.bodies[name]
    mass = machine.bodies[link].mass
    shape = body.draw or body.shape
    # Without a shape the box of the same mass and inertia gives an idea of the size.
    size = equal_box(mass) if shape is None else shape_size(shape)
    about = "about " if shape is None else ""
    spin = "" if body.spin is None else f", spinning at {body.spin.speed * 30 / np.pi:.4g} rev/min"
    kind = ", a beam of finite elements" if body.beam is not None else ", by finite elements" if body.is_elastic else ""
    return f"{mass[0, 0]:.4g} kg, {about}{' x '.join(f'{v:.3g}' for v in size)} m{kind}{spin}"


def joint_words(machine: Machine, name: str) -> str:
    """Return the directions of a joint in words: those with springs, free ones, and driven ones with their axis."""
    joint = machine.description.joints[name]
    springs = _springs(joint)
    free = [way for way in DIRECTION_NAMES if way in joint.free]
    drives = [f"{drive.direction.lstrip('-')} by {axis_name}" for axis_name, axis in machine.description.axes.items()
              for drive in axis.moved if drive.joint == name]
    words = [f"springs {springs}"] if springs else []
    words += [f"free {' '.join(free)}"] if free else []
    words += [f"free along {len(joint.screws)} screws"] if joint.screws else []
    return ", ".join([*(words or ["rigid"]), *(f"driven in {drive}" for drive in drives)])


def _springs(joint: JointDescription) -> str:
    """Return the directions with springs, or where the stiffness comes from: a law or a whole matrix."""
    if joint.law is not None:
        extra = f" and {' '.join(joint.stiffness)}" if joint.stiffness else ""
        return f"by the law of its kind{extra}"
    if joint.stiffness_matrix is not None:
        return "by a whole matrix"
    return " ".join(way for way in DIRECTION_NAMES if way in joint.stiffness)


def describe_travel(machine: Machine) -> tuple[str, ...]:
    """Return a line for every axis: what it moves, along what, from where to where."""
    axes = {axis.name: axis for axis in machine.chain.axes}
    lines = []
    for name, described in machine.description.axes.items():
        axis = axes[name]
        span = f"{axis.words(axis.lower)} .. {axis.words(axis.upper)}" if np.isfinite([axis.lower, axis.upper]).all() else \
            "no limits given"
        lines.append(f"axis {name} moves {_describe_drives(machine, described)}; travel {span}")
    return tuple(lines)


def _describe_drives(machine: Machine, axis: AxisDescription) -> str:
    """Return which bodies an axis moves, and along or about which direction of which joint."""
    joints = machine.description.joints
    words = []
    for drive in axis.moved:
        way = drive.direction.lstrip("-")
        # A drive along the negative direction with a negative factor moves forwards.
        sign = "-" if (drive.direction[0] == "-") != (drive.factor < 0) else "+"
        words.append(f"{joints[drive.joint].child} {'about' if way[0] == 'r' else 'along'} {sign}{way[-1]} of {drive.joint}")
    return " and ".join(words)


def describe_assumed(machine: Machine) -> tuple[str, ...]:
    """Return the assumptions of a machine file, a line each, and a line on where its numbers come from.

    Assumptions are rigid joints, damping, gravity, tool and work, and those that the file states itself.
    """
    description = machine.description
    rigid = [name for name, joint in description.joints.items() if joint_words(machine, name).startswith("rigid")]
    lines = [f"assumed: {', '.join(rigid)}: rigid but for what is driven" if len(rigid) > 1 else
             f"assumed: {rigid[0]} is rigid but for what is driven"] if rigid else []
    if description.damping_ratio is not None:
        lines.append(f"assumed: a damping ratio of {100 * description.damping_ratio:.3g} % for every mode")
    elif description.modal_damping:
        lines.append("assumed: modes are damped one by one, so shapes are real: " + (
            "each by the share that joints have in its strain energy" if description.modal_damping == "energy" else
            ", ".join(f"{100 * float(ratio):.3g} %" for ratio in description.modal_damping)))
    elif not any(_is_damped(joint) for joint in description.joints.values()) and not any(
            np.any(body.damping) or np.any(body.structural_damping) for body in machine.bodies):
        lines.append("assumed: no damping at all, so peaks of responses have no height and stable depths no limit; write "
                     "'damping_ratio: 3 %' or damping in the joints")
    if description.gravity is None and not description.loads:
        lines.append("assumed: no gravity and no loads, so no preload of joints")
    if description.tool is None:
        lines.append("assumed: no tool, so no responses of the tool and no lobes; write 'tool: POINT'")
    elif description.table is None:
        lines.append("assumed: the work stands still with the ground; write 'table: POINT' for the point that carries it")
    lines += [f"bodies.{name}: {note}" for name, body in description.bodies.items()
              if body.solid is not None and body.solid.content is not None for note in body.solid.content.notes]
    lines += [f"assumed by the file: {text}" for text in description.assumptions]
    return (*lines, *_sources(machine))


def _is_damped(joint: JointDescription) -> bool:
    """Whether a joint states damping of any kind."""
    return bool(joint.damping or joint.loss_factor) or joint.damping_matrix is not None


def _sources(machine: Machine) -> list[str]:
    """Return a line with the number of bodies and joints for each source."""
    description = machine.description
    sources = [body.source for body in description.bodies.values()] + [joint.source for joint in description.joints.values()]
    counts = Counter(source or "of unstated source" for source in sources)
    # A list that says for every part that nothing is stated would say nothing.
    if set(counts) == {"of unstated source"}:
        return ["sources: no body and no joint says where its numbers are from (write 'source: measured', published, chosen)"]
    return ["sources: " + ", ".join(f"{number} parts {source}" for source, number in counts.most_common())]
