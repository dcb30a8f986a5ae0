"""Bulk data that holds elements and ties, with matrices (DMIG) or without: assembled to stiffness and mass."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.bodies.grid.model import GridModel, GridPart
from toolpoint.bodies.grid.tie import TieEquation
from toolpoint.bodies.imported import ImportedMatrices
from toolpoint.io.door import door
from toolpoint.io.matrices import dmig
from toolpoint.io.matrices.bulk_cards import BulkCard, bulk_cards, bulk_lines
from toolpoint.io.matrices.bulk_elements import ELEMENTS, BulkTables, read_element
from toolpoint.io.matrices.bulk_points import TIE_KEYWORDS, read_places, read_tie
from toolpoint.io.matrices.bulk_sections import SECTION_KEYWORDS, read_material, read_section
from toolpoint.machine.description.matrices import Units

_SUFFIXES = (".bdf", ".nas", ".dat", ".pch")
# Metres and newtons of a system of units whose unit of time is the second.
_LENGTH_AND_FORCE: dict[Units, tuple[float, float]] = {"m-kg-s": (1.0, 1.0), "mm-t-s": (1e-3, 1.0)}
_KEYWORDS = frozenset({*ELEMENTS, *TIE_KEYWORDS, *SECTION_KEYWORDS, "GRID", "GRDSET", "CORD2R", "MAT1", "PELAS", "PBUSH",
                       "PARAM", "SPC", "SPC1"})


def holds_model(path: Path) -> bool:
    """Whether a file is bulk data with grid points, and elements or ties that are read."""
    if path.suffix.lower() not in _SUFFIXES:
        return False
    keywords = {raw.split(",")[0][:8].strip().rstrip("*").upper() for _, _, raw in bulk_lines(path)}
    return "GRID" in keywords and bool(keywords & {*ELEMENTS, *TIE_KEYWORDS})


@door("Nastran bulk data file")
def read(path: Path, names: tuple[str, str] | None = None, *, units: Units = "m-kg-s") -> ImportedMatrices:
    """Return stiffness and mass of bars, rods, springs, bushings and point masses, with the matrices beside them, in SI units.

    Ties (RBE2, RBE3, RBAR, and the MPC that the case control selects) are eliminated; points that follow others stay as `tied`
    coordinates. Supports (SPC) are not applied: a body of a machine is held by its joints.

    names : stiffness and mass among the matrices; else those that K2GG and M2GG select, or whose names begin with K and M.

    Raises ToolpointError with file and line for cards that name what the file lacks, and for what is not read.
    """
    cards = defaultdict(list)
    for card in bulk_cards(path, _KEYWORDS):
        cards[card.keyword].append(card)
    # Defaults of all points are easy to overlook: coordinates would be read in another system without a word.
    for card in cards["GRDSET"]:
        if card.whole(2, 0) or card.whole(6, 0):
            card.refuse("coordinate systems for all points", "must be left out: state those of each GRID")
    control, parameters = _case_control(path), {card.word(1).upper(): card for card in cards["PARAM"]}
    places = read_places(cards["GRID"], cards["CORD2R"])
    is_coupled = "COUPMASS" in parameters and parameters["COUPMASS"].whole(2) > 0
    tables = _tables(cards, places, is_coupled=is_coupled,
                     mass_factor=parameters["WTMASS"].real(2) if "WTMASS" in parameters else 1.0)
    elements = tuple(read_element(card, tables) for keyword in ELEMENTS for card in cards[keyword])
    model = GridModel(places, (*elements, *_matrix_parts(path, names, control)),
                      tuple(_ties(cards, places, control)), _notes(path, cards, is_coupled=is_coupled))
    length, force = _LENGTH_AND_FORCE[units]
    try:
        return model.assemble(length=length, force=force)
    except ToolpointError as error:
        raise ToolpointError(f"{path}: {error}", argument=error.argument) from None


def _case_control(path: Path) -> dict[str, str]:
    """Return what the lines NAME = VALUE of the case control say, by name."""
    control = {}
    for _, _, raw in bulk_lines(path):
        if statement := re.match(r"\s*(MPC|K2GG|M2GG)\s*=\s*(\w+)\s*$", raw.split("$")[0], re.IGNORECASE):
            control[statement.group(1).upper()] = statement.group(2).upper()
    return control


def _tables(cards: dict[str, list[BulkCard]], places: dict[int, FloatArray], *, is_coupled: bool,
            mass_factor: float) -> BulkTables:
    materials = {card.whole(1): read_material(card) for card in cards["MAT1"]}
    return BulkTables(
        places, {card.whole(1): read_section(card, materials) for keyword in SECTION_KEYWORDS for card in cards[keyword]},
        materials, {card.whole(1): card.real(2) for card in cards["PELAS"]},
        {card.whole(1): _bushing_stiffness(card) for card in cards["PBUSH"]}, is_coupled, mass_factor)


def _bushing_stiffness(card: BulkCard) -> FloatArray:
    """Return the six stiffnesses of the group K of a PBUSH."""
    for k in range(2, len(card.fields), 8):
        if card.word(k).upper() == "K":
            if any(card.word(k + 1 + way).upper() == "RIGID" for way in range(6)):
                card.refuse("RIGID", "must be numbers; tie the points by RBE2")
            return np.array(card.reals(range(k + 1, k + 7)))
    card.refuse("no group K", "must state six stiffnesses")


def _matrix_parts(path: Path, names: tuple[str, str] | None, control: dict[str, str]) -> list[GridPart]:
    """Return the stiffness and the mass that stand in the file as matrices."""
    if next(bulk_cards(path, ("DMIG",)), None) is None:
        return []
    matrices = {matrix.name.upper(): matrix for matrix in dmig.read(path)}
    parts = []
    for k, (selection, initial) in enumerate((("K2GG", "K"), ("M2GG", "M"))):
        selected = names[k].upper() if names else control.get(selection)
        fitting = [selected] if selected else [name for name in matrices if name.startswith(initial)]
        if len(fitting) > 1 or (fitting and fitting[0] not in matrices):
            count = str(len(fitting)) if len(fitting) > 1 else "no"
            raise ToolpointError(f"{path}: {count} matrices {selected or initial + '...'} among {', '.join(matrices)}; must be "
                                 "one; give the names of stiffness and mass (--matrices KAA,MAA; names= in Python)")
        for name in fitting:
            matrix = matrices[name].matrix.real
            parts.append(GridPart(matrices[name].rows, matrix if k == 0 else None, matrix if k else None))
    return parts


def _ties(cards: dict[str, list[BulkCard]], places: dict[int, FloatArray], control: dict[str, str]) -> list[TieEquation]:
    selected = control.get("MPC", "")
    chosen = [card for keyword in TIE_KEYWORDS for card in cards[keyword] if keyword != "MPC" or card.word(1) == selected]
    return [tie for card in chosen for tie in read_tie(card, places)]


def _notes(path: Path, cards: dict[str, list[BulkCard]], *, is_coupled: bool) -> tuple[str, ...]:
    """Return what is left out, doubts first, and how masses of bars are laid."""
    notes: list[str] = list(dmig.question_other_cards(path, _KEYWORDS))
    counts = [f"{len(cards[keyword])} {keyword}" for keyword in (*ELEMENTS, *TIE_KEYWORDS) if cards[keyword]]
    bars: Sequence[BulkCard] = [card for keyword in ("CBAR", "CBEAM", "CROD", "CONROD") for card in cards[keyword]]
    notes.append(f"{', '.join(counts)} of {Path(path).name} are in the matrices")
    if bars and not is_coupled:
        notes.append("masses of bars and rods stand half at each end, as the file asks; PARAM,COUPMASS,1 lays them along")
    if supports := [keyword for keyword in ("SPC", "SPC1") if cards[keyword]]:
        notes.append(f"supports ({', '.join(supports)}) are not applied: joints hold a body")
    return tuple(notes)
