"""Options of a cut, made from what its description says of every value."""

from __future__ import annotations

from typing import Annotated, Any

import click

from toolpoint.app.declare import Reading, WordChoice
from toolpoint.app.values import NUMBERS
from toolpoint.cutting.description import (
    PARAMETERS,
    PLACES,
    TOTAL_ENERGY,
    VARIATION,
    CutParameter,
    SpeedVariationDescription,
    TotalEnergyDescription,
    check_values,
)

_NESTED = {"speed_variation": SpeedVariationDescription, "total_energy": TotalEnergyDescription}


class CutOptions:
    """Options of a cut, made from what its description says of every value; the command receives those that were given, in SI,
    under the flat keys of a machine file."""

    def __init__(self, *groups: str) -> None:
        self.keys = {_argument(PARAMETERS[key]): key for key, place in PLACES.items()
                     if PARAMETERS[key].option and (not groups or place[0] in groups)}

    def parameters(self) -> list[click.Parameter]:
        """Return the options in the order of the description."""
        return [_option_of(PARAMETERS[key]) for key in self.keys.values()]

    def gather(self, values: dict[str, Any]) -> dict[str, Any]:
        """Return the given values in SI; none beyond its limits."""
        cut: dict[str, Any] = {}
        for option, key in self.keys.items():
            if (value := values.pop(option)) is not None:
                cut[key] = _NESTED[key](*value) if key in _NESTED else PARAMETERS[key].in_si(value)
        check_values(cut, {key: f"--{PARAMETERS[key].option}" for key in cut})
        if "material" in cut:  # an unknown one would else be named after minutes of reading and identifying
            from toolpoint.cutting.build import find_material

            find_material(cut["material"])
        return cut


def _option_of(parameter: CutParameter) -> click.Option:
    kinds: dict[str, Any] = {
        "count": int, "text": str, "choice": WordChoice(list(parameter.choices)),
        "variation": Reading(_variation, "SHARE,REVOLUTIONS or SHARE,REVOLUTIONS,PHASE (degrees), for example 0.1,4"),
        "total energy": Reading(_total_energy, "ENERGY,EXPONENT,NORMAL or ENERGY,EXPONENT,NORMAL,AXIAL (N/mm^2 at a chip of "
                                               "1 mm, then ratios), for example 1200,0.2,0.3")}
    kind = kinds.get(parameter.kind, float if parameter.several == 1 else NUMBERS)
    return click.Option([f"--{parameter.option}", _argument(parameter)], type=kind, help=parameter.help,
                        metavar=parameter.metavar)


def _argument(parameter: CutParameter) -> str:
    return "cut_" + parameter.option.replace("-", "_")


def _variation(text: str) -> tuple[float, int, float]:
    parts = text.split(",")
    share, revolutions, phase = (*parts, *("", "4", "0")[len(parts):])
    return float(share), int(revolutions), float(VARIATION["phase"].in_si(float(phase)))


def _total_energy(text: str) -> tuple[float, ...]:
    parts = text.split(",")
    numbers = [float(part) for part in (*parts, "0")[:4]]
    for key, number in zip(TOTAL_ENERGY, numbers, strict=True):
        TOTAL_ENERGY[key].check(f"--total-energy {key.replace('_', ' ')}", TOTAL_ENERGY[key].in_si(number))
    return tuple(TOTAL_ENERGY[key].in_si(number) for key, number in zip(TOTAL_ENERGY, numbers, strict=True))


CutValues = Annotated[dict[str, Any], CutOptions()]
ToolValues = Annotated[dict[str, Any], CutOptions("tool", "engagement")]
