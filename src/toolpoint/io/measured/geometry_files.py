"""Places of measured points: universal files, CSV, and the points of a machine file."""

from __future__ import annotations

import contextlib
import csv
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.io import point_table, uff
from toolpoint.io.binary import hdf5
from toolpoint.io.door import door
from toolpoint.io.point_table import FORMATS, is_number
from toolpoint.io.suffixes import HDF5, UNIVERSAL, YAML
from toolpoint.vibration.geometry import Geometry


@door("file of points")
def read(path: str | Path) -> Geometry:
    r"""Return the geometry of a universal file (sets 15 or 2411, 82, edges of the elements of 2412), of a CSV file with
    columns point, x, y, z (m), the points of a machine file (YAML) at its reference pose, or those that an HDF5 file of
    toolpoint keeps beside its modes.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "points.csv")
    ...     _ = file.write_text("point,x,y,z\n1,0,0,0\n2,0.5,0,0\n")
    ...     read(file)
    Geometry(2 points, 0 lines)
    """
    path = Path(path)
    if path.suffix.lower() in HDF5:
        return _kept_places(path)
    if path.suffix.lower() in UNIVERSAL:
        measured = uff.read_geometry(path)
        pairs: list[tuple[str | int, str | int]] = [pair for line in measured.lines for pair in pairwise(line)]
        return Geometry(dict(zip(measured.points, measured.coordinates, strict=True)), pairs)
    if path.suffix.lower() in YAML:
        return Geometry(_machine_points(path), [])
    return Geometry(point_table.read(path), [])


def read_test_geometry(path: str | Path | None, measured_files: Sequence[str | Path] = ()) -> Geometry:
    r"""Return the geometry of a file, or where none is named that of the first measured file that holds places.

    Raises ToolpointError where no file does.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "points.csv")
    ...     _ = file.write_text("point,x,y,z\n1,0,0,0\n2,0.5,0,0\n")
    ...     read_test_geometry(file)
    Geometry(2 points, 0 lines)
    """
    if path is not None:
        return read(path)
    for file in map(Path, measured_files):
        if file.suffix.lower() in (*HDF5, *UNIVERSAL):
            with contextlib.suppress(ToolpointError):
                geometry: Geometry = read(file)
                if geometry.points:
                    return geometry
    names = ", ".join(Path(file).name for file in measured_files[:3])
    raise ToolpointError(f"`geometry`: missing, and {names or 'no file'} holds no places of points; name a file that says "
                         "where each point is: universal, or CSV with the columns point,x,y,z in m")


@door("file of lines")
def read_lines(path: str | Path, geometry: Geometry) -> Geometry:
    r"""Return the geometry with the lines of a file in place of its own: a universal file (set 82, edges of 2412), or CSV whose
    rows are the points that a line runs through, two or more.

    Raises ToolpointError for a point that the geometry does not have, naming file and line.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     points, lines = Path(folder, "points.csv"), Path(folder, "lines.csv")
    ...     _ = points.write_text("point,x,y,z\n1,0,0,0\n2,0.5,0,0\n3,1,0,0\n")
    ...     _ = lines.write_text("1,2,3\n")
    ...     read_lines(lines, read(points)).lines
    [(1, 2), (2, 3)]
    """
    path = Path(path)
    if path.suffix.lower() in UNIVERSAL:
        measured = uff.read_geometry(path)
        runs: list[tuple[int, list[str | int]]] = [(0, list(line)) for line in measured.lines]
    else:
        runs = _csv_runs(path)
    pairs: list[tuple[str | int, str | int]] = []
    for number, run in runs:
        unknown = [point for point in run if point not in geometry.points]
        if unknown:
            first_points = ", ".join(map(str, list(geometry.points)[:6]))
            raise ToolpointError(f"{path}{f':{number}' if number else ''}: point {unknown[0]} is not in the geometry (it has "
                                 f"{first_points} ..)")
        pairs += pairwise(run)
    if not pairs:
        raise ToolpointError(f"{path}: no line; rows must be points that a line runs through, for example 1,2,3")
    return Geometry(geometry.points, pairs)


def _csv_runs(path: Path) -> list[tuple[int, list[str | int]]]:
    runs: list[tuple[int, list[str | int]]] = []
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            for number, row in enumerate(csv.reader(file), start=1):
                names = [cell.strip() for cell in row if cell.strip()]
                if not names or names[0].startswith("#") or (number == 1 and not any(is_number(name) for name in names)
                                                             and names[0].lower() in ("from", "point", "a", "start")):
                    continue
                if len(names) < 2:
                    raise ToolpointError(f"{path}:{number}: {','.join(row)[:60]!r}; a line runs through two points at least")
                runs.append((number, [int(name) if name.lstrip("-").isdigit() else name for name in names]))
    except OSError as error:
        raise ToolpointError(f"{path}: cannot be read ({error.strerror})") from None
    return runs


def _kept_places(path: Path) -> Geometry:
    try:
        return hdf5.read(path, Geometry)
    except ToolpointError as error:
        raise ToolpointError(f"{FORMATS.format(path)}; in an HDF5 file those are looked for that were kept beside modes, but"
                             f"\n{error}") from None


def _machine_points(path: Path) -> dict[str | int, FloatArray]:
    try:
        from toolpoint.io.yaml import machine_file  # loaded for this format only
        from toolpoint.machine.pose.named_points import point_positions

        points = point_positions(machine_file.read(path))
    except ToolpointError as error:
        raise ToolpointError(f"{FORMATS.format(path)}; in a YAML file the points of a machine are looked for, but\n{error}"
                             ) from None
    if not points:
        raise ToolpointError(f"{FORMATS.format(path)}; this machine file has no section 'points:'")
    return {int(name) if str(name).lstrip("-").isdigit() else name: place for name, place in points.items()}
