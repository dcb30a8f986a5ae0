"""Electrical quantities in files: volt, ampere, ohm, henry and their products, each field with its own short table."""

from __future__ import annotations

import re
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema
from pydantic_core import PydanticCustomError

_NUMBER = re.compile(r"\s*([-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*$")
_PREFIX = {"": 1.0, "u": 1e-6, "µ": 1e-6, "m": 1e-3, "k": 1e3}


def electrical_type(name: str, *units: str, **limits: Any) -> Any:
    """Return the type of a field that holds a quantity in one of `units` (the first is its SI unit), within limits.

    Units are symbols such as ``V``, ``ohm``, ``V/A`` or ``V*s``; a single symbol takes the prefixes u, m and k.
    """
    table = {prefix + unit: factor for unit in units for prefix, factor in _PREFIX.items()
             if not prefix or unit.isalpha() or unit == "Ω"}

    def read(value: object) -> float:
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            return float(value)
        match = _NUMBER.match(value) if isinstance(value, str) else None
        if match is None:
            raise _fault(f"{value!r} is not a {name}; write a number with a unit, for example 1.5 {units[0]}")
        if match[2] and match[2] not in table:
            comma = "; is there a decimal comma? write a decimal point" if match[2].startswith(",") else ""
            raise _fault(f"{value!r}: unit {match[2]!r} is not one of {name}; expected something like {units[0]}{comma}")
        return float(match[1]) * table.get(match[2], 1.0)

    described = {"anyOf": [{"type": "number"}, {"type": "string"}], "description": f"{name}; a bare number is in {units[0]}"}
    return Annotated[float, BeforeValidator(read), Field(allow_inf_nan=False, **limits),
                     WithJsonSchema(described)]


def _fault(message: str) -> PydanticCustomError:
    return PydanticCustomError("quantity", "{message}", {"message": message})


VOLTAGE = ("voltage", "V")
CURRENT = ("current", "A")
RESISTANCE = ("resistance", "ohm", "Ω")
INDUCTANCE = ("inductance", "H")
FLUX = ("flux linkage", "V*s", "Vs", "Wb")
CURRENT_GAIN = ("current gain", "V/A")
CURRENT_INTEGRAL = ("integral current gain", "V/(A*s)", "V/A/s", "V/As")
TORQUE_CONSTANT = ("torque constant", "N*m/A", "Nm/A")
