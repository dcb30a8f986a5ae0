"""Universal files (UNV, UFF): sets 15, 55, 58, 58b, 82, 151, 164, 2411 read and written; SI inside.

Files are opened lazily (`UniversalFile` reads delimiters and headers only), read tolerantly with every repair reported,
and written in one pass.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from toolpoint._check import Array, FloatArray, ToolpointError, ToolpointWarning, one_of
from toolpoint.io.door import door
from toolpoint.io.uff import functions, geometry, modes
from toolpoint.io.uff.functions import COHERENCE, KINDS, RESPONSE, TIME, FunctionHeader
from toolpoint.io.uff.geometry import MeasuredGeometry
from toolpoint.io.uff.sets import UniversalFile, UniversalSet
from toolpoint.vibration import Dof, Frf, Modes, Record
from toolpoint.vibration.frf import QUANTITIES

__all__ = ["MeasuredGeometry", "Units", "UniversalFile", "headers", "read_frf", "read_geometry", "read_modes",
           "read_record", "units", "write"]

NUMERATOR = {"receptance": 8, "mobility": 11, "accelerance": 12}
CODES = {"displacement": 8, "velocity": 11, "acceleration": 12, "force": 13}
GRAVITY = 9.80665


@dataclass(frozen=True)
class Units:
    """Factors of set 164: a value in SI is the file's value over its factor."""

    length: float = 1.0
    force: float = 1.0
    stated: bool = False


def units(file: UniversalFile) -> Units:
    """Return the units of a file; SI, and a repair noted, where it states none."""
    for dataset in file.sets:
        if dataset.number == 164:
            words = file.text(dataset).upper().replace("D", "E").splitlines()
            words = " ".join(words[1:]).split()
            try:
                length, force = float(words[0]), float(words[1])
            except (IndexError, ValueError):
                raise ToolpointError(f"{file.path}: the units set 164 holds no factors of length and force") from None
            if length <= 0 or force <= 0:
                raise ToolpointError(f"{file.path}: the units set 164 has factors {length:g} and {force:g}; must be "
                                     "above zero")
            return Units(length, force, True)
    file.repaired("no units set 164: SI units are assumed")
    return Units()


@door("universal file")
def headers(path: str | Path) -> list[FunctionHeader]:
    """Return the headers of all functions of a file, without reading their values."""
    file = UniversalFile(path)
    return [functions.header(file, dataset) for dataset in file.sets if dataset.number == 58]


@door("universal file")
def read_frf(path: str | Path | UniversalFile, quantity: str | None = None) -> Frf:
    """Return all frequency responses of a file as one Frf; coherences beside them where there is one for each.

    Parameters
    ----------
    path : path or UniversalFile
    quantity : str, optional
        ``receptance``, ``mobility`` or ``accelerance`` where the file does not say (specific data type 0).

    Raises
    ------
    ToolpointError
        For a file that is no universal file, without responses, with unequal axes, a response that is missing or there
        twice, or values that are not finite. Repairs give a ToolpointWarning and stand in `notes`.
    """
    file = path if isinstance(path, UniversalFile) else UniversalFile(path)
    scale = units(file)
    every = [(dataset, functions.header(file, dataset)) for dataset in file.sets if dataset.number == 58]
    responses = [(dataset, head) for dataset, head in every if head.kind == RESPONSE]
    if not responses:
        raise ToolpointError(f"{file.path}: no frequency response (set 58 of function type 4); it holds {file!r}")
    kind = _quantity(file, [head for _, head in responses], quantity)
    frequency, values, rows, columns = _table(file, responses)
    values = (values * (scale.force / scale.length) * _gravity(file, responses[0][1])).astype(complex, copy=False)
    coherences = [(dataset, head) for dataset, head in every if head.kind == COHERENCE]
    coherence = _coherence(file, coherences, frequency, rows, columns)
    _report(file)
    return Frf(frequency, values, rows, columns, kind, coherence=coherence, notes=tuple(file.repairs))


def _quantity(file: UniversalFile, heads: list[FunctionHeader], given: str | None) -> str:
    kinds = {head.numerator for head in heads}
    names = {code: name for name, code in NUMERATOR.items()}
    stated = {names[kind] for kind in kinds if kind in names}
    if len(kinds) > 1 and len(stated) > 1:
        raise ToolpointError(f"{file.path}: responses of different quantities, {', '.join(sorted(stated))}; split the "
                             "file")
    swapped = [KINDS[head.denominator] for head in heads if head.denominator in names]
    swapped += ["force over another channel" for head in heads if KINDS.get(head.numerator) == "force"]
    if swapped:
        if given is None:
            raise ToolpointError(f"{file.path}: {len(swapped)} of {len(heads)} responses are stated as "
                                 f"{'motion over ' * (swapped[0] in CODES)}{swapped[0]}; must be motion over force: the "
                                 "channels may be swapped; measure again, or state the quantity if only the labels are wrong")
        file.repaired(f"{len(swapped)} responses are not stated as motion over force; read as {given} on request")
    if given is not None:
        one_of("quantity", given, QUANTITIES)
        if stated and stated != {given}:
            file.repaired(f"the file says {stated.pop()}, read as {given} on request")
        return given
    if not stated:
        raise ToolpointError(f"{file.path}: the responses do not say whether they are displacement, velocity or "
                             "acceleration; give quantity='accelerance' or another")
    return stated.pop()


def _gravity(file: UniversalFile, head: FunctionHeader) -> float:
    if head.numerator_unit.strip().lower() in ("g", "g's", "gs"):
        file.repaired("acceleration in g converted to m/s^2")
        return GRAVITY
    return 1.0


def _table(file: UniversalFile, parts: list[tuple[UniversalSet, FunctionHeader]]) -> tuple[
        FloatArray, Array, tuple[Dof, ...], tuple[Dof, ...]]:
    rows = tuple(dict.fromkeys(head.response for _, head in parts))
    columns = tuple(dict.fromkeys(_reference(file, head) for _, head in parts))
    row_at, column_at = {dof: i for i, dof in enumerate(rows)}, {dof: i for i, dof in enumerate(columns)}
    frequency: FloatArray = np.empty(0)
    values: Array = np.empty(0)
    filled = np.zeros((len(rows), len(columns)), bool)
    for dataset, head in parts:
        axis, data = functions.values(file, dataset, head)
        if not np.isfinite(data).all():
            line = int(np.argmin(np.isfinite(data)))
            raise ToolpointError(f"{file.path}: {head.response} / {head.reference} is not finite at {axis[line]:g} Hz (value "
                                 f"{line + 1} of {data.size}); measure it again or take the response out")
        if not filled.any():
            # One contiguous run for each response while reading; turned to lines first at the end.
            frequency, values = axis, np.empty((len(rows), len(columns), axis.size), data.dtype)
        if not (np.array_equal(axis, frequency) or (axis.size == frequency.size and np.allclose(axis, frequency, rtol=1e-6))):
            raise ToolpointError(f"{file.path}: {head.response} / {head.reference} has {axis.size} lines, "
                                 f"{axis[0]:g} .. {axis[-1]:g} Hz, beside {frequency.size}, {frequency[0]:g} .. "
                                 f"{frequency[-1]:g} Hz; axes must be equal; split the file")
        at = row_at[head.response], column_at[_reference(file, head)]
        if filled[at]:
            raise ToolpointError(f"{file.path}: {head.response} / {head.reference} is there twice; remove one")
        if np.iscomplexobj(data) and not np.iscomplexobj(values):
            values = values.astype(complex)
        values[at], filled[at] = data, True
    if not filled.all():
        row, column = np.argwhere(~filled)[0]
        raise ToolpointError(f"{file.path}: {int((~filled).sum())} of {filled.size} responses are missing, the first "
                             f"{rows[row]} / {columns[column]}; read fewer references or complete the file")
    return frequency, values.transpose(2, 0, 1), rows, columns


def _reference(file: UniversalFile, head: FunctionHeader) -> Dof:
    if head.reference is None:
        raise ToolpointError(f"{file.path}: the response of {head.response} names no reference point; a frequency "
                             "response needs one")
    return head.reference


def _coherence(file: UniversalFile, coherences: list[tuple[UniversalSet, FunctionHeader]], frequency: FloatArray,
               rows: tuple[Dof, ...], columns: tuple[Dof, ...]) -> FloatArray | None:
    if not coherences:
        return None
    try:
        axis, values, have_rows, have_columns = _table(file, coherences)
    except ToolpointError as error:
        file.repaired(f"coherences left out: {str(error).split(': ', 1)[-1]}")
        return None
    if set(have_rows) != set(rows) or set(have_columns) != set(columns) or axis.size != frequency.size:
        file.repaired("coherences left out: not one for each response")
        return None
    order = np.ix_([have_rows.index(dof) for dof in rows], [have_columns.index(dof) for dof in columns])
    return np.clip(values.real[:, order[0], order[1]], 0.0, 1.0)


@door("universal file")
def read_record(path: str | Path | UniversalFile) -> Record:
    """Return all time records of a file (function type 1) as one Record; SI."""
    file = path if isinstance(path, UniversalFile) else UniversalFile(path)
    scale = units(file)
    records = [(dataset, head) for dataset in file.sets if dataset.number == 58
             for head in [functions.header(file, dataset)] if head.kind == TIME]
    if not records:
        raise ToolpointError(f"{file.path}: no time record (set 58 of function type 1); it holds {file!r}")
    columns, kinds, axes = [], [], []
    for dataset, head in records:
        axis, data = functions.values(file, dataset, head)
        kind = KINDS.get(head.numerator, "unknown")
        factor = scale.force if kind == "force" else scale.length if kind != "unknown" else 1.0
        columns.append(np.real(data) / factor * (_gravity(file, head) if kind == "acceleration" else 1.0))
        kinds.append(kind)
        axes.append(axis)
    step = _step(file, axes)
    _report(file)
    return Record(np.stack(columns, axis=1), 1 / step, tuple(head.response for _, head in records), tuple(kinds),
                  start=float(axes[0][0]), name=file.path.stem)


def _step(file: UniversalFile, axes: list[FloatArray]) -> float:
    first = axes[0]
    if any(axis.size != first.size or not np.allclose(axis, first, rtol=1e-6, atol=1e-9) for axis in axes[1:]):
        raise ToolpointError(f"{file.path}: time records with unequal axes; must share start, step and length")
    step = float((first[-1] - first[0]) / (first.size - 1)) if first.size > 1 else 0.0
    if step <= 0 or np.abs(np.diff(first) - step).max() > 1e-3 * step:
        raise ToolpointError(f"{file.path}: time step {step:g} s; must be above zero and even")
    return step


@door("universal file")
def read_geometry(path: str | Path | UniversalFile) -> MeasuredGeometry:
    """Return points (m) and lines of a file."""
    file = path if isinstance(path, UniversalFile) else UniversalFile(path)
    shape = geometry.geometry(file, units(file).length)
    _report(file)
    return shape


@door("universal file")
def read_modes(path: str | Path | UniversalFile) -> Modes:
    """Return the mode shapes (sets 55) of a file; see `modes.modes`."""
    file = path if isinstance(path, UniversalFile) else UniversalFile(path)
    result = modes.modes(file)
    _report(file)
    return result


def _report(file: UniversalFile) -> None:
    if file.repairs:
        warnings.warn(f"{file.path}: {'; '.join(file.repairs)}", ToolpointWarning, stacklevel=3)


def write(path: str | Path, *items: Frf | Record | Modes | MeasuredGeometry, text: bool = False,
          append: bool = False) -> None:
    """Write responses, records, modes and geometry to a universal file in SI.

    Parameters
    ----------
    path : path
    items : Frf, Record, Modes or MeasuredGeometry
        Points must be numbered. Several Frf may share a file if their Dofs differ.
    text : bool
        Functions as text (set 58, 13 digits) instead of binary (58b, exact to the last bit).
    append : bool
        Behind what the file holds, instead of in its place.
    """
    parts = [] if append else [_title(), _si()]
    for item in items:
        parts += _parts(item, text)
    with Path(path).open("ab" if append else "wb") as file:
        file.writelines(parts)


def _parts(item: Frf | Record | Modes | MeasuredGeometry, text: bool) -> Iterable[bytes]:
    if isinstance(item, Frf):
        return _responses(item, text)
    if isinstance(item, Record):
        return [functions.written(TIME, dof, None, numerator=CODES.get(kind, 0), denominator=0, abscissa=item.time,
                                  data=item.samples[:, i], text=text,
                                      units=(unit or "NONE", "NONE"))
                for i, (dof, kind, unit) in enumerate(zip(item.channels, item.quantities, item.units, strict=True))]
    if isinstance(item, Modes):
        return [modes.written(item)]
    return [geometry.written(item)]


def _responses(frf: Frf, text: bool) -> Iterable[bytes]:
    if frf.values.ndim != 3:
        raise ToolpointError(f"frf: {frf!r}; must be one pose; use frf.at_pose(i)")
    values = np.ascontiguousarray(frf.values.transpose(1, 2, 0))
    label = (QUANTITIES[frf.quantity].split("/N")[0], "N")
    for i, output in enumerate(frf.outputs):
        for j, source in enumerate(frf.inputs):
            yield functions.written(RESPONSE, output, source, numerator=NUMERATOR[frf.quantity], denominator=13,
                                    abscissa=frf.frequency,
                                        data=values[i, j], text=text, units=label)
            if frf.coherence is not None:
                yield functions.written(COHERENCE, output, source, numerator=0, denominator=0, abscissa=frf.frequency,
                                        data=frf.coherence[:, i, j],
                                            text=text)


def _title() -> bytes:
    lines = ["toolpoint", "NONE", "toolpoint", f"{'01-Jan-00':10s}{'00:00:00':10s}{0:10d}{0:10d}{0:10d}",
             f"{'01-Jan-00':10s}{'00:00:00':10s}", "toolpoint", f"{'01-Jan-00':10s}{'00:00:00':10s}"]
    return ("    -1\n   151\n" + "".join(f"{line:80s}\n" for line in lines) + "    -1\n").encode("ascii")


def _si() -> bytes:
    return (f"    -1\n   164\n{1:10d}{'SI: m, N':20s}{2:10d}\n"
            f"{1.0:25.16E}{1.0:25.16E}{1.0:25.16E}\n{273.15:25.16E}\n".replace("E+", "D+") + "    -1\n").encode("ascii")
