"""Tables of points as CSV: point, x, y, z."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.io.decoding import read_text
from toolpoint.io.quantities import units

_UNIT = re.compile(r"(?:^[xyzXYZ]\s+(?![\[(])|[\[(])\s*([^\])]+?)\s*[\])]?\s*$")  # of 'x [mm]', 'x (mm)', 'x mm'
FORMATS = ("{}: geometry is read from a universal file (.uff, .unv), from CSV with lines point,x,y,z in m, or from a machine "
            "file (.yaml)")
FORM = "lines are point,x,y,z in m, or with the unit in a first line such as point,x [mm],y [mm],z [mm]"


def read(path: Path, length: float | None = None) -> dict[str | int, FloatArray]:
    """Return the places of points by name (whole numbers as such), m.

    A first line of names may state the unit of each column; `length` is that of files which do not, m in one unit. Where both
    are missing the numbers are metres, and places beyond every machine tool are refused.

    Raises ToolpointError, naming the line, for anything else than points, a point twice, a number that is not finite.
    """
    lines = [(number, line) for number, line in enumerate(read_text(path, FORMATS.format(path)).splitlines(), start=1)
             if line.strip(" ,;\t") and not line.lstrip().startswith("#")]
    separator = next((mark for mark in (";", "\t") if any(mark in line for _, line in lines[:2])), ",")
    rows = [(number, [cell.strip().strip('"').strip() for cell in line.strip().split(separator)]) for number, line in lines]
    if separator != ",":
        rows = [(number, [row[0], *(re.sub(r"^([-+]?\d*),(\d)", r"\1.\2", cell) for cell in row[1:])]) for number, row in rows]
    stated = None
    if rows and not is_number(rows[0][1][-1]):
        number, names = rows.pop(0)
        stated = _units(path, number, names[1:])
    points: dict[str | int, FloatArray] = {}
    for number, row in rows:
        name, place = _point(path, number, row)
        if name in points:
            raise ToolpointError(f"{path}:{number}: point {name} is there twice; every point has one place")
        points[name] = place * (np.array(stated) if stated else 1.0 if length is None else length)
    if not points:
        raise ToolpointError(f"{path}: no points; {FORM}")
    farthest = max(points, key=lambda name: float(np.abs(points[name]).max()))
    size = float(np.abs(points[farthest]).max())
    if size > units.LENGTH.largest:
        raise ToolpointError(f"{path}: point {farthest} lies {size:g} m away, more than {units.LENGTH.largest:g} m: no machine "
                             "tool is so large; write the unit of the columns in a first line: point,x [mm],y [mm],z [mm]")
    return points


def _point(path: Path, number: int, row: list[str]) -> tuple[str | int, FloatArray]:
    if len(row) != 4 or not all(is_number(cell) for cell in row[1:]):
        raise ToolpointError(f"{path}:{number}: {','.join(row)[:60]!r}; read as CSV, whose {FORM}; else give a universal file "
                             "(.uff, .unv) or a machine file (.yaml)")
    place = np.array([float(cell) for cell in row[1:]])
    if not np.isfinite(place).all():
        raise ToolpointError(f"{path}:{number}: {','.join(row)[:60]!r}; every coordinate must be a finite number")
    return (int(row[0]) if row[0].lstrip("-").isdigit() else row[0]), place


def _units(path: Path, number: int, names: list[str]) -> list[float] | None:
    """Return m in one unit of x, y and z by the names of their columns, None where these state no unit."""
    words = [_UNIT.search(name) for name in names]
    if not any(words):
        return None
    if len(names) != 3 or not all(words):
        raise ToolpointError(f"{path}:{number}: {','.join(names)[:60]!r} states the unit of some columns; must be of x, y and z"
                             ": x [mm],y [mm],z [mm]")
    try:
        return [units.quantity(f"1 {word[1]}", units.LENGTH) for word in words if word]
    except units.UnitError as error:
        raise ToolpointError(f"{path}:{number}: {error}") from None


def is_number(text: str) -> bool:
    """Return whether a cell holds a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def read_places(path: str | Path) -> FloatArray:
    r"""Return places (n, 3), m, of a CSV with lines x,y,z.

    A first line of the names x, y, z may state their unit: ``x mm, y mm, z mm``, ``x [mm]`` or ``x (mm)``; m where none does.

    Raises ToolpointError where the file holds anything else, or names in another order.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "places.csv")
    ...     _ = file.write_text("x mm, y mm, z mm\n100, 0, 250\n")
    ...     read_places(file).tolist()
    [[0.1, 0.0, 0.25]]
    """
    path = Path(path)
    lines = [line for line in read_text(path, "expected lines of x,y,z").splitlines() if line.strip()]
    cells = [cell.strip().strip('"') for cell in lines[0].split(",")] if lines else []
    named = bool(cells) and not any(map(is_number, cells)) and not lines[0].lstrip().startswith("#")
    if named and [cell[:1].lower() for cell in cells] != ["x", "y", "z"]:
        raise ToolpointError(f"{path}:1: {lines[0][:60]!r}; columns must be x, y, z in this order")
    size = np.array((_units(path, 1, cells) if named else None) or 1.0)
    try:
        places = np.loadtxt(lines[named:], delimiter=",", ndmin=2) if lines[named:] else np.zeros((0, 0))
    except ValueError as error:
        raise ToolpointError(f"{path}: not lines of x,y,z ({error})") from None
    if places.shape[1:] != (3,) or not np.isfinite(places).all():
        count, width = places.shape
        raise ToolpointError(f"{path}: {count} lines of {width} numbers; must be lines of x,y,z, finite")
    return size * places
