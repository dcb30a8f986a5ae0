"""Elements of bulk data beside matrices: bars, rods, springs, bushings and point masses, as parts of a grid model."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.bodies.grid.bar import BarSection, bar_frame
from toolpoint.bodies.grid.model import Bar, GridPart, bar_part, bushing_part, mass_part, spring_part
from toolpoint.bodies.grid.tie import WAYS
from toolpoint.io.matrices.bulk_cards import BulkCard
from toolpoint.io.matrices.bulk_points import Places, place_of
from toolpoint.io.matrices.bulk_sections import BulkMaterial, rod_section
from toolpoint.vibration import Dof

_Value = TypeVar("_Value")


@dataclass(frozen=True, eq=False)
class BulkTables:
    """Tables that elements refer to: places, sections, materials, and stiffnesses of PELAS and PBUSH, each by number.

    is_coupled : whether masses of bars lie along them; mass_factor : of all masses (PARAM,WTMASS).
    """

    places: Places
    sections: Mapping[int, BarSection]
    materials: Mapping[int, BulkMaterial]
    springs: Mapping[int, float]
    bushings: Mapping[int, FloatArray]
    is_coupled: bool
    mass_factor: float


def read_element(card: BulkCard, tables: BulkTables) -> GridPart:
    """Return what an element adds. Raises ToolpointError with its line for what it names and the file lacks."""
    try:
        return ELEMENTS[card.keyword](card, tables)
    except ToolpointError as error:
        raise card.with_line(error) from None


def _bar(card: BulkCard, tables: BulkTables) -> GridPart:
    section = _named(card, tables.sections, "property")
    ends = (card.whole(3), card.whole(4))
    start, end = (place_of(card, point, tables.places) for point in ends)
    along = bar_frame(start, end, _any_across(end - start))
    toward, flag = _orientation(card, tables.places, start, along), card.word(8).upper() or "GGG"
    if set(flag) - {"G", "O"} or len(flag) != 3:
        card.refuse(f"OFFT {flag}", "must be three letters of G and O")
    offsets = np.array(card.reals(range(11, 17))).reshape(2, 3)
    for k in range(2):
        if flag[1 + k] == "O":  # offsets in the element's own axes
            offsets[k] = offsets[k] @ bar_frame(start, end, toward)
    hinges = tuple(6 * side + int(letter) - 1 for side in (0, 1) for letter in card.word(9 + side) if letter in "123456")
    return bar_part(tables.places, Bar(ends, section, toward, offsets, hinges), is_coupled=tables.is_coupled)


def _orientation(card: BulkCard, places: Places, start: FloatArray, axes: FloatArray) -> FloatArray:
    """Return the vector into plane 1: by components, or by a grid point."""
    # One field alone that is a whole number is a grid point; a vector has a point or three components.
    if card.word(5) and not card.word(6) and not card.word(7) and card.word(5).isdigit():
        return place_of(card, card.whole(5), places) - start
    vector = np.array(card.reals((5, 6, 7)))
    if not vector.any():
        card.refuse("no orientation vector", "must have X1, X2, X3 or a grid point G0")
    return vector @ axes if card.word(8).upper().startswith("O") else vector


def _any_across(along: FloatArray) -> FloatArray:
    # The axis that is least along the bar: any other may lie on it, and the planes of a round bar do not matter.
    return np.eye(3)[int(np.argmin(np.abs(along)))]


def _rod(card: BulkCard, tables: BulkTables) -> GridPart:
    if card.keyword == "CONROD":
        section, ends = rod_section(card, tables.materials), (card.whole(2), card.whole(3))
    else:
        section, ends = _named(card, tables.sections, "property"), (card.whole(3), card.whole(4))
    start, end = (place_of(card, point, tables.places) for point in ends)
    return bar_part(tables.places, Bar(ends, section, _any_across(end - start)), is_coupled=tables.is_coupled)


def _scalar_spring(card: BulkCard, tables: BulkTables) -> GridPart:
    is_stated = card.keyword == "CELAS2"
    stiffness = card.real(2) if is_stated else _named(card, tables.springs, "property")
    ends = [Dof(card.whole(k), WAYS[max(card.whole(k + 1, 0) - 1, 0)]) if card.word(k) not in ("", "0") else None
            for k in (3, 5)]
    if not any(ends):
        card.refuse("no grid point", "must have one or two")
    return spring_part(ends, stiffness)


def _bushing(card: BulkCard, tables: BulkTables) -> GridPart:
    stiffness = _named(card, tables.bushings, "property")
    ends = [card.whole(3), *([card.whole(4)] if card.word(4) not in ("", "0") else [])]
    start, end = (place_of(card, point, tables.places) for point in (ends[0], ends[-1]))
    system, share = card.whole(8, -1), card.real(9, 0.5)
    if card.word(10) not in ("", "-1"):
        card.refuse("an offset system OCID", "must be left out")
    if system > 0:
        card.refuse(f"coordinate system {system}", "must be the basic one (0), or an orientation vector")
    axes: FloatArray = np.eye(3)
    if system != 0 and (card.words(5) or not np.allclose(start, end)):
        toward = _orientation(card, tables.places, start, np.eye(3)) if card.words(5) else _any_across(end - start)
        axes = bar_frame(start, end, toward)
    return bushing_part(tables.places, ends, centre=start + share * (end - start), axes=axes, stiffness=stiffness)


def _point_mass(card: BulkCard, tables: BulkTables) -> GridPart:
    point, system = card.whole(2), card.whole(3, 0)
    place = place_of(card, point, tables.places)
    if system > 0:
        card.refuse(f"coordinate system {system}", "must be the basic one (0 or -1)")
    mass, offset = card.real(4, 0.0), np.array(card.reals((5, 6, 7)))
    # The lower triangle in the order 11, 21, 22, 31, 32, 33; products are stated with the sign of sums.
    xx, xy, yy, xz, yz, zz = card.reals(range(9, 15))
    inertia = np.array([[xx, -xy, -xz], [-xy, yy, -yz], [-xz, -yz, zz]])
    if mass < 0:
        card.refuse(f"mass {mass:g}", "must not be negative")
    return mass_part(point, tables.mass_factor * mass, offset=offset - place if system == -1 else offset,
                     inertia=tables.mass_factor * inertia)


def _named(card: BulkCard, values: Mapping[int, _Value], what: str) -> _Value:
    number = card.whole(2, card.whole(1))
    if number not in values:
        card.refuse(f"{what} {number}", "must be in this file")
    return values[number]


ELEMENTS: dict[str, Callable[[BulkCard, BulkTables], GridPart]] = {
    "CBAR": _bar, "CBEAM": _bar, "CROD": _rod, "CONROD": _rod, "CELAS1": _scalar_spring, "CELAS2": _scalar_spring,
    "CBUSH": _bushing, "CONM2": _point_mass}
