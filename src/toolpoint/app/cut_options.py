"""Options that say what is cut, made from what the description of a cut states; their values turned into SI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import click

from toolpoint.cutting.description import (
    PARAMETERS,
    PLACES,
    VARIATION,
    CutParameter,
    SpeedVariationDescription,
)


def numbers(ctx: click.Context, parameter: click.Parameter, value: str | None) -> tuple[float, ...] | None:
    """Return the numbers of the text 80,100,80,100."""
    if value is None:
        return None
    try:
        return tuple(float(part) for part in value.split(","))
    except ValueError:
        raise click.BadParameter(f"{value!r}: write numbers with a decimal point, separated by commas, for example "
                                 "80,100,80,100") from None


def _variation(ctx: click.Context, parameter: click.Parameter, value: str | None) -> tuple[float, int, float] | None:
    if value is None:
        return None
    parts = value.split(",")
    try:
        if not 1 <= len(parts) <= 3:
            raise ValueError
        phase = float(VARIATION["phase"].in_si(float(parts[2]))) if len(parts) > 2 else 0.0
        return float(parts[0]), int(parts[1]) if len(parts) > 1 else 4, phase
    except ValueError:
        raise click.BadParameter(f"{value!r}: write SHARE,REVOLUTIONS or SHARE,REVOLUTIONS,PHASE (degrees), for example 0.1,4"
                                 ) from None


def tool_options(command: Any) -> Any:
    """Add the options of the tool and the arc of cut."""
    return _with_options(command, [key for key, place in PLACES.items() if place[0] in ("tool", "engagement")])


def coefficient_options(command: Any) -> Any:
    """Add the options of the cutting coefficients and what else acts on the edge."""
    return _with_options(command, [key for key, place in PLACES.items() if place[0] not in ("tool", "engagement")])


def _with_options(command: Any, keys: Sequence[str]) -> Any:
    """Add the options of these keys of a cut, as far as the keys have one, in their order."""
    for key in reversed(keys):
        if PARAMETERS[key].option:
            command = _option(PARAMETERS[key])(command)
    return command


def _option(parameter: CutParameter) -> Any:
    """Return the option of a parameter; `exit` takes another name in Python, where it is a builtin."""
    more: dict[str, Any] = {"help": parameter.help, "metavar": parameter.metavar}
    if parameter.kind == "variation":
        more["callback"] = _variation
    elif parameter.several != 1:
        more["callback"] = numbers
    elif parameter.kind == "choice":
        more["type"] = click.Choice(list(parameter.choices))
    elif parameter.kind != "text":
        more["type"] = int if parameter.kind == "count" else float
    return click.option(f"--{parameter.option}", _argument(parameter), **more)


def _argument(parameter: CutParameter) -> str:
    return "exit_" if parameter.option == "exit" else parameter.option.replace("-", "_")


_KEYS = {_argument(parameter): key for key, parameter in PARAMETERS.items() if parameter.option}


def in_si(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a cut under its flat keys, SI, from the options that were given."""
    values: dict[str, Any] = {}
    for option, value in given.items():
        if value is not None:
            key = _KEYS[option]
            values[key] = SpeedVariationDescription(*value) if key == "speed_variation" else PARAMETERS[key].in_si(value)
    return values
