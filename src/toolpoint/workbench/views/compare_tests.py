"""Two tests of a project side by side, by the date of their records: frequencies with the interval of their change, shapes."""

from __future__ import annotations

import datetime
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint import io, studies
from toolpoint._doubt import Doubt
from toolpoint.project import Project
from toolpoint.workbench.state.access import path_beneath
from toolpoint.workbench.state.desk import Desk, collect_doubts
from toolpoint.workbench.views.view import WorkbenchView, command_line

COMPARISON_SEED = 1  # of the noise that is drawn, as that of the command compare


def test_files(desk: Desk, project: Project) -> dict[str, str]:
    """Return the saved modes of the tests of a project with words for each: its name and the date of its records."""
    entries = {}
    responses = {step.name.partition("/")[2]: step for step in project.chain.steps if step.name.startswith("responses/")}
    for step in project.chain.steps:
        name = step.name.partition("/")[2]
        place = next((path for path in step.output_paths if path.endswith(".h5")), "")
        if not step.name.startswith("modes/") or not (desk.folder / place).is_file():
            continue
        records = responses[name].inputs.get("records", ()) if name in responses else ()
        entries[place] = f"test {name}, {date_of(desk.folder, records or (place,))}"
    for path in sorted(desk.folder.glob("*.h5")):
        entries[path.name] = f"{path.name}, {date_of(desk.folder, (path.name,))}"
    return entries


def date_of(folder: Path, places: Any) -> str:
    """Return the day on which the first of the files was last written."""
    places = (places,) if isinstance(places, str) else places
    times = [(folder / place).stat().st_mtime for place in places if (folder / place).is_file()]
    return datetime.date.fromtimestamp(min(times)).isoformat() if times else "no date"


def view_two_tests(desk: Desk, names: tuple[str, str], data: dict[str, Any]) -> WorkbenchView:
    """Return the view of two tests; data : what the page needs beside the comparison."""
    older, newer = (path_beneath(desk.folder, name) for name in names)
    states = io.read_two_states(older, newer)
    result, warned = collect_doubts(lambda: studies.compare_two_states(*states, rng=np.random.default_rng(COMPARISON_SEED)))
    date_doubt = Doubt("the dates", "are those at which the files of the records were last written: a copy can have another",
                       "name the tests by their date in project.yaml")
    content = {"test_rows": result.rows(), "test_lines": [*result.single_lines(), *result.point_lines()]}
    return WorkbenchView("compare", f"{data['labels'][names[1]]} beside {data['labels'][names[0]]}: {result.answer()}",
                         (*result.doubts, *warned, date_doubt), (command_line("compare", *names),),
                         (f"states = io.read_two_states({names[0]!r}, {names[1]!r})",
                          f"print(studies.compare_two_states(*states, rng=np.random.default_rng({COMPARISON_SEED})).table())"),
                         {**data, **content})
