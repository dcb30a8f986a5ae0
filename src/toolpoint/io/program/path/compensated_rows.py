"""Rows of a program under radius compensation, offset to the way of the tool's centre.

Compensation begins and ends on straight lines, whose end at the contour is square to it (type A of Fanuc, NORM of Siemens, RL
of Heidenhain). About outside corners the tool goes on an arc (G450), or by intersections after G451. A tool that does not fit
is a fault with its line, as controls give an alarm there.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

from toolpoint._doubt import Doubt
from toolpoint.io.program.path.offset import (
    ContourElement,
    Joint,
    OffsetFault,
    join_elements,
    lead_in_arc,
    place_parallel,
)
from toolpoint.io.program.path.path_rows import (
    END_COLUMN,
    PLANE_COLUMN,
    START_COLUMN,
    STOP_COLUMN,
    TILT_COLUMN,
    Row,
    element_of,
    end_of,
    line_of,
    moves_in_plane,
    plane_of,
    plane_point,
    start_of,
)

if TYPE_CHECKING:
    from toolpoint.io.program.language.remarks import Remarks
    from toolpoint.io.program.path.segments import Segments

MAX_BLOCKS_WITHOUT_PLANE_MOTION = 1  # between two that move in the plane, which all controls look past


def compensate_rows(segments: Segments, remarks: Remarks) -> None:
    """Offset the rows of a program that are compensated; dwells and what else is kept of a row goes with it."""
    if not segments.compensations:
        return
    runs = _list_runs(segments)
    radii = [_radius(segments, rows[0], remarks) for rows in runs]
    if any(radius is None for radius in radii):
        return
    offsets = dict[int, float]()
    for rows, radius in zip(runs, radii, strict=True):
        assert radius is not None
        offsets |= dict.fromkeys(rows, radius * segments.compensations[rows[0]].side)
    # D0 and a radius of zero compensate nothing: the rows stay bit for bit as they were.
    if not any(offsets.values()):
        return
    writer = _Writer(segments, remarks)
    start = 0
    for rows in runs:
        writer.keep(range(start, rows[0]))
        start = rows[-1] + 1
        if offsets[rows[0]] == 0.0:
            writer.keep(rows)
        else:
            writer.offset(rows, offsets[rows[0]], is_mitred=segments.compensations[rows[0]].is_mitred)
    writer.keep(range(start, len(segments.rows)))
    writer.finish()
    numbers = sorted({(segments.tool_of(segments.rows[rows[0]]), radius) for rows, radius in zip(runs, radii, strict=True)
                      if radius})
    tools = ", ".join(f"T{number}: {1e3 * (radius or 0.0):.6g} mm" for number, radius in numbers)
    segments.doubts.append(Doubt(
        "radius compensation", f"the whole radius of the tool is added to the contour in {sum(map(bool, offsets.values()))} "
        f"segments ({tools}), as the program is taken to hold the contour of the part; corners, start and end are those of "
        "NORM and G450", "where it holds the path of the tool's centre and corrects wear alone, say so (`wear_only`)"))


def _list_runs(segments: Segments) -> list[range]:
    """Return the runs of rows with one compensation, tool and plane."""
    runs, first, last_key = list[range](), -1, None
    for k in range(len(segments.rows) + 1):
        compensation = segments.compensations.get(k)
        row = segments.rows[k] if k < len(segments.rows) else ()
        # A change of any of these inside a run is a new run, whose beginning then is refused or noted with its line.
        key = None if compensation is None else (compensation, segments.tool_of(row), plane_of(row), row[TILT_COLUMN])
        if key != last_key:
            if last_key is not None:
                runs.append(range(first, k))
            first, last_key = k, key
    return runs


def _radius(segments: Segments, k: int, remarks: Remarks) -> float | None:
    """Return the radius of the tool of a row, m; nothing, after a fault, where it is not known."""
    stated = segments.compensations[k].radius
    if stated is not None:
        return stated
    number = segments.tool_of(segments.rows[k])
    if segments.cutter_radii is not None:
        return segments.cutter_radii.of(number)
    if number in segments.defined_radii:
        return segments.defined_radii[number]
    remarks.fault(line_of(segments.rows[k]), 1, "cutter radius compensation, and the radius of the tool is not known; give "
                  "`cutter_radius`, or post the program with the path of the tool's centre")
    return None


class _Writer:
    """Rows of the program as the tool's centre goes; `place` is where it stands beside the programmed path, None on it."""

    def __init__(self, segments: Segments, remarks: Remarks) -> None:
        self.segments, self.remarks = segments, remarks
        self.rows: list[Row] = []
        self.index: dict[int, int] = {}
        self.place: complex | None = None
        self.plane, self.tilt, self.last_offset = (0, 1), 0.0, 0.0
        self.ways: dict[int, list[ContourElement]] = {}  # to contours and from them, by the row that stands for them

    def keep(self, rows: Sequence[int]) -> None:
        """Take rows without compensation; the first that moves in the plane ends the one before."""
        for k in rows:
            row = self.segments.rows[k]
            if self.place is None:
                self._write(k, row)
            elif row[TILT_COLUMN] != self.tilt:
                self.remarks.fault(line_of(row), 1, "a plane is tilted while radius compensation is in force; program G40 "
                                   "before it")
            elif not moves_in_plane(row, self.plane):
                self._line(k, self.place)
            else:
                if row[0]:
                    self.remarks.fault(line_of(row), 1, "the end of radius compensation on an arc; program G40 with a "
                                       "straight line")
                self._line(k, plane_point(row, END_COLUMN, self.plane))
                self.place = None

    def offset(self, rows: Sequence[int], offset: float, *, is_mitred: bool) -> None:
        """Take the rows of one compensation: the first that moves in the plane leads to the contour, the others are it."""
        plane = plane_of(self.segments.rows[rows[0]])
        if self.place is not None and offset != self.last_offset:  # the same one goes on behind G28 and G53
            if offset != -self.last_offset or plane != self.plane:
                self.remarks.fault(line_of(self.segments.rows[rows[0]]), 1, "radius or plane of the compensation changed while "
                                   "it is in force; program G40 between")
                return
            self.remarks.note(line_of(self.segments.rows[rows[0]]), "the side of the radius compensation changes in one move: "
                              "the block before ends square to its end, this one leads to the other side, square to its own "
                              "end (Siemens); other controls begin it square to its start")
        self.plane, self.tilt, self.last_offset = plane, self.segments.rows[rows[0]][TILT_COLUMN], offset
        moving = [k for k in rows if moves_in_plane(self.segments.rows[k], plane)]
        if not moving:
            self.keep(rows)
            return
        self._note_blocks_without_motion(rows, moving)
        contour = [k for k in moving[1:] if k not in self.segments.contour_ends]
        elements = [element_of(self.segments.rows[k], plane) for k in contour]
        try:
            joints = [self._join(elements[m - 1:m + 1], contour[m], offset=offset, is_mitred=is_mitred)
                      for m in range(1, len(contour))]
            parallels = self._parallels(elements, joints, contour, offset=offset)
            way = self._ends(moving, elements, parallels, offset=offset)
        except OffsetFault:
            return
        self._follow(rows, way | dict(zip(contour, parallels, strict=True)), dict(zip(contour[1:], joints, strict=True)))

    def _join(self, elements: list[ContourElement], k: int, *, offset: float, is_mitred: bool) -> Joint:
        try:
            return join_elements(elements[0], elements[1], offset, is_mitred=is_mitred)
        except OffsetFault as fault:
            raise self._fault(k, fault) from None

    def _parallels(self, elements: list[ContourElement], joints: list[Joint], contour: list[int], *, offset: float
                   ) -> list[ContourElement]:
        """Return the parallels between the joints; the ends of the contour are square to it."""
        parallels = []
        for m, element in enumerate(elements):
            begin = joints[m - 1].begin if m else element.start + 1j * offset * element.tangent(is_end=False)
            end = joints[m].leave if m < len(joints) else element.end + 1j * offset * element.tangent(is_end=True)
            try:
                parallels.append(place_parallel(element, offset, (begin, end)))
            except OffsetFault as fault:
                raise self._fault(contour[m], fault) from None
        return parallels

    def _ends(self, moving: list[int], elements: list[ContourElement], parallels: list[ContourElement], *, offset: float
              ) -> dict[int, ContourElement]:
        """Return the ways to the contour and from it, by their rows."""
        rows, ends, first = self.segments.rows, self.segments.contour_ends, moving[0]
        entry = element_of(rows[first], self.plane)
        tangent = elements[0].tangent(is_end=False) if elements else entry.tangent(is_end=True)
        contact = parallels[0].start if parallels else entry.end + 1j * offset * tangent
        way = {first: ContourElement(entry.start, contact)}
        if entry.centre is not None:
            try:
                way[first] = lead_in_arc(entry, offset, entry.start if self.place is None else self.place)
            except OffsetFault as fault:
                raise self._fault(first, fault) from None
            self.remarks.note(line_of(rows[first]), "radius compensation begins on an arc: from where the tool stands one arc "
                              "leads to the compensated end, tangent to the contour there (LinuxCNC)")
        side = 1 if offset > 0 else -1
        try:
            if first in ends:
                place = entry.start if self.place is None else self.place
                self.ways[first] = ends[first].ways(contact, tangent, side, place=place, is_start=True)
            if (last := moving[-1]) in ends and last != first and parallels:
                goal = plane_point(rows[last], END_COLUMN, self.plane)
                self.ways[last] = ends[last].ways(parallels[-1].end, elements[-1].tangent(is_end=True), side,
                                                  place=goal, is_start=False)
                way[last] = self.ways[last][-1]
        except OffsetFault as fault:
            raise self._fault(moving[-1], fault) from None
        return way

    def _fault(self, k: int, fault: OffsetFault) -> OffsetFault:
        word = self.remarks.look_ahead
        passed = f"; the program has the control look ahead ({word}), whose way past it is not computed here" if word else ""
        self.remarks.fault(line_of(self.segments.rows[k]), 1, f"{fault}{passed}; a smaller tool, or a contour that it can "
                           "follow")
        return fault

    def _follow(self, rows: Sequence[int], parallels: dict[int, ContourElement], joints: dict[int, Joint]) -> None:
        """Write the rows along their parallels, with the arcs about outside corners before the rows that follow them."""
        for k in rows:
            row = self.segments.rows[k]
            if k not in parallels:
                self._line(k, plane_point(row, START_COLUMN, self.plane) if self.place is None else self.place)
                continue
            joint, parallel = joints.get(k), parallels[k]
            if joint is not None and joint.centre is not None:
                height = start_of(row)
                # An arc about a corner has no row of the program: its number leaves dwells and directions with the rows
                # that have one.
                self._write(-1, self._arc_row(row, ContourElement(joint.leave, joint.begin, joint.centre, joint.sweep),
                                              (height, height), stop=False))
                self.place = joint.begin
            if k in self.ways:
                self._follow_ways(k, self.ways[k])
            elif parallel.centre is None:
                self._line(k, parallel.end)
            else:
                self._write(k, self._arc_row(row, parallel, (start_of(row), end_of(row)),
                                             stop=bool(row[STOP_COLUMN])))
            self.place = parallel.end

    def _follow_ways(self, k: int, ways: list[ContourElement]) -> None:
        """Write the ways to a contour or from it in place of their row: the first at its heights, the others at its end."""
        row = self.segments.rows[k]
        height = end_of(row)
        for number, way in enumerate(ways):
            begin = start_of(row) if number == 0 else height
            if way.centre is not None:
                self._write(k, self._arc_row(row, way, (begin, height), stop=False))
            elif abs(way.end - way.start) > 0:
                place = self._at(begin, way.start)
                self._write(k, (0, *place, *self._at(height, way.end), *place, 0.0, *row[PLANE_COLUMN:]))
        self.place = ways[-1].end

    def _line(self, k: int, end: complex) -> None:
        """Write a row as a line from where the tool stands to a place of the plane, at its own heights."""
        row = self.segments.rows[k]
        start = plane_point(row, START_COLUMN, self.plane) if self.place is None else self.place
        begin = self._at(start_of(row), start)
        self._write(k, (0, *begin, *self._at(end_of(row), end), *begin, 0.0, *row[PLANE_COLUMN:]))

    def _arc_row(self, row: Row, arc: ContourElement, heights: tuple[Row, Row], *, stop: bool) -> Row:
        assert arc.centre is not None
        start, end = self._at(heights[0], arc.start), self._at(heights[1], arc.end)
        centre = self._at(heights[0], arc.centre)
        return (1, *start, *end, *centre, arc.sweep, *row[PLANE_COLUMN:STOP_COLUMN], stop, *row[STOP_COLUMN + 1:])

    def _at(self, point: Sequence[float], place: complex) -> Row:
        moved = list(point)
        moved[self.plane[0]], moved[self.plane[1]] = place.real, place.imag
        return tuple(moved)

    def _write(self, k: int, row: Row) -> None:
        self.rows.append(row)
        self.index[k] = len(self.rows) - 1

    def _note_blocks_without_motion(self, rows: Sequence[int], moving: list[int]) -> None:
        for first, second in pairwise(moving):
            if second - first - 1 > MAX_BLOCKS_WITHOUT_PLANE_MOTION:
                self.remarks.note(line_of(self.segments.rows[first + 1]), f"more than {MAX_BLOCKS_WITHOUT_PLANE_MOTION} "
                                  "block without motion in the plane of the radius compensation: a control that looks no "
                                  "further cuts into the corner before it")

    def finish(self) -> None:
        """Give the rows to the segments, and to dwells and unseen rows their new numbers."""
        segments = self.segments
        if self.remarks.faults:
            return
        segments.rows = self.rows
        segments.waits = {self.index[k]: duration for k, duration in segments.waits.items()}
        segments.unseen = {self.index[k] for k in segments.unseen}
        segments.directions = {self.index[k]: directions for k, directions in segments.directions.items()}


def last_tangent(segments: Segments, plane: tuple[int, int]) -> complex | None:
    """Return the unit tangent at the end of the last row that moves in a plane; none where none does."""
    row = next((row for row in reversed(segments.rows) if moves_in_plane(row, plane)), None)
    return None if row is None else element_of(row, plane).tangent(is_end=True)
