"""A machine of a file with poses that a person wrote: names, lengths or angles, and limits of travel are checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.io.quantities.written import AxisPoints
from toolpoint.io.yaml import machine_file
from toolpoint.machine import Machine

Pose = Mapping[str, float]


def read_machine_at(path: str | Path, *poses: Pose | None) -> Machine:
    """Read a machine file and check poses against its axes, see `check_pose`; errors are those of `machine_file.read` too.

    >>> from importlib.resources import files
    >>> read_machine_at(files("toolpoint.app") / "machines" / "three_axis_vertical.yaml", {"X": 0.1}).size
    6
    """
    machine = machine_file.read(path)
    for pose in poses:
        check_pose(machine, pose or {})
    return machine


def lay_grid(machine: Machine, axes: Sequence[AxisPoints]) -> dict[str, FloatArray]:
    """Return the positions of axes by name, m or rad; one that the machine cannot reach is refused before any work.

    >>> from importlib.resources import files
    >>> from toolpoint.io import read_machine
    >>> machine = read_machine(files("toolpoint.app") / "machines" / "three_axis_vertical.yaml")
    >>> from toolpoint.io.quantities.written import AxisPoints, WrittenPosition
    >>> grid = lay_grid(machine, [AxisPoints("X", WrittenPosition(-0.1), WrittenPosition(0.1), 3)])
    >>> {name: values.tolist() for name, values in grid.items()}
    {'X': [-0.1, 0.0, 0.1]}
    """
    for axis in axes:
        if [other.name for other in axes].count(axis.name) > 1:
            raise ToolpointError(f"axis {axis.name}: is there twice; must be one range for each axis")
        for end in (axis.first, axis.last):
            check_pose(machine, {axis.name: end})
    return {axis.name: axis.positions for axis in axes}


def check_pose(machine: Machine, pose: Pose) -> None:
    """Check a pose against the axes of a machine; raises ToolpointError for an unknown axis, a length given to a rotary axis or
    an angle to a linear one (`written.WrittenPosition` remembers), and a position beyond the travel.

    >>> from importlib.resources import files
    >>> from toolpoint.io import read_machine
    >>> machine = read_machine(files("toolpoint.app") / "machines" / "three_axis_vertical.yaml")
    >>> check_pose(machine, {"X": 0.1})  # an axis that the machine has, within its travel
    """
    rotary = {axis.name: axis.is_rotary for axis in machine.chain.axes}
    for name, value in pose.items():
        written = getattr(value, "written", "")
        if written and name in rotary and (written == "angle") != rotary[name]:
            raise ToolpointError(f"pose {name}: given as {'an angle' if written == 'angle' else 'a length'}; the axis is "
                                 + ("rotary (rad, deg)" if rotary[name] else "linear (m, mm, um)"))
    machine.chain.batch(pose)  # names and limits of travel
