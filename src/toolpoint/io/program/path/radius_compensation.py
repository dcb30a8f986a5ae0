"""Cutter radius compensation, G41, G42 and G40 (ISO), RL, RR and R0 (Klartext): radii of tools, state of the control.

The radius is that of the tool in the spindle, which the program does not hold, or what the program sets: G10 L12 and L13 of a
register D, G41.1 D, TOOL DEF; D0 is none. `path.compensated_rows` offsets the segments by it.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from toolpoint.io.program.path.offset import ContourElement, OffsetFault

if TYPE_CHECKING:
    from toolpoint.cutting.description import CuttingDescription


@dataclass(frozen=True)
class CutterRadii:
    """Radii of the tools, m: of a number, and of every other number; zero where the program holds the path of the centre.

    Examples
    --------
    >>> CutterRadii(0.005, {3: 0.004}).of(3), CutterRadii(0.005).of(1)
    (0.004, 0.005)
    """

    default: float
    by_tool: Mapping[int, float] = field(default_factory=dict)

    def of(self, number: int) -> float:
        """Return the radius of a tool's number, m."""
        return self.by_tool.get(number, self.default)

    @classmethod
    def of_cuts(cls, cut: CuttingDescription, cuts: Mapping[int, CuttingDescription], *, wear_only: bool = False
                ) -> CutterRadii:
        """Return the radii of the tools of cuts; none with `wear_only`: then the program holds the path of the centre."""
        if wear_only:
            return cls(0.0)
        return cls(cut.tool.diameter / 2, {number: other.tool.diameter / 2 for number, other in cuts.items()})


@dataclass(frozen=True)
class Compensation:
    """Compensation of a row: 1 left, -1 right; the radius that the program itself sets, m; intersections at outside corners."""

    side: int
    radius: float | None
    is_mitred: bool


@dataclass(frozen=True)
class ContourEnd:
    """Way to a contour, or from it, beside the radius (Klartext).

    kind : LT, a line of a length (m) along the tangent; LN, square to it; CT, an arc of a radius (m) and an angle (rad); LCT,
    an arc of a radius, tangent to the contour and to the line from where the tool stands, or to where it goes. The radius is
    that of the tool centre's path, negative on the other side of the contour.
    """

    kind: str
    length: float = 0.0
    radius: float = 0.0
    angle: float = 0.0

    def ways(self, contact: complex, tangent: complex, side: int, *, place: complex, is_start: bool) -> list[ContourElement]:
        """Return the ways between a place of the tool's centre and the compensated contour, in the order of motion.

        contact : compensated end of the contour; tangent : of the motion there; side : 1 left, -1 right of the contour; place :
        where the tool comes from, or where it goes (LCT).

        Raises OffsetFault where the place lies inside the arc.
        """
        if self.kind in ("LT", "LN"):
            way = self.length * (tangent if self.kind == "LT" else (-1j if is_start else 1j) * side * tangent)
            lines = [ContourElement(place, contact - way), ContourElement(contact - way, contact)]
            return lines if is_start else [ContourElement(contact, contact + way)]
        turn = side * (1 if self.radius > 0 else -1)
        radius = abs(self.radius)
        centre = contact + 1j * turn * radius * tangent
        if self.kind == "CT":
            sweep = turn * self.angle
            end = centre + (contact - centre) * cmath.exp((-1j if is_start else 1j) * sweep)
        else:
            ray = place - centre
            if abs(ray) < radius:
                raise OffsetFault(f"the tool stands inside the circle of {1e3 * radius:g} mm by which it comes or goes")
            half = math.acos(radius / abs(ray))
            end = centre + radius * ray / abs(ray) * cmath.exp((1j if is_start else -1j) * turn * half)
            swept = cmath.phase((contact - centre) / (end - centre)) * (1 if is_start else -1)
            sweep = turn * ((turn * swept) % (2 * math.pi))
        if is_start:
            return [ContourElement(place, end), ContourElement(end, contact, centre, sweep)]
        arc = ContourElement(contact, end, centre, sweep)
        return [arc, ContourElement(end, place)] if self.kind == "LCT" else [arc]


@dataclass
class CompensationMode:
    """Modal state: side, register D, radius of G41.1 (m), corners; registers that the program sets (geometry and wear, m)."""

    side: int = 0
    register: int | None = None
    radius: float | None = None
    is_mitred: bool = False
    geometry: dict[int, float] = field(default_factory=dict)
    wear: dict[int, float] = field(default_factory=dict)

    def begin(self, side: int, radius: float | None = None) -> None:
        """Begin (1 left, -1 right) or end (0) compensation, with a radius of the block itself (m)."""
        self.side, self.radius = side, radius

    def of_block(self, *, is_mirrored: bool) -> Compensation | None:
        """Return the compensation of a block, on the other side where the program is mirrored; none without."""
        if not self.side:
            return None
        radius = self.radius
        if radius is None and self.register is not None:
            geometry = self.geometry.get(self.register)
            radius = 0.0 if self.register == 0 else None if geometry is None else geometry + self.wear.get(self.register, 0.0)
        return Compensation(-self.side if is_mirrored else self.side, radius, self.is_mitred)
