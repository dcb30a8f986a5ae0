"""The command demo: published systems by name, each with its page; `DEMOS` is the only list of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from toolpoint import cutting, io, pages, project, studies
from toolpoint import machine as machines
from toolpoint._check import fail, one_of
from toolpoint._doubt import mark_notes
from toolpoint.app.declare import Argument, Help, command
from toolpoint.app.frame import Frame

DEFAULT_DEMO = "machining-centre"  # the quickest: it needs no compiler
MACHINE_FOLDER = Path(__file__).parents[1] / "machines"
# The same machine without feed drives and with them: what they cost in stiffness is what the page shows.
CASTING_FILE, DRIVE_FILE = "three_axis_vertical.yaml", "three_axis_vertical_drives.yaml"

MILL_FILE = "small_mill.yaml"


@dataclass(frozen=True)
class Demo:
    """A published system: one line of what it shows, how many steps it takes, and what runs it; `full` at full length."""

    summary: str
    steps: int
    run: Callable[[Frame], None]
    full: Callable[[Frame], None] | None = None


@command(json=False)
def demo(run: Frame, name: Annotated[str, Argument()] = DEFAULT_DEMO, *,
         listed: Annotated[bool, Help("Print the names and what they show.", name="--list")] = False,
         full: Annotated[bool, Help("At full length: of the milling robot, all four sides of all 23 variants (four "
                                    "minutes).")] = False) -> None:
    """A published system by name (see --list): by default a machining centre with modes, tool-point responses and lobes."""
    if listed:
        width = max(map(len, DEMOS))
        run.show_text(*(f"{key:{width}}  {entry.summary}" for key, entry in DEMOS.items()))
        return
    chosen = DEMOS[one_of("demo", name, DEMOS)]
    if full and chosen.full is None:
        fail("--full", name, "has one length only")
    run.steps = chosen.steps
    (chosen.full if full and chosen.full is not None else chosen.run)(run)
    run.show_rest()
    if name == DEFAULT_DEMO:
        run.suggest("demo --list", "new machine my_machine.yaml --template three-axis-vertical")


def run_machining_centre(run: Frame) -> None:
    """Show the published three-axis machining centre, without and with its feed drives."""
    run.step("machine")
    casting = studies.study_modes(io.read_machine(MACHINE_FOLDER / CASTING_FILE))
    run.step("machine with feed drives")
    # The quickest method: nobody wants to wait for a compiler on the first page.
    drives = studies.study_machine(io.read_machine(MACHINE_FOLDER / DRIVE_FILE), step=run.step, method=cutting.ZeroOrder())
    run.step("page")
    run.save(pages.demo_page, casting, drives, [(name, _machine_text(name)) for name in (CASTING_FILE, DRIVE_FILE)],
             warnings=run.warnings)
    size, frequency = drives.machine.size, drives.frequency
    run.show_text(*mark_notes(drives.to_dict()["doubts"]), casting.table(),
                  f"With feed drives: {size} degrees of freedom, {frequency[0]:.2f} .. {frequency[-1]:.1f} Hz",
                  *drives.limit_lines())


def run_three_rps_head(run: Frame) -> None:
    """Show the 3-RPS head with rigid limbs, then (each in a folder or file of its own) with elastic ones that slide through
    their frames, and beside its source: modes at tilted poses, responses, lobes, and maps over tilt and azimuth."""
    azimuth, tilt = np.radians(np.linspace(0, 360, 25)), np.radians(np.linspace(0, 30, 7))
    _run_over_workspace(run, "three_rps_head.yaml", {"tilt": tilt, "azimuth": azimuth})
    output = run.output or Path()
    elastic = output.with_name(f"{output.stem}-elastic{output.suffix}") if output.suffix else output / "elastic"
    _run_over_workspace(run, "three_rps_elastic_head.yaml", {"tilt": tilt[::2], "azimuth": azimuth[::2]}, to=elastic)
    _run_published_head(run, output.with_name(f"{output.stem}-tested{output.suffix}") if output.suffix else output / "tested")


def _run_published_head(run: Frame, to: Path) -> None:
    """Show the head beside its source: planes of 550 and 750 mm, responses over -30 to 30 degrees."""
    name, earlier_warnings = "three_rps_tested_head.yaml", len(run.warnings)
    run.step("machine")
    head = io.read_machine(MACHINE_FOLDER / name)
    result = studies.study_published_head(head, step=run.step, method=cutting.ZeroOrder())
    run.step("page")
    run.save(pages.head_source_page, result, source=_machine_text(name), file_name=name,
             warnings=run.warnings[earlier_warnings:], to=to)
    run.show_text(result.table())


def run_gantry(run: Frame) -> None:
    """Show the gantry, whose axis Y drives both sides: modes, responses, lobes, frequencies and stiffness over Y and X."""
    _run_over_workspace(run, "gantry.yaml", {"Y": np.linspace(-1, 1, 11), "X": np.linspace(-0.8, 0.8, 9)})


def _run_over_workspace(run: Frame, name: str, axes: Mapping[str, ArrayLike], to: Path | None = None) -> None:
    """Show a machine of the package and two maps of it."""
    earlier_warnings = len(run.warnings)
    run.step("machine")
    result = studies.study_workspace(io.read_machine(MACHINE_FOLDER / name), axes, step=run.step, method=cutting.ZeroOrder())
    run.step("page")
    run.save(pages.workspace_page, result, source=_machine_text(name), file_name=name, warnings=run.warnings[earlier_warnings:],
             to=to)
    run.show_text(result.table())


def run_video_mill(run: Frame) -> None:
    """Film a small mill of known truth in two planes, find its soft interfaces, update its model to the videos."""
    result = studies.update_from_virtual_videos(io.read_machine(MACHINE_FOLDER / MILL_FILE), studies.FILMED_TRUTH,
                                                "spindle_nose",
                                                rng=np.random.default_rng(1), step=run.step)
    run.step("page")

    from toolpoint.pages.video import virtual_update_page

    answer = run.save(virtual_update_page, result, _machine_text(MILL_FILE), MILL_FILE, warnings=run.warnings)
    run.show_text(answer, result.table())


def run_milling_robot(run: Frame, *, full_length: bool = False) -> None:
    """Show the published milling robot; `full_length`: whole sides of all variants, kept and resumed in a folder beside the
    page."""
    run.step("datasheet")
    sheet, output = MACHINE_FOLDER / "milling_robot_datasheet.yaml", run.output or Path()
    description = io.read_robot_machine(sheet)
    study = studies.study_datasheet(io.read_datasheet(sheet), description)
    result = studies.run_robot_demo(study, machines.build(description),
                                    io.read_plan(MACHINE_FOLDER / "milling_robot_screening.yaml"),
                                    step=run.step, all_sides=full_length,
                                    folder=output.with_name(f"{output.stem}-kept") if full_length else None)
    run.step("page")

    from toolpoint.pages.robots.robot_demo import robot_demo_page

    run.save(robot_demo_page, result, _machine_text(sheet.name), sheet.name, warnings=run.warnings)
    run.show_text(study.table(), result.table())


def run_finite_element_mill(run: Frame) -> None:
    """Show an example mill by finite elements: modes, a virtual hammer test beside them, sensitivities, what helps the cut."""
    run.step("meshes")
    result = studies.study_example_mill(step=run.step)
    run.step("page")
    run.save(pages.finite_element_page, result, warnings=run.warnings)
    run.show_text(result.table())


def run_project_demo(run: Frame) -> None:
    """Write a virtual mill's raw records as a project in a folder beside the page, and run it from records to advice."""
    run.step("records")
    output = run.output or Path("toolpoint-report")
    folder = output.with_name(f"{output.stem}-mill") if output.suffix else output / "mill"
    # A second run goes on with the folder of the first: the files of a person in it are never written over.
    if not (folder / "project.yaml").exists():
        project.write_demo(folder)
    opened = project.Project.open(folder)
    results = opened.run(listen=lambda event: None if event.ended else run.step(event.decision.step))
    run.step("page")
    run.save(pages.project_page, results, warnings=run.warnings)
    run.show_text(results.table())
    run.suggest(f"run {folder} --explain", f"serve {folder}")


def _machine_text(name: str) -> str:
    return (MACHINE_FOLDER / name).read_text(encoding="utf-8")


DEMOS: dict[str, Demo] = {
    DEFAULT_DEMO: Demo("three-axis machining centre: modes, tool-point responses, stability lobes", 6, run_machining_centre),
    "video-mill": Demo("small mill filmed in two planes: modes from video, the soft joints, the updated model", 6,
                       run_video_mill),
    "three-rps-head": Demo("parallel head with three driven limbs: closed loops, parasitic motion, maps over tilt and azimuth",
                           21, run_three_rps_head),
    "milling-robot": Demo("six-axis robot that mills: datasheet, map, best region, stable depths, accuracy, 23 design changes",
                          7, run_milling_robot, partial(run_milling_robot, full_length=True)),
    "finite-element-mill": Demo("mill of castings by finite elements: hammer test, sensitivities, layers, dampers",
                                13, run_finite_element_mill),
    "project": Demo("a project: raw records of a virtual mill, two bad hits and a wrong channel, to limits, changes, next test",
                    10, run_project_demo),
    "gantry": Demo("gantry whose one axis drives both sides of a closed loop: maps over Y and X", 7, run_gantry),
}
