"""View that compares two machine files of a project: modes, responses of the tool, and the limit at the goals' speeds; or
two tests, or two kept states."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from toolpoint import io
from toolpoint._check import ToolpointError, fail
from toolpoint._doubt import Doubt
from toolpoint.machine import Machine
from toolpoint.project import Project
from toolpoint.studies.machines.tool_yielding import spring_paths
from toolpoint.workbench.state.access import path_beneath
from toolpoint.workbench.state.desk import Desk
from toolpoint.workbench.state.machine_request import MachineRequest
from toolpoint.workbench.views.compare_states import kept_entries, view_two_states
from toolpoint.workbench.views.compare_tests import date_of, test_files, view_two_tests
from toolpoint.workbench.views.machine_look import drawn_shapes, limit_of, response_lines, response_of, state_of
from toolpoint.workbench.views.machine_view import cuts_of
from toolpoint.workbench.views.view import WorkbenchView, command_line

MIN_SHOWN_DIFFERENCE = 1e-6  # relative: smaller differences of a spring are not listed


def machine_files(desk: Desk, project: Project) -> list[str]:
    """Return the machine files of a project: that of its results first, then those in its folder."""
    try:
        files = [project.machine_file.relative_to(desk.folder).as_posix()]
    except ToolpointError:  # a project of a struck tip
        return []
    for path in sorted(desk.folder.glob("*.y*ml")):
        try:
            if path.name not in ("project.yaml", "tried.yaml") and io.kind_of(path) == "machine":
                files.append(path.name)
        except ToolpointError:
            continue
    for name in ("joints", "update"):
        place = Path("results") / name / "machine.yaml"
        if (desk.folder / place).is_file():
            files.append(place.as_posix())
    return list(dict.fromkeys(files))


def view_compare(desk: Desk, first: str = "", second: str = "") -> WorkbenchView:
    """Return the view of two machine files, or two tests, side by side; the first two machines where none are named."""
    project = desk.project()
    tests = test_files(desk, project)
    machines = machine_files(desk, project)
    states = kept_entries(project)
    files = [*machines, *tests, *states]
    names = _chosen_names(first, second, machines, list(states))
    for name in names:
        if name not in files:
            fail("file", repr(name), f"must be one of {', '.join(files)}")
    data: dict[str, Any] = {"files": files, "first": names[0], "second": names[1],
                            "labels": {name: {**tests, **states}.get(name) or f"{name}, {date_of(desk.folder, name)}"
                                       for name in files}}
    if names[0] in states and names[1] in states and names[0] != names[1]:
        return view_two_states(project, names, data)
    if names[0] in tests and names[1] in tests and names[0] != names[1]:
        return view_two_tests(desk, names, data)
    kinds = {"test" if name in tests else "kept state" if name in states else "machine file" for name in names}
    if len(kinds) > 1:
        words = (f"A {' and a '.join(sorted(kinds))} are two kinds: choose two machine files, two tests or two kept states. "
                 "Shapes of test and model stand side by side under Modes.")
        return WorkbenchView("compare", words, commands=(command_line("run", "."),), data=data)
    if names[0] not in machines:
        return WorkbenchView("compare", f"Choose another {kinds.pop()} as the second: one stands beside itself.",
                             commands=(command_line("run", "."),), data=data)
    if names[0] == names[1]:
        return WorkbenchView("compare", "There is one machine file only: save a changed machine under another name, then "
                             "compare the two here.", commands=(command_line("modes", names[0]),), data=data)
    reads = [desk.machine(path_beneath(desk.folder, name)) for name in names]
    doubts = [doubt.within(name) for name, read in zip(names, reads, strict=True) for doubt in read.doubts]
    content = differences(project, reads[0].machine, reads[1].machine)
    return WorkbenchView("compare", _answer(names, content), (*_no_interval(), *doubts),
                         (command_line("compare", *names),),
                         (f"states = io.read_two_states({names[0]!r}, {names[1]!r})",
                          "print(studies.compare_two_states(*states).table())"),
                         {**data, **content})


def _chosen_names(first: str, second: str, machines: list[str], states: list[str]) -> tuple[str, str]:
    """Return what is compared where a person has chosen nothing: two machine files, else the last two kept states."""
    files = machines if len(machines) > 1 or len(states) < 2 else states[1::-1]
    return first or files[0], second or files[min(1, len(files) - 1)]


def _no_interval() -> tuple[Doubt, ...]:
    return (Doubt("the differences", "are of the two files' numbers, without an interval",
                  "see the intervals of each under Project and Lobes"),
            Doubt("modes", "stand beside each other by their order, not by their shape",
                  "toolpoint compare pairs them by shape"),
            Doubt("limits", "are those at one speed: a lobe that moves by can raise or lower them whatever the stiffness does",
                  "look at the whole chart of each (Lobes)"))


def _answer(names: tuple[str, str], content: dict[str, Any]) -> str:
    frequency = [np.asarray(values) for values in content["frequency_hz"]]
    count = min(map(len, frequency))
    ratio = frequency[1][:count] / frequency[0][:count] - 1
    place = int(np.argmax(np.abs(ratio)))
    springs = len(content["springs"])
    words = f"{names[1]} beside {names[0]}: {springs} spring{'s differ' if springs != 1 else ' differs'}; "
    words += (f"mode {place + 1} moves most, from {frequency[0][place]:.4g} to {frequency[1][place]:.4g} Hz "
              f"({100 * ratio[place]:+.2g} %)")
    for limit in content["limits"][:1]:
        words += f"; the limit of {limit['goal']} from {_millimetres(limit['first_m'])} to {_millimetres(limit['second_m'])}"
    return words + "."


def _millimetres(depth: float) -> str:
    return f"{1e3 * depth:.3g} mm" if np.isfinite(depth) else "none in the searched depths"


def differences(project: Project, first: Machine, second: Machine) -> dict[str, Any]:
    """Return what differs between two machines and their answers as plain data."""
    lines = response_lines(first)
    states = [state_of(machine, MachineRequest(), None) for machine in (first, second)]
    values = [{path: machine.value(path) for path in spring_paths(machine)} for machine in (first, second)]
    pairs = {path: (values[0].get(path, 0.0), values[1].get(path, 0.0)) for path in dict.fromkeys([*values[0], *values[1]])}
    springs = [{"path": path, "first": values[0].get(path), "second": values[1].get(path)} for path, pair in pairs.items()
               if abs(pair[0] - pair[1]) > MIN_SHOWN_DIFFERENCE * max(map(abs, pair))]
    shapes = [drawn_shapes(machine, {})[1] for machine in (first, second)]
    return {"springs": springs, "frequency_hz": [shape.frequency for shape in shapes],
            "damping_ratio": [shape.damping_ratio for shape in shapes], "lines_hz": lines,
            "responses": [response_of(state, lines) if state.has_tool else None for state in states],
            "limits": _limits(project, first, second)}


def _limits(project: Project, first: Machine, second: Machine) -> list[dict[str, Any]]:
    """Return the exact limit of every goal on both machines, at its speed and pose."""
    from toolpoint.studies.cuts.tool_dynamics import machine_dynamics

    if first.description.tool is None or second.description.tool is None:
        return []
    rows = []
    for name, goal in project.description.goals.items():
        cut = cuts_of(project, first)[goal.cut]
        request = MachineRequest(speed=goal.speed, pose=goal.pose, count=2)
        depths = [limit_of(machine_dynamics(machine, goal.pose), cut, request)[0]["limit_m"] for machine in (first, second)]
        rows.append({"goal": name, "speed_rpm": goal.speed, "first_m": float(depths[0]), "second_m": float(depths[1])})
    return rows
