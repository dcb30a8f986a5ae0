"""The command demo: published systems by name, each with its page; `DEMOS` is the only list of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import click
from numpy.typing import ArrayLike

from toolpoint._check import fail, one_of
from toolpoint.app.frame import frame
from toolpoint.app.options import OUTPUT

DEFAULT = "machining-centre"
CASTING, DRIVES = "three_axis_vertical.yaml", "three_axis_vertical_drives.yaml"

MILL = "small_mill.yaml"
# What the filmed mill has instead of the file's starting values: chosen, so that each plane has a mode near 13 and near 64 Hz.
MILL_TRUTH = {
    "joints.floor_base.stiffness.rx": 1.12e6, "joints.floor_base.stiffness.ry": 1.13e6,
    "joints.column_housing.stiffness.rx": 8.9e5, "joints.column_housing.stiffness.ry": 1.72e5,
    "joints.floor_base.damping.rx": 560.0, "joints.floor_base.damping.ry": 560.0,
    "joints.column_housing.damping.rx": 66.0, "joints.column_housing.damping.ry": 13.0}


@dataclass(frozen=True)
class Demo:
    """A published system: one line of what it shows, and what runs it and writes its page into a folder; `full` at full
    length."""

    summary: str
    run: Callable[[Path], None]
    full: Callable[[Path], None] | None = None


@click.command()
@click.argument("name", default=DEFAULT)
@click.option("--list", "listed", is_flag=True, help="Print the names and what they show.")
@click.option("--full", is_flag=True,
              help="At full length: of the milling robot, all four sides of all 23 variants (four minutes).")
@OUTPUT
def demo(name: str, listed: bool, full: bool, output: Path) -> None:
    """A published system by name (see --list): by default a machining centre with modes, tool-point responses and lobes."""
    if listed:
        width = max(map(len, DEMOS))
        click.echo("\n".join(f"{key:{width}}  {entry.summary}" for key, entry in DEMOS.items()))
        return
    chosen = DEMOS[one_of("demo", name, DEMOS)]
    if full and chosen.full is None:
        fail("--full", name, "has one length only")
    (chosen.full if full and chosen.full is not None else chosen.run)(output)
    if name == DEFAULT:
        from toolpoint.app import console

        console.suggest("demo --list", "new machine my_machine.yaml --template three-axis-vertical")


def run_machining_centre(output: Path) -> None:
    """Show the published three-axis machining centre, without and with its feed drives."""
    from importlib import resources

    from toolpoint.app import console
    from toolpoint.cutting import ZeroOrder
    from toolpoint.io.yaml import machine_file
    from toolpoint.pages.machines.demo import demo_page
    from toolpoint.studies.machines.machine_report import study_machine, study_modes

    with resources.as_file(resources.files("toolpoint.app") / "machines") as folder, frame(output, False, steps=6) as run:
        run.step("machine")
        casting = study_modes(machine_file.read(folder / CASTING))
        run.step("machine with feed drives")
        # The quickest method: nobody wants to wait for a compiler on the first page.
        drives = study_machine(machine_file.read(folder / DRIVES), step=run.step, method=ZeroOrder())
        run.step("page")
        files = [(name, (folder / name).read_text(encoding="utf-8")) for name in (CASTING, DRIVES)]
        run.save(demo_page(casting, drives, files, warnings=run.warnings))
    size, frequency = drives.machine.size, drives.frequency
    console.text(casting.table())
    console.text(f"With feed drives: {size} degrees of freedom, {frequency[0]:.2f} .. {frequency[-1]:.1f} Hz")
    console.text("\n".join(drives.limit_lines()))
    run.show_rest()


def run_three_rps_head(output: Path) -> None:
    """Show the 3-RPS head with rigid limbs, then (in a folder or file of its own) with elastic ones that slide through their
    frames: modes at tilted poses, responses, lobes, and frequencies and stiffness over tilt and azimuth."""
    import numpy as np

    azimuth, tilt = np.radians(np.linspace(0, 360, 25)), np.radians(np.linspace(0, 30, 7))
    _run_over_workspace(output, "three_rps_head.yaml", {"tilt": tilt, "azimuth": azimuth})
    elastic = output.with_name(f"{output.stem}-elastic{output.suffix}") if output.suffix else output / "elastic"
    _run_over_workspace(elastic, "three_rps_elastic_head.yaml", {"tilt": tilt[::2], "azimuth": azimuth[::2]})


def run_gantry(output: Path) -> None:
    """Show the gantry, whose axis Y drives both sides: modes, responses, lobes, frequencies and stiffness over Y and X."""
    import numpy as np

    _run_over_workspace(output, "gantry.yaml", {"Y": np.linspace(-1, 1, 11), "X": np.linspace(-0.8, 0.8, 9)})


def _run_over_workspace(output: Path, name: str, axes: Mapping[str, ArrayLike]) -> None:
    """Show a machine of the package and two maps of it."""
    from importlib import resources

    from toolpoint.app import console
    from toolpoint.cutting import ZeroOrder
    from toolpoint.io.yaml import machine_file
    from toolpoint.pages.machines.demo import workspace_page
    from toolpoint.studies.machines.check.machine_words import describe_motion
    from toolpoint.studies.machines.machine_report import study_machine
    from toolpoint.studies.machines.pose_map import pose_map
    from toolpoint.studies.machines.stiffness_map import stiffness_map

    with resources.as_file(resources.files("toolpoint.app") / "machines" / name) as path, frame(output, False, steps=7) as run:
        run.step("machine")
        machine = machine_file.read(path)
        result = study_machine(machine, step=run.step, method=ZeroOrder())
        run.step("frequencies over the workspace")
        frequencies = pose_map(machine, axes)
        run.step("stiffness over the workspace")
        stiffness = stiffness_map(machine, axes)
        run.step("page")
        text = path.read_text(encoding="utf-8")
        run.save(workspace_page(result, frequencies, stiffness, source=text, file_name=name, warnings=run.warnings))
    console.text(result.table())
    for line in (*describe_motion(machine), *frequencies.extremes(), *stiffness.extremes()):
        console.text(line)
    run.show_rest()


def run_video_mill(output: Path) -> None:
    """Film a small mill of known truth in two planes, find its soft interfaces, update its model to the videos."""
    from importlib import resources

    import numpy as np

    from toolpoint.app import console
    from toolpoint.io.yaml import machine_file
    from toolpoint.pages.video import virtual_update_page
    from toolpoint.studies.video.virtual_update import update_from_virtual_videos

    with resources.as_file(resources.files("toolpoint.app") / "machines") as folder, frame(output, False, steps=6) as run:
        result = update_from_virtual_videos(machine_file.read(folder / MILL), MILL_TRUTH, "spindle_nose",
                                            rng=np.random.default_rng(1), step=run.step)
        run.step("page")
        run.save(virtual_update_page(result, (folder / MILL).read_text(encoding="utf-8"), MILL, warnings=run.warnings))
    console.text(result.table())
    run.show_rest()


def run_milling_robot(output: Path, *, whole: bool = False) -> None:
    """Show the published milling robot; `whole`: whole sides of all variants, kept and resumed in a folder beside the page."""
    from importlib import resources

    from toolpoint.app import console
    from toolpoint.io.yaml import plan_file, robot_file
    from toolpoint.machine.parts.build import build
    from toolpoint.pages.robots.robot_demo import robot_demo_page
    from toolpoint.studies.robots.datasheet_study import study_datasheet
    from toolpoint.studies.screening.robot_demo import run_demo

    with resources.as_file(resources.files("toolpoint.app") / "machines") as folder, frame(output, False, steps=7) as run:
        run.step("datasheet")
        sheet = folder / "milling_robot_datasheet.yaml"
        description = robot_file.read_robot_machine(sheet)
        study = study_datasheet(robot_file.read(sheet), description)
        result = run_demo(study, build(description), plan_file.read(folder / "milling_robot_screening.yaml"), step=run.step,
                          whole=whole, folder=output.with_name(f"{output.stem}-kept") if whole else None)
        run.step("page")
        run.save(robot_demo_page(result, sheet.read_text(encoding="utf-8"), sheet.name, warnings=run.warnings))
    console.text(study.table())
    console.text(result.table())
    run.show_rest()


def run_finite_element_mill(output: Path) -> None:
    """Show an example mill by finite elements: modes, a virtual hammer test beside them, sensitivities, what helps the cut."""
    from toolpoint.app import console
    from toolpoint.pages.machines.finite_elements import finite_element_page
    from toolpoint.studies.finite_elements.example_mill import (
        FINE_MESH,
        example_mill,
        example_tested_mill,
        example_variants,
    )
    from toolpoint.studies.finite_elements.machine_study import study_finite_elements

    with frame(output, False, steps=13) as run:
        run.step("meshes")
        mill, variants = example_mill(), example_variants()
        result = study_finite_elements(mill, variants, tested=example_tested_mill(mill),
                                       finer=example_mill(mesh_size=FINE_MESH), step=run.step)
        run.step("page")
        run.save(finite_element_page(result, warnings=run.warnings))
    console.text(result.table())
    run.show_rest(result.notes)


DEMOS: dict[str, Demo] = {
    DEFAULT: Demo("three-axis machining centre: modes, tool-point responses, stability lobes", run_machining_centre),
    "video-mill": Demo("small mill filmed in two planes: modes from video, the soft joints, the updated model", run_video_mill),
    "three-rps-head": Demo("parallel head with three driven limbs: closed loops, parasitic motion, maps over tilt and azimuth",
                           run_three_rps_head),
    "milling-robot": Demo("six-axis robot that mills: datasheet, map, best region, stable depths, accuracy, 23 design changes",
                          run_milling_robot, partial(run_milling_robot, whole=True)),
    "finite-element-mill": Demo("mill of castings by finite elements: hammer test, sensitivities, layers, dampers",
                                run_finite_element_mill),
    "gantry": Demo("gantry whose one axis drives both sides of a closed loop: maps over Y and X", run_gantry),
}
