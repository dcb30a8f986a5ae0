"""Description -> chain: which directions axes drive, which loops move, and the coordinates of the tool."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail, suggestion
from toolpoint.joints import LinearJoint
from toolpoint.kinematics import Axis, ClosedChain, Drive, LoopClosure, Step, Task, TreeChain
from toolpoint.kinematics.axis import AXES
from toolpoint.kinematics.task import ANGLES
from toolpoint.machine.description.faults import axis_faults
from toolpoint.machine.description.frames import frame
from toolpoint.machine.description.machine import GROUND, JointDescription, MachineDescription
from toolpoint.spatial import transform as tf


def build_chain(description: MachineDescription, order: Sequence[str], laws: Mapping[str, LinearJoint]) -> TreeChain:
    """Return the chain of a machine whose tree joints stand in `order`, with the laws of all its joints.

    Raises ToolpointError for axes that drive nothing, something twice, or a loop joint, and for a task that does not fit.
    """
    tree = [description.joints[name] for name in order]
    links = {joint.child: i for i, joint in enumerate(tree)} | {GROUND: -1}
    faults = axis_faults(description)
    if faults:
        raise ToolpointError("; ".join(f"{path}: {text}" for path, text in faults))
    parents = tuple(links[joint.parent] for joint in tree)
    frames = np.array([frame(joint.frame) for joint in tree]).reshape(-1, 4, 4)
    axes = tuple(Axis(name, tuple(Drive(order.index(drive.joint), drive.direction, drive.factor) for drive in axis.moved),
                      *axis.limits, reference_position=axis.at_reference) for name, axis in description.axes.items())
    loops = {name: joint for name, joint in description.joints.items() if joint.closes_loop}
    if not loops and description.task is None:
        return TreeChain(parents, frames, axes)
    passive = _passive_steps(tree, _on_loops(parents, loops, links), axes)
    task, task_axes = _task(description, links)
    chain = ClosedChain(
        parents, frames, (*axes, *task_axes), passive,
        tuple(_closure(name, joint, links, laws[name]) for name, joint in loops.items()), task, tuple(order),
        length=_size(frames))
    return _with_limits(chain, description)


def _on_loops(parents: Sequence[int], loops: Mapping[str, JointDescription], links: Mapping[str, int]) -> set[int]:
    """Return the tree joints that lie on a loop: those on the path to one side of a loop joint, but not to the other."""
    def path(link: int) -> set[int]:
        path_links = set()
        while link >= 0:
            path_links.add(link)
            link = parents[link]
        return path_links

    return {joint for loop in loops.values() for joint in path(links[loop.parent]) ^ path(links[loop.child])}


def _passive_steps(tree: Sequence[JointDescription], on_loops: set[int], axes: Sequence[Axis]) -> tuple[Step, ...]:
    """Return the steps of the tree's passive directions, translations before rotations."""
    driven = {(drive.joint, drive.way) for axis in axes for drive in axis.drives}
    steps: list[Step] = []
    for i, joint in enumerate(tree):
        named = (*joint.free, *(way for way in joint.passive if way not in joint.free)) if i in on_loops else joint.passive
        ways = [AXES.index(way) for way in named if (i, AXES.index(way)) not in driven]
        turns = [way for way in ways if way > 2]
        steps += [Step(i, way) for way in ways if way < 3]
        steps += [Step(i, way, len(turns) == 3) for way in turns]
    return tuple(steps)


def _closure(name: str, joint: JointDescription, links: Mapping[str, int], law: LinearJoint) -> LoopClosure:
    """Return the closure of a loop joint, the directions that its springs hold apart from the locked ones."""
    free = large_freedoms(joint)
    tilt = np.inf if joint.largest_tilt is None else joint.largest_tilt
    ends = links[joint.parent], links[joint.child]
    if not law.is_of_directions:  # screws: every direction takes part in the springs
        return LoopClosure(name, *ends, frame(joint.frame), free, tuple(way for way in AXES if way not in free), None, tilt)
    elastic = tuple(AXES[i] for i, state in enumerate(law.states) if state == "elastic" and AXES[i] not in free)
    return LoopClosure(name, *ends, frame(joint.frame), free, elastic, law.stiffness, tilt)


def large_freedoms(joint: JointDescription) -> tuple[str, ...]:
    """Return the directions in which a loop joint gives way at large, in their order."""
    return (*joint.free, *(way for way in joint.passive if way not in joint.free))


def _size(frames: FloatArray) -> float:
    """Return the size of a machine, m: the largest distance of joints along an axis."""
    return float(np.ptp(frames[:, :3, 3], axis=0).max(initial=0.0)) or 1.0


def _task(description: MachineDescription, links: Mapping[str, int]) -> tuple[Task | None, tuple[Axis, ...]]:
    """Return the task of a description and its coordinates as axes; None and none without one."""
    part = description.task
    if part is None:
        return None, ()
    if part.point not in description.points:
        fail("task.point", repr(part.point), f"must be of {', '.join(description.points)}",
             remedy=suggestion(part.point, description.points))
    for name in part.axes:
        if name not in description.axes:
            fail("task.axes", f"no axis {name!r}", f"must be of {', '.join(description.axes)}",
                 remedy=suggestion(name, description.axes))
    for name in part.coordinates:
        if name in description.axes:
            fail(f"task.coordinates.{name}", "is an axis of the machine too", "needs a name of its own")
    point = description.points[part.point]
    if point.body == GROUND:
        fail("task.point", f"{part.point} on the ground", "must be on a body that moves")
    tool_place = tf.move(frame(description.bodies[point.body].frame), np.array([point.at]))[0]
    task = Task(links[point.body], tool_place, np.array(description.tool_axis), part.axes,
                {name: coordinate.coordinate for name, coordinate in part.coordinates.items()})
    reference_coordinates = task.read(np.broadcast_to(np.eye(4), (1, len(links) - 1, 4, 4)))
    axes = tuple(Axis(name, (), *coordinate.limits, reference_position=float(reference_coordinates[coordinate.coordinate][0]),
                      turns=coordinate.coordinate in ANGLES) for name, coordinate in part.coordinates.items())
    return task, axes


def _with_limits(chain: ClosedChain, description: MachineDescription) -> ClosedChain:
    """Return the chain with limits of its passive joints and its other assembly modes."""
    steps = {chain.step_name(k): k for k in chain.passive_steps}
    limits = {}
    for name, joint in description.joints.items():
        for way, span in joint.limits.items():
            if f"{name}.{way}" not in steps:
                fail(f"joints.{name}.limits.{way}", "is no passive direction of a tree joint", "limits serve those only",
                     remedy=f"passive are {', '.join(steps) or 'none'}; an axis has limits of its own, a loop joint "
                      "largest_tilt")
            limits[steps[f"{name}.{way}"]] = span
    modes: dict[str, dict[int, float]] = {}
    for mode, values in description.assembly_modes.items():
        unknown = [name for name in values if name not in steps]
        if unknown:
            fail(f"assembly_modes.{mode}.{unknown[0]}", "no such passive direction", f"must be of {', '.join(steps) or 'none'}",
                 remedy=suggestion(unknown[0], steps))
        modes[mode] = {steps[name]: value for name, value in values.items()}
    chain = replace(chain, limits=limits, modes=modes)
    return chain.with_mode(description.assembly_mode) if description.assembly_mode else chain
