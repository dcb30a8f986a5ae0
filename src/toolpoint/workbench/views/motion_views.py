"""Views of motion: circles of the servo and NC programs, each with its answer and doubts, and its page."""

from __future__ import annotations

from typing import Any

from toolpoint._check import one_of
from toolpoint.plot.page.markup import typeset
from toolpoint.project.engine.outlook import StepOutlook
from toolpoint.workbench.state.desk import Desk
from toolpoint.workbench.views.hammer_views import record_doubts
from toolpoint.workbench.views.view import WorkbenchView, command_line

SERVO_STEPS, PROGRAM_STEPS = "contour", "program"  # first parts of the names of steps


def view_servo(desk: Desk, part: str = "") -> WorkbenchView:
    """Return the view of the circles that a servo is asked for: deviation, and the page with its loops and step."""
    view = _view_steps(desk, "servo", SERVO_STEPS, part)
    step = next(step for step in desk.project().chain.steps if step.name == f"{SERVO_STEPS}/{view.data['part']}")
    servo, *machine = step.input_paths
    structure = "".join(f", machine=io.read_machine_at({file!r}, goal.pose)" for file in machine)
    calls = (f"goal = project.Project.open('.').description.contours[{view.data['part']!r}]",
             f"result = studies.study_circle(io.read_drives({servo!r}), goal{structure})", "print(result.table())")
    return WorkbenchView(view.name, view.answer, view.doubts, view.commands, calls, view.data, view.is_stale)


def view_program(desk: Desk, part: str = "") -> WorkbenchView:
    """Return the view of the NC programs: which blocks chatter, and the page with the path coloured."""
    view = _view_steps(desk, "program", PROGRAM_STEPS, part)
    calls = (f"run = project.Project.open('.').program({view.data['part']!r})", "print(run)")
    return WorkbenchView(view.name, view.answer, view.doubts, view.commands, calls, view.data, view.is_stale)


def _view_steps(desk: Desk, name: str, kind: str, part: str) -> WorkbenchView:
    """Return the view of the steps of a kind that were run, the first where none is named."""
    entries = {entry.step.name.partition("/")[2]: entry for entry in desk.outlook(desk.project())
               if entry.step.name.startswith(f"{kind}/") and entry.record is not None}
    chosen = one_of("part", part or next(iter(entries), ""), entries)
    entry = entries[chosen]
    rows = [{"name": key, "words": _words(other), "is_of_today": other.is_of_today} for key, other in entries.items()]
    answer = f"{chosen}: {_words(entry)}."
    data: dict[str, Any] = {"parts": rows, "part": chosen, "pages": [entry.step.name]}
    return WorkbenchView(name, ("Of an earlier state: " if not entry.is_of_today else "") + answer, record_doubts(entry),
                         (entry.step.command or command_line("run", ".", entry.step.name),), (), data, not entry.is_of_today)


def _words(entry: StepOutlook) -> str:
    return "" if entry.record is None else typeset(entry.record.words.rstrip("."))
