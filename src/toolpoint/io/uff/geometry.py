"""Sets 15, 2411 (points), 82 (lines) and 2412 (elements) of universal files: the measured geometry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail, floats
from toolpoint._notebook import NotebookText
from toolpoint.io.uff import elements
from toolpoint.io.uff.sets import UniversalFile, UniversalSet


@dataclass(frozen=True, eq=False)
class MeasuredGeometry(NotebookText):
    """Points of a measurement and the lines drawn between them.

    Parameters
    ----------
    points : tuple of int
        Point numbers, all different.
    coordinates : (n_points, 3) floats
        m.
    lines : tuple of tuples of int
        Point numbers of every polyline.

    >>> frame = MeasuredGeometry((1, 2, 3), [[0, 0, 0], [1, 0, 0], [1, 1, 0]], lines=((1, 2, 3),))
    >>> frame.coordinates.shape
    (3, 3)
    """

    points: tuple[int, ...]
    coordinates: FloatArray
    lines: tuple[tuple[int, ...], ...] = ()

    def __post_init__(self) -> None:
        points = tuple(int(point) for point in self.points)
        if len(set(points)) != len(points):
            repeated = next(point for point in points if points.count(point) > 1)
            fail("MeasuredGeometry.points", f"point {repeated} twice", "must differ")
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "coordinates",
                           floats("MeasuredGeometry.coordinates", self.coordinates, (len(points), 3)))
        lines = tuple(tuple(int(point) for point in line) for line in self.lines)
        absent_points = sorted({point for line in lines for point in line} - set(points))
        if absent_points:
            fail("MeasuredGeometry.lines", f"point {absent_points[0]}", "must be among the points")
        object.__setattr__(self, "lines", lines)

    def __repr__(self) -> str:
        return f"MeasuredGeometry({len(self.points)} points, {len(self.lines)} lines)"


def geometry(file: UniversalFile, length_factor: float) -> MeasuredGeometry:
    """Return all points and lines of a file in metres."""
    table: dict[int, tuple[float, float, float]] = {}
    lines: list[tuple[int, ...]] = []
    for dataset in file.sets:
        if dataset.number in (15, 2411):
            points = _points_15(file, dataset) if dataset.number == 15 else _points_2411(file, dataset)
            if table.keys() & points.keys():
                file.repaired("points given twice: the last is kept")
            table |= points
        elif dataset.number == 82:
            lines += _lines(file, dataset)
        elif dataset.number == 2412:
            lines += elements.edges(file, dataset)
    if not table:
        raise ToolpointError(f"{file.path}: no set 15 or 2411; a geometry needs points")
    have = set(table)
    drawn_lines = [part for line in lines for part in _known(file, line, have)]
    return MeasuredGeometry(tuple(table), np.array(list(table.values())) / length_factor, tuple(drawn_lines))


def _known(file: UniversalFile, line: tuple[int, ...], have: set[int]) -> list[tuple[int, ...]]:
    if not set(line) <= have:
        file.repaired(f"a line to point {sorted(set(line) - have)[0]}, which has no coordinates, is left out")
        return []
    return [line] if len(line) > 1 else []


def _points_15(file: UniversalFile, dataset: UniversalSet) -> dict[int, tuple[float, float, float]]:
    points = {}
    for line in _records(file, dataset):
        words = line.split()
        if len(words) < 7:  # columns that touch
            words = [line[start:start + width] for start, width in ((0, 10), (10, 10), (20, 10), (30, 10), (40, 13), (53, 13),
                                                          (66, 13))]
        points[_int(file, words[0])] = _three(file, words[4:7])
    return points


def _points_2411(file: UniversalFile, dataset: UniversalSet) -> dict[int, tuple[float, float, float]]:
    lines = _records(file, dataset)
    if len(lines) % 2:
        raise ToolpointError(f"{file.path}: a set 2411 of {len(lines)} lines; must have two for every point")
    points = {}
    for first, second in zip(lines[::2], lines[1::2], strict=True):
        words = second.split()
        words = words if len(words) == 3 else [second[start:start + 25] for start in (0, 25, 50)]
        points[_int(file, first[:10].strip() or first.split()[0])] = _three(file, words)
    return points


def _lines(file: UniversalFile, dataset: UniversalSet) -> list[tuple[int, ...]]:
    records = _records(file, dataset)
    if len(records) < 2:
        raise ToolpointError(f"{file.path}: a set 82 of {len(records)} lines; must have a header, a name and points")
    numbers = [_int(file, word) for line in records[2:] for word in line.split()]
    parts: list[list[int]] = [[]]
    for number in numbers:
        if number == 0:  # the pen is lifted
            parts.append([])
        else:
            parts[-1].append(number)
    return [tuple(part) for part in parts if part]


def _records(file: UniversalFile, dataset: UniversalSet) -> list[str]:
    return [line for line in file.text(dataset).splitlines() if line.strip()]


def _int(file: UniversalFile, word: str) -> int:
    try:
        return int(word)
    except ValueError:
        raise ToolpointError(f"{file.path}: {word.strip()!r} where a point number must stand") from None


def _three(file: UniversalFile, words: list[str]) -> tuple[float, float, float]:
    try:
        x, y, z = (float(word.upper().replace("D", "E")) for word in words)
    except ValueError:
        raise ToolpointError(f"{file.path}: {' '.join(words)!r} where three coordinates must stand") from None
    return x, y, z


def written(shape: MeasuredGeometry) -> bytes:
    """Return the points as a set 2411 (exact to the last bit) and the lines as sets 82, SI."""
    parts = ["    -1\n  2411\n"]
    for point, (x, y, z) in zip(shape.points, shape.coordinates.tolist(), strict=True):
        parts.append(f"{point:10d}{0:10d}{0:10d}{11:10d}\n{x:25.16E}{y:25.16E}{z:25.16E}\n".replace("E", "D"))
    parts.append("    -1\n")
    for number, line in enumerate(shape.lines, start=1):
        parts.append(f"    -1\n    82\n{number:10d}{len(line):10d}{11:10d}\n{'NONE':80s}\n")
        parts += ["".join(f"{point:10d}" for point in line[start:start + 8]) + "\n" for start in range(0, len(line), 8)]
        parts.append("    -1\n")
    return "".join(parts).encode("ascii")
