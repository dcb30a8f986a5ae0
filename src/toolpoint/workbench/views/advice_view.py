"""View of advice: what to change and what to measure next, ranked; each can be tried on the machine."""

from __future__ import annotations

from typing import Any

from toolpoint._doubt import Doubt
from toolpoint.project.changed_machine import change_machine
from toolpoint.project.limits.changes import lead_of
from toolpoint.project.steps.plain_files import read_json
from toolpoint.studies.machines.tool_yielding import spring_paths
from toolpoint.workbench.state.desk import Desk
from toolpoint.workbench.state.machine_request import MachineRequest
from toolpoint.workbench.views.compare_view import differences
from toolpoint.workbench.views.view import WorkbenchView, command_line

SHOWN_TESTS = 10  # candidates of the next test


def view_advice(desk: Desk) -> WorkbenchView:
    """Return the view of ranked changes and measurements."""
    project = desk.project()
    entries = {entry.step.name: entry for entry in desk.outlook(project) if entry.step.name in ("changes", "next")}
    kept = {name: _read(desk, f"results/{name}/{name}.json") for name in ("changes", "next")}
    is_stale = any(not entry.is_of_today for entry in entries.values())
    ranked = (kept["changes"] or {}).get("changes", [])
    machine = desk.machine(project.machine_file).machine
    springs = spring_paths(machine)
    changes = [{**change, "values": {path: machine.value(path) * (1 + change["stiffness_share"]) for path in springs
                                     if path.split(".")[1] == change["joint"]}} for change in ranked]
    doubts = [Doubt("the ranking", "is of an earlier state", "run the project")] if is_stale else []
    doubts += [doubt.doubt for entry in entries.values() if entry.record is not None for doubt in entry.record.doubts]
    lead = lead_of(ranked)
    answer = f"{lead[0].upper()}{lead[1:]}." if ranked else "No change is ranked yet: a goal and a machine give one."
    following = kept["next"] or {}
    return WorkbenchView("advice", ("Of an earlier state: " if is_stale else "") + answer, tuple(doubts),
                         (command_line("run", ".", "changes", "next"),),
                         ("results = project.Project.open('.').run(['changes', 'next'])",),
                         {"changes": changes,
                          "next": {**following, "candidates": following.get("candidates", [])[:SHOWN_TESTS]},
                          "machine": project.machine_file.relative_to(desk.folder).as_posix(),
                          "digest": desk.machine(project.machine_file).digest}, is_stale)


def difference_deed(desk: Desk, request: MachineRequest) -> dict[str, Any]:
    """Return what a machine with changed numbers does otherwise than the saved one: modes, responses, limits at the goals."""
    project = desk.project()
    file = project.machine_file
    saved = desk.machine(file).machine
    relative = file.relative_to(desk.folder).as_posix()
    changed = change_machine(saved, request.values)
    numbers = [f"{path}={value:.9g}" for path, value in request.values.items()]
    return {**differences(project, saved, changed), "doubts": [
        str(Doubt("the difference", "is that of the likeliest machine, without an interval",
                  "the table above gives the interval of the least limit"))],
            "commands": [command_line("change", relative, *numbers, "-o", "changed.yaml"),
                         command_line("compare", relative, "changed.yaml")],
            "calls": [f"saved = io.read_machine({relative!r})",
                      f"changed = project.change_machine(saved, {dict(request.values)!r})",
                      "print(studies.solve_modes(saved).table(), studies.solve_modes(changed).table())"]}


def _read(desk: Desk, place: str) -> Any:
    try:
        return read_json(desk.folder / place)
    except (OSError, ValueError):
        return None
