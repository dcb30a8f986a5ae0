"""Request about the machine of a project: its numbers as changed on the page, the pose, what is looked at; checked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from toolpoint._check import ToolpointError, fail
from toolpoint.io.quantities import units

MAX_CHANGED_NUMBERS = 200  # of one request
MAX_LOOKED_MODES = 12  # modes that the page lists
STIFFNESS_KINDS = {"x": units.STIFFNESS, "y": units.STIFFNESS, "z": units.STIFFNESS, "rx": units.TURNING_STIFFNESS,
                   "ry": units.TURNING_STIFFNESS, "rz": units.TURNING_STIFFNESS}


@dataclass(frozen=True)
class MachineRequest:
    """State of the machine view.

    values : path to number, SI; pose : axis to m or rad; mode : place of the drawn mode; speed : rev/min; cut : name of a
    cut of the project; cut_values : flat keys of the cut changed by hand, SI; count : of charted speeds.
    """

    values: Mapping[str, float] = field(default_factory=dict)
    pose: Mapping[str, float] = field(default_factory=dict)
    mode: int = 0
    speed: float | None = None
    cut: str = ""
    cut_values: Mapping[str, float] = field(default_factory=dict)
    count: int = 100

    @classmethod
    def of(cls, data: Any) -> MachineRequest:
        """Return the request of plain data; raises ToolpointError for what is none."""
        if not isinstance(data, dict):
            fail("request", type(data).__name__, "must be a mapping")
        speed = data.get("speed")
        return cls(_numbers("values", data.get("values")), _numbers("pose", data.get("pose")),
                   min(int(_number("mode", data.get("mode", 0))), MAX_LOOKED_MODES - 1),
                   None if speed is None else _number("speed", speed), str(data.get("cut") or ""),
                   _numbers("cut_values", data.get("cut_values")), int(_number("count", data.get("count", 100))))


def _numbers(name: str, entries: Any) -> dict[str, float]:
    if entries is None:
        return {}
    if not isinstance(entries, dict) or len(entries) > MAX_CHANGED_NUMBERS:
        fail(name, type(entries).__name__, f"must map at most {MAX_CHANGED_NUMBERS} names to numbers")
    return {str(key): _number(f"{name}.{key}", value) for key, value in entries.items()}


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        fail(name, repr(value), "must be a finite number")
    return float(value)


def read_typed_number(text: str, path: str) -> float:
    """Return a number that a person typed with its unit, SI; a bare number is in SI.

    path : of the machine's number (``joints.guide.stiffness.rx``) or an axis (``axis X``), which says what it is of.
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
    """Return a text with the signs of a screen as the units of files write them."""
    return text.strip().replace("µ", "u").replace("μ", "u").replace("·", "*")
