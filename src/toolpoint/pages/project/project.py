"""The page of a project: the answer to each goal, doubts, limits with intervals, changes, steps, what to do next, methods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from toolpoint.pages.project.program import program_parts
from toolpoint.plot import Cell, Notes, Report, Table
from toolpoint.project import ProjectResults, StateDifference
from toolpoint.project.results import contour_lines

MARKS = {"done": "good", "by hand": "assumed", "failed": "doubtful", "stopped": "doubtful"}
MAX_SHOWN_SHARES = 4  # sources named beside a limit
MAX_SHOWN_TESTS = 8  # candidates of the next test


def project_page(result: ProjectResults, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a project.

    Examples
    --------
    Runs in ``examples/run_a_project.py``.
    """
    data = result.data
    answers = "\n\n".join(result.answers) or "No goal has an answer yet."
    report = Report(str(data["project"]), answers, subtitle="Project: from records to advice").with_doubts(*result.doubts)
    if result.next_steps:
        report = report.with_section("What to do next", Notes(list(result.next_steps), "note", "In this order"))
    if data["goals"]:
        report = report.with_section("Limits of the goals", _limits(data["goals"]), _sources(data["goals"]))
    for name, program in data.get("programs", {}).items():
        report = report.with_section(f"Program {name}", *program_parts(program))
    if data["contours"]:
        rows = [[name, f"{1e6 * goal['deviation_m']:.3g}", f"{1e6 * goal['goal_m']:.3g}", "yes" if goal["met"] else "no"]
                for name, goal in data["contours"].items()]
        lines = [f"{name}: {line}" for name, goal in data["contours"].items() for line in contour_lines(goal)]
        report = report.with_section("Contours", Table(["circle", "deviation, µm", "goal, µm", "met"], rows),
                                     *([Notes(lines, "note", "Causes, and what was tried by simulation")] if lines else []))
    if data["changes"]:
        report = report.with_section("What to change", _changes(data["changes"]))
    if data["next"]:
        rows = [[entry["test"], f"{100 * entry['after']:.3g}"] for entry in data["next"]["candidates"][:MAX_SHOWN_TESTS]]
        caption = (f"95 % half width of the {data['next']['answer']}: today {100 * data['next']['today']:.3g} %, after a "
                   f"random one of these tests {100 * data['next']['random']:.3g} %.")
        report = report.with_section("What to measure", Table(["test", "half width after it %"], rows, caption))
    if result.difference is not None:
        report = report.with_section("What differs from an earlier run", *_difference_parts(result.difference))
    report = report.with_section("Evidence, step by step", _steps(data["steps"]), _files(data["steps"]))
    report = report.with_section("Methods", str(data["methods"]))
    if warnings:
        report = report.with_section("Remarks", Notes(list(warnings), "warning"))
    return report.with_assumptions(*data["assumptions"])


def _difference_parts(difference: StateDifference) -> list[Table | Notes | str]:
    """Return the parts of the section about two kept states."""
    tables = [Table(list(header), [list(row) for row in rows], f"{title}.")
              for title, header, rows in difference.tables() if rows]
    return [difference.summary, *tables,
            Notes(list(difference.changed_inputs) or ["Nothing."], "note", "What was changed (numbers in SI)")]


def _limits(goals: Mapping[str, Any]) -> Table:
    """Return the table of limits with intervals and probabilities."""
    rows = []
    for name, goal in goals.items():
        lower, upper = goal["interval_m"]
        search_end = f"above {1e3 * goal['depth_max_m']:.3g}"
        ends = search_end if lower is None else (
            f"{1e3 * lower:.3g} .. " + (search_end if upper is None else f"{1e3 * upper:.3g}"))
        limit = search_end if goal["limit_m"] is None else f"{1e3 * goal['limit_m']:.3g}"
        chatter = "" if goal["chatter_frequency_hz"] is None else f"{goal['chatter_frequency_hz']:.4g}"
        rows.append([name, goal["cut"], f"{goal['speed_rpm']:.5g}", f"{1e3 * goal['depth_m']:.3g}", limit, ends,
                     f"{100 * goal['stable_probability']:.0f}", chatter])
    return Table(["goal", "cut", "rev/min", "depth mm", "limit mm", "95 % interval mm", "stable %", "chatter Hz"], rows,
                 "The limit is the first loss of stability at this speed.")


def _sources(goals: Mapping[str, Any]) -> Table:
    """Return the table of the sources of every interval."""
    rows = [[name, ", ".join(f"{part} {100 * share:.0f} %" for part, share in list(goal["shares"].items())[:MAX_SHOWN_SHARES])]
            for name, goal in goals.items()]
    return Table(["goal", "what the interval comes from"], rows, "Shares in the variance of the logarithm of the limit.")


def _changes(changes: Sequence[Mapping[str, Any]]) -> Table:
    rows = [[change["name"], change["joint"], f"{100 * change['stiffness_share']:+.3g}", f"{100 * change['gain']:+.2g}",
             f"{100 * change['gain_interval'][0]:+.2g} .. {100 * change['gain_interval'][1]:+.2g}", f"{change['cost']:g}"]
            for change in changes]
    return Table(["change", "joint", "springs %", "least limit %", "95 % interval", "cost"], rows,
                 "Gain of the least limit over the speeds of the cut (single-frequency solution), at the goal where it gains "
                 "least; ranked by gain a cost.")


def _steps(steps: Sequence[Mapping[str, Any]]) -> Table:
    """Return the table of the steps: what each says, and how many doubts arose in it (they stand at the top of the page)."""
    rows = [[step["step"], Cell(step["state"], MARKS[step["state"]]), step["words"], str(len(step["doubts"]) or "")]
            for step in steps]
    return Table(["step", "state", "what it says", "doubts"], rows)


def _files(steps: Sequence[Mapping[str, Any]]) -> Table:
    """Return the table of the steps' files, and of the commands that open their own pages."""
    rows = [[step["step"], step["command"], ", ".join(step["files"])] for step in steps]
    return Table(["step", "command that opens its own page", "its files"], rows,
                 "Commands and files count from the project's folder.")
