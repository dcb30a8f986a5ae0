"""Signals of controllers in tables: any header, units in [] or () or given, groups with a time of their own, decimal commas.

TNCscope (.sco) and TwinCAT Scope exports are such tables with more words above them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.drives.accuracy.axis_record import AxisRecord, AxisSignal, role_of
from toolpoint.io.faults import Fault, FileFaults

_UNITS: dict[str, tuple[str, float]] = {
    "s": ("s", 1.0), "ms": ("s", 1e-3), "us": ("s", 1e-6), "µs": ("s", 1e-6), "m": ("m", 1.0), "mm": ("m", 1e-3),
    "um": ("m", 1e-6), "µm": ("m", 1e-6),
    "nm": ("m", 1e-9), "inch": ("m", 0.0254), "rad": ("rad", 1.0), "deg": ("rad", np.pi / 180),
    "°": ("rad", np.pi / 180), "m/s": ("m/s", 1.0), "mm/s": ("m/s", 1e-3), "mm/min": ("m/s", 1e-3 / 60),
    "m/min": ("m/s", 1 / 60),
    "rad/s": ("rad/s", 1.0), "deg/s": ("rad/s", np.pi / 180), "°/s": ("rad/s", np.pi / 180), "rpm": ("rad/s", np.pi / 30),
    "rev/min": ("rad/s", np.pi / 30), "1/min": ("rad/s", np.pi / 30), "u/min": ("rad/s", np.pi / 30), "m/s2": ("m/s^2", 1.0),
    "m/s^2": ("m/s^2", 1.0), "m/s²": ("m/s^2", 1.0), "mm/s2": ("m/s^2", 1e-3), "mm/s^2": ("m/s^2", 1e-3), "a": ("A", 1.0),
    "ampere": ("A", 1.0), "ma": ("A", 1e-3), "v": ("V", 1.0), "volt": ("V", 1.0),
    "w": ("W", 1.0), "kw": ("W", 1e3), "n": ("N", 1.0), "kn": ("N", 1e3),
    "n m": ("N m", 1.0), "n*m": ("N m", 1.0), "%": ("%", 1.0), "counts": ("counts", 1.0),
    "inc": ("counts", 1.0), "hz": ("Hz", 1.0)}
_COLUMN = re.compile(r"^\s*(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\))?\s*$")
_TIME = re.compile(r"^(time|t|zeit|zeitstempel|timestamp)\b", re.IGNORECASE)


def unit_of(words: str) -> tuple[str, float] | None:
    """Return the SI unit and the factor to it, None for an unknown unit. Nm is a torque (lengths of nm are written small)."""
    stripped = words.strip()
    if stripped == "Nm":
        return "N m", 1.0
    return _UNITS.get(stripped.lower())


def read(path: Path, text: str, units: Mapping[str, str] | None = None, *, sample_time: float | None = None) -> AxisRecord:
    """Return the signals of a table.

    The header is the last line of words before the numbers. `units` gives units by column name where the header has none; a
    column without either is kept with the unit "" and a note. Empty cells hold the value before.
    """
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith(("#", "%"))]
    first = next((k for k, line in enumerate(lines) if _is_numbers(line) or (k and _is_comma_row(lines[k - 1], line))), None)
    if first is None or first == 0:
        raise FileFaults(str(path), text, [Fault(1, 1, "", "no line of column names above lines of numbers")])
    mark = _separator(lines[first])
    header = [part.strip().strip('"') for part in lines[first - 1].split(mark)]
    table = _numbers(lines[first:], mark, max(len(header), 1))
    columns = [_COLUMN.match(part) for part in header]
    names = [match[1] if match else part for match, part in zip(columns, header, strict=True)]
    words = [(match[2] or match[3] or "") if match else "" for match in columns]
    given_units = dict(units or {})
    column_units = [given_units.get(n, w) for n, w in zip(names, words, strict=True)]
    return build_record(path, text, names=names, units=column_units, table=table, sample_time=sample_time)


def build_record(path: Path, text: str, *, names: Sequence[str], units: Sequence[str], table: FloatArray,
                 sample_time: float | None = None, axes: Sequence[str] | None = None, roles: Sequence[str] | None = None
                 ) -> AxisRecord:
    """Return the record of columns; a time column serves those behind it, up to the next."""
    notes: list[str] = []
    signals: list[AxisSignal] = []
    time = np.arange(len(table)) * sample_time if sample_time else None
    for k, (name, words) in enumerate(zip(names, units, strict=True)):
        si = unit_of(words) if words else ("", 1.0)
        if si is None:
            notes.append(f"column {name!r}: unknown unit {words!r}; its numbers are kept as they stand")
            si = words, 1.0
        values = table[:, k] * si[1] if k < table.shape[1] else np.full(len(table), np.nan)
        if _TIME.match(name):
            if not words:
                notes.append(f"column {name!r} has no unit and is read as seconds")
            time = values
        elif name:
            if time is None:
                raise FileFaults(str(path), text, [Fault(1, 1, name, "no time column; name it time, or give sample_time")])
            role = roles[k] if roles is not None and roles[k] else role_of(name, si[0])
            if not words and role:
                notes.append(f"column {name!r} has no unit; give one to have it judged")
                role = ""
            keep = np.isfinite(time) & np.isfinite(values)
            if keep.sum() > 1:
                axis = axes[k] if axes is not None else _axis_of(name)
                signals.append(AxisSignal(name, si[0], role, axis, time[keep], values[keep]))
    for signal in signals:
        if (np.diff(signal.time) <= 0).any():
            raise FileFaults(str(path), text, [Fault(1, 1, signal.name, "its time does not increase")])
    if not signals:
        raise FileFaults(str(path), text, [Fault(1, 1, "", "no signal with two values")])
    return AxisRecord(tuple(signals), str(path), tuple(dict.fromkeys(notes)))


def read_tncscope(path: Path, text: str) -> AxisRecord:
    """Return the signals of a TNCscope file: curves described in its header, times in us, columns closed by semicolons."""
    curves: list[dict[str, str]] = []
    for line in text.splitlines():
        if line.startswith("%[CURVE"):
            curves.append({})
        elif curves and line.startswith("%") and "=" in line:
            key, _, value = line[1:].partition("=")
            curves[-1][key.strip()] = value.strip()
    rows = [line for line in text.splitlines() if line.strip() and not line.startswith("%")]
    if not curves or not rows:
        raise FileFaults(str(path), text, [Fault(1, 1, "", "no curves with numbers; is it a TNCscope file?")])
    table = _numbers(rows, ";", len(curves) + 1)
    names = ["time", *(c.get("NAME", f"curve {k}") for k, c in enumerate(curves, 1))]
    return build_record(path, text, names=names, units=["us", *(c.get("DIMENSION", "") for c in curves)], table=table,
                        axes=["", *(c.get("AXISTYPE", "") for c in curves)])


def read_twincat(path: Path, text: str) -> AxisRecord:
    """Return the signals of a TwinCAT Scope export: a line of names (columns named Name are times, ms), lines of properties."""
    lines = text.splitlines()
    name_line = next((k for k, line in enumerate(lines) if k > 0 and line.startswith("Name\t") and line.count("\t") > 1), None)
    if name_line is None:
        raise FileFaults(str(path), text, [Fault(1, 1, "", "no line of channel names; is it a TwinCAT Scope export?")])
    header = lines[name_line].split("\t")
    unit_line = next((line.split("\t") for line in lines[name_line:] if line.startswith("Unit\t")), [""] * len(header))
    first = next((k for k in range(name_line, len(lines)) if _is_numbers(lines[k])), len(lines))
    rows = []
    for line in lines[first:]:
        if not _is_numbers(line):
            break
        rows.append(line)
    table = _numbers(rows, "\t", len(header))
    names = ["time" if name == "Name" else name for name in header]
    units = ["ms" if name == "Name" else re.sub(r"\s*\(.*\)$", "", unit) for name, unit in zip(header, unit_line, strict=False)]
    units = ["" if unit.startswith("(None") else unit for unit in units]
    units += [""] * (len(names) - len(units))
    return build_record(path, text, names=names, units=units, table=table)


def _axis_of(name: str) -> str:
    """Return the axis that a name ends on or begins with, X, Y, Z, A, B or C (v, u and w are speeds and voltages too)."""
    letters = re.findall(r"(?:^|(?<=[\s_./]))([XYZABC]\d?)(?=$|[\s_.])", name, re.IGNORECASE)
    return letters[-1].upper() if letters else ""


def _is_numbers(line: str) -> bool:
    parts = [p for p in re.split(r"[;\t]|,(?!\d)| +", line.strip().strip(";")) if p]
    return bool(parts) and all(_number(p) is not None or not p.strip() for p in parts)


def _is_comma_row(head: str, line: str) -> bool:
    """Whether a line holds numbers between commas, as many as the line above it holds names: no decimal commas then."""
    if any(mark in line for mark in ";\t") or head.count(",") != line.count(",") or "," not in line:
        return False
    return all(_number(part) is not None for part in line.split(","))


def _separator(line: str) -> str:
    return next((m for m in ("\t", ";") if m in line), "," if "," in line else " ")


def _number(text: str) -> float | None:
    try:
        return float(text.strip().replace(",", "."))
    except ValueError:
        return None


def _numbers(lines: Sequence[str], mark: str, width: int) -> FloatArray:
    """Return the numbers of lines, not-a-number in empty cells; a line of another kind ends the table."""
    rows = []
    for line in lines:
        parts = line.split(mark) if mark != " " else line.split()
        values = [_number(p) for p in parts[:width]]
        if all(v is None for v in values):
            break
        rows.append([np.nan if v is None else v for v in values] + [np.nan] * (width - len(values)))
    return np.array(rows, float).reshape(-1, width)
