"""A machine as the structure that drives push against: its driven directions freed, its modes where the drives hold on."""

from __future__ import annotations

from collections.abc import Mapping

from toolpoint._check import ToolpointError
from toolpoint.drives.axis.plant import Structure
from toolpoint.drives.description import DriveDescription
from toolpoint.drives.faults import check_description
from toolpoint.machine import Machine
from toolpoint.machine.assembly.system import assemble
from toolpoint.vibration import eigen

# The drives carry these directions now; a stiffness of zero would make them free and change the joint's kind.
_FREED = 1e-9


def structure_of(drives: DriveDescription, machine: Machine | None, pose: Mapping[str, float] | None = None
                 ) -> Structure | None:
    """Return the structure of a machine at a pose for drives whose axes end on it; None for drives on the ground.

    Raises ToolpointError where the drives end at points of a machine and none is given, or the other way round.
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
    free = machine.with_values({end.replaces: _FREED * machine.value(end.replaces) for end in ends.values()})
    boundaries = {f"{name}.{side}": dof for name, end in ends.items()
                  for side, dof in (("base", end.base), ("table", end.table))}
    return free, boundaries, {name: end.tool for name, end in ends.items()}


def structure_at(machine: Machine, pose: Mapping[str, float] | None, *, ends: Mapping[str, str], tools: Mapping[str, str]
                 ) -> Structure:
    """Return the machine's modes at a pose as the structure that the drives push against.

    Parameters
    ----------
    machine : Machine
        With its driven directions free (a vanishing drive stiffness), so that the drives carry them.
    ends : mapping of a drive's boundary (``x.table``) to the machine's Dof (``saddle:+x``)
    tools : mapping of axis name to the Dof of the tool point in its direction
    """
    labels = list(dict.fromkeys([*ends.values(), *tools.values()]))
    modes = eigen.solve_undamped(assemble(machine, pose, labels, modal_damping=False))
    if machine.description.damping_ratio is not None:
        modes = modes.with_damping(machine.description.damping_ratio)
    return Structure.from_modes(modes, dict(ends), dict(tools))
