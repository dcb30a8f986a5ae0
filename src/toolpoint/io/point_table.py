"""Tables of points as CSV: point, x, y, z."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, ToolpointError

FORMATS = ("{}: geometry is read from a universal file (.uff, .unv), from CSV with lines point,x,y,z in m, or from a machine "
            "file (.yaml)")


def read(path: Path) -> dict[str | int, FloatArray]:
    """Return the places of points by name (whole numbers as such), as the file holds them, m where nobody says otherwise."""
    points: dict[str | int, FloatArray] = {}
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            for number, row in enumerate(csv.reader(file), start=1):
                if not row or row[0].lstrip().startswith("#") or (number == 1 and not is_number(row[-1])):
                    continue
                if len(row) != 4 or not all(is_number(v) for v in row[1:]):
                    raise ToolpointError(f"{path}:{number}: {','.join(row)[:60]!r}; read as CSV, whose lines are "
                                         "point,x,y,z in m; else give a universal file (.uff, .unv) or a machine file (.yaml)")
                name = row[0].strip()
                points[int(name) if name.lstrip("-").isdigit() else name] = np.array([float(v) for v in row[1:]])
    except OSError as error:
        raise ToolpointError(f"{path}: cannot be read ({error.strerror})") from None
    except (UnicodeDecodeError, csv.Error):
        raise ToolpointError(f"{FORMATS.format(path)}; this is a binary file of another kind") from None
    if not points:
        raise ToolpointError(f"{path}: no points; lines must be point,x,y,z in m")
    return points


def is_number(text: str) -> bool:
    """Return whether a cell holds a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True
