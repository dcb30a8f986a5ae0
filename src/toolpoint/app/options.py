"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from toolpoint._check import ToolpointError, suggestion


def pose(ctx: click.Context, parameter: click.Parameter, value: str | None) -> dict[str, float] | None:
    """Return axis positions of the text X=0.1,Y=200mm,A=30deg."""
    if not value:
        return None
    from toolpoint.app.poses import pose_of

    try:
        return pose_of(value)
    except ToolpointError as error:
        raise click.BadParameter(str(error)) from None


def poses(ctx: click.Context, parameter: click.Parameter, value: Sequence[str]) -> tuple[dict[str, float], ...]:
    """Return axis positions of several texts X=0.1,Y=0.2."""
    return tuple(at for text in value if (at := pose(ctx, parameter, text)) is not None)


def band_of(ctx: click.Context, parameter: click.Parameter, value: str | None) -> tuple[float, float] | None:
    """Return both ends of the text LOW:HIGH."""
    if not value:
        return None
    try:
        low, high = (float(part) for part in value.split(":"))
    except ValueError:
        raise click.BadParameter(f"{value!r}: write LOW:HIGH in Hz, for example 200:5000") from None
    if not 0 <= low < high:
        raise click.BadParameter(f"{value!r}: the lower end must be below the upper")
    return low, high


def lines_of(ctx: click.Context, parameter: click.Parameter, value: str | None) -> Any:
    """Return the lines (Hz) of the text LOW:HIGH:NUMBER."""
    if not value:
        return None
    import numpy as np

    try:
        low, high, number = value.split(":")
        ends, count = (float(low), float(high)), int(number)
    except ValueError:
        raise click.BadParameter(f"{value!r}: write LOW:HIGH:NUMBER in Hz, for example 5:400:1600") from None
    if not 0 <= ends[0] < ends[1] < 1e7 or not 2 <= count <= 100_000:
        raise click.BadParameter(f"{value!r}: must be 0 <= LOW < HIGH and 2 to 100000 lines")
    return np.linspace(*ends, count)


class _Source(click.Path):
    """A file to read: looked for as soon as the options are known, before anything else is loaded."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        path = Path(value)
        if not path.exists():
            folder = path.parent
            siblings = (each.name for each in folder.iterdir()) if folder.is_dir() else ()
            hint = suggestion(path.name, siblings) if path.name else ""
            remedy = hint or "check the name and the folder"
            raise ToolpointError(f"{path}: cannot be read (no such file); {remedy}")
        return path


class _NewFile(click.Path):
    """A file to write: one that is there is refused before anything is computed, unless --replace is given."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        path = Path(value)
        if path.exists() and not (ctx is not None and ctx.meta.get(_REPLACE)):
            can_replace = ctx is not None and any(option.name == "replace" for option in ctx.command.params)
            raise ToolpointError(f"{path}: exists already; nothing was written; choose another name"
                                 + (", or add --replace" if can_replace else ""))
        return path


_REPLACE = "toolpoint.replace"
PATH = click.Path(path_type=Path)  # to be written
NEW_FILE = _NewFile(path_type=Path)  # to be written, and not there yet; `REPLACE` allows it
FILE = _Source(path_type=Path)  # to be read
REPLACE = click.option("--replace", is_flag=True, is_eager=True, expose_value=False, help="Write over existing files.",
                       callback=lambda ctx, option, value: ctx.meta.update({_REPLACE: value}))
OUTPUT = click.option("-o", "--output", default="toolpoint-report", show_default=True, type=PATH,
                       help="Folder (or .html file) of the page.")
POSE = click.option("--pose", callback=pose, metavar="X=0.1,Y=200mm", help="Axis positions; m or rad where no unit is written.")
POSES = click.option("--pose", "poses", callback=poses, multiple=True, metavar="X=0.1,Y=200mm",
                     help="Axis positions of a measurement (m or rad without a unit); several times, in the order of files.")
JSON = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
BAND = click.option("--band", callback=band_of, metavar="LOW:HIGH", help="Part of the measured lines to use, Hz.")
QUANTITY = click.option("--quantity", type=click.Choice(["receptance", "mobility", "accelerance"]),
                        help="What FRF files hold that do not say; text: receptance, MATLAB: accelerance where left out.")
GEOMETRY = "Universal file, CSV (point,x,y,z in m), or machine YAML."
