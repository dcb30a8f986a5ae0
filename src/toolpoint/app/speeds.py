"""The option of spindle speeds that charts share."""

from __future__ import annotations

from typing import Any

import click


def speeds_of(ctx: click.Context, parameter: click.Parameter, value: str | None) -> Any:
    """Return the speeds (rev/min) of the text FIRST:LAST:NUMBER."""
    if not value:
        return None
    import numpy as np

    try:
        first, last, number = value.split(":")
        low, high, count = float(first), float(last), int(number)
    except ValueError:
        raise click.BadParameter(f"{value!r}: write FIRST:LAST:NUMBER in rev/min, for example 3000:20000:200") from None
    if not (0 < low < high < 1e6 and count >= 2) and not (0 < low <= high < 1e6 and count == 1):
        raise click.BadParameter(f"{value!r}: the first speed must be above zero, the last above the first, and the number at "
                                 "least 2 (or one speed: 9000:9000:1)")
    return np.linspace(low, high, count)


SPEEDS = click.option("--speeds", callback=speeds_of, metavar="3000:20000:200", help="Spindle speeds, rev/min.")
