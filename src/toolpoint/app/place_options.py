"""Options of a place: its coordinates, where the tool points, the turn about it."""

from __future__ import annotations

import click

from toolpoint._check import ToolpointError


def numbers_of(text: str, option: str, count: int, angle: bool = False) -> list[float]:
    """Numbers of a text like ``600mm,0,300mm``: m, or rad, where no unit is written."""
    from toolpoint.io.quantities import units

    parts = text.split(",")
    if len(parts) != count:
        raise ToolpointError(f"{option}: {text!r}; must be {count} numbers with commas between them")
    try:
        return [units.quantity(part.strip(), units.ANGLE if angle else units.LENGTH) if not _bare(part) else float(part)
                for part in parts]
    except units.UnitError as error:
        raise ToolpointError(f"{option}: {text!r}; {error}") from None


def _bare(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def direction_of(text: str | None, option: str) -> list[float] | None:
    """Return a direction of a text like ``-x`` or ``0,0.5,1``."""
    if text is None:
        return None
    word = text.strip().lower()
    if word.lstrip("+-") in ("x", "y", "z"):
        return [(-1.0 if word[0] == "-" else 1.0) * (axis == word[-1]) for axis in "xyz"]
    return numbers_of(text, option, 3)


DIRECTION = click.option("--direction", metavar="-x",
                         help="Where the tool's axis points, away from the work: ±x, ±y, ±z or three "
                                                          "numbers; as at the reference pose where left out.")
TURN = click.option("--turn", default="0deg", show_default=True, help="Turn about the tool's axis.")
