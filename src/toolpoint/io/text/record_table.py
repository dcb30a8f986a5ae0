"""Time histories in text: a header of channel names, columns of numbers, the first one time; read and write."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.io.decoding import read_text
from toolpoint.io.door import door
from toolpoint.io.faults import Fault, FileFaults
from toolpoint.io.quantities import units
from toolpoint.vibration import Dof, Record

_SPLIT = re.compile(r"\s*[,;\t]\s*|\s+")
_HEAD = re.compile(r"^\s*([^\[\](]+?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?\s*$")
_DECIMAL_COMMA = re.compile(r"^\s*[-+]?\d+,\d+\s*[;\t]")
_FORCE = re.compile(r"f(?:orce)?[ _-]?([xyz])", re.IGNORECASE)
TIMES = ("t", "time")
GRAVITY = 9.80665
KINDS = {"force": units.FORCE, "acceleration": units.ACCELERATION, "velocity": units.FEED, "displacement": units.LENGTH,
         "feed": units.LENGTH, "time": units.TIME}
STEADY = 0.01  # largest deviation of a time step from the mean one


def channel_of(name: str) -> tuple[Dof, str]:
    """Return label and quantity of a column: Fx, Fy, Fz are forces on the tool, other names stand for themselves."""
    match = _FORCE.fullmatch(name.strip())
    if match:
        return Dof("tool", "+" + match[1].lower()), "force"
    return Dof(name.strip(), "+x"), name.strip().lower()


@door("table of numbers")
def read(path: str | Path) -> Record:
    """Return the time histories of a text file.

    The last line before the numbers names the columns, with a unit in brackets where it is not the SI one: ``time [ms]``,
    ``Fx [kN]``, ``feed [mm]``. Separators may be commas, semicolons, tabs or blanks.

    Raises
    ------
    FileFaults
        With every faulty line: no number, too few columns, not finite, a time that does not run evenly, a decimal comma.
    """
    path = Path(path)
    text = read_text(path, "expected text with columns of time and samples")
    names, at, table = _table(path, text)
    scale = [_factor(path, text, at, name, unit) for name, unit in names]
    if names[0][0].lower() not in TIMES:
        raise FileFaults(str(path), text, [Fault(at, 1, "", f"the first column is {names[0][0]!r}; must be 'time' in s, "
                                                 "or with its unit, for example 'time [ms]'")])
    return of_columns(path, [name for name, _ in names[1:]], table[:, 0] * scale[0], values=table[:, 1:] * np.array(scale[1:]))


def of_columns(path: Path, names: Sequence[str], time: FloatArray, *, values: FloatArray) -> Record:
    """Return columns (SI) over time (s) as a Record after checking that the time runs evenly."""
    step = np.diff(time)
    if step.size == 0 or not step.mean() > 0 or np.abs(step - step.mean()).max() > STEADY * step.mean() + 1e-12:
        worst = int(np.argmax(np.abs(step - step.mean()))) + 1 if step.size else 0
        raise ToolpointError(f"{path}: time does not run evenly (sample {worst}); must have one sample rate; "
                             "resample it, and give the time enough digits")
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


def _table(path: Path, text: str) -> tuple[list[tuple[str, str]], int, FloatArray]:
    """Return (name, unit) of every column, the header's line, and the numbers."""
    head, at, rows, faults = "", 0, list[list[float]](), list[Fault]()
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip():
            continue
        if _DECIMAL_COMMA.match(line):
            faults.append(Fault(number, 1, "", "decimal comma; write decimal points"))
            continue
        try:
            row = [float(part) for part in _SPLIT.split(line.strip().rstrip(",;"))]
        except ValueError:
            if rows:
                faults.append(Fault(number, 1, "", f"{line.strip()[:60]!r} is not a line of numbers"))
            else:
                head, at = line.lstrip("#% "), number
            continue
        if rows and len(row) != len(rows[0]):
            faults.append(Fault(number, 1, "", f"{len(row)} numbers; must be {len(rows[0])} as in the lines before"))
        elif not np.isfinite(row).all():
            faults.append(Fault(number, 1, "", "a value that is not finite; remove the line or measure again"))
        else:
            rows.append(row)
    separator = next((s for s in (";", "\t", ",") if s in head), None)
    names = [_HEAD.match(cell) for cell in (head.split(separator) if separator else re.findall(r"\S+(?:\s*\[[^\]]*\])?", head))]
    if not faults and (not rows or not head or None in names or len(names) != len(rows[0])):
        counts = f"{len(names) if head else 0} names for {len(rows[0]) if rows else 0} columns"
        faults.append(Fault(max(at, 1), 1, "", f"{counts}; the line before the numbers must name them, "
                            "for example time,Fx,Fy,Fz"))
    if faults:
        raise FileFaults(str(path), text, faults[:50])
    return [(m[1], m[2] or "") for m in names if m], at, np.array(rows)


def _factor(path: Path, text: str, at: int, name: str, unit: str) -> float:
    quantity = "time" if name.lower() in TIMES else channel_of(name)[1]
    if not unit:
        return 1.0
    if quantity not in KINDS:  # a name of the user's: its unit says what it is, and an unknown unit (A, V) stays as it is
        return next((factor for kind in (units.LENGTH, *KINDS.values(), units.ANGLE, units.ANGULAR_SPEED)
                     if (factor := _si(unit, kind)) is not None), 1.0)
    if quantity == "acceleration" and unit.lower() == "g":  # not the gram
        return GRAVITY
    try:
        return units.quantity(f"1 {unit}", KINDS[quantity])
    except units.UnitError as error:
        raise FileFaults(str(path), text, [Fault(at, 1, name, str(error))]) from None


def _si(unit: str, kind: units.Kind) -> float | None:
    """Return how many SI units one unit of a kind is; None where it is none of that kind."""
    try:
        return units.quantity(f"1 {unit}", kind)
    except units.UnitError:
        return None
