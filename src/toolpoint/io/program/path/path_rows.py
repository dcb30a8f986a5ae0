"""Rows of a program that is being read: their columns, and rows as elements of their plane."""

from __future__ import annotations

import math

from toolpoint.io.program.path.offset import ContourElement

MIN_PLANE_MOTION = 1e-9  # m: below it a block does not move in its plane
Row = tuple[float, ...]
# Columns of a row, see `Segments.line`.
START_COLUMN, END_COLUMN, CENTRE_COLUMN, SWEEP_COLUMN, PLANE_COLUMN = 1, 4, 7, 10, 11
FEED_COLUMN, RAPID_COLUMN, STOP_COLUMN, LINE_COLUMN, TILT_COLUMN = 13, 14, 15, 16, 20


def line_of(row: Row) -> int:
    """Return the line of the program that a row comes from."""
    return int(row[LINE_COLUMN])


def plane_of(row: Row) -> tuple[int, int]:
    """Return the axes of a row's plane."""
    return int(row[PLANE_COLUMN]), int(row[PLANE_COLUMN + 1])


def start_of(row: Row) -> Row:
    """Return the start of a row, m."""
    return row[START_COLUMN:START_COLUMN + 3]


def end_of(row: Row) -> Row:
    """Return the end of a row, m."""
    return row[END_COLUMN:END_COLUMN + 3]


def plane_point(row: Row, column: int, plane: tuple[int, int]) -> complex:
    """Return a point of a row, by its first column, as a complex number of a plane."""
    return complex(row[column + plane[0]], row[column + plane[1]])


def moves_in_plane(row: Row, plane: tuple[int, int]) -> bool:
    """Return whether a row moves in a plane."""
    way = plane_point(row, END_COLUMN, plane) - plane_point(row, START_COLUMN, plane)
    return bool(row[0]) or abs(way) > MIN_PLANE_MOTION


def element_of(row: Row, plane: tuple[int, int]) -> ContourElement:
    """Return a row as an element of its plane."""
    start, end = plane_point(row, START_COLUMN, plane), plane_point(row, END_COLUMN, plane)
    if not row[0]:
        return ContourElement(start, end)
    return ContourElement(start, end, plane_point(row, CENTRE_COLUMN, plane), math.fmod(row[SWEEP_COLUMN], 4 * math.pi))
