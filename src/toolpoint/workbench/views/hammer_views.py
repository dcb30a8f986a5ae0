"""Views of tests: blows with their verdicts, accepted and refused by a person; modes with what is doubtful about them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from toolpoint import io
from toolpoint._check import ToolpointError, one_of
from toolpoint._doubt import Doubt
from toolpoint.project import Project
from toolpoint.project.steps.plain_files import read_json
from toolpoint.workbench.state.desk import Desk
from toolpoint.workbench.views.view import WorkbenchView, command_line

MAX_ANSWERED_MODES = 12  # frequencies in the answer


def _tests_with(desk: Desk, project: Project, kind: str, file: str) -> dict[str, tuple[Any, Any]]:
    """Return data and state of the steps of a kind whose file is there, by the name of the test."""
    tests = {}
    for entry in desk.outlook(project):
        first, _, name = entry.step.name.partition("/")
        place = desk.folder / "results" / entry.step.name / file
        if first == kind and place.is_file():
            tests[name] = (read_json(place), entry)
    return tests


def view_modes(desk: Desk, test: str = "") -> WorkbenchView:
    """Return the view of the modes of a test, the first where none is named."""
    project = desk.project()
    tests = _tests_with(desk, project, "modes", "modes.json")
    name = one_of("test", test or next(iter(tests), ""), tests)
    data, entry = tests[name]
    frequencies = [f"{value:.4g}" for value in data["frequency_hz"]]
    doubtful = [text for text, flag in zip(frequencies, data["doubtful"], strict=True) if flag]
    further_words = f" and {len(frequencies) - MAX_ANSWERED_MODES} more" if len(frequencies) > MAX_ANSWERED_MODES else ""
    answer = f"{name}: {len(frequencies)} modes, {', '.join(frequencies[:MAX_ANSWERED_MODES])}{further_words} Hz"
    answer += f"; doubtful: {', '.join(doubtful)} Hz." if doubtful else "."
    responses = f"results/responses/{name}/responses.h5"
    rows = [{"frequency_hz": f, "damping_ratio": z, "doubtful": bad} for f, z, bad in
            zip(data["frequency_hz"], data["damping_ratio"], data["doubtful"], strict=True)]
    doubts = (*_doubts_of(entry), *map(Doubt.parsed, data["advice"]))
    return WorkbenchView("modes", ("Of an earlier state: " if not entry.is_of_today else "") + answer, doubts,
                         (command_line("identify", responses),),
                         (f"frf = io.read_frf([{responses!r}])", "print(studies.identify_modes(frf).table())"),
                         {"tests": list(tests), "test": name, "modes": rows,
                          "pages": [f"modes/{name}", *([f"correlate/{name}"] if _has_machine(project) else [])]},
                         not entry.is_of_today)


def _has_machine(project: Project) -> bool:
    try:
        return project.machine_file.is_file()
    except ToolpointError:
        return False


def _doubts_of(entry: Any) -> tuple[Doubt, ...]:
    old = [] if entry.is_of_today else [Doubt(entry.step.name, entry.reason, "run the project")]
    record = entry.record
    return (*old, *([] if record is None else [doubt.doubt for doubt in record.doubts if doubt.step == entry.step.name]))


def view_blows(desk: Desk, test: str = "") -> WorkbenchView:
    """Return the view of the blows of a test with their verdicts; a person may decide against each."""
    project = desk.project()
    tests = _tests_with(desk, project, "responses", "hits.json")
    name = one_of("test", test or next(iter(tests), ""), tests)
    data, entry = tests[name]
    hits = data.get("hits", [])  # a shaker's records hold none
    refused = [hit for hit in hits if not hit["accepted"]]
    answer = f"{name}: {len(hits) - len(refused)} of {len(hits)} blows are used. {data['status']}" if hits else (
        f"{name}: {data['status']}")
    file = project.description.tests[name].test
    return WorkbenchView("blows", ("Of an earlier state: " if not entry.is_of_today else "") + answer, _doubts_of(entry),
                         (command_line("frf", file),) if file else (command_line("run", ".", f"responses/{name}"),),
                         _blow_calls(file, name), {"tests": list(tests), "test": name, "hits": hits, "notes": data["notes"],
                                                   "can_decide": file is not None, "file": file, "pages": [f"blows/{name}"]},
                         not entry.is_of_today)


def _blow_calls(file: str | None, name: str) -> tuple[str, ...]:
    if file is None:
        return (f"project.Project.open('.').run(['responses/{name}'])",)
    return (f"records, description = io.read_hammer_test({file!r})",
            "print(studies.study_described_records(records, description).table())")


def decide_hit(desk: Desk, test: str, hit: str, *, accept: bool | None) -> dict[str, Any]:
    """Write a person's decision about a blow into the test file, None takes it back; say the command that does the same.

    Raises ToolpointError for a test without a test file, and for a blow that it lacks.
    """
    project = desk.project()
    described = project.description.tests
    file = described[one_of("test", test, described)].test
    if file is None:
        raise ToolpointError(f"tests.{test}: has no test file, where decisions stand; write one with toolpoint frf --test")
    place = desk.folder / file
    _, description = io.read_hammer_test(place)
    hits = _tests_with(desk, project, "responses", "hits.json")
    one_of("blow", hit, [entry["name"] for entry in hits[test][0]["hits"]] if test in hits else ())
    decisions: dict[str, bool] = {name: word == "accepted" for name, word in description.hits.items()}
    decisions.pop(hit, None)
    if accept is not None:
        decisions[hit] = accept
    io.write_test(description.with_decisions(decisions), place, replace=True)
    option = "--accept" if accept else "--refuse"
    return {"command": command_line("frf", file, option, hit, "--test", file, "--replace") if accept is not None else
            f"{file}: the line {hit} under hits was removed", "decisions": _words(decisions)}


def _words(decisions: Mapping[str, bool]) -> dict[str, str]:
    return {name: "accepted" if accept else "refused" for name, accept in decisions.items()}
