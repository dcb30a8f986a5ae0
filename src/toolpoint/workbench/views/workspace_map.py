"""Map of the workspace beside the sliders: first frequency, softest static stiffness, or limit of a cut over two axes; a click
takes a pose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from toolpoint import studies
from toolpoint._check import fail, one_of
from toolpoint._doubt import Doubt, doubts_among
from toolpoint.cutting.description import CuttingDescription, flat_values
from toolpoint.cutting.option_words import cut_words
from toolpoint.machine import Machine
from toolpoint.studies.machines.stiffness_map import NAMES
from toolpoint.workbench.state.desk import Desk, collect_doubts
from toolpoint.workbench.state.machine_request import MachineRequest
from toolpoint.workbench.views.machine_look import apply_cut_values, pack, resolve_speed, state_of
from toolpoint.workbench.views.machine_view import CHANGED_FILE, calls_of, commands_of, cuts_of
from toolpoint.workbench.views.view import command_line

MAP_SIDE = 7  # positions along each of the two axes of the map beside the sliders
LIMIT_MAP_SIDE = 5  # the same of limits, which take half a second a pose


def map_deed(desk: Desk, request: MachineRequest) -> dict[str, Any]:
    """Return first frequency (Hz) and softest static stiffness (N/m) over the first two axes, packed row by row of the second.

    Other axes stand where the page has them. A pose that failed is not a number. Raises ToolpointError for a machine with
    fewer than two axes of known ends.
    """
    project = desk.project()
    read = desk.machine(project.machine_file)
    machine = state_of(read.machine, request, None).machine
    names, grid = _grid(machine, request, MAP_SIDE)
    frequencies, doubts = collect_doubts(lambda: studies.map_frequencies(machine, grid, 1))
    data: dict[str, Any] = {"axes": [_axis(machine, name, grid[name]) for name in names], "digest": read.digest,
                            "frequency_hz": _packed(frequencies.frequency[..., 0])}
    if machine.description.tool is not None:
        stiffness = studies.map_stiffness(machine, grid, "static").stiffness[..., list(NAMES).index("softest direction")]
        data["stiffness"] = _packed(stiffness)
    place = project.machine_file.relative_to(desk.folder).as_posix()
    return {**data, "doubts": [str(doubt) for doubt in doubts], **_same(place, request, grid)}


def limit_map_deed(desk: Desk, request: MachineRequest) -> dict[str, Any]:
    """Return the limit (m) of a cut at the asked speed over the first two axes, packed row by row of the second.

    It is that of the command ``map-chatter``. A pose without a limit in the searched depths has that depth, and is counted in
    the doubts; one that failed is not a number. Raises ToolpointError as `map_deed` does, and for a project without the cut.
    """
    project = desk.project()
    read = desk.machine(project.machine_file)
    machine = state_of(read.machine, request, None).machine
    cuts = cuts_of(project, machine)
    cut = apply_cut_values(cuts[one_of("cut", request.cut or next(iter(cuts), ""), cuts)], request.cut_values)
    speed = resolve_speed(cut, request)
    names, grid = _grid(machine, request, LIMIT_MAP_SIDE)
    result, doubts = collect_doubts(lambda: studies.map_chatter(machine, grid, cut, speeds=[speed]))
    limit = np.reshape(result.limit, (LIMIT_MAP_SIDE, LIMIT_MAP_SIDE))
    is_open = np.isinf(limit)
    if is_open.any():
        doubts = (*doubts, Doubt("limits", f"none was met in the searched depths at {int(is_open.sum())} of {limit.size} poses",
                                 "these cells show the depth up to which it was looked for"))
    place = project.machine_file.relative_to(desk.folder).as_posix()
    return {"axes": [_axis(machine, name, grid[name]) for name in names], "digest": read.digest, "speed_rpm": speed,
            "limit_m": _packed(np.where(is_open, cut.depth_end[0], limit)),
            "doubts": [str(doubt) for doubt in dict.fromkeys((*doubts_among(result.notes), *doubts))],
            **_same_limits(place, request, grid, cut=cut, speed=speed)}


def _grid(machine: Machine, request: MachineRequest, side: int) -> tuple[list[str], dict[str, Any]]:
    """Return the two mapped axes, and positions of all axes: others stand where the page has them."""
    ends = {name: axis.limits for name, axis in machine.description.axes.items() if np.isfinite(axis.limits).all()}
    if len(ends) < 2:
        fail("axes", f"{len(ends)} with known ends", "must be at least two for a map",
             remedy="give limits to the axes in the machine file")
    names = list(ends)[:2]
    grid = {name: np.linspace(*ends[name], side) for name in names}
    return names, grid | {name: np.array([position]) for name, position in request.pose.items() if name not in names}


def _same_limits(place: str, request: MachineRequest, grid: Mapping[str, Any], *, cut: CuttingDescription, speed: float
                 ) -> dict[str, list[str]]:
    """Return the command and the Python calls that give the map of limits."""
    values = replace(request, pose={}, speed=None)
    file, commands = (CHANGED_FILE, commands_of(place, values)[:1]) if request.values else (place, [])
    flat = {key: value for key, value in flat_values(cut).items() if value not in (None, "", ())}
    words = ("map-chatter", file, *_axis_words(grid), "--speeds", f"{speed:.9g}", *cut_words(cut))
    calls = [*calls_of(place, values)[:1 + bool(request.values)], f"cut, _ = studies.cut_on(machine, {flat!r})",
             f"studies.map_chatter(machine, {{{_axis_entries(grid)}}}, cut, speeds=[{speed:.9g}])"]
    return {"commands": [*commands, command_line(*words)], "calls": calls}


def _axis_words(grid: Mapping[str, Any]) -> list[str]:
    return [f"--axis={name}={positions[0]:.12g}:{positions[-1]:.12g}:{len(positions)}" for name, positions in grid.items()]


def _axis_entries(grid: Mapping[str, Any]) -> str:
    return ", ".join(f"{name!r}: np.linspace({positions[0]:.12g}, {positions[-1]:.12g}, {len(positions)})"
                     for name, positions in grid.items())


def _same(place: str, request: MachineRequest, grid: Mapping[str, Any]) -> dict[str, list[str]]:
    """Return the commands and the Python calls that give the map; a changed machine is written to a file of its own first."""
    values = replace(request, pose={}, speed=None)
    file, commands = (CHANGED_FILE, commands_of(place, values)[:1]) if request.values else (place, [])
    axes = _axis_entries(grid)
    maps = [command_line("map", file, *_axis_words(grid), "--quantity", kind) for kind in ("frequency", "static")]
    return {"commands": [*commands, *maps],
            "calls": [*calls_of(place, values)[:1 + bool(request.values)], f"studies.map_frequencies(machine, {{{axes}}}, 1)",
                      f"studies.map_stiffness(machine, {{{axes}}}, 'static')"]}


def _axis(machine: Any, name: str, positions: Any) -> dict[str, Any]:
    """Return name and positions (m or rad) of an axis of the map."""
    turns = str(machine.description.axes[name].direction).lstrip("+-").startswith("r")
    return {"name": name, "positions": positions, "turns": turns}


def _packed(values: Any) -> str:
    """Return a quantity over the grid, packed: first axis along the columns."""
    side = round(np.size(values) ** 0.5)
    return pack(np.reshape(values, (side, side)).T)
