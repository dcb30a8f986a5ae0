"""Types of options: values from the text that a person types, and files that exist or not yet."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import click

from toolpoint._check import FloatArray, ToolpointError, suggestion
from toolpoint.app import console
from toolpoint.app.declare import REPLACE_KEY, Reading
from toolpoint.io.output_places import check_file_place, check_folder_place
from toolpoint.io.quantities import written
from toolpoint.io.quantities.written import AxisPoints, Vector


class _Source(click.Path):
    """A file to read: looked for as soon as the options are known, before anything else is loaded. The folder of a project
    stands for its machine file."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        path = Path(value)
        if not path.exists():
            folder = path.parent
            siblings = (each.name for each in folder.iterdir()) if folder.is_dir() else ()
            hint = suggestion(path.name, siblings) if path.name else ""
            raise ToolpointError(f"{path}: cannot be read (no such file); {hint or 'check the name and the folder'}")
        return _machine_file(path) if (path / "project.yaml").is_file() else path


def _machine_file(folder: Path) -> Path:
    """Return the machine file of a project, with a warning where a run would make another one."""
    from toolpoint.project import Project  # only where a project is given

    project = Project.open(folder)
    place = project.machine_file
    if project.machine_doubt:
        console.warning(f"{project.machine_doubt}; run it first (toolpoint run {folder})")
    return place


class _NewFile(click.Path):
    """A file to write: one that is there is refused before anything is computed, unless --replace is given, and so is one in a
    folder that is not there."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        path = Path(value)
        if os.path.exists(path) and not (ctx is not None and ctx.meta.get(REPLACE_KEY)):
            can_replace = ctx is not None and any(option.name == "replace" for option in ctx.command.params)
            raise ToolpointError(f"{path}: exists already; nothing was written; choose another name"
                                 + (", or add --replace" if can_replace else ""))
        check_file_place(path)
        return path


class _KeptFolder(click.Path):
    """A folder in which a study keeps its parts: made where it is not there, refused before anything is computed where it
    cannot be."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        path = Path(value)
        check_folder_place(path)
        return path


NEW_FILE = _NewFile(path_type=Path)
SourceFile = Annotated[Path, _Source(path_type=Path)]  # to be read
NewFile = Annotated[Path, NEW_FILE]  # to be written, and not there yet; --replace allows it
KeptFolder = Annotated[Path, _KeptFolder(path_type=Path)]  # of the finished parts of a study
AnyPath = Annotated[Path, click.Path(path_type=Path)]  # to be written
NUMBERS = Reading(written.read_numbers, "numbers with a decimal point, separated by commas, for example 80,100,80,100")
Numbers = Annotated[tuple[float, ...], NUMBERS]
Span = Annotated[tuple[float, float], Reading(written.read_band, "LOW:HIGH in Hz, for example 200:5000")]
Lines = Annotated[FloatArray, Reading(written.read_lines, "LOW:HIGH:NUMBER in Hz, for example 5:400:1600")]
SpindleSpeeds = Annotated[FloatArray, Reading(written.read_speeds, "FIRST:LAST:NUMBER in rev/min, for example 3000:20000:200")]
SpeedsFromRest = Annotated[FloatArray, Reading(partial(written.read_speeds, from_rest=True),
                                               "FIRST:LAST:NUMBER in rev/min, for example 0:24000:25")]
Angles = Annotated[FloatArray, Reading(written.read_angles,
                                       "angles in degrees, 0,45,90 or FIRST:LAST:NUMBER, for example 0:135:4")]
AxisPositions = Annotated[dict[str, float], Reading(written.read_pose)]
AxisRange = Annotated[AxisPoints, Reading(written.read_axis_points, "AXIS=FIRST:LAST:NUMBER, for example X=-0.3:0.3:7 or "
                                                                    "X=-300mm:300mm:7")]
LengthRange = Annotated[AxisPoints, Reading(written.read_length_points,
                                            "NAME=FIRST:LAST:NUMBER, for example x=300mm:700mm:9")]
Length = Annotated[float, Reading(written.read_length)]
Angle = Annotated[float, Reading(written.read_angle)]
Place = Annotated[tuple[float, float, float], Reading(written.read_lengths)]
Direction = Annotated[Vector, Reading(written.read_direction, "x, y, z, an angle from x towards y like 30deg, or a vector like "
                                                              "1,0,0.5")]
TwoPoints = Annotated[tuple[str, str], Reading(written.read_two_points, "two points of the test, as tool,table")]
Plane = Annotated[tuple[Vector, Vector], Reading(written.read_plane, "two directions, as y,z")]
