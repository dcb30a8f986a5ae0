"""Mode shapes of universal files: read from sets 55 and 2414, written as sets 55, real or complex."""

from __future__ import annotations

import numpy as np

from toolpoint._check import Array, ToolpointError
from toolpoint.io.uff import analysis, shape_records
from toolpoint.io.uff.functions import DIRECTIONS
from toolpoint.io.uff.labels import NumberedLabels
from toolpoint.io.uff.sets import UniversalFile
from toolpoint.io.uff.shape_records import NORMAL_MODE_ANALYSIS
from toolpoint.vibration import Dof, Modes

READERS = {55: shape_records.shape, 2414: analysis.shape}


def modes(file: UniversalFile) -> Modes:
    """Return all mode shapes of a file as one set of modes, lowest first.

    Shapes with a modal mass (real) or modal A (complex) are scaled by it; where one has none, all stay unscaled.
    """
    present = [number for number in READERS if any(dataset.number == number for dataset in file.sets)]
    if len(present) > 1:  # the same modes in the old and the new set
        file.repaired("mode shapes in sets 55 and 2414: those of the sets 55 are read")
    shapes = [READERS[dataset.number](file, dataset) for dataset in file.sets if dataset.number in present[:1]]
    ordered = sorted((shape for shape in shapes if shape is not None), key=lambda shape: shape.frequency)
    if not ordered:
        raise ToolpointError(f"{file.path}: no set 55 or 2414 with mode shapes; it holds {file!r}")
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
    dofs = tuple(file.labels.labelled(Dof(point, DIRECTIONS[way])) for point, way in keys)
    return Modes(np.array([shape.frequency for shape in ordered]), np.array([shape.ratio for shape in ordered]), array, dofs,
                 kind, notes=tuple(file.repairs))


def written(noun: Modes, labels: NumberedLabels | None = None) -> bytes:
    """Return the modes as sets 55 (six digits, as the format has no more); labels : numbers of Dofs that it cannot hold."""
    is_complex = np.iscomplexobj(noun.shape)
    numbers_of_labels = labels or NumberedLabels.of(noun.dofs)
    dofs = [numbers_of_labels.numbered(dof) for dof in noun.dofs]
    points = list(dict.fromkeys(dof.point for dof in dofs))
    rotations = any(dof.is_rotation for dof in dofs)
    each = 6 if rotations else 3
    parts: list[str] = []
    unit = noun.scaling != "unscaled"
    for i in range(noun.count):
        table: dict[object, list[complex]] = {point: [0j] * each for point in points}
        for dof, value in zip(dofs, noun.shape[:, i].tolist(), strict=True):
            axis = int(np.flatnonzero(dof.unit)[0])
            table[dof.point][axis] = complex(value) * float(dof.unit[axis])
        parts.append(_head(noun, i, is_complex, each, unit))
        for point, row in table.items():
            numbers = [part for value in row for part in ((value.real, value.imag) if is_complex else (value.real,))]
            parts.append(f"{point:10d}\n")
            parts += ["".join(f"{number:13.5E}" for number in numbers[start:start + 6]) + "\n"
                      for start in range(0, len(numbers), 6)]
        parts.append("    -1\n")
    return "".join(parts).encode("ascii")


def _head(noun: Modes, i: int, is_complex: bool, each: int, unit: bool) -> str:
    names = "".join(f"{name:80s}\n" for name in (f"mode {i + 1}", "NONE", "NONE", "NONE", "NONE"))
    kind = 3 if is_complex else NORMAL_MODE_ANALYSIS
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
