"""View of the project: the chain with the state of each step, its age and doubts, and what one part more would give."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.plot.page.markup import typeset
from toolpoint.project import Project
from toolpoint.project.components_text import draft_components
from toolpoint.project.engine.outlook import FRESH, StepOutlook, seconds_of
from toolpoint.project.engine.plan import plan_steps
from toolpoint.project.records_draft import draft_test
from toolpoint.project.steps.plain_files import read_json
from toolpoint.workbench.state.desk import Desk
from toolpoint.workbench.views.intake import kinds_in_words
from toolpoint.workbench.views.view import WorkbenchView, command_line

UNNAMED_RECORDS = "records belong to no test yet: say below what each of their channels measures"
STALE_DOUBT = Doubt("the answers", "are of an earlier state: files have changed since", "run the project")


def view_project(desk: Desk) -> WorkbenchView:
    """Return the view of a project; of a folder without one, what begins it."""
    if not desk.has_project:
        return WorkbenchView("project", "This folder holds no project yet: begin one, then drop in what you have measured.",
                             commands=(command_line("new", "project", "."),),
                             calls=("project.write_folder('.')",), data={"is_empty": True, "name": desk.folder.name})
    project = desk.project()
    outlooks = desk.outlook(project)
    results = _kept_results(project)
    is_stale = any(not entry.is_of_today for entry in outlooks)
    answers = [] if results is None else [typeset(answer) for answer in results["answers"]]
    doubts = [STALE_DOUBT] if answers and is_stale else []
    doubts += [] if results is None else _traced_doubts(results)
    next_steps = [] if results is None else results["next_steps"]
    draft = draft_test(project.folder, project.description)
    waiting_parts = [] if draft is None else [UNNAMED_RECORDS]
    data = {"is_empty": False, "name": project.description.name, "answers": answers,
            "steps": [_step(entry, project.folder) for entry in outlooks], "links": _links(project),
            "absent_parts": [*waiting_parts, *(part for part in project.chain.absent_parts if part not in next_steps)],
            "next_steps": [_from(project.folder, line) for line in next_steps],
            "goals": {} if results is None else results["goals"], "parts": describe_parts(project), "kinds": kinds_in_words(),
            "components_text": _components_text(project), "test_draft": None if draft is None else draft.to_dict(),
            "seconds_to_run": seconds_of(outlooks), "waiting": sum(not entry.is_of_today for entry in outlooks)}
    answer = _answer(project, answers, outlooks, waiting_parts)
    return WorkbenchView("project", answer, tuple(doubts), (command_line("run", "."),),
                         ("results = project.Project.open('.').run()", "print(results.table())"), data, is_stale)


def _answer(project: Project, answers: Sequence[str], outlooks: Sequence[StepOutlook], waiting_parts: Sequence[str]
            ) -> str:
    """Return the answer of the project in a sentence; an old one is said to be old."""
    waiting = [entry for entry in outlooks if not entry.is_of_today]
    if not outlooks:
        return f"{project.description.name}: nothing to compute yet. {_first([*waiting_parts, *project.chain.absent_parts])}"
    if not answers:
        return (f"{project.description.name}: {len(outlooks)} steps, none has an answer to a goal yet; "
                f"{len(waiting)} would run." if waiting else f"{project.description.name}: no goal has an answer yet.")
    if waiting:
        return f"Of an earlier state ({len(waiting)} of {len(outlooks)} steps must run): {answers[0]}"
    goal_count = len(answers) - 1
    return answers[0] + (f" {goal_count} further goal{'s' if goal_count > 1 else ''} below." if goal_count else "")


def _first(lines: Sequence[str]) -> str:
    return f"One part more: {lines[0]}." if lines else ""


def _step(entry: StepOutlook, folder: Path) -> dict[str, Any]:
    """Return a step with its state, age, words, doubts and files, these named from the project's folder."""
    step, record = entry.step, entry.record
    # The reason of a step that failed holds the words of its error: they are said once.
    words = "" if record is None or record.words in entry.reason else typeset(record.words)
    arisen = [] if record is None else [str(doubt.doubt) for doubt in record.doubts if doubt.step == step.name]
    return {"name": step.name, "does": step.words, "state": entry.state, "reason": _from(folder, entry.reason),
            "words": _from(folder, words), "doubts": [typeset(doubt) for doubt in arisen],
            "command": step.command or command_line("run", ".", step.name),
            "age_s": None if record is None else _age(record.started), "started": None if record is None else record.started,
            "seconds": None if record is None else record.seconds, "files": list(step.output_paths),
            "inputs": len(step.input_paths), "is_of_today": entry.is_of_today, "is_fresh": entry.state == FRESH}


def _from(folder: Path, text: str) -> str:
    """Return a text in which files of a folder are named from it."""
    return text.replace(f"{folder}{os.sep}", "")


def _age(started: str) -> float | None:
    try:
        return max(time.time() - datetime.fromisoformat(started).timestamp(), 0.0)
    except ValueError:
        return None


def _links(project: Project) -> list[list[str]]:
    """Return pairs of steps of which the second rests on the first."""
    sources = plan_steps(project.chain.steps, project.folder).sources
    return [[source, name] for name, names in sources.items() for source in names]


def _kept_results(project: Project) -> dict[str, Any] | None:
    """Return the results of the last run, None where there are none that can be read."""
    try:
        data: dict[str, Any] = read_json(project.folder / "results" / "project.json")
        return data if {"answers", "doubts", "goals", "next_steps"} <= data.keys() else None
    except (OSError, ValueError, AttributeError, ToolpointError):
        return None


def _traced_doubts(results: dict[str, Any]) -> list[Doubt]:
    """Return the doubts of the last run, each named with its step, each said once."""
    doubts: dict[tuple[str, str], Doubt] = {}
    for entry in results["doubts"]:
        doubt = Doubt(f"{entry['step']}: {entry['what']}", entry["why"], entry["remedy"], grave=bool(entry["grave"]))
        doubts.setdefault((entry["what"], entry["why"]), doubt)
    return list(doubts.values())


def _components_text(project: Project) -> str | None:
    """Return the text of the components file to edit; None where no test of a structure asks for one."""
    described = project.description
    has_structure = any(test.of == "structure" for test in described.tests.values())
    return draft_components(project.folder, described) if has_structure and described.machine is None else None


def describe_parts(project: Project) -> dict[str, Any]:
    """Return what the project file names: tests, cuts, goals, changes, files."""
    described = project.description
    return {"tests": list(described.tests), "programs": list(described.programs),
            "cuts": list(described.cuts), "changes": list(described.changes),
            "goals": {name: {"cut": goal.cut, "speed_rpm": goal.speed, "depth_m": goal.depth, "pose": dict(goal.pose)}
                      for name, goal in described.goals.items()},
            "machine": described.machine, "components": described.components, "geometry": described.geometry,
            "servo": described.servo}
