"""Structure that drives push against, from a machine: its driven directions freed, with the damping that its file states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.drives.axis.plant import Attachment, Structure
from toolpoint.drives.description import DriveDescription, EndsDescription
from toolpoint.drives.faults import check_description
from toolpoint.machine import Machine
from toolpoint.machine.assembly.system import assemble
from toolpoint.vibration import eigen, frequency_response, state_space
from toolpoint.vibration.damping import equivalent_viscous

# The drives carry these directions now; a stiffness of zero would make them free and change the joint's kind.
_FREED_STIFFNESS_RATIO = 1e-9
RIGID_MODE_RATIO = 1e-4  # of the highest frequency, below which a mode is a freed direction
MAX_JUDGED_FREQUENCY, JUDGED_LINES = 2000.0, 400  # up to which the structure's response is judged, and at how many lines
MIN_EQUIVALENT_ERROR = 0.01  # of the response, from which an equivalent damping is doubted


def structure_of(drives: DriveDescription, machine: Machine | None, pose: Mapping[str, float] | None = None
                 ) -> Structure | None:
    """Return the structure of a machine at a pose for drives whose axes end on it; None for drives on the ground.

    Raises ToolpointError where the drives end at points of a machine and none is given, or the other way round.

    >>> from importlib.resources import files
    >>> from toolpoint.io import read_drives
    >>> drives = read_drives(files("toolpoint.app") / "machines" / "three_axis_vertical_servo.yaml")
    >>> structure_of(drives, None) is None  # drives on mechanics of their own need no machine
    True
    """
    check_description(drives)
    if machine is None:
        ends = next((name for name, axis in drives.axes.items() if axis.ends is not None), None)
        if ends is not None:
            raise ToolpointError(f"machine: missing; axis {ends} of the drive file ends at points of a machine")
        return None
    free, boundaries, tools = free_machine(drives, machine)
    return structure_at(free, pose, ends=boundaries, tools=tools)


def free_machine(drives: DriveDescription, machine: Machine) -> tuple[Machine, dict[str, str], dict[str, str]]:
    """Return the machine with its driven directions free, and the Dofs of the drives' boundaries and of the tool."""
    ends = {name: axis.ends for name, axis in drives.axes.items() if axis.ends is not None}
    if not ends:
        raise ToolpointError("machine: no axis of the drive file is a ball screw with 'ends' on a machine; leave it out, "
                             "or describe where the drives hold on")
    free = machine.with_values({end.replaces: _FREED_STIFFNESS_RATIO * _replaced_stiffness(machine, name, end)
                                for name, end in ends.items()})
    boundaries = {f"{name}.{side}": dof for name, end in ends.items()
                  for side, dof in (("base", end.base), ("table", end.table))}
    return free, boundaries, {name: end.tool for name, end in ends.items()}


def _replaced_stiffness(machine: Machine, axis: str, ends: EndsDescription) -> float:
    """Return the machine's own drive stiffness that a ball screw takes the place of; refuse one that the machine lacks."""
    try:
        return machine.value(ends.replaces)
    except ToolpointError as error:
        raise ToolpointError(f"axes.{axis}.ends.replaces: the machine {machine.description.name!r} has no such number "
                             f"({error}); name the stiffness of that axis's drive in this machine's file") from error


def structure_at(machine: Machine, pose: Mapping[str, float] | None, *, ends: Mapping[str, str], tools: Mapping[str, str]
                 ) -> Structure:
    """Return the machine at a pose as the structure that the drives push against, its damping coupled between modes.

    Parameters
    ----------
    machine : Machine
        With its driven directions free (a vanishing drive stiffness), so that the drives carry them.
    ends : mapping of a drive's boundary (``x.table``) to the machine's Dof (``saddle:+x``)
    tools : mapping of axis name to the Dof of the tool point in its direction
    """
    labels = list(dict.fromkeys([*ends.values(), *tools.values()]))
    driven = list(dict.fromkeys(ends.values()))
    system = equivalent_viscous(assemble(machine, pose, labels, inputs=driven))
    states = state_space.modal_coordinates(system, "displacement and velocity")
    return Structure(states, {key: Attachment(dof, dof, "d" + dof) for key, dof in ends.items()}, dict(tools))


def question_damping(drives: DriveDescription, machine: Machine | None) -> list[Doubt]:
    """Return the doubt about active damping by a sensor at the tool: ideal, and the table alone without a machine."""
    damped = [name for name, axis in drives.axes.items()
              if axis.velocity.damping_gain and axis.velocity.damping_sensor == "tool"]
    if not damped:
        return []
    words = "without noise, drift or a delay of its own"
    if machine is None or all(drives.axes[name].ends is None for name in damped):
        words += ", and without a machine that is the table's own place: what the frame does is not in it"
    return [Doubt(f"active damping of {', '.join(damped)}", f"takes the table against the tool from an ideal sensor, {words}",
                  "damping_sensor: scale is a sensor that the machine has")]


def question_structure(drives: DriveDescription, machine: Machine | None, pose: Mapping[str, float] | None = None
                       ) -> list[Doubt]:
    """Return the doubts about active damping, and about a structure's equivalent damping in time of its loss factors.

    The error is the largest over the lines about the modes of the difference to the direct solution, over the response there.
    """
    doubts = question_damping(drives, machine)
    if machine is None or not any(axis.ends is not None for axis in drives.axes.values()):
        return doubts
    free, ends, tools = free_machine(drives, machine)
    labels = list(dict.fromkeys([*ends.values(), *tools.values()]))
    system = assemble(free, pose, labels, inputs=list(dict.fromkeys(ends.values())))
    if system.structural_damping is None or not np.any(system.structural_damping):
        return doubts
    frequency = eigen.solve_undamped(replace(system, damping=None, structural_damping=None)).frequency
    moving = frequency[frequency > RIGID_MODE_RATIO * frequency.max()]
    lines = np.unique(np.concatenate([np.geomspace(0.3 * moving.min(), min(1.2 * moving.max(), MAX_JUDGED_FREQUENCY),
                                                   JUDGED_LINES), moving]))
    exact = frequency_response.direct(system, lines).values
    equivalent = frequency_response.direct(equivalent_viscous(system), lines).values
    error = np.linalg.norm(equivalent - exact, axis=(1, 2)) / np.linalg.norm(exact, axis=(1, 2))
    worst_line = int(error.argmax())
    if error[worst_line] < MIN_EQUIVALENT_ERROR:
        return doubts
    return [*doubts, Doubt(
        "structure", f"its loss factors are taken in time as viscous damping of equal loss at each resonance: its response at "
        f"the drives errs by up to {100 * error[worst_line]:.2g} % (at {lines[worst_line]:.4g} Hz), by "
        f"{100 * float(np.median(error)):.2g} % in the median", "give dampers in place of the loss factors to compare",
        figure=float(error[worst_line]))]
