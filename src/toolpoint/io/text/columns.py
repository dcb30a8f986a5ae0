"""Columns of samples as a file holds them: names, units, numbers; before anybody says what they measure and where."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NoReturn

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._rounding import number_text
from toolpoint.io.decoding import read_text
from toolpoint.io.door import door
from toolpoint.io.faults import Fault, FileFaults
from toolpoint.io.quantities.sensitivities import QUANTITY_BY_UNIT, VOLTS

# As loggers, LabVIEW and spreadsheets call a column of time; matched whole, so that "temperature" is none.
TIMES = ("t", "time", "zeit", "x_value", "timestamp", "time stamp", "date", "date/time", "datetime")
COUNTS = ("sample", "samples", "index", "idx", "n", "nr", "no", "point", "row", "count", "messwert", "")
EXPECTED_RECORDS = "records are read from universal files, text, LVM, WAV, TDMS, MATLAB, NumPy and HDF5"
DAY = 86400.0  # s
# A time of day with a date before it or a zone behind it: only differences count.
_CLOCK = re.compile(r"(?:[\d./-]+[T ])?\s*(\d{1,2}):(\d{2}):(\d{2}(?:[.,]\d+)?)(?:Z|[+-]\d{2}:?\d{2})?")
# A comma inside a number with another separator behind it: with commas as separators it could not be told.
_DECIMAL_COMMA = re.compile(r"^\s*[-+]?\d+,\d+\s*[;\t]")
# Largest deviation of a time step from the mean one: a sample that is left out doubles one.
TIME_STEP_TOLERANCE = 0.01
MAX_ROUNDING_STEPS = 0.25  # of a time step, in the last digit of the times: coarser, a sample that is left out does not show
MAX_TIME_DECIMALS, LATE_TIMES = 9, 100
# Name and unit in either kind of bracket, quoted or not.
_HEAD = re.compile(r"^\s*\"?([^\[\](\"]+?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?\"?\s*$")
_TIME_UNITS = {"": 1.0, "s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6}


@dataclass(frozen=True, eq=False)
class Columns:
    """Samples (n, n_channels) in the file's own units; `sample_rate` in Hz, None where the file does not say it; `line` of a
    text that names them, 0 where none does."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    samples: FloatArray
    sample_rate: float | None
    start: float = 0.0
    line: int = 0

    def __post_init__(self) -> None:
        columns = self.samples.shape[1]
        if not len(self.names) == len(self.units) == columns:  # the reader's door names the file
            raise ValueError(f"{len(self.names)} names and {len(self.units)} units of {columns} columns of samples")


@door("table of numbers")
def read_columns(path: str | Path) -> Columns:
    """Return the columns of a text file: a first column named time gives the rate, the line before the numbers the names.

    Separators may be commas, semicolons, tabs or blanks; decimal commas are read where semicolons or tabs separate. Columns
    without names are ``channel 1`` .. Units stand in brackets behind the names, behind an underscore (time_ms, force_N) or in a
    line of their own below. Times may be those of a clock (10:00:00.125, with a date before it). Raises FileFaults with every
    faulty line.
    """
    path = Path(path)
    text = read_text(path, EXPECTED_RECORDS)
    lines = text.splitlines()
    separator, comma = _style(lines)
    head, rows, numbers, faults = ["", ""], list[list[float]](), list[int](), list[Fault]()
    named = 0
    for number, line in enumerate(lines, start=1):
        row = split_numbers(line, separator, comma)
        if row is None:
            # Words before the first line of numbers are a header; behind it they are a fault, as a line left out would
            # shift the times.
            if rows and line.strip() and line.lstrip()[:1] not in "#%":
                hint = "decimal comma; write decimal points" if _DECIMAL_COMMA.match(line) else ""
                faults.append(Fault(number, 1, "", hint or f"{line.strip()[:60]!r} is not a line of numbers"))
            elif not rows and line.strip():
                head, named = [head[1], line.strip().lstrip("#% ")], number
            continue
        rows.append(row)
        numbers.append(number)
    faults += [Fault(numbers[i], 1, "", f"{len(row)} numbers; must be {len(rows[0])} as in the first line of numbers")
               for i, row in enumerate(rows) if len(row) != len(rows[0])]
    if not rows or faults:
        raise FileFaults(str(path), text, faults[:50] or [Fault(1, 1, "", "no line of numbers; expected columns of samples")])
    table = np.array(rows)
    bad = np.flatnonzero(~np.isfinite(table).all(axis=1))
    if bad.size:
        words = "a value that is not finite; remove the line or measure again"
        raise FileFaults(str(path), text, [Fault(numbers[i], 1, "", words) for i in bad[:50]])
    cells = _names(head, separator, table.shape[1])
    result = _with_time(path, *(cells or ([f"channel {k + 1}" for k in range(table.shape[1])], [""] * table.shape[1])), table,
                        is_clock=":" in lines[numbers[0] - 1])
    return replace(result, line=named if cells else 0)


def is_count(name: str) -> bool:
    """Return whether a column of this name counts the samples: it stands before the times and says nothing."""
    return name.strip('" ').lower().rstrip(".:") in COUNTS


def split_numbers(line: str, separator: str | None, comma: bool) -> list[float] | None:
    """Return the numbers of a line, None where it holds anything else."""
    # Exports of spreadsheets end a line by a separator, which is no further column, and quote numbers.
    stripped = line.strip().rstrip(";,").replace('"', "").strip()
    if not stripped:
        return None
    try:
        return [_number(part, comma) for part in stripped.split(separator) if part.strip()]
    except ValueError:
        return None


def _number(cell: str, comma: bool) -> float:
    """Return a number, or the seconds of the day of a clock's time; ValueError for anything else."""
    clock = _CLOCK.fullmatch(cell.strip()) if ":" in cell else None
    if clock is None:
        return float(cell.replace(",", ".") if comma else cell)
    return 3600 * int(clock[1]) + 60 * int(clock[2]) + float(clock[3].replace(",", "."))


def _style(lines: list[str]) -> tuple[str | None, bool]:
    """Return the separator of the numbers, and whether they have decimal commas."""
    # The last line of numbers: header lines may hold any separator.
    body = next((line for line in reversed(lines) if re.match(r"^\s*\"?[-+]?[\d.,]", line)), "")
    for separator in (";", "\t"):
        if separator in body.strip():
            return separator, re.search(r"\d,\d", body) is not None
    return ("," if "," in body else None), False


def _names(head: list[str], separator: str | None, count: int) -> tuple[list[str], list[str]] | None:
    """Return name and unit of every column from the last two lines before the numbers; None where they do not fit them."""
    upper_cells, lower_cells = ([part.strip().strip('"') for part in _cells(line, separator)] for line in head)
    unit = lower_cells[0].strip("[]()").lower()
    if len(upper_cells) == len(lower_cells) == count and upper_cells[0].lower() in TIMES and unit and unit in _TIME_UNITS:
        return upper_cells, [cell.strip("[]()") for cell in lower_cells]
    matches = [_HEAD.match(cell) for cell in _cells(head[1], separator)]
    if len(matches) != count or not all(matches):
        return None
    names, units = zip(*(((match[1] or "").strip(), (match[2] or "").strip()) for match in matches if match), strict=True)
    return _parted_units(names) or (list(names), list(units))


def _parted_units(names: Sequence[str]) -> tuple[list[str], list[str]] | None:
    """Return names and units of heads such as Zeit_ms, Kraft_N; None where the first is no time with its unit so behind it."""
    time_name, _, time_unit = names[0].rpartition("_")
    if time_name.lower() not in TIMES or time_unit.lower() not in _TIME_UNITS:
        return None
    parted = [(head, unit) if head and unit.lower() in QUANTITY_BY_UNIT | VOLTS else (name, "")
              for name, (head, _, unit) in ((name, name.rpartition("_")) for name in names[1:])]
    return [time_name, *(head for head, _ in parted)], [time_unit, *(unit for _, unit in parted)]


def _cells(line: str, separator: str | None) -> list[str]:
    return re.split(r"\s{2,}|\s(?![\[(])", line) if separator is None else line.split(separator)


def _with_time(path: Path, names: list[str], units: list[str], table: FloatArray, *, is_clock: bool) -> Columns:
    if len(names) > 2 and is_count(names[0]) and names[1].lower() in TIMES:  # numbers of the samples before their times
        names, units, table = names[1:], units[1:], table[:, 1:]
    if names[0].lower() not in TIMES:
        if is_clock:
            raise ToolpointError(f"{path}: the first column holds a clock's times and is called {names[0]!r}; must be 'time'")
        return Columns(tuple(names), tuple(units), table, None)
    if table.shape[1] < 2:
        raise ToolpointError(f"{path}: only a column of time; must hold samples beside it")
    if units[0].lower() not in _TIME_UNITS:
        raise ToolpointError(f"{path}: time in {units[0]!r}; must be in {', '.join(u for u in _TIME_UNITS if u)}")
    time = table[:, 0] * _TIME_UNITS[units[0].lower()]
    if is_clock and (decreasing := np.flatnonzero(np.diff(time) < -DAY / 2)).size == 1:
        time[decreasing[0] + 1:] += DAY  # over midnight
    step = (time[-1] - time[0]) / max(time.size - 1, 1)
    # The second term is single precision's rounding of the last time: loggers write times as float32.
    is_even = step > 0 and np.abs(np.diff(time) - step).max() <= TIME_STEP_TOLERANCE * step + 2e-6 * abs(time[-1])
    if not is_even and _is_rounded(time, step):
        # The last digit of the first and last times would be an error of the rate: all times tell it.
        step = float(np.polyfit(np.arange(time.size), time, 1)[0])
    elif not is_even:
        refuse_uneven_time(path, time)
    return Columns(tuple(names[1:]), tuple(units[1:]), table[:, 1:], 1 / float(step), float(time[0]))


def refuse_uneven_time(path: Path, time: FloatArray) -> NoReturn:
    """Raise ToolpointError for times (s) that are no even sequence: the sample whose step differs most, and both steps."""
    if time.size < 2:
        raise ToolpointError(f"{path}: one sample; must be at least two, whose times give the sample rate")
    steps = np.diff(time)
    usual = float(np.median(steps))
    largest_gap = int(np.argmax(np.abs(steps - usual)))
    step, place = number_text(float(steps[largest_gap])), f"sample {largest_gap + 2} (at {time[largest_gap + 1]:.8g} s)"
    raise ToolpointError(f"{path}: time does not run evenly: {step} s before {place}, {number_text(usual)} s as a rule; must "
                         "have one sample rate; resample it, and give the time enough digits")


def _is_rounded(time: FloatArray, step: float) -> bool:
    """Whether times run evenly but for their last digit: a logger with 0.1 ms writes 1.25 ms as 0.0012 or 0.0013 s.

    Every time must lie within half of the last digit of an even line; the digit is that of the last times, as numbers
    of a fixed count of digits have fewer decimals there.
    """
    late = time[-LATE_TIMES:]
    decimals = next((d for d in range(MAX_TIME_DECIMALS) if np.abs(late - np.round(late, d)).max() < 10.0**-d * 1e-4), None)
    if decimals is None or not 0 < 10.0**-decimals <= MAX_ROUNDING_STEPS * step:
        return False
    count = np.arange(time.size)
    departure = time - np.polyval(np.polyfit(count, time, 1), count)
    return bool(np.abs(departure).max() <= 0.5 * 10.0**-decimals + TIME_STEP_TOLERANCE * step)
