"""Existing pages of the commands, shown in a frame of the workbench: made anew where their files have changed, else kept."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint import io, pages, studies
from toolpoint._check import ToolpointError, fail
from toolpoint.io.yaml.named_files import list_named_files
from toolpoint.machine.description.project_plan import ContourGoal
from toolpoint.project import Project
from toolpoint.project.chain import choice_place
from toolpoint.project.steps.measuring import identify_responses
from toolpoint.project.steps.plain_files import read_json
from toolpoint.workbench.state.desk import STATE_PLACE, Desk, collect_doubts
from toolpoint.workbench.state.kept_files import keep_file
from toolpoint.workbench.views.project_view import view_project
from toolpoint.workbench.views.view import WorkbenchView, command_line

MAP_POSITIONS, MAP_AXES = 9, 2  # positions along an axis, axes of a map
MAPPED_QUANTITIES = {"frequency": "natural frequencies", "static": "static stiffness of the tool"}
KEPT_PAGES = 24  # made pages in the folder of the workbench's state


@dataclass(frozen=True)
class KnownPage:
    """A page that a project has: its title, the files it rests on, the command that writes it, and what makes it."""

    title: str
    files: tuple[Path, ...]
    command: str
    make: Callable[[], Any]


def pages_of(desk: Desk) -> dict[str, KnownPage]:
    """Return the pages of a project by name, of those whose files are there."""
    project = desk.project()
    results = desk.folder / "results"
    entries = {"report": KnownPage("Report of the project", (results / "project.json",), command_line("run", "."),
                                 lambda: pages.project_page(project.results))}
    for name in project.description.tests:
        entries |= _pages_of_test(desk, project, name)
    entries |= _machine_pages(project)
    entries |= _map_pages(desk, project)
    entries |= _servo_pages(project)
    entries |= _program_pages(desk, project)
    return {name: page for name, page in entries.items() if all(file.is_file() for file in page.files)}


def _servo_pages(project: Project) -> dict[str, KnownPage]:
    """Return the pages of the circles that the servo is asked for."""
    steps = [step for step in project.chain.steps if step.name.startswith("contour/")]
    return {step.name: KnownPage(f"Servo: the circle of {name}, loops, step", files, step.command,
                                 partial(_circle, project.description.contours[name], *files))
            for step in steps for name in [step.name.partition("/")[2]]
            for files in [tuple(project.folder / path for path in step.input_paths)]}


def _program_pages(desk: Desk, project: Project) -> dict[str, KnownPage]:
    """Return the pages of the NC programs that were run."""
    steps = [step for step in project.chain.steps if step.name.startswith("program/")]
    return {step.name: KnownPage(f"NC program {name}: blocks in space, lobes, text",
                                 tuple(project.folder / path for path in (*step.input_paths, step.output_paths[0])),
                                 step.command, partial(_program, desk, project, name))
            for step in steps for name in [step.name.partition("/")[2]]}


def _program(desk: Desk, project: Project, name: str) -> Any:
    data = read_json(project.folder / "results" / "program" / name / "program.json")
    records = [entry.record for entry in desk.outlook(project) if entry.step.name == f"program/{name}"]
    # The page says its own doubts; those of a step before it are named by the step.
    doubts = [entry.doubt if entry.step == f"program/{name}" else entry.doubt.within(entry.step)
              for record in records if record is not None for entry in record.doubts]
    return pages.project_program_page(project.program(name), data).preceded_by(*doubts)


def _circle(goal: ContourGoal, servo: Path, machine: Path | None = None) -> Any:
    built = None if machine is None else io.read_machine_at(machine, goal.pose)
    result = studies.study_circle(io.read_drives(servo), goal, machine=built)
    return pages.circle_page(result, source_text=servo.read_text(encoding="utf-8-sig"), warnings=list(result.experiment.notes))


def _pages_of_test(desk: Desk, project: Project, name: str) -> dict[str, KnownPage]:
    responses, test = desk.folder / "results" / "responses" / name / "responses.h5", project.description.tests[name]
    entries = {}
    if (desk.folder / "results" / "modes" / name / "modes.json").is_file():
        place, choice = responses.relative_to(desk.folder).as_posix(), desk.folder / choice_place(name)
        options = ["--choice", choice_place(name)] if choice.is_file() else []
        entries[f"modes/{name}"] = KnownPage(f"Modes of {name}: stabilization, synthesis, shapes",
                                           (responses, *([choice] if options else [])),
                                           command_line("identify", place, *options),
                                           partial(_identification, project, responses, name))
    if test.test is not None:
        file = desk.folder / test.test
        entries[f"blows/{name}"] = KnownPage(f"Blows of {name}: pulses, spectra, responses", (file, responses),
                                           command_line("frf", test.test), partial(_blows, file))
    modes = desk.folder / "results" / "modes" / name / "modes.h5"
    machine, described = _machine_file(project), project.description
    if machine is not None and described.geometry is not None and described.components is not None:
        words = [machine.relative_to(desk.folder).as_posix(), modes.relative_to(desk.folder).as_posix(), "--geometry",
                 described.geometry, "--components", described.components]
        entries[f"correlate/{name}"] = KnownPage(f"Model beside the test {name}: shapes, MAC, difference", (modes, machine),
                                               command_line("correlate", *words),
                                               partial(_correlation, project, machine, modes))
    return entries


def _identification(project: Project, responses: Path, test: str) -> Any:
    geometry, choice = project.description.geometry, project.folder / choice_place(test)
    shape = None if geometry is None else io.read_geometry(project.folder / geometry)
    described = project.description.tests[test]
    result, _ = identify_responses(responses, choice if choice.is_file() else None, band=described.band,
                                   sensor_mass=described.sensor_mass, whole_band=bool(described.responses))
    place = responses.relative_to(project.folder).as_posix()
    return pages.identification_page(result, shape, [responses.name], warnings=[], command=command_line("identify", place),
                                     components=_components_of(project))


def _components_of(project: Project) -> Any:
    """Return the points by component, None where no file of the project says it."""
    file = project.description.components
    return None if file is None else io.read_components(project.folder / file).points


def _blows(file: Path) -> Any:
    records, description = io.read_hammer_test(file)
    result = studies.study_described_records(records, description)
    return pages.records_page(result, [], description.test)


def _correlation(project: Project, machine: Path, modes: Path) -> Any:
    described, built = project.description, io.read_machine(machine)
    saved, responses = io.read_test_nouns([modes])
    test = studies.gather_test(saved, responses, geometry=io.read_geometry(project.folder / str(described.geometry)),
                               owner=io.read_components(project.folder / str(described.components)).points)
    return pages.correlation_page(studies.compare_with_test(built, test))


def _machine_file(project: Project) -> Path | None:
    try:
        return project.machine_file
    except ToolpointError:
        return None


def _machine_pages(project: Project) -> dict[str, KnownPage]:
    file = _machine_file(project)
    if file is None:
        return {}
    place = file.relative_to(project.folder).as_posix()
    return {"machine": KnownPage("Report of the machine", (file,), command_line("report", place), partial(_machine, file))}


def _machine(file: Path) -> Any:
    result = studies.study_machine_and_responses(io.read_machine(file), None)
    return pages.first_look_page(result, source=file.read_text(encoding="utf-8-sig"), file_name=file.name, names=[],
                                 warnings=[])


def _map_pages(desk: Desk, project: Project) -> dict[str, KnownPage]:
    """Return maps over the first axes of the machine that have limits."""
    file = _machine_file(project)
    if file is None:
        return {}
    axes = desk.machine(file).machine.description.axes.items()
    ends = {name: axis.limits for name, axis in axes if np.isfinite(axis.limits).all()}
    grid = {name: np.linspace(*ends[name], MAP_POSITIONS) for name in list(ends)[:MAP_AXES]}
    if not grid:
        return {}
    place = file.relative_to(project.folder).as_posix()
    ranges = [f"--axis={name}={lower:g}:{upper:g}:{MAP_POSITIONS}" for name, (lower, upper) in list(ends.items())[:MAP_AXES]]
    words = " and ".join(grid)
    return {f"map/{quantity}": KnownPage(f"Workspace: {title} over {words}", (file,),
                                         command_line("map", place, *ranges, "--quantity", quantity),
                                         partial(_map, file, grid, quantity))
            for quantity, title in MAPPED_QUANTITIES.items()}


def _map(file: Path, grid: Mapping[str, Any], quantity: str) -> Any:
    built = io.read_machine(file)
    result = studies.map_frequencies(built, grid) if quantity == "frequency" else studies.map_stiffness(built, grid, quantity)
    return pages.map_page(result, built.name)


def page_text(desk: Desk, name: str) -> str:
    """Return a page as HTML: that of today's files."""
    entries = pages_of(desk)
    if name not in entries:
        fail("page", repr(name), f"must be one of {', '.join(entries) or 'none yet: run the project'}")
    page = entries[name]
    files = [*page.files, *(file.parent / named for file in page.files for named in list_named_files(file))]
    digest = hashlib.sha256("\n".join([name, *map(_stamp, files)]).encode()).hexdigest()[:24]
    kept = desk.folder / STATE_PLACE / "pages" / f"{digest}.html"
    if kept.is_file():
        return kept.read_text(encoding="utf-8")
    with desk.lock:
        report, doubts = collect_doubts(page.make)
    text: str = report.preceded_by(*doubts).html()
    keep_file(kept, text)
    _forget_old(kept.parent)
    return text


def _stamp(file: Path) -> str:
    status = file.stat()
    return f"{file} {status.st_size} {status.st_mtime_ns}"


def _forget_old(folder: Path) -> None:
    files = sorted(folder.glob("*.html"), key=lambda path: path.stat().st_mtime, reverse=True)
    for file in files[KEPT_PAGES:]:
        file.unlink(missing_ok=True)


def view_report(desk: Desk, page: str = "") -> WorkbenchView:
    """Return the view of the pages that a project has, with the chosen one."""
    entries: Mapping[str, KnownPage] = pages_of(desk)
    if not entries:
        return WorkbenchView("report", "There is no page yet: run the project.", commands=(command_line("run", "."),))
    name = page if page in entries else next(iter(entries))
    project_view = view_project(desk)  # a report begins with what the project answers, and with what speaks against it
    return WorkbenchView("report", project_view.answer, project_view.doubts, (entries[name].command,), (), {
        "pages": [{"name": key, "title": entry.title} for key, entry in entries.items()], "page": name}, project_view.is_stale)
