"""Views of tests: blows with their verdicts, accepted and refused by a person; modes with what is doubtful about them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from toolpoint import io, studies
from toolpoint._check import ToolpointError, one_of
from toolpoint._doubt import Doubt
from toolpoint.project import Project
from toolpoint.project.chain import choice_place
from toolpoint.project.steps.plain_files import read_json
from toolpoint.studies.measured.hammer_study import HammerStudy
from toolpoint.vibration import Dof, Record
from toolpoint.workbench.state.blow_responses import response_beside
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
    answer = f"{name}: {len(frequencies)} modes, {', '.join(frequencies[:MAX_ANSWERED_MODES])} Hz{further_words}"
    answer += f"; doubtful: {', '.join(doubtful)} Hz." if doubtful else "."
    responses = f"results/responses/{name}/responses.h5"
    options = ["--choice", choice_place(name)] if _kept_choice(desk, name) else []
    rows = _mode_rows(data)
    doubts = (*record_doubts(entry), *map(Doubt.parsed, data["advice"]))
    return WorkbenchView("modes", ("Of an earlier state: " if not entry.is_of_today else "") + answer, doubts,
                         (command_line("identify", responses, *options),),
                         (f"frf = io.read_frf([{responses!r}])",
                          f"print(studies.identify_modes(frf{_choice_argument(options)}).table())"),
                         {"tests": list(tests), "test": name, "modes": rows, "choice": _kept_choice(desk, name),
                          "pages": [f"modes/{name}", *([f"correlate/{name}"] if _has_machine(project) else [])]},
                         not entry.is_of_today)


def _mode_rows(data: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return frequency, damping, their 95 % half widths (None where they are not known) and the mark of every mode."""
    unknown = [None] * len(data["frequency_hz"])
    columns = {"frequency_hz": data["frequency_hz"], "frequency_interval_hz": data.get("frequency_interval_hz") or unknown,
               "damping_ratio": data["damping_ratio"], "damping_interval": data.get("damping_interval") or unknown,
               "doubtful": data["doubtful"]}
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _choice_argument(options: list[str]) -> str:
    return f", choice=io.read_choice({options[1]!r})" if options else ""


def _kept_choice(desk: Desk, test: str) -> str:
    """Return the text of the poles that a person chose for a test, empty where there are none."""
    place = desk.folder / choice_place(test)
    return place.read_text(encoding="utf-8") if place.is_file() else ""


def keep_choice(desk: Desk, test: str, text: str) -> dict[str, Any]:
    """Write poles chosen by clicks for a test, an empty text takes them back; say the command that does the same."""
    place = desk.project().choose_poles(test, text)
    if not text.strip():
        return {"place": place, "command": f"rm {place}"}
    return {"place": place, "command": command_line("add", ".", "--choice", f"{test}=choice.yaml")}


def _has_machine(project: Project) -> bool:
    try:
        return project.machine_file.is_file()
    except ToolpointError:
        return False


def record_doubts(entry: Any) -> tuple[Doubt, ...]:
    """Return the doubts that arose in a step, after that of results that are not of today."""
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
    answer = f"{name}: {data['status']}"
    file = project.description.tests[name].test
    return WorkbenchView("blows", ("Of an earlier state: " if not entry.is_of_today else "") + answer, record_doubts(entry),
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
            f"{file}: the line {hit} under hits was removed", "decisions": _words(decisions),
            "response": _response_after(desk, test, place, hit)}


def _response_after(desk: Desk, test: str, file: Path, hit: str) -> dict[str, Any] | None:
    """Return the response that a decided blow contributes to, beside that of the last run; None where no good blow is left."""
    records, description = io.read_hammer_test(file)
    names = [name for name in records.names if hit == name or hit.startswith(f"{name}#")]
    outputs = tuple(dof for name in names for dof, quantity in _channels(records.records[records.names.index(name)])
                    if quantity != "force")
    kept = desk.folder / "results" / "responses" / test / "responses.h5"
    try:
        study = studies.study_described_records(records, description)
        earlier = io.read_frf([kept]) if kept.is_file() else None
    except ToolpointError:
        return None
    return response_beside(study, outputs, earlier) if isinstance(study, HammerStudy) else None


def _channels(record: Record) -> list[tuple[Dof, str]]:
    return list(zip(record.channels, record.quantities, strict=True))


def _words(decisions: Mapping[str, bool]) -> dict[str, str]:
    return {name: "accepted" if accept else "refused" for name, accept in decisions.items()}
