"""Time histories in text: a header of channel names, columns of numbers, the first one time; read and write."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.io.decoding import read_text
from toolpoint.io.faults import Fault, FileFaults
from toolpoint.io.quantities import units
from toolpoint.io.quantities.sensitivities import GRAVITY_UNIT
from toolpoint.io.text.columns import EXPECTED_RECORDS, TIME_STEP_TOLERANCE, read_columns, refuse_uneven_time
from toolpoint.vibration import Dof, Record

_FORCE = re.compile(r"f(?:orce)?[ _-]?([xyz])", re.IGNORECASE)
_LABELLED_COLUMN = re.compile(r"(\w+) (\S+):([+-][xyzXYZ])")  # quantity, point and direction
TIMES = ("t", "time")
KINDS = {"force": units.FORCE, "acceleration": units.ACCELERATION, "velocity": units.FEED, "displacement": units.LENGTH,
         "feed": units.LENGTH, "time": units.TIME}


def channel_of(name: str) -> tuple[Dof, str]:
    """Return label and quantity of a column: Fx, Fy, Fz are forces on the tool, ``acceleration tip:+x`` says both, other names
    stand for themselves."""
    match = _FORCE.fullmatch(name.strip())
    if match:
        return Dof("tool", "+" + match[1].lower()), "force"
    match = _LABELLED_COLUMN.fullmatch(name.strip())
    if match and match[1].lower() in KINDS:
        return Dof.parse(f"{match[2]}:{match[3].lower()}"), match[1].lower()
    return Dof(name.strip(), "+x"), name.strip().lower()


def read(path: str | Path) -> Record:
    """Return the time histories of a text file, SI.

    The last line before the numbers names the columns, with a unit in brackets where it is not the SI one: ``time [ms]``,
    ``Fx [kN]``, ``feed [mm]``, or in a line of their own below; separators and decimal commas as in `columns.read_columns`.

    Raises
    ------
    FileFaults
        With every faulty line: no number, too few columns, not finite; no names, no time, a unit of another kind.
    """
    path = Path(path)
    table = read_columns(path)
    if not table.line:
        _refuse(path, 1, "", f"0 names for {table.samples.shape[1]} columns; the line before the numbers must name them, "
                "for example time,Fx,Fy,Fz")
    if table.sample_rate is None:
        _refuse(path, table.line, "", f"the first column is {table.names[0]!r}; must be 'time' in s, or with its unit, for "
                "example 'time [ms]'")
    labels = [channel_of(name) for name in table.names]
    scale = [_factor(path, table.line, name, unit) for name, unit in zip(table.names, table.units, strict=True)]
    return Record(table.samples * np.array(scale), table.sample_rate, tuple(dof for dof, _ in labels),
                  tuple(kind for _, kind in labels), start=table.start, name=path.name)


def of_columns(path: Path, names: Sequence[str], time: FloatArray, *, values: FloatArray) -> Record:
    """Return columns (SI) over time (s) as a Record after checking that the time runs evenly."""
    step = np.diff(time)
    if step.size == 0 or not step.mean() > 0 or np.abs(step - step.mean()).max() > TIME_STEP_TOLERANCE * step.mean() + 1e-12:
        refuse_uneven_time(path, time)
    labels = [channel_of(name) for name in names]
    return Record(values, 1 / float(step.mean()), tuple(dof for dof, _ in labels), tuple(kind for _, kind in labels),
                  start=float(time[0]), name=path.name)


def write(record: Record, path: str | Path) -> None:
    """Write a record as columns of SI numbers that read back to the same values."""
    names = [f"F{dof.direction[1:]}" if kind == "force" else str(dof.point)
             for dof, kind in zip(record.channels, record.quantities, strict=True)]
    lines = [",".join(["time", *names])]
    lines += [",".join(map(repr, row)) for row in np.column_stack([record.time, record.samples]).tolist()]
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


def _refuse(path: Path, line: int, column: str, message: str) -> NoReturn:
    raise FileFaults(str(path), read_text(path, EXPECTED_RECORDS), [Fault(line, 1, column, message)])


def _factor(path: Path, line: int, name: str, unit: str) -> float:
    """Return what one unit of a column is in SI."""
    quantity = channel_of(name)[1]
    if not unit:
        return 1.0
    if unit.lower() == "g":  # no record is of grams
        return GRAVITY_UNIT
    if quantity not in KINDS:  # a name of the user's: its unit says what it is, and an unknown unit (A, V) stays as it is
        return next((factor for kind in (units.LENGTH, *KINDS.values(), units.ANGLE, units.ANGULAR_SPEED)
                     if (factor := _si(unit, kind)) is not None), 1.0)
    try:
        return units.quantity(f"1 {unit}", KINDS[quantity])
    except units.UnitError as error:
        _refuse(path, line, name, str(error))


def _si(unit: str, kind: units.Kind) -> float | None:
    """Return how many SI units one unit of a kind is; None where it is none of that kind."""
    try:
        return units.quantity(f"1 {unit}", kind)
    except units.UnitError:
        return None
