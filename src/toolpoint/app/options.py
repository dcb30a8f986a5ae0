"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click


def pose(ctx: click.Context, parameter: click.Parameter, value: str | None) -> dict[str, float] | None:
    """Return axis positions of the text X=0.1,Y=0.2."""
    if not value:
        return None
    result: dict[str, float] = {}
    for part in value.split(","):
        name, equals, number = part.partition("=")
        try:
            if not equals or not name.strip():
                raise ValueError
            result[name.strip()] = float(number)
        except ValueError:
            raise click.BadParameter(f"{part!r}: write AXIS=VALUE with a decimal point, m or rad, for example X=0.1,Y=0.2"
                                     ) from None
    return result


def poses(ctx: click.Context, parameter: click.Parameter, value: Sequence[str]) -> tuple[dict[str, float], ...]:
    """Return axis positions of several texts X=0.1,Y=0.2."""
    return tuple(one for text in value if (one := pose(ctx, parameter, text)) is not None)


def band(ctx: click.Context, parameter: click.Parameter, value: str | None) -> tuple[float, float] | None:
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


OUTPUT = click.option("-o", "--output", default="toolpoint-report", show_default=True, type=click.Path(path_type=Path),
                       help="Folder (or .html file) of the page.")
POSE = click.option("--pose", callback=pose, metavar="X=0.1,Y=0.2", help="Axis positions, m or rad.")
POSES = click.option("--pose", "poses", callback=poses, multiple=True, metavar="X=0.1,Y=0.2",
                     help="Axis positions of a measurement, m or rad; several times for several measurements, in their order.")
JSON = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
