"""Command streams in CSV: set points or controller records, one column a signal, as recorded by a controller; read, write.

The header line names the columns, each with its unit in brackets: ``time [s], X [mm], Y [mm], Tx [N m]``.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, suggestion
from toolpoint._notebook import NotebookText
from toolpoint.io.faults import Fault, FileFaults
from toolpoint.vibration import Record

_FACTORS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "rad": 1.0,
            "deg": np.pi / 180, "m/s": 1.0, "mm/s": 1e-3, "mm/min": 1e-3 / 60, "m/min": 1 / 60, "rad/s": 1.0,
            "rpm": 2 * np.pi / 60, "N": 1.0, "kN": 1e3, "N m": 1.0, "Nm": 1.0, "A": 1.0, "V": 1.0, "": 1.0}
_SI = {"ms": "s", "us": "s", "mm": "m", "um": "m", "nm": "m", "deg": "rad", "mm/s": "m/s", "mm/min": "m/s",
       "m/min": "m/s", "rpm": "rad/s", "kN": "N", "Nm": "N m"}
_KIND = {"m": "displacement", "rad": "displacement", "m/s": "velocity", "rad/s": "velocity", "N": "force", "N m": "torque",
         "A": "current", "V": "voltage"}
_COLUMN = re.compile(r"^\s*([^\[\]]+?)\s*(?:\[([^\]]*)\])?\s*$")


@dataclass(frozen=True, eq=False)
class CommandStream(NotebookText):
    """Signals at one sample time: `values` (n, n_columns) in SI, their names and units, start time."""

    values: FloatArray
    sample_time: float
    names: tuple[str, ...]
    units: tuple[str, ...]
    start: float = 0.0

    def columns(self, names: Sequence[str]) -> FloatArray:
        """Return the named columns, (n, len(names))."""
        for name in names:
            if name not in self.names:
                raise ToolpointError(f"column: {name!r}; must be one of {', '.join(self.names)}; "
                                     + suggestion(name, self.names))
        return self.values[:, [self.names.index(name) for name in names]]

    @property
    def record(self) -> Record:
        """The signals as a Record; every column is a point of its own in +x."""
        from toolpoint.vibration import Dof

        return Record(self.values, 1 / self.sample_time, tuple(Dof(n, "+x") for n in self.names),
                      tuple(_KIND.get(u, u or "number") for u in self.units), self.units, self.start)

    def __repr__(self) -> str:
        return f"CommandStream({', '.join(self.names)}; {len(self.values)} samples every {1e3 * self.sample_time:g} ms)"


def read(path: str | Path, sample_time: float | None = None) -> CommandStream:
    """Return a command stream.

    Parameters
    ----------
    path : path
        Separators comma, semicolon or tab; the first column is the time where it is named time or t.
    sample_time : float, optional
        s; needed only where the file has no time column.

    Raises
    ------
    FileFaults
        Every faulty line: wrong number of values, not a number, time that does not increase evenly, unknown units.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig", errors="replace")
    except OSError as error:
        raise ToolpointError(f"{path}: cannot be read ({error.strerror}); check the name and the folder") from None
    lines = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and line.lstrip()[0] not in "#%"]
    if len(lines) < 3:
        raise FileFaults(str(path), text, [Fault(1, 1, "", "fewer than two lines of numbers below a header")])
    mark = next((m for m in (";", "\t", ",") if m in lines[0][1]), ",")
    names, units, faults = _header(*lines[0], mark)
    table, table_faults = _numbers(lines[1:], len(names), mark)
    faults += table_faults
    if faults:
        raise FileFaults(str(path), text, faults[:50])
    values = table * np.array([_FACTORS[u] for u in units])
    si = tuple(_SI.get(u, u) for u in units)
    start = 0.0
    if names[0].lower() in ("time", "t"):
        step, bad = _even(values[:, 0], [i for i, _ in lines[1:]])
        if bad:
            raise FileFaults(str(path), text, bad[:50])
        start, values, names, si = float(values[0, 0]), values[:, 1:], names[1:], si[1:]
    elif sample_time is None:
        raise FileFaults(str(path), text, [Fault(lines[0][0], 1, "", "no time column; name it time, or give sample_time")])
    else:
        step = sample_time
    return CommandStream(values, step, names, si, start)


def write(stream: CommandStream, path: str | Path) -> None:
    """Write a command stream in SI with a time column; it reads back to the same numbers."""
    header = ", ".join(["time [s]", *(f"{n} [{u}]" for n, u in zip(stream.names, stream.units, strict=True))])
    time = stream.start + np.arange(len(stream.values)) * stream.sample_time
    lines = (", ".join(repr(float(v)) for v in (t, *row)) for t, row in zip(time, stream.values, strict=True))
    Path(path).write_text(header + "\n" + "\n".join(lines) + "\n", encoding="utf-8")


def _header(number: int, line: str, mark: str) -> tuple[tuple[str, ...], tuple[str, ...], list[Fault]]:
    names, units, faults, column = [], [], [], 1
    for part in line.split(mark):
        match = _COLUMN.match(part)
        name, unit = (match[1], (match[2] or "").strip()) if match else ("", "")
        if not name or re.fullmatch(r"[-+.\deE]+", name):
            faults.append(Fault(number, column, "", f"{part.strip()!r} is not a column name"))
        elif unit not in _FACTORS:
            faults.append(Fault(number, column, name, f"unknown unit {unit!r}; {suggestion(unit, _FACTORS)}"))
        elif name in names:
            faults.append(Fault(number, column, name, "a column of this name stands before"))
        names.append(name)
        units.append(unit)
        column += len(part) + 1
    return tuple(names), tuple(units), faults


def _numbers(lines: list[tuple[int, str]], width: int, mark: str) -> tuple[FloatArray, list[Fault]]:
    rows, faults = [], []
    for number, line in lines:
        parts = line.rstrip().rstrip(mark).split(mark)
        if len(parts) != width:
            faults.append(Fault(number, 1, "", f"{len(parts)} values; the header names {width}"))
            continue
        try:
            row = [float(p) for p in parts]
        except ValueError:
            bad = next(k for k, p in enumerate(parts) if not _is_number(p))
            faults.append(Fault(number, 1 + sum(len(p) + 1 for p in parts[:bad]), "", f"{parts[bad].strip()!r} is not a number"
                                + ("; write decimal points" if "," in parts[bad] else "")))
            continue
        if not np.isfinite(row).all():
            faults.append(Fault(number, 1, "", "a value that is not finite; remove the line or record again"))
        rows.append(row)
    return np.array(rows, float).reshape(-1, width), faults


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _even(time: FloatArray, numbers: list[int]) -> tuple[float, list[Fault]]:
    steps = np.diff(time)
    step = float(np.median(steps)) if steps.size else 0.0
    if step <= 0:
        return 1.0, [Fault(numbers[0], 1, "time", "time does not increase")]
    # A hundredth of a step is rounding of printed times; a lost sample is a whole one.
    bad = np.flatnonzero(np.abs(steps - step) > 0.01 * step)
    return (time[-1] - time[0]) / steps.size, [
        Fault(numbers[k + 1], 1, "time", f"step of {steps[k]:g} s where the others are {step:g} s; resample first")
        for k in bad]
