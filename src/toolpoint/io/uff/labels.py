"""Labels that a universal file has no number for: named points, relative ones (``tip-work``), directions off the axes.

The format knows numbered points and the directions +x .. -rz. Every other Dof is written at a number of its own, and a table
of these numbers (a set of this package, which other programs skip) gives the label back. One rule for functions and shapes.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from toolpoint._check import ToolpointError
from toolpoint.vibration import Dof

LABEL_SET_NUMBER = 705858  # number of the set; the format leaves large ones to programs
MAX_POINT = 2**31 - 1  # largest point number of the format's ten columns that other programs read
_FIRST_LABEL_NUMBER = 900001  # of the numbers given to labels, above those of most tests


@dataclass(frozen=True)
class NumberedLabels:
    """Numbered Dofs as they stand in a file, and the table that leads from their numbers to labels.

    points : number to name of a point; directions : number to a whole Dof whose direction is off the axes.
    """

    points: Mapping[int, str | int] = field(default_factory=dict)
    directions: Mapping[int, Dof] = field(default_factory=dict)

    @classmethod
    def of(cls, dofs: Iterable[Dof], present: NumberedLabels | None = None) -> NumberedLabels:
        """Return the numbers for all labels of a file, beyond those that it gives already; numbered points keep theirs."""
        labels = list(dict.fromkeys(dofs))
        taken = {dof.point for dof in labels if _is_numbered(dof.point)}
        if present is not None:
            taken |= {*present.points, *present.directions}
        free = (number for number in range(_FIRST_LABEL_NUMBER, MAX_POINT) if number not in taken)
        names = dict.fromkeys(dof.point for dof in labels if not _is_numbered(dof.point) and dof.vector is None)
        return cls({next(free): name for name in names}, {next(free): dof for dof in labels if dof.vector is not None})

    def numbered(self, dof: Dof) -> Dof:
        """Return a Dof as it is written: at a numbered point, along an axis."""
        if dof.vector is not None:
            return Dof(next(number for number, label in self.directions.items() if label == dof), "+x")
        if _is_numbered(dof.point):
            return dof
        return Dof(next(number for number, name in self.points.items() if name == dof.point), dof.direction)

    def labelled(self, dof: Dof) -> Dof:
        """Return the label of a Dof as it was written."""
        if dof.point in self.directions:
            label = self.directions[int(dof.point)]
            return label if dof.direction == "+x" else Dof(label.point, dof.direction)
        return Dof(self.points.get(int(dof.point), dof.point), dof.direction)

    def written(self) -> bytes:
        """Return the table as a set; empty where every point is numbered."""
        rows = [json.dumps([number, name]) for number, name in self.points.items()]
        rows += [json.dumps([number, dof.point, dof.direction, dof.vector]) for number, dof in self.directions.items()]
        return ("".join([f"    -1\n{LABEL_SET_NUMBER:6d}\n", *(f"{row}\n" for row in rows), "    -1\n"]) if rows
                else "").encode("ascii")


def parse_labels(lines: Iterable[str], where: str) -> NumberedLabels:
    """Return the labels that the lines of a file's tables give its numbers.

    Raises ToolpointError, naming the file (`where`), for a line that is damaged.
    """
    points: dict[int, str | int] = {}
    directions: dict[int, Dof] = {}
    for line in lines:
        try:
            number, name, *way = json.loads(line)
            if not isinstance(number, int) or not isinstance(name, (str, int)):
                raise ValueError(line)
            if way:
                directions[number] = Dof(name, str(way[0]), tuple(way[1]))
            else:
                points[number] = name
        except (ValueError, TypeError, IndexError, RecursionError, ToolpointError):
            raise ToolpointError(f"{where}: the line {line[:60]!r} of its table of labels (set {LABEL_SET_NUMBER}) is damaged; "
                                 "save the file again") from None
    return NumberedLabels(points, directions)


def _is_numbered(point: str | int) -> bool:
    return isinstance(point, int) and 0 <= point <= MAX_POINT
