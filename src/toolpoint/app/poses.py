"""Axis positions as a person writes them, X=0.1,A=30deg and X=-200mm:200mm:5, checked against the axes of a machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.io.quantities import units
from toolpoint.io.yaml import machine_file
from toolpoint.machine import Machine

Pose = Mapping[str, float]


class WrittenPosition(float):
    """A position in m or rad that remembers as what it was written: ``length``, ``angle``, or nothing for a bare number."""

    written: str = ""


def position(text: str) -> WrittenPosition:
    """Return the position of a text like ``0.1``, ``200mm`` or ``30 deg``; UnitError where it is none."""
    value, kind = units.length_or_angle(text)
    written = WrittenPosition(value)
    written.written = "" if kind is None else kind.name
    return written


def pose_of(text: str) -> dict[str, float]:
    """Return the pose of a text like ``X=0.1,A=30deg``; ToolpointError where it is none."""
    result: dict[str, float] = {}
    for part in text.split(","):
        name, equals, number = (text_part.strip() for text_part in part.partition("="))
        if not equals or not name:
            raise ToolpointError(f"{part!r}: write AXIS=VALUE with a decimal point, for example X=0.1,Y=200mm,A=30deg")
        if name in result:
            raise ToolpointError(f"{part!r}: axis {name} is there twice")
        try:
            result[name] = position(number)
        except units.UnitError as error:
            raise ToolpointError(f"{part.strip()!r}: {error}") from None
    return result


def grid(machine: Machine, texts: Sequence[str], option: str) -> dict[str, FloatArray]:
    """Return axis name to positions of texts like ``X=-200mm:200mm:5`` (first, last, number), checked against a machine."""
    result: dict[str, FloatArray] = {}
    for text in texts:
        name, first, last, number = line_of(text, option)
        if name in result:
            raise ToolpointError(f"{option}: {text!r}; axis {name} is there twice")
        for end in (first, last):  # a position out of reach is refused before any work
            check(machine, {name: end})
        result[name] = np.linspace(float(first), float(last), number)
    return result


def line_of(text: str, option: str) -> tuple[str, WrittenPosition, WrittenPosition, int]:
    """Return name, first, last and number of a text like ``X=-200mm:200mm:5``."""
    name, _, rest = text.partition("=")
    parts = rest.split(":")
    form = "write AXIS=FIRST:LAST:NUMBER, for example X=-0.3:0.3:7 or X=-300mm:300mm:7"
    if len(parts) != 3 or not name.strip() or not parts[2].strip().isdigit() or int(parts[2]) < 1:
        raise ToolpointError(f"{option}: {text!r}; {form}")
    try:
        first, last = position(parts[0]), position(parts[1])
    except units.UnitError as error:
        raise ToolpointError(f"{option}: {text!r}; {error}; {form}") from None
    number = int(parts[2])
    if number > 1 and not last > first:
        raise ToolpointError(f"{option}: {text!r}; the last position must be above the first, or the number 1")
    if first and last and bool(first.written) != bool(last.written):
        raise ToolpointError(f"{option}: {text!r}; one end has a unit and the other none; write both, or none (m, rad)")
    return name.strip(), first, last, number


def machine_at(path: str | Path, *poses: Pose | None) -> Machine:
    """Read a machine file and check poses against its axes: names, lengths or angles, limits of travel."""
    machine = machine_file.read(path)
    for pose in poses:
        check(machine, pose or {})
    return machine


def check(machine: Machine, pose: Pose) -> None:
    """Check a pose against the axes of a machine; raises ToolpointError."""
    rotary = {axis.name: axis.is_rotary for axis in machine.chain.axes}
    for name, value in pose.items():
        written = getattr(value, "written", "")
        if written and name in rotary and (written == "angle") != rotary[name]:
            raise ToolpointError(f"pose {name}: given as {'an angle' if written == 'angle' else 'a length'}; the axis is "
                                 + ("rotary (rad, deg)" if rotary[name] else "linear (m, mm, um)"))
    machine.chain.batch(pose)  # names and limits of travel
