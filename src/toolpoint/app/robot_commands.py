"""Commands about robots and other machines that put a tool to places: robot, reach, region."""

from __future__ import annotations

from pathlib import Path

import click

from toolpoint.app.frame import frame
from toolpoint.app.options import JSON, OUTPUT, PATH


@click.command()
@click.argument("datasheet", type=PATH)
@click.option("--machine", "written", type=PATH, help="Write the machine here.")
@OUTPUT
@JSON
def robot(datasheet: Path, written: Path | None, output: Path, as_json: bool) -> None:
    """A robot from its datasheet (YAML): gear ratios, reducers, density, forces on the base, and the machine they make."""
    from toolpoint.io.yaml import machine_file, robot_file
    from toolpoint.pages.robot import robot_page
    from toolpoint.studies.robots.datasheet_study import study_datasheet

    with frame(None if as_json else output, as_json, steps=2) as run:
        run.step("datasheet")
        sheet, description = robot_file.read(datasheet), robot_file.read_robot_machine(datasheet)
        result = study_datasheet(sheet, description)
        if written is not None:
            machine_file.write(description, written)
        run.step("page")
        if not as_json:
            run.save(robot_page(result, datasheet.read_text(encoding="utf-8-sig"), datasheet.name))
    run.show(result, written={"Machine file": written})
