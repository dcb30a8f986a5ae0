"""View of two kept states of a project side by side: limits with intervals, modes, springs, and what was changed."""

from __future__ import annotations

from typing import Any

from toolpoint.project import Project
from toolpoint.workbench.views.view import WorkbenchView, command_line

STATE_WORD = "state"  # before the key of a kept state in a list of what can be compared


def kept_entries(project: Project) -> dict[str, str]:
    """Return the kept states of a project, the newest first, with words for each."""
    return {f"{STATE_WORD} {state.key}": f"answers of {state.date.replace('T', ' ')} ({state.key})"
            for state in reversed(project.states)}


def view_two_states(project: Project, names: tuple[str, str], data: dict[str, Any]) -> WorkbenchView:
    """Return the view of two kept states; data : what the page needs beside the comparison."""
    keys = tuple(name.removeprefix(f"{STATE_WORD} ") for name in names)
    difference = project.compare_states(*keys)
    tables = [{"title": title, "header": list(header), "rows": [list(row) for row in rows]}
              for title, header, rows in difference.tables() if rows]
    return WorkbenchView("compare", difference.summary, difference.doubts,
                         (command_line("run", ".", "--since", keys[0], "--until", keys[1]),),
                         (f"print(project.Project.open('.').compare_states({keys[0]!r}, {keys[1]!r}).table())",),
                         {**data, "state_tables": tables, "state_changes": list(difference.changed_inputs)})
