"""Corners that a program rounds or breaks: RND and CHF (Klartext), RND=, RNDM=, CHF=, CHR= (Siemens), ,R and ,C (Fanuc).

The rounding lies between two blocks that meet in their plane: an arc of the radius r tangent to both, its centre where their
parallels at r meet. A chamfer cuts off the same length of both. It is a part of the contour: radius compensation comes after.
"""

from __future__ import annotations

import cmath
import math
import re
from collections.abc import MutableMapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from toolpoint.io.program.language.expressions import ExpressionFault, Reader
from toolpoint.io.program.path.offset import ContourElement, OffsetFault, join_elements
from toolpoint.io.program.path.path_rows import (
    CENTRE_COLUMN,
    END_COLUMN,
    FEED_COLUMN,
    LINE_COLUMN,
    PLANE_COLUMN,
    RAPID_COLUMN,
    START_COLUMN,
    SWEEP_COLUMN,
    TILT_COLUMN,
    Row,
    element_of,
    end_of,
    moves_in_plane,
    plane_of,
    start_of,
)

if TYPE_CHECKING:
    from toolpoint.io.program.language.remarks import Remarks
    from toolpoint.io.program.path.radius_compensation import Compensation
    from toolpoint.io.program.path.segments import Segments

ROUND, LEG, CHAMFER = "rounding", "chamfer by its legs", "chamfer by its length"
_MIN_TURN = 1e-4  # rad: at flatter corners there is nothing to round
_MAX_CORNER_EXCESS = 1e-8  # m, by which a rounding may reach past the end of its block
_LEVEL_TOLERANCE = 1e-9  # m
_SIEMENS_WORD = re.compile(r"\b(RNDM?|CHF|CHR|FRCM?)\s*=\s*")
_FANUC_WORD = re.compile(r",\s*([RC])\s*=?\s*(?=[-+.\d#\[])")


@dataclass(frozen=True)
class Corner:
    """Rounding or chamfer of a corner.

    kind; size : m; line : of the program; feed : m/s, zero for that of the block behind it; is_modal : where it does not fit
    or nothing is to be rounded it is left out without a fault.
    """

    kind: str
    size: float
    line: int
    feed: float = 0.0
    is_modal: bool = False


def take_corner_words(text: str, variables: MutableMapping[str, float], unset: set[str]) -> tuple[str, dict[str, float]]:
    """Return a block without its words of corners, and their values as programmed.

    Raises ExpressionFault for a word without a value.

    >>> take_corner_words("G1 X10 RND=2.5", {}, set())
    ('G1 X10        ', {'RND': 2.5})
    """
    values = dict[str, float]()
    for pattern in (_SIEMENS_WORD, _FANUC_WORD):
        while match := pattern.search(text):
            reader = Reader(text, variables, match.end(), unset)
            values[match[1] if pattern is _SIEMENS_WORD else f",{match[1]}"] = reader.sum()
            # Blanks in place of the word: columns of later faults stay those of the file.
            text = text[:match.start()] + " " * (reader.position - match.start()) + text[reader.position:]
    if "," in text and re.search(r",\s*[A-Z]\s*[-+.\d]", text) and "(" not in text:
        raise ExpressionFault("words behind a comma are ,R and ,C alone")
    return text, values


def round_corners(segments: Segments, remarks: Remarks) -> None:
    """Round and break the corners of the rows that were read; what does not fit is a fault with its line."""
    if not segments.corners:
        return
    rows, inserted = segments.rows, dict[int, Row]()
    for k, corner in sorted(segments.corners.items()):
        j = _row_behind(segments, k)
        wrong = _question(segments, k, j)
        if not wrong and j is not None:
            try:
                replaced = _cut_corner(rows[k], rows[j], corner)
            except OffsetFault as fault:
                wrong = str(fault)
            else:
                if replaced is not None:
                    rows[k], inserted[j], rows[j] = replaced
                continue
        # A rounding for all corners (RNDM) passes over those where it does not fit, as controls do.
        if not corner.is_modal:
            remarks.fault(corner.line, 1, f"a {corner.kind} of {1e3 * corner.size:g} mm: {wrong or 'no block follows it'}")
    _insert(segments, inserted)


def _row_behind(segments: Segments, k: int) -> int | None:
    """Return the next row that moves at all."""
    rows = segments.rows
    return next((j for j in range(k + 1, len(rows)) if rows[j][0] or math.dist(start_of(rows[j]), end_of(rows[j])) > 0), None)


def _question(segments: Segments, k: int, j: int | None) -> str:
    """Return why the corner between two rows cannot be rounded, in words."""
    first = segments.rows[k]
    if j is None:
        return ""
    second, plane = segments.rows[j], plane_of(first)
    third = 3 - sum(plane)
    if first[RAPID_COLUMN] or second[RAPID_COLUMN]:
        return "it stands beside a rapid"
    if plane_of(second) != plane or first[TILT_COLUMN] != second[TILT_COLUMN]:
        return "the blocks beside it lie in two planes"
    is_level = all(abs(start_of(row)[third] - end_of(row)[third]) < _LEVEL_TOLERANCE for row in (first, second))
    if not is_level or not moves_in_plane(first, plane) or not moves_in_plane(second, plane):
        return "the blocks beside it do not both lie in the plane"
    if segments.compensations.get(k) != segments.compensations.get(j):
        return "radius compensation changes there"
    return "it is under tool centre control" if k in segments.directions else ""


def _cut_corner(first: Row, second: Row, corner: Corner) -> tuple[Row, Row, Row] | None:
    """Return both rows cut back and what stands between them; nothing at a corner that is flat."""
    plane = plane_of(first)
    entry, following = element_of(first, plane), element_of(second, plane)
    turn = cmath.phase(following.tangent(is_end=False) / entry.tangent(is_end=True))
    if abs(turn) < _MIN_TURN:
        return None
    if corner.kind == ROUND:
        centre = join_elements(entry, following, math.copysign(corner.size, turn)).leave
        leave, begin = _foot(entry, centre), _foot(following, centre)
    else:
        if entry.centre is not None or following.centre is not None:
            raise OffsetFault("it stands beside an arc; a chamfer is between straight lines")
        leg = corner.size if corner.kind == LEG else corner.size / (2 * math.cos(turn / 2))
        centre, leave = None, entry.end - leg * entry.tangent(is_end=True)
        begin = following.start + leg * following.tangent(is_end=False)
    tail = list(second[PLANE_COLUMN:])
    tail[LINE_COLUMN - PLANE_COLUMN] = corner.line
    tail[FEED_COLUMN - PLANE_COLUMN] = corner.feed or tail[FEED_COLUMN - PLANE_COLUMN]
    start, end = _at(end_of(first), plane, leave), _at(end_of(first), plane, begin)
    if centre is None:
        between: Row = (0, *start, *end, *start, 0.0, *tail)
    else:
        between = (1, *start, *end, *_at(end_of(first), plane, centre),
                   _sweep(leave - centre, begin - centre, math.copysign(1.0, turn)), *tail)
    return _shortened(first, entry, leave, is_end=True), between, _shortened(second, following, begin, is_end=False)


def _foot(element: ContourElement, place: complex) -> complex:
    """Return the place of an element that is nearest to the centre of a rounding."""
    if element.centre is None:
        way = element.tangent(is_end=True)
        return element.start + way * ((place - element.start) * way.conjugate()).real
    ray = place - element.centre
    return element.centre + ray / abs(ray) * abs(element.start - element.centre)


def _sweep(start: complex, end: complex, way: float) -> float:
    return way * ((way * cmath.phase(end / start)) % (2 * math.pi))


def _shortened(row: Row, element: ContourElement, place: complex, *, is_end: bool) -> Row:
    """Return a row that ends, or begins, at a place on it; raises OffsetFault where the place is not on it."""
    plane, out = plane_of(row), list(row)
    fixed = element.start if is_end else element.end
    if element.centre is None:
        way = element.tangent(is_end=True)
        length = ((place - fixed) * way.conjugate()).real * (1 if is_end else -1)
        size = abs(element.end - element.start)
    else:
        radius = abs(element.start - element.centre)
        turn = math.copysign(1.0, element.sweep)
        angle = _sweep(fixed - element.centre, place - element.centre, turn if is_end else -turn)
        length, size = abs(angle) * radius, abs(element.sweep) * radius
        out[SWEEP_COLUMN] = turn * abs(angle)
    if length < -_MAX_CORNER_EXCESS or length > size + _MAX_CORNER_EXCESS:
        raise OffsetFault("the block beside it is too short for it")
    column = END_COLUMN if is_end else START_COLUMN
    out[column + plane[0]], out[column + plane[1]] = place.real, place.imag
    if element.centre is None:
        out[CENTRE_COLUMN:CENTRE_COLUMN + 3] = out[START_COLUMN:START_COLUMN + 3]
    return tuple(out)


def _at(point: Row, plane: tuple[int, int], place: complex) -> Row:
    moved = list(point)
    moved[plane[0]], moved[plane[1]] = place.real, place.imag
    return tuple(moved)


def _insert(segments: Segments, inserted: dict[int, Row]) -> None:
    """Put rows before others, and give what is kept of rows by number its new numbers."""
    rows, index = list[Row](), dict[int, int]()
    compensations = dict(segments.compensations)
    moved: dict[int, Compensation] = {}
    for k, row in enumerate(segments.rows):
        if k in inserted:
            rows.append(inserted[k])
            if k in compensations:
                moved[len(rows) - 1] = compensations[k]
        rows.append(row)
        index[k] = len(rows) - 1
    segments.rows = rows
    segments.compensations = {index[k]: value for k, value in compensations.items()} | moved
    segments.waits = {index[k]: value for k, value in segments.waits.items()}
    segments.unseen = {index[k] for k in segments.unseen}
    segments.directions = {index[k]: value for k, value in segments.directions.items()}
    segments.contour_ends = {index[k]: value for k, value in segments.contour_ends.items()}
