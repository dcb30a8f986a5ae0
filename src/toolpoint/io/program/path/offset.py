r"""Contour offset by a tool's radius in its plane: parallel lines and arcs, intersections inside, arcs about outside corners.

Places are complex numbers of the plane, m. The offset d is that of the tool's centre to the left of the motion, negative to the
right: the parallel of a point P with unit tangent t is :math:`P + i d t`, that of an arc of radius R has the radius
:math:`R - d` where it turns left and :math:`R + d` where it turns right.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

_MAX_MITRE_MISMATCH = 1.6e-8  # m: ends of parallels that lie so near normal to the path are joined in their middle
_MAX_REVERSAL = 2e-6  # m, of a segment whose ends have passed each other by the rounding of a program
_REVERSED_TURN = math.pi - 1e-6  # rad: from it on the contour runs back along itself, and the tool goes round its end
_MAX_MITRE_TURN = math.radians(100.0)  # of outside corners with intersections: at sharper ones the tool goes round


class OffsetFault(Exception):
    """Segment or corner that the tool's centre cannot follow."""


@dataclass(frozen=True)
class ContourElement:
    """Line, or arc with a centre and a sweep (rad, positive to the left), in its plane."""

    start: complex
    end: complex
    centre: complex | None = None
    sweep: float = 0.0

    def tangent(self, *, is_end: bool) -> complex:
        """Return the unit tangent at an end."""
        if self.centre is None:
            return (self.end - self.start) / abs(self.end - self.start)
        radius_vector = (self.end if is_end else self.start) - self.centre
        return 1j * math.copysign(1.0, self.sweep) * radius_vector / abs(radius_vector)

    @property
    def curvature(self) -> float:
        """Curvature, 1/m, positive to the left."""
        return 0.0 if self.centre is None else math.copysign(1 / abs(self.start - self.centre), self.sweep)

    def offset_radius(self, offset: float) -> float:
        """Return the radius of the parallel of an arc, m; below zero where the tool is too large for it."""
        assert self.centre is not None
        return abs(self.start - self.centre) - math.copysign(1.0, self.sweep) * offset


@dataclass(frozen=True)
class Joint:
    """Centre of the tool at a corner: where it leaves one segment and begins the next; between them an arc about `centre`."""

    leave: complex
    begin: complex
    centre: complex | None = None
    sweep: float = 0.0


def join_elements(first: ContourElement, second: ContourElement, offset: float, *, is_mitred: bool = False) -> Joint:
    """Return the way of the tool's centre past the corner between two segments.

    is_mitred : outside corners of at most 100 degrees are intersections too, in place of arcs.

    Raises OffsetFault where the parallels do not meet inside the corner.

    Examples
    --------
    Around a square corner, outside: a quarter of a circle.

    >>> joint = join_elements(ContourElement(0, 1), ContourElement(1, 1 - 1j), 0.5)
    >>> joint.leave, joint.begin, round(joint.sweep / math.pi, 6)
    ((1+0.5j), (1.5+0j), -0.5)
    """
    corner, first_way, second_way = first.end, first.tangent(is_end=True), second.tangent(is_end=False)
    turn = cmath.phase(second_way / first_way)
    bisector = first_way + second_way
    if abs(turn) > _REVERSED_TURN:  # a cusp: a valley where the segment behind it bends to the tool's side of the one before
        is_outside = offset * (first.curvature + second.curvature) >= 0
    else:
        is_outside = turn * offset < 0
    # Rounding of programmed coordinates turns tangents of smooth contours a little: arcs of nanometres between would be
    # noise.
    if abs(offset) * turn * turn < _MAX_MITRE_MISMATCH:
        place = corner + 1j * offset * bisector / (abs(bisector) * math.cos(turn / 2))
        return Joint(place, place)
    if is_outside and not (is_mitred and abs(turn) < _MAX_MITRE_TURN):
        return Joint(corner + 1j * offset * first_way, corner + 1j * offset * second_way, corner, -math.copysign(turn, offset))
    places = _intersections(first, second, offset)
    if not places:
        raise OffsetFault(f"the tool of {1e3 * abs(offset):g} mm radius does not fit into the corner")
    # Into the corner: the way in which the direction changes, of small turns the normal.
    inwards = 1j * offset * bisector if abs(turn) < 1 or is_outside else abs(offset) * (second_way - first_way)
    middle = corner + abs(offset) * inwards / abs(inwards)
    # A circle is met twice: the place at the corner is the one nearest to its bisector.
    place = min(places, key=lambda candidate: abs(candidate - middle))
    return Joint(place, place)


def _intersections(first: ContourElement, second: ContourElement, offset: float) -> list[complex]:
    """Return where the parallels of two segments meet, both taken beyond their ends."""
    if first.centre is None and second.centre is None:
        first_way, second_way = first.tangent(is_end=True), second.tangent(is_end=False)
        begin, end = first.end + 1j * offset * first_way, second.start + 1j * offset * second_way
        return [begin + first_way * ((end - begin) * second_way.conjugate()).imag / (first_way * second_way.conjugate()).imag]
    if first.centre is None:
        return _line_and_circle(first, second, offset)
    return _line_and_circle(second, first, offset) if second.centre is None else _two_circles(first, second, offset)


def _line_and_circle(line: ContourElement, arc: ContourElement, offset: float) -> list[complex]:
    assert arc.centre is not None
    direction = line.tangent(is_end=True)
    begin = line.start + 1j * offset * direction
    along = (arc.centre - begin) * direction.conjugate()  # of the centre: along the line, and beside it
    squared = arc.offset_radius(offset) ** 2 - along.imag**2
    if squared < 0:
        return []
    return [begin + direction * (along.real + sign * math.sqrt(squared)) for sign in (-1.0, 1.0)]


def _two_circles(first: ContourElement, second: ContourElement, offset: float) -> list[complex]:
    assert first.centre is not None and second.centre is not None
    between, radius = second.centre - first.centre, first.offset_radius(offset)
    distance = abs(between)
    if distance == 0:
        return []
    along = (distance**2 + radius**2 - second.offset_radius(offset) ** 2) / (2 * distance)
    squared = radius**2 - along**2
    if squared < 0:
        return []
    return [first.centre + between / distance * (along + 1j * sign * math.sqrt(squared)) for sign in (-1.0, 1.0)]


def place_parallel(element: ContourElement, offset: float, ends: tuple[complex, complex]) -> ContourElement:
    """Return the parallel of a segment between two places on it.

    Raises OffsetFault for an arc that is too small for the tool, and for a segment that is too short beside its corners.
    """
    begin, end = ends
    if element.centre is None:
        if ((end - begin) * element.tangent(is_end=True).conjugate()).real < -_MAX_REVERSAL:
            raise OffsetFault(f"the tool of {1e3 * abs(offset):g} mm radius does not reach this segment: the corners beside it "
                              "leave nothing of it")
        return ContourElement(begin, end)
    radius = element.offset_radius(offset)
    if radius < -_MAX_REVERSAL:
        raise OffsetFault(f"the tool of {1e3 * abs(offset):g} mm radius does not fit into an arc of "
                          f"{1e3 * abs(element.start - element.centre):g} mm radius")
    if radius < _MAX_REVERSAL:  # the tool turns on the spot
        return ContourElement(begin, end)
    way = math.copysign(1.0, element.sweep)
    # By angles from both ends, not from the begin to the end: an arc of more than half a turn keeps its sense.
    late = cmath.phase((begin - element.centre) / (element.start - element.centre))
    early = cmath.phase((element.end - element.centre) / (end - element.centre))
    sweep = element.sweep - late - early
    if way * sweep * radius < -_MAX_REVERSAL:
        raise OffsetFault(f"the tool of {1e3 * abs(offset):g} mm radius does not reach this arc: the corners beside it leave "
                          "nothing of it")
    return ContourElement(begin, end, element.centre, sweep) if way * sweep > 0 else ContourElement(begin, end)


def lead_in_arc(element: ContourElement, offset: float, start: complex) -> ContourElement:
    """Return the arc from a place of the tool's centre to the end of a contour's arc, tangent there beside it by the offset.

    Its centre lies on the normal of the contour at the end, as far from the start as from the end.

    Raises OffsetFault where no such arc turns as the contour's does.

    >>> arc = lead_in_arc(ContourElement(0, 1 + 1j, 1j, math.pi / 2), 0.5, 0)
    >>> round(abs(arc.start - arc.centre), 6), round(abs(arc.end - arc.centre), 6)
    (1.25, 1.25)
    """
    tangent = element.tangent(is_end=True)
    end = element.end + 1j * offset * tangent
    normal, way = 1j * tangent, start - end
    across = (way * normal.conjugate()).real
    radius = abs(way) ** 2 / (2 * across) if across else math.inf
    if not math.isfinite(radius) or radius * element.sweep <= 0 or element.offset_radius(offset) <= 0:
        raise OffsetFault(f"no arc leads the tool of {1e3 * abs(offset):g} mm radius from where it stands to the end of "
                          "this one")
    centre, turn = end + radius * normal, math.copysign(1.0, element.sweep)
    sweep = (turn * cmath.phase((end - centre) / (start - centre))) % (2 * math.pi)
    return ContourElement(start, end, centre, turn * sweep)
