"""View of joints and machine: what a slider may move, how soft and how sure each spring is, the scene, the responses."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint import io, studies
from toolpoint._check import ToolpointError, fail
from toolpoint._doubt import Doubt
from toolpoint._rounding import NORMAL_QUANTILE_95, with_uncertainty
from toolpoint.cutting.description import CuttingDescription
from toolpoint.machine import Machine
from toolpoint.machine.description import AxisDescription
from toolpoint.plot.shape_view.view import ShapeView
from toolpoint.project import Project
from toolpoint.project.engine.drafts import write_whole
from toolpoint.studies.machines.tool_yielding import compliance_shares, spring_paths, yielding_sentence
from toolpoint.workbench.state.access import check_file_name
from toolpoint.workbench.state.desk import Desk, ReadMachine, collect_doubts
from toolpoint.workbench.state.machine_request import MachineRequest
from toolpoint.workbench.views.machine_look import (
    drawn_shapes,
    joint_marks,
    look,
    response_lines,
    response_of,
    state_of,
)
from toolpoint.workbench.views.view import WorkbenchView, command_line, pose_words_of

CHANGED_FILE = "changed.yaml"  # name of the file that the shown commands write
MIN_TOLD_HALF_WIDTH = 5e-4  # of a frequency: a sharper one is shown without its interval in the headline
AXIS_REACH = 0.3  # m or rad to each side of an axis without limits, for its slider


def view_machine(desk: Desk) -> WorkbenchView:
    """Return the view of the machine that the project's limits rest on, in its saved state."""
    project = desk.project()
    file = project.machine_file
    read = desk.machine(file)
    machine, relative = read.machine, file.relative_to(desk.folder).as_posix()
    is_stale = any(not entry.is_of_today for entry in desk.outlook(project) if entry.step.name in _makers(relative))
    old = Doubt(relative, "is of an earlier state: what it rests on has changed", "run the project")
    doubts = [*([old] if is_stale else []), *read.doubts, *_unstated(machine)]
    return WorkbenchView("machine", _answer(machine), tuple(doubts), (command_line("report", relative),
                                                                     command_line("modes", relative)),
                         (f"machine = io.read_machine({relative!r})", "print(studies.solve_modes(machine).table())"),
                         {**_content(read), "file": relative, "cuts": _cuts(project, machine),
                          "name": machine.name}, is_stale)


def _makers(relative: str) -> tuple[str, ...]:
    parts = Path(relative).parts
    return ("/".join(parts[1:-1]),) if parts[0] == "results" else ()


def _unstated(machine: Machine) -> list[Doubt]:
    """Return the doubt of a machine whose numbers have no uncertainty."""
    if machine.description.identified is not None:
        return []
    return [Doubt("the springs", "the file states no uncertainty of its numbers: the page cannot say how sure they are",
                  "identify the machine from a test (tests, components, geometry)")]


def _answer(machine: Machine) -> str:
    shares = compliance_shares(machine)
    first = studies.solve_modes(machine, None, 1)
    frequency, half_width = float(first.frequency[0]), 0.0 if first.spread is None else float(first.spread.interval[0])
    # Noise alone makes some fits sharp to 1e-5; next to what no test repeats, such an interval is no news for a headline.
    is_told = half_width > MIN_TOLD_HALF_WIDTH * frequency
    words = f"{machine.name}: the lowest mode is at {with_uncertainty(frequency, half_width if is_told else None, 'Hz')}"
    if not shares:
        return f"{words}; the file names no tool."
    return f"{words}. {yielding_sentence(shares)}"


def _content(read: ReadMachine) -> dict[str, Any]:
    """Return scene, springs, axes, and the saved state at rest."""
    machine = read.machine
    scene, shapes = drawn_shapes(machine, {})
    lines = response_lines(machine)
    state = state_of(machine, MachineRequest(), None)
    return {"scene": ShapeView(scene, shapes, "machine", machine.name).payload(), "springs": _springs(machine),
            "marks": joint_marks(machine, scene),
            "axes": [_axis(name, axis) for name, axis in machine.description.axes.items()], "digest": read.digest,
            "lines_hz": lines, "response": response_of(state, lines) if state.has_tool else None,
            "frequency_hz": shapes.frequency, "damping_ratio": shapes.damping_ratio,
            "interval_hz": _frequency_interval(machine, shapes.count)}


def _frequency_interval(machine: Machine, count: int) -> Any:
    spread = collect_doubts(lambda: studies.solve_modes(machine, None, count))[0].spread
    return None if spread is None else spread.interval


def _springs(machine: Machine) -> list[dict[str, Any]]:
    """Return every spring with its value, 95 % half width (relative), and share of the tool's static compliance."""
    identified = machine.description.identified
    deviation = {} if identified is None else dict(zip(identified.parameters, np.sqrt(np.diag(identified.matrix)), strict=True))
    shares, springs = compliance_shares(machine), []
    for path in spring_paths(machine):
        _, joint, _, way = path.split(".")
        value = machine.value(path)
        half_width = NORMAL_QUANTILE_95 * float(deviation[path]) / value if path in deviation else None
        springs.append({"path": path, "joint": joint, "way": way, "value": value, "half_width": half_width,
                        "share": shares.get(path), "unit": "N m/rad" if way.startswith("r") else "N/m",
                        "source": machine.description.joints[joint].source})
    return springs


def _axis(name: str, axis: AxisDescription) -> dict[str, Any]:
    lower, upper = (float(end) for end in axis.limits)
    middle = float(axis.reference_position) if hasattr(axis, "reference_position") else 0.0
    turns = str(axis.direction).lstrip("+-").startswith("r")
    return {"name": name, "lower": lower if np.isfinite(lower) else middle - AXIS_REACH,
            "upper": upper if np.isfinite(upper) else middle + AXIS_REACH, "at": middle, "turns": turns}


def cuts_of(project: Project, machine: Machine) -> dict[str, CuttingDescription]:
    """Return the cuts of a project by name, and that of the machine's own file under its own."""
    cuts = {name: cut.cut for name, cut in project.description.cuts.items()}
    if not cuts and machine.description.cutting is not None:
        cuts["cut of the machine file"] = machine.description.cutting
    return cuts


def _cuts(project: Project, machine: Machine) -> list[dict[str, Any]]:
    goals = {goal.cut: goal.speed for goal in reversed(list(project.description.goals.values()))}
    return [{"name": name, "speeds": list(cut.speeds), "speed_rpm": goals.get(name, sum(cut.speeds) / 2)}
            for name, cut in cuts_of(project, machine).items()]


def look_at_machine(desk: Desk, request: MachineRequest) -> dict[str, Any]:
    """Return the machine in the state of the page: modes, shape, responses, limit, doubts, and the calls that give them."""
    project = desk.project()
    read = desk.machine(project.machine_file)
    state = state_of(read.machine, request, chosen_cut(project, read.machine, request.cut))
    data = look(state, request, response_lines(read.machine))
    relative = project.machine_file.relative_to(desk.folder).as_posix()
    return {**data, "digest": read.digest, "calls": calls_of(relative, request), "commands": commands_of(relative, request)}


def chosen_cut(project: Project, machine: Machine, name: str) -> CuttingDescription | None:
    """Return a cut by name, the first where none is named; None where there are none."""
    cuts = cuts_of(project, machine)
    if name and name not in cuts:
        fail("cut", repr(name), f"must be one of {', '.join(cuts) or 'the cuts of project.yaml, which has none'}")
    return cuts[name] if name else next(iter(cuts.values()), None)


def calls_of(file: str, request: MachineRequest) -> list[str]:
    """Return the Python calls that give the same."""
    lines = [f"machine = io.read_machine({file!r})"]
    if request.values:
        entries = ", ".join(f"{path!r}: {value!r}" for path, value in request.values.items())
        lines.append(f"machine = project.change_machine(machine, {{{entries}}})")
    pose = "{" + ", ".join(f"{axis!r}: {position!r}" for axis, position in request.pose.items()) + "}"
    return [*lines, f"print(studies.solve_modes(machine, {pose}).table())",
            f"dynamics = studies.machine_dynamics(machine, {pose})",
            f"print(studies.chart_lobes(dynamics, {dict(request.cut_values)!r}).table())"]


def commands_of(file: str, request: MachineRequest) -> list[str]:
    """Return the commands that give the same; numbers that were changed are written to a file first."""
    pose = ["--pose", pose_words_of(request.pose)] if request.pose else []
    commands, used = [], file
    if request.values:
        used = CHANGED_FILE
        numbers = [f"{path}={value!r}" for path, value in request.values.items()]
        commands.append(command_line("change", file, *numbers, "-o", used))
    return [*commands, command_line("modes", used, *pose), command_line("lobes", used, *pose)]


def save_machine(desk: Desk, name: str, values: Mapping[str, float]) -> str:
    """Write the machine with the numbers of the page to a new file of the project, and return its place.

    Raises ToolpointError for a name that is none, and for a file that is there: nothing is overwritten.
    """
    place = Path(check_file_name(name if name.endswith((".yaml", ".yml")) else f"{name}.yaml"))
    target = desk.folder / place
    if target.exists():
        raise ToolpointError(f"{place.as_posix()}: is there already; nothing was written: name another file")
    read = desk.machine(desk.project().machine_file)
    state = state_of(read.machine, MachineRequest(dict(values)), None)
    draft = target.with_name(f".{target.name}.draft")
    try:
        io.write_machine(state.machine.description, draft)
        write_whole(target, draft.read_text(encoding="utf-8"))
    finally:
        draft.unlink(missing_ok=True)
    return place.as_posix()
