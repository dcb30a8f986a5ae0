"""Checked request about the machine of a project: numbers changed on the page, the pose, what is looked at."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from toolpoint._check import ToolpointError, fail
from toolpoint.io.quantities import units

MAX_CHANGED_NUMBERS = 200  # entries of each mapping of a request
MAX_LOOKED_MODES = 12  # modes that the page lists
# Direction of a joint to the kind of unit of its stiffness.
STIFFNESS_KINDS = {"x": units.STIFFNESS, "y": units.STIFFNESS, "z": units.STIFFNESS, "rx": units.TURNING_STIFFNESS,
                   "ry": units.TURNING_STIFFNESS, "rz": units.TURNING_STIFFNESS}


@dataclass(frozen=True)
class MachineRequest:
    """State of the machine view.

    values : path of a number in the machine file to its changed value, SI; pose : axis to m or rad; mode : index of the drawn
    mode, from 0; speed : rev/min, None where not asked; cut : name of a cut of the project, empty where none is chosen;
    cut_values : flat key of the cut to its changed value, SI; count : number of charted speeds; is_moving : whether a slider is
    on its way, so that the limit may be that of the quick method, which says so; stick_out : m, of the project's coupled tool,
    None for the machine or the tip as they are.
    """

    values: Mapping[str, float] = field(default_factory=dict)
    pose: Mapping[str, float] = field(default_factory=dict)
    mode: int = 0
    speed: float | None = None
    cut: str = ""
    cut_values: Mapping[str, float] = field(default_factory=dict)
    count: int = 100
    is_moving: bool = False
    stick_out: float | None = None

    @classmethod
    def of(cls, data: Any) -> MachineRequest:
        """Return the request of plain data as JSON gives it; raises ToolpointError for other types and numbers not finite.

        A mode beyond the listed ones is taken as the last.
        """
        if not isinstance(data, dict):
            fail("request", type(data).__name__, "must be a mapping")
        speed, stick_out = data.get("speed"), data.get("stick_out")
        return cls(_numbers("values", data.get("values")), _numbers("pose", data.get("pose")),
                   min(_count("mode", data.get("mode", 0), 0), MAX_LOOKED_MODES - 1),
                   None if speed is None else _number("speed", speed), str(data.get("cut") or ""),
                   _numbers("cut_values", data.get("cut_values")), _count("count", data.get("count", 100), 1),
                   data.get("is_moving") is True, None if stick_out is None else _number("stick_out", stick_out))


def _numbers(name: str, entries: Any) -> dict[str, float]:
    """Return a checked mapping of names to finite numbers, empty for None."""
    if entries is None:
        return {}
    if not isinstance(entries, dict) or len(entries) > MAX_CHANGED_NUMBERS:
        fail(name, type(entries).__name__, f"must map at most {MAX_CHANGED_NUMBERS} names to numbers")
    return {str(key): _number(f"{name}.{key}", value) for key, value in entries.items()}


def _number(name: str, value: Any) -> float:
    """Return a checked finite number; booleans, which Python counts as numbers, are refused."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        fail(name, repr(value), "must be a finite number")
    return float(value)


def _count(name: str, value: Any, minimum: int) -> int:
    """Return a checked whole number that is not below a minimum; what is charted of many is bounded where it is charted."""
    number = int(_number(name, value))
    if number < minimum:
        fail(name, str(number), f"must be at least {minimum}")
    return number


def read_typed_number(text: str, path: str) -> float:
    """Return a number that a person typed with its unit, SI; a bare number is in SI.

    path : of a stiffness (``joints.guide.stiffness.rx``), whose direction gives the unit, or an axis (``axis X``) with the unit
    of a length or an angle. Raises ToolpointError for other numbers, and for units that do not fit.
    """
    way = path.rsplit(".", 1)[-1]
    try:
        if path.startswith("axis "):
            return units.length_or_angle(text.strip())[0]
        kind = STIFFNESS_KINDS.get(way)
        if kind is None:
            raise ToolpointError(f"{path}: only stiffness is set here; change other numbers in the machine file")
        return units.quantity(_spelled(text), kind)
    except units.UnitError as error:
        raise ToolpointError(str(error)) from None


def _spelled(text: str) -> str:
    """Return a text with µ and · written as ``u`` and ``*``, as units of files are."""
    return text.strip().replace("µ", "u").replace("μ", "u").replace("·", "*")
