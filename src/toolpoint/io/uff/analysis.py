"""Set 2414 of universal files: results of an analysis at points, of which mode shapes are read."""

from __future__ import annotations

import math

from toolpoint._check import ToolpointError
from toolpoint.io.uff.sets import UniversalFile, UniversalSet
from toolpoint.io.uff.shape_records import COMPLEX_MODE_ANALYSES, NORMAL_MODE_ANALYSIS, Shape, cells, integers, reals, values

AT_POINTS, DISPLACEMENT_RESULT = 1, 8
_HEADER_LINE_COUNT = 13
# Characters a number: 6E13.5 in single, 3E20.12 in double precision.
_WIDTHS = {2: 13, 4: 20, 5: 13, 6: 20}


def shape(file: UniversalFile, dataset: UniversalSet) -> Shape | None:
    """Return the mode shape of a set 2414, or None, noted, where it holds something else (stresses, a static result)."""
    lines = file.text(dataset).splitlines()
    if len(lines) <= _HEADER_LINE_COUNT:
        raise ToolpointError(f"{file.path}: a set 2414 of {len(lines)} lines; must have {_HEADER_LINE_COUNT} header lines and "
                             "values")
    place = (integers(file, lines[2], 2414) or [0])[0]
    form = integers(file, lines[8], 2414)
    if len(form) < 6 or form[5] < 1:
        raise ToolpointError(f"{file.path}: record 9 {lines[8].strip()!r} of a set 2414; must give six whole numbers, the last "
                             "of them (values a point) above zero")
    analysis, result, data_type, each = form[1], form[3], form[4], form[5]
    if analysis not in (NORMAL_MODE_ANALYSIS,
                        *COMPLEX_MODE_ANALYSES) or place != AT_POINTS or result not in (0, DISPLACEMENT_RESULT):
        file.repaired(f"a set 2414 of analysis type {analysis}, location {place}, result type {result} (no mode shape at "
                      "points) is left out")
        return None
    if data_type not in _WIDTHS:
        raise ToolpointError(f"{file.path}: data type {data_type} of a mode shape in a set 2414; must be 2, 4 (real), 5 or 6 "
                             "(complex)")
    numbers = [number for line in lines[11:13] for number in (*reals(file, " ".join(cells(line, 13)), 2414), *[0.0] * 6)[:6]]
    frequency, ratio, scale = _pole(analysis, numbers)
    is_complex = data_type in (5, 6)
    table = values(file, lines[_HEADER_LINE_COUNT:], each, is_complex=is_complex, width=_WIDTHS[data_type], number=2414)
    return Shape(frequency, ratio, scale, not is_complex, table)


def _pole(analysis: int, numbers: list[float]) -> tuple[float, float, complex]:
    """Return frequency (Hz), damping ratio and modal mass or modal A from records 12 and 13."""
    _, frequency, eigenvalue, mass, viscous, hysteretic = numbers[:6]
    pole = complex(numbers[6], numbers[7])
    if analysis == NORMAL_MODE_ANALYSIS or pole == 0:
        frequency = frequency or math.sqrt(max(eigenvalue, 0.0)) / (2 * math.pi)
        return frequency, viscous or hysteretic / 2, complex(mass)
    return abs(pole) / (2 * math.pi), -pole.real / abs(pole), complex(numbers[8], numbers[9])
