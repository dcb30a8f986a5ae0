"""Columns of a text file of frequency responses: told by the line of names before the numbers, never guessed.

A line of names may state units (in brackets, or in a line of their own below), so that um/N, g/N or rad/s are not read as SI.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from toolpoint.io.quantities.sensitivities import QUANTITY_BY_UNIT, motion_over_force
from toolpoint.io.text.column_labels import column_pair, without_pair
from toolpoint.vibration import Dof

QUANTITIES = {"receptance": "receptance", "compliance": "receptance", "flexibility": "receptance", "mobility": "mobility",
              "accelerance": "accelerance", "inertance": "accelerance"}
_MOTION = {"displacement": "receptance", "velocity": "mobility", "acceleration": "accelerance"}
_FREQUENCY_UNITS = {"hz": 1.0, "1/s": 1.0, "khz": 1e3, "rad/s": 1 / (2 * math.pi), "rad/sec": 1 / (2 * math.pi)}
_PHASE_UNITS = {"deg": math.pi / 180, "degree": math.pi / 180, "degrees": math.pi / 180, "°": math.pi / 180, "rad": 1.0,
                "radian": 1.0, "radians": 1.0}
_WORDS = {part: rf"(?<![a-z])(?:{words})(?![a-z])" for part, words in {  # also in H_re, FRF_imag
    "real": r"real[a-z]*|re", "imaginary": r"imag[a-z]*|im", "magnitude": r"mag[a-z]*|amp[a-z]*|abs[a-z]*|modulus|betrag",
    "phase": r"phase[a-z]*|angle|arg|winkel", "coherence": r"coh[a-z]*|gamma[a-z]*"}.items()}
_WORDS["magnitude"] += r"|\|h\|"
_TIME = r"(?:t|time|zeit|temps|tiempo|tempo)(?![a-z])"
_FREQUENCY = r"freq|\bf\b|\bhz\b|\bkhz\b|omega|\bw\b|rad/s"
# A name, and the last brackets as its unit, which may hold brackets of its own: (m/s^2)/N.
_CELL = re.compile(r"^\s*\"?\s*(.*?)\s*(?:[\[(]\s*((?:[^()\[\]]|\([^()]*\))*)\s*[\])])?\s*\"?\s*$")


class HeaderError(ValueError):
    """A line of names that says something else than the reader can take; the message says what, and the way out."""


@dataclass(frozen=True)
class Column:
    """A column: `part` (real, imaginary, magnitude, decibel, phase, complex, coherence) and the SI value of its unit."""

    part: str
    scale: float = 1.0
    quantity: str | None = None
    labels: tuple[Dof, Dof] | None = None
    has_unit: bool = False


@dataclass(frozen=True)
class FrfLayout:
    """Hz in one unit of the first column, the columns behind it, the quantity that is stated, and what is assumed."""

    frequency: float
    columns: tuple[Column, ...]
    quantity: str | None
    notes: tuple[str, ...] = ()
    is_named: bool = False


def read_layout(head: Sequence[Sequence[str]], remarks: str, *, count: int, is_complex: bool) -> FrfLayout:
    """Return the layout of `count` columns.

    Parameters
    ----------
    head : cells of the lines before the numbers, the last one last
    remarks : all text before the numbers, where a quantity may be named
    is_complex : bool
        Whether numbers have the form 1e-6-2e-6j.

    Raises HeaderError for columns that are named as something else, a unit that is not known, a part without its other one.
    """
    names, units = _names_and_units(head, count)
    stated = next((QUANTITIES[word] for word in re.findall(r"[a-z]+", remarks.lower()) if word in QUANTITIES), None)
    pairs = _pairs(head, count)
    parts = [_part(name, unit, is_complex) for name, unit in zip(names[1:], units[1:], strict=True)]
    if not any(part for part in parts if part != "complex"):
        if re.match(_TIME, names[0]):
            raise HeaderError(f"the first column is named {names[0]!r}: times are of a record, not of responses; name the "
                              "columns of a record with their units, for example time [s], force [N], acceleration [m/s^2]")
        return _unnamed(units, is_complex, stated, any(names))
    unclear = [names[k + 1] or f"column {k + 2}" for k, part in enumerate(parts) if part is None]
    # A column is never guessed by its place: a phase taken as an imaginary part gives modes that look right.
    if unclear:
        raise HeaderError(f"column {unclear[0]!r} is not understood; columns are frequency, then real and imaginary, or "
                          "magnitude and phase, for each response, and coherence; name them so, or take the column out")
    columns = [_column(part, pair, unit) for part, pair, unit in zip(parts, pairs[1:], units[1:], strict=True) if part]
    _check_pairs(columns, names[1:])
    quantities = {column.quantity for column in columns if column.quantity} | ({stated} if stated else set())
    if len(quantities) > 1:
        raise HeaderError(f"the names say {' and '.join(sorted(map(str, quantities)))}; must be one quantity")
    scale, note = _frequency(names[0], units[0])
    notes = [note] if note else []
    if any(column.part == "coherence" for column in columns):
        notes.append("a column of coherence is left out: without the number of averages it gives no interval")
    return FrfLayout(scale, tuple(columns), quantities.pop() if quantities else None, tuple(notes), is_named=True)


def _names_and_units(head: Sequence[Sequence[str]], count: int) -> tuple[list[str], list[str]]:
    """Return name and unit of every column from the last lines that have as many cells as there are columns."""
    fitting = [list(line) for line in head if len(line) == count][-2:]
    if not fitting:
        return [""] * count, [""] * count
    cells = [_CELL.match(without_pair(cell)) for cell in fitting[-1]]
    names, units = [m[1].lower() if m else "" for m in cells], [(m[2] or "").strip() if m else "" for m in cells]
    for k, unit in enumerate(units[1:], start=1):
        if unit and not _is_unit(unit):  # Re(H), Phase (unwrapped): words of the name
            names[k], units[k] = f"{names[k]} ({unit.lower()})", ""
    if len(fitting) == 2 and not any(units) and not any(_part(name, "", False) for name in names[1:]):
        above, bare = fitting[0], [cell.strip().strip("[]()\"") for cell in fitting[1]]
        if any(_part(cell.lower(), "", False) for cell in above[1:]):  # a line of names, and one of units below it
            return [cell.strip().strip('"').lower() for cell in above], bare
    return names, units


def _pairs(head: Sequence[Sequence[str]], count: int) -> list[tuple[Dof, Dof] | None]:
    """Return the labels that the name of every column holds, as they are spelled."""
    fitting = [list(line) for line in head if len(line) == count][-2:]
    pairs = [[column_pair(cell) for cell in line] for line in fitting]
    return next((line for line in reversed(pairs) if any(line)), [None] * count)


def _is_unit(text: str) -> bool:
    """Return whether a text in brackets is meant as a unit, known or not."""
    lowered = text.lower()
    return "/" in text or lowered.startswith(("db", "kg")) or lowered in _PHASE_UNITS or lowered in QUANTITY_BY_UNIT


def _part(name: str, unit: str, is_complex: bool) -> str | None:
    """Return what a column is by its name and unit, None where they do not say it."""
    if unit.lower().startswith("db") or re.search(r"\bdb\b", name):
        return "decibel"
    if unit.lower() in _PHASE_UNITS:
        return "phase"
    for part, words in _WORDS.items():
        if re.search(words, name):
            return part
    return "complex" if is_complex else None


def _column(part: str, labels: tuple[Dof, Dof] | None, unit: str) -> Column:
    if part == "coherence":
        return Column(part)
    if part == "phase":
        if unit and unit.lower() not in _PHASE_UNITS:
            raise HeaderError(f"phase in {unit!r}; must be deg or rad")
        return Column(part, _PHASE_UNITS.get(unit.lower(), 1.0), has_unit=bool(unit))
    if part == "decibel":
        unit = re.sub(r"(?i)^db\s*(?:re\s*1?)?\s*|[,()]", "", unit).strip()  # what is left is the reference: dB re 1 m/N
    scale, quantity = _motion_over_force(unit) if unit else (1.0, None)
    return Column(part, scale, quantity, labels, bool(unit))


def _motion_over_force(unit: str) -> tuple[float, str]:
    """Return SI units in a unit such as um/N or (m/s^2)/N, and the quantity that it is of."""
    try:
        scale, motion = motion_over_force(unit)
    except ValueError as error:
        raise HeaderError(str(error)) from None
    return scale, _MOTION[motion]


def _check_pairs(columns: Sequence[Column], names: Sequence[str]) -> None:
    """Raise HeaderError where a part stands without its other one behind it."""
    other = {"real": "imaginary", "magnitude": "phase", "decibel": "phase"}
    parts = [column.part for column in columns if column.part != "coherence"]
    kept = [name for name, column in zip(names, columns, strict=True) if column.part != "coherence"]
    k = 0
    while k < len(parts):
        partner = other.get(parts[k])
        if parts[k] == "complex":
            k += 1
        elif partner is None or parts[k + 1:k + 2] != [partner]:
            raise HeaderError(f"column {kept[k]!r} ({parts[k]}) has no column of {partner or 'its other part'} beside it; a "
                              "response needs both: a magnitude alone, or a phase alone, is none")
        else:
            k += 2


def _frequency(name: str, unit: str) -> tuple[float, str]:
    """Return Hz in one unit of the first column, and a note where its name does not say that it is frequency."""
    lowered = unit.lower()
    if lowered:
        if lowered not in _FREQUENCY_UNITS:
            raise HeaderError(f"the first column is in {unit!r}; must be a frequency in Hz, kHz or rad/s")
        return _FREQUENCY_UNITS[lowered], ""
    if re.search(r"rad/s|omega|\bw\b", name):
        return _FREQUENCY_UNITS["rad/s"], "" if "rad/s" in name else f"the first column, {name!r}, is taken in rad/s"
    if re.search(r"\bkhz\b", name):
        return 1e3, ""
    return 1.0, "" if re.search(_FREQUENCY, name) else f"the first column, {name!r}, is taken as frequency in Hz"


def _unnamed(units: Sequence[str], is_complex: bool, stated: str | None, has_names: bool) -> FrfLayout:
    """Return the layout of columns that no line names: frequency in Hz, then real and imaginary part, or complex numbers."""
    count = len(units)
    if not is_complex and count != 3:
        raise HeaderError(f"{count} columns, and no line before them names them; must be three (Hz, real, imaginary), or "
                          "named: frequency, real, imaginary, magnitude, phase, coherence")
    parts = ["complex"] * (count - 1) if is_complex else ["real", "imaginary"]
    columns = tuple(_column(part, None, unit) for part, unit in zip(parts, units[1:], strict=True))
    quantities = {column.quantity for column in columns if column.quantity} | ({stated} if stated else set())
    if len(quantities) > 1:
        raise HeaderError(f"the units say {' and '.join(sorted(map(str, quantities)))}; must be one quantity")
    scale = _frequency("hz", units[0])[0]
    notes = ("the line before the numbers does not say what the columns are: taken as Hz, real, imaginary",) \
        if has_names and not is_complex else ()
    return FrfLayout(scale, columns, quantities.pop() if quantities else None, notes)
