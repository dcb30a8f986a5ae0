"""Set 55 of universal files: one mode shape at points, and the records that set 2414 shares with it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.io.uff.sets import UniversalFile, UniversalSet

NORMAL_MODE_ANALYSIS, COMPLEX_MODE_ANALYSES = 2, (3, 7)
MOST_EACH = 36  # values a point: a general 6 x 6 tensor has no more


@dataclass(frozen=True, eq=False)
class Shape:
    """One mode shape: frequency (Hz), damping ratio, modal mass or modal A, and values by point and direction (0 .. 5)."""

    frequency: float
    ratio: float
    scale: complex
    real: bool
    values: dict[tuple[int, int], complex]


def shape(file: UniversalFile, dataset: UniversalSet) -> Shape | None:
    """Return the mode shape of a set 55, or None, noted, where it holds something else than a mode."""
    lines = file.text(dataset).splitlines()
    if len(lines) < 9:
        raise ToolpointError(f"{file.path}: a set 55 of {len(lines)} lines; must have 8 header lines and shapes")
    model = integers(file, lines[5])
    if len(model) < 6 or model[5] < 1:
        raise ToolpointError(f"{file.path}: record 6 {lines[5].strip()!r} of a set 55; must give six whole numbers, the last "
                             "of them (values a point) above zero")
    analysis, data_type, each = model[1], model[4], model[5]
    if analysis not in (NORMAL_MODE_ANALYSIS, *COMPLEX_MODE_ANALYSES):
        file.repaired(f"a set 55 of analysis type {analysis} (no mode) is left out")
        return None
    numbers = reals(file, " ".join(cells(lines[7])))
    needed = 4 if analysis == NORMAL_MODE_ANALYSIS else 6
    if len(numbers) < min(needed, 4):
        raise ToolpointError(f"{file.path}: record 8 {lines[7].strip()!r} of a set 55; must hold {needed} numbers: "
                             "frequency or pole, modal mass, damping")
    if analysis == NORMAL_MODE_ANALYSIS:
        frequency, ratio, scale = numbers[0], numbers[2] or numbers[3] / 2, complex(numbers[1])
    else:
        pole = complex(numbers[0], numbers[1])
        frequency, ratio = abs(pole) / (2 * np.pi), -pole.real / abs(pole) if pole else 0.0
        scale = complex(numbers[2], numbers[3])
    is_complex = data_type in (5, 6)
    return Shape(frequency, ratio, scale, not is_complex, values(file, lines[8:], each, is_complex=is_complex))


def values(file: UniversalFile, lines: list[str], each: int, *, is_complex: bool, width: int = 13,
           number: int = 55) -> dict[tuple[int, int], complex]:
    """Return the values of a shape by point and direction from the records behind its head; `width` characters a number."""
    words = each * (2 if is_complex else 1)
    entries: dict[tuple[int, int], complex] = {}
    position = 0
    rows = [line for line in lines if line.strip()]
    while position < len(rows):
        point = integers(file, rows[position], number)[0]
        if each > MOST_EACH:
            raise ToolpointError(f"{file.path}: a set {number} of {each} values a point; must be at most {MOST_EACH}")
        parts: list[float] = []
        while len(parts) < words:
            position += 1
            if position >= len(rows):
                raise ToolpointError(f"{file.path}: the shape of a set {number} ends within point {point}; it is cut short")
            parts += reals(file, " ".join(cells(rows[position], width)), number)
        table = np.array(parts[:words])
        numbers = table[::2] + 1j * table[1::2] if is_complex else table + 0j
        entries |= {(point, way + 1): complex(value) for way, value in enumerate(numbers[:6])}
        position += 1
    return entries


def cells(line: str, width: int = 13) -> list[str]:
    """Return the numbers of a line as words, by columns of `width` where they touch."""
    words = line.split()
    return words if all(len(word) <= width for word in words) else [line[start:start + width]
                                                                    for start in range(0, len(line), width)]


def integers(file: UniversalFile, line: str, number: int = 55) -> list[int]:
    """Return the whole numbers of a line of a set `number`."""
    try:
        return [int(word) for word in line.split()]
    except ValueError:
        raise ToolpointError(f"{file.path}: {line.strip()!r} in a set {number} where whole numbers must stand") from None


def reals(file: UniversalFile, line: str, number: int = 55) -> list[float]:
    """Return the numbers of a line of a set `number`; Fortran's D is read as E, and noted."""
    if "D" in line.upper():
        file.repaired("Fortran D exponents")
    try:
        return [float(word) for word in line.upper().replace("D", "E").split()]
    except ValueError:
        raise ToolpointError(f"{file.path}: {line.strip()!r} in a set {number} where numbers must stand") from None
