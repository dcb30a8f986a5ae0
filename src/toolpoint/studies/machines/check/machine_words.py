"""Motion of a machine in words for `check`: direction of the tool, what axes drive, how loops close."""

from __future__ import annotations

import numpy as np

from toolpoint.kinematics import ClosedChain
from toolpoint.kinematics.singularity import pose_condition
from toolpoint.kinematics.tool_frame import smallest_turn
from toolpoint.machine.assembly.system import freedoms
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.machines.pose_words import direction_words


def describe_motion(machine: Machine) -> tuple[str, ...]:
    """Return lines on the tool's direction and plane, on axes that drive several directions, and on the loops."""
    description = machine.description
    lines = []
    if description.tool is not None:
        turn = smallest_turn(np.array(description.tool_axis))
        lines.append(f"tool: {description.tool} with its axis along {direction_words(turn[:, 2])} (away from the work); cut is "
                     f"the plane of {direction_words(turn[:, 0])} and {direction_words(turn[:, 1])} at the reference pose")
    for name, axis in description.axes.items():
        if len(axis.moved) > 1:
            drives = ", ".join(f"{drive.joint}.{drive.direction}" + (f" x {drive.factor:g}" if drive.factor != 1 else "")
                               for drive in axis.moved)
            lines.append(f"axis {name} drives {drives}")
    return (*lines, *_loop_lines(machine))


def _loop_lines(machine: Machine) -> list[str]:
    """Return lines on loops, passive and idle motions, the reference pose and task coordinates; none without loops."""
    chain = machine.chain
    if not isinstance(chain, ClosedChain) or not chain.loops:
        return []
    passive = [chain.step_name(k) for k in chain.passive_steps]
    condition = pose_condition(chain, {})
    # Passive motions that the closure does not determine are the nullity of its Jacobian.
    rate = chain.closure.evaluate(np.asarray(chain.start), {})[1][0] @ chain.closure.unknowns
    idle = len(passive) - (int(np.linalg.matrix_rank(rate)) if passive else 0)
    lines = [f"loops: {', '.join(loop.name for loop in chain.loops)}; solved at every pose: {', '.join(passive) or 'nothing'}; "
             f"{freedoms(machine)} coordinates are left of {machine.size}"]
    if idle:
        lines.append(f"{idle} passive motions are moved by no axis and held by no loop (a rod that turns about itself): they "
                     "stay as they are, and are modes at 0 Hz unless a spring holds them")
    lines += [f"reference pose: {reason}" for reason in condition.reasons() if reason]
    if chain.task is not None:
        lines.append(f"poses may be given as {', '.join(chain.task.coordinates)} in place of {', '.join(chain.task.axes)}")
    return lines
