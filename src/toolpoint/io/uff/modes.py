"""Set 55 of universal files: mode shapes at points, real or complex."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import Array, ToolpointError
from toolpoint.io.uff.functions import DIRECTIONS
from toolpoint.io.uff.sets import UniversalFile, UniversalSet
from toolpoint.vibration import Dof, Modes

NORMAL, COMPLEX = 2, (3, 7)
MOST_EACH = 36  # values a point: a general 6 x 6 tensor has no more


@dataclass(frozen=True, eq=False)
class _Shape:
    frequency: float
    ratio: float
    scale: complex
    real: bool
    values: dict[tuple[int, int], complex]


def modes(file: UniversalFile) -> Modes:
    """Return all mode shapes of a file as one set of modes, lowest first.

    Shapes with a modal mass (real) or modal A (complex) are scaled by it; where one has none, all stay unscaled.
    """
    shapes = [_shape(file, dataset) for dataset in file.sets if dataset.number == 55]
    ordered = sorted((shape for shape in shapes if shape is not None), key=lambda shape: shape.frequency)
    if not ordered:
        raise ToolpointError(f"{file.path}: no set 55 with mode shapes; it holds {file!r}")
    keys = list(dict.fromkeys(key for shape in ordered for key in shape.values))
    table = np.array([[shape.values.get(key, 0j) for shape in ordered] for key in keys])
    moving = np.abs(table).sum(axis=1) > 0
    if not moving.all():
        keys, table = [key for key, keep in zip(keys, moving, strict=True) if keep], table[moving]
    real = all(shape.real for shape in ordered)
    # Among complex modes a real one of modal mass m has the modal A 2 i w m.
    scales = np.array([shape.scale * (2j * 2 * np.pi * shape.frequency * np.sqrt(max(1 - shape.ratio**2, 0.0))
                                      if shape.real and not real else 1.0) for shape in ordered])
    scaled = bool((np.abs(scales) > 0).all())
    table = table / np.sqrt(scales) if scaled else table
    kind = ("unit modal mass" if real else "modal A") if scaled else "unscaled"
    array: Array = table.real if real else table
    return Modes(np.array([shape.frequency for shape in ordered]), np.array([shape.ratio for shape in ordered]), array,
                 tuple(Dof(point, DIRECTIONS[way]) for point, way in keys), kind, notes=tuple(file.repairs))


def _shape(file: UniversalFile, dataset: UniversalSet) -> _Shape | None:
    lines = file.text(dataset).splitlines()
    if len(lines) < 9:
        raise ToolpointError(f"{file.path}: a set 55 of {len(lines)} lines; must have 8 header lines and shapes")
    model = _integers(file, lines[5])
    if len(model) < 6 or model[5] < 1:
        raise ToolpointError(f"{file.path}: record 6 {lines[5].strip()!r} of a set 55; must give six whole numbers, the last "
                             "of them (values a point) above zero")
    analysis, data_type, each = model[1], model[4], model[5]
    if analysis not in (NORMAL, *COMPLEX):
        file.repaired(f"a set 55 of analysis type {analysis} (no mode) is left out")
        return None
    numbers = _reals(file, " ".join(_cells(lines[7])))
    needed = 4 if analysis == NORMAL else 6
    if len(numbers) < min(needed, 4):
        raise ToolpointError(f"{file.path}: record 8 {lines[7].strip()!r} of a set 55; must hold {needed} numbers: "
                             "frequency or pole, modal mass, damping")
    if analysis == NORMAL:
        frequency, ratio, scale = numbers[0], numbers[2] or numbers[3] / 2, complex(numbers[1])
    else:
        pole = complex(numbers[0], numbers[1])
        frequency, ratio = abs(pole) / (2 * np.pi), -pole.real / abs(pole) if pole else 0.0
        scale = complex(numbers[2], numbers[3])
    is_complex = data_type in (5, 6)
    return _Shape(frequency, ratio, scale, not is_complex, _values(file, lines[8:], each, is_complex))


def _values(file: UniversalFile, lines: list[str], each: int, is_complex: bool) -> dict[tuple[int, int], complex]:
    words = each * (2 if is_complex else 1)
    entries: dict[tuple[int, int], complex] = {}
    at = 0
    rows = [line for line in lines if line.strip()]
    while at < len(rows):
        point = _integers(file, rows[at])[0]
        if each > MOST_EACH:
            raise ToolpointError(f"{file.path}: a set 55 of {each} values a point; must be at most {MOST_EACH}")
        cells: list[float] = []
        while len(cells) < words:
            at += 1
            if at >= len(rows):
                raise ToolpointError(f"{file.path}: the shape of a set 55 ends within point {point}; it is cut short")
            cells += _reals(file, " ".join(_cells(rows[at])))
        numbers = np.array(cells[:words])
        values = numbers[::2] + 1j * numbers[1::2] if is_complex else numbers + 0j
        entries |= {(point, way + 1): complex(value) for way, value in enumerate(values[:6])}
        at += 1
    return entries


def _cells(line: str) -> list[str]:
    words = line.split()
    return words if all(len(word) <= 13 for word in words) else [line[at:at + 13] for at in range(0, len(line), 13)]


def _integers(file: UniversalFile, line: str) -> list[int]:
    try:
        return [int(word) for word in line.split()]
    except ValueError:
        raise ToolpointError(f"{file.path}: {line.strip()!r} in a set 55 where whole numbers must stand") from None


def _reals(file: UniversalFile, line: str) -> list[float]:
    if "D" in line.upper():
        file.repaired("Fortran D exponents")
    try:
        return [float(word) for word in line.upper().replace("D", "E").split()]
    except ValueError:
        raise ToolpointError(f"{file.path}: {line.strip()!r} in a set 55 where numbers must stand") from None


def written(noun: Modes) -> bytes:
    """Return the modes as sets 55 (six digits, as the format has no more)."""
    is_complex = np.iscomplexobj(noun.shape)
    points = list(dict.fromkeys(dof.point for dof in noun.dofs))
    rotations = any(dof.is_rotation for dof in noun.dofs)
    each = 6 if rotations else 3
    parts: list[str] = []
    unit = noun.scaling != "unscaled"
    for i in range(noun.count):
        table: dict[object, list[complex]] = {point: [0j] * each for point in points}
        for dof, value in zip(noun.dofs, noun.shape[:, i].tolist(), strict=True):
            axis = int(np.flatnonzero(dof.unit)[0]) if dof.vector is None else -1
            if axis < 0 or not isinstance(dof.point, int):
                raise ToolpointError(f"{dof}: a universal file holds numbered points and the axes x .. rz only")
            table[dof.point][axis] = complex(value) * float(dof.unit[axis])
        parts.append(_head(noun, i, is_complex, each, unit))
        for point, row in table.items():
            numbers = [part for value in row for part in ((value.real, value.imag) if is_complex else (value.real,))]
            parts.append(f"{point:10d}\n")
            parts += ["".join(f"{number:13.5E}" for number in numbers[at:at + 6]) + "\n"
                      for at in range(0, len(numbers), 6)]
        parts.append("    -1\n")
    return "".join(parts).encode("ascii")


def _head(noun: Modes, i: int, is_complex: bool, each: int, unit: bool) -> str:
    names = "".join(f"{name:80s}\n" for name in (f"mode {i + 1}", "NONE", "NONE", "NONE", "NONE"))
    kind = 3 if is_complex else NORMAL
    form = f"{1:10d}{kind:10d}{2 if each == 3 else 3:10d}{8:10d}{5 if is_complex else 2:10d}{each:10d}\n"
    numbers: tuple[float, ...]
    if is_complex:
        s = complex(noun.poles[i])
        a = 1.0 if unit else 0.0
        numbers, count = (s.real, s.imag, a, 0.0, -s.real * a, -s.imag * a), 6
    else:
        ratio = float(noun.damping_ratio[i])
        viscous = noun.damping == "viscous"
        numbers, count = (float(noun.frequency[i]), 1.0 if unit else 0.0, ratio if viscous else 0.0,
                          0.0 if viscous else 2 * ratio), 4
    return (f"    -1\n    55\n{names}{form}{2:10d}{count:10d}{0:10d}{i + 1:10d}\n"
            + "".join(f"{number:13.5E}" for number in numbers) + "\n")
