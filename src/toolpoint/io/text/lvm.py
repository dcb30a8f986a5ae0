"""LabVIEW measurement files (LVM): one segment or several, decimal points or commas, with or without a column of time."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.io.decoding import read_text
from toolpoint.io.door import door
from toolpoint.io.faults import Fault, FileFaults
from toolpoint.io.text.columns import EXPECTED_RECORDS, Columns, split_numbers

# Twice in a file: behind the file's own header, and behind that of its channels.
END = "***End_of_Header***"
_SEPARATORS = {"Tab": "\t", "Comma": ",", "Semicolon": ";"}


@door("LabVIEW measurement file")
def read_columns(path: str | Path) -> list[Columns]:
    """Return the columns of every segment; raises ToolpointError or FileFaults where the file is none or is cut off."""
    path = Path(path)
    text = read_text(path, EXPECTED_RECORDS)
    lines = text.splitlines()
    if not lines or not lines[0].startswith("LabVIEW Measurement"):
        raise ToolpointError(f"{path}: no LabVIEW measurement file; its first line must say 'LabVIEW Measurement'")
    ends = [k for k, line in enumerate(lines) if line.strip() == END]
    head = _header(lines[:ends[0]], "\t") if ends else {}
    if len(ends) < 2:
        raise ToolpointError(f"{path}: no segment header; a LabVIEW measurement file must have channel names and units")
    separator = _SEPARATORS.get(head.get("Separator", ["Tab"])[0], "\t")
    comma = head.get("Decimal_Separator", ["."])[0] == ","
    segments = []
    for number, end in enumerate(ends[1:]):
        first = ends[number] + 1
        stop = ends[number + 2] if number + 2 < len(ends) else len(lines)
        segment_header = _header(lines[first:end], separator)
        segments.append(_segment(path, text, segment_header, lines[end + 1:stop], end + 2, comma, separator,
                                 head.get("X_Columns", ["One"])[0]))
    return segments


def _header(lines: list[str], separator: str) -> dict[str, list[str]]:
    cells = (line.split(separator) for line in lines if line.strip())
    return {row[0].strip(): [cell.strip() for cell in row[1:] if cell.strip()] for row in cells}


def _segment(path: Path, text: str, head: dict[str, list[str]], lines: list[str], line_number: int, comma: bool, separator: str,
             times: str) -> Columns:
    names = [name.strip() for name in lines[0].split(separator)] if lines else []
    names = [name for name in names if name and name not in ("X_Value", "Comment")]
    rows, faults = [], []
    for number, line in enumerate(lines[1:], start=line_number + 1):
        if not line.strip():
            continue
        row = split_numbers(line, separator, comma)
        if row is None and any(key in line for key in ("Channels", "Samples")):
            break  # the header of the next segment
        if row is None or len(row) < len(names):
            faults.append(Fault(number, 1, "", f"{line.strip()[:60]!r}; must be {len(names)} numbers"))
        else:
            rows.append(row)
    if faults or not rows:
        raise FileFaults(str(path), text, faults[:50] or [Fault(line_number, 1, "", "no samples")])
    stated = max((int(float(count)) for count in head.get("Samples", [])), default=len(rows))
    if len(rows) < stated:
        words = f"{len(rows)} samples of {stated}: the file is cut off"
        raise FileFaults(str(path), text, [Fault(line_number + len(rows), 1, "", words)])
    table = np.array(rows)
    table = table[:, 1::2] if times == "Multi" else table[:, 1:] if times == "One" else table
    steps = [float(value.replace(",", ".")) for value in head.get("Delta_X", [])]
    if not steps or min(steps) <= 0 or max(steps) != min(steps):
        raise ToolpointError(f"{path}: steps of time {head.get('Delta_X', [])}; must be one step above zero for all channels")
    units = [*head.get("Y_Unit_Label", []), *[""] * len(names)][:len(names)]
    return Columns(tuple(names), tuple(units), table[:, :len(names)], 1 / steps[0])
