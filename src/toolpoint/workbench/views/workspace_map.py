"""Map of the workspace beside the sliders: first frequency and softest static stiffness over two axes; a click takes a pose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from toolpoint import studies
from toolpoint._check import fail
from toolpoint.studies.machines.stiffness_map import NAMES
from toolpoint.workbench.state.desk import Desk, collect_doubts
from toolpoint.workbench.state.machine_request import MachineRequest
from toolpoint.workbench.views.machine_look import pack, state_of
from toolpoint.workbench.views.machine_view import CHANGED_FILE, calls_of, commands_of
from toolpoint.workbench.views.view import command_line

MAP_SIDE = 7  # positions along each of the two axes of the map beside the sliders


def map_deed(desk: Desk, request: MachineRequest) -> dict[str, Any]:
    """Return first frequency (Hz) and softest static stiffness (N/m) over the first two axes, packed row by row of the second.

    Other axes stand where the page has them. A pose that failed is not a number. Raises ToolpointError for a machine with
    fewer than two axes of known ends.
    """
    project = desk.project()
    read = desk.machine(project.machine_file)
    machine = state_of(read.machine, request, None).machine
    axes = machine.description.axes
    ends = {name: axis.limits for name, axis in axes.items() if np.isfinite(axis.limits).all()}
    if len(ends) < 2:
        fail("axes", f"{len(ends)} with known ends", "must be at least two for a map",
             remedy="give limits to the axes in the machine file")
    names = list(ends)[:2]
    grid = {name: np.linspace(*ends[name], MAP_SIDE) for name in names}
    grid |= {name: np.array([position]) for name, position in request.pose.items() if name not in names}
    frequencies, doubts = collect_doubts(lambda: studies.map_frequencies(machine, grid, 1))
    data: dict[str, Any] = {"axes": [_axis(machine, name, grid[name]) for name in names], "digest": read.digest,
                            "frequency_hz": _packed(frequencies.frequency[..., 0])}
    if machine.description.tool is not None:
        stiffness = studies.map_stiffness(machine, grid, "static").stiffness[..., list(NAMES).index("softest direction")]
        data["stiffness"] = _packed(stiffness)
    place = project.machine_file.relative_to(desk.folder).as_posix()
    return {**data, "doubts": [str(doubt) for doubt in doubts], **_same(place, request, grid)}


def _same(place: str, request: MachineRequest, grid: Mapping[str, Any]) -> dict[str, list[str]]:
    """Return the commands and the Python calls that give the map; a changed machine is written to a file of its own first."""
    ranges = [f"--axis={name}={positions[0]:.12g}:{positions[-1]:.12g}:{len(positions)}" for name, positions in grid.items()]
    values = replace(request, pose={}, speed=None)
    file, commands = (CHANGED_FILE, commands_of(place, values)[:1]) if request.values else (place, [])
    axes = ", ".join(f"{name!r}: np.linspace({positions[0]:.12g}, {positions[-1]:.12g}, {len(positions)})"
                     for name, positions in grid.items())
    maps = [command_line("map", file, *ranges, "--quantity", kind) for kind in ("frequency", "static")]
    return {"commands": [*commands, *maps],
            "calls": [*calls_of(place, values)[:1 + bool(request.values)], f"studies.map_frequencies(machine, {{{axes}}}, 1)",
                      f"studies.map_stiffness(machine, {{{axes}}}, 'static')"]}


def _axis(machine: Any, name: str, positions: Any) -> dict[str, Any]:
    """Return name and positions (m or rad) of an axis of the map."""
    turns = str(machine.description.axes[name].direction).lstrip("+-").startswith("r")
    return {"name": name, "positions": positions, "turns": turns}


def _packed(values: Any) -> str:
    """Return a quantity over the grid, packed: first axis along the columns."""
    return pack(np.reshape(values, (MAP_SIDE, MAP_SIDE)).T)
