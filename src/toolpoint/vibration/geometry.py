"""Geometry: places of measured points, and the lines drawn between them."""

from __future__ import annotations

from dataclasses import dataclass

from toolpoint._check import FloatArray
from toolpoint._notebook import NotebookText


@dataclass(frozen=True, eq=False)
class Geometry(NotebookText):
    """Measured points, name or number to coordinates (3,) in m, and pairs of points that a line is drawn between."""

    points: dict[str | int, FloatArray]
    lines: list[tuple[str | int, str | int]]

    def __repr__(self) -> str:
        return f"Geometry({len(self.points)} points, {len(self.lines)} lines)"
