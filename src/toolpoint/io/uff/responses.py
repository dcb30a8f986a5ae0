"""Frequency responses of universal files: functions of type 4 with their coherences, or H1 of the spectra that stand in their
place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from toolpoint._check import Array, FloatArray, ToolpointError, one_of
from toolpoint.io.door import door
from toolpoint.io.uff import functions
from toolpoint.io.uff.functions import COHERENCE_TYPE, KINDS, RESPONSE_TYPE, FunctionHeader
from toolpoint.io.uff.sets import UniversalFile
from toolpoint.io.uff.spectra import Part, holds_spectra, responses_of_spectra
from toolpoint.io.uff.units import factor_to_si, report, second_channel, units
from toolpoint.vibration import Dof, Frf
from toolpoint.vibration.frf import QUANTITIES

Function = tuple[FunctionHeader, FloatArray, Array]
MOTIONS = ("displacement", "velocity", "acceleration")
NUMERATOR = {"receptance": 8, "mobility": 11, "accelerance": 12}


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

    >>> import tempfile
    >>> import numpy as np
    >>> from toolpoint.io import uff
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "tip.uff")
    ...     uff.write(path, Frf([10.0, 20.0], np.full((2, 1, 1), 1e-8 + 0j), ["7:+x"], ["7:+x"]))
    ...     read_frf(path).frequency.tolist()
    [10.0, 20.0]
    """
    file = path if isinstance(path, UniversalFile) else UniversalFile(path)
    scale = units(file)
    function_parts = [(dataset, functions.header(file, dataset)) for dataset in file.sets if dataset.number == 58]
    responses, coherences = _functions(file, function_parts)
    kind = _quantity(file, [head for head, _, _ in responses], quantity)
    responses = [(head, axis, data * factor_to_si(file, head, scale, is_response=True)) for head, axis, data in responses]
    frequency, values, rows, columns = _table(file, responses)
    values = values.astype(complex, copy=False)
    coherence = _coherence(file, coherences, frequency, rows, columns)
    report(file)
    return Frf(frequency, values, rows, columns, kind, coherence=coherence, notes=tuple(file.repairs))


def _functions(file: UniversalFile, function_parts: list[Part]) -> tuple[list[Function], list[Function]]:
    """Return the responses and the coherences of a file: header, lines, values."""
    if any(head.kind == RESPONSE_TYPE for _, head in function_parts):
        first, second = ([(head, *functions.values(file, dataset, head)) for dataset,
                          head in function_parts if head.kind == kind]
                         for kind in (RESPONSE_TYPE, COHERENCE_TYPE))
        return first, second
    if not holds_spectra([head for _, head in function_parts]):
        raise ToolpointError(f"{file.path}: no frequency response (set 58 of function type 4) and no cross spectra; it holds "
                             f"{file!r}")
    return responses_of_spectra(file, function_parts)


def _quantity(file: UniversalFile, heads: list[FunctionHeader], requested: str | None) -> str:
    kinds = {head.numerator for head in heads}
    names = {code: name for name, code in NUMERATOR.items()}
    stated = {names[kind] for kind in kinds if kind in names}
    if len(kinds) > 1 and len(stated) > 1:
        raise ToolpointError(f"{file.path}: responses of different quantities, {', '.join(sorted(stated))}; split the "
                             "file")
    swapped = [KINDS[head.denominator] for head in heads if head.denominator in names]
    swapped += ["force over another channel" for head in heads if KINDS.get(head.numerator) == "force"]
    if swapped:
        if requested is None:
            raise ToolpointError(f"{file.path}: {len(swapped)} of {len(heads)} responses are stated as "
                                 f"{'motion over ' * (swapped[0] in MOTIONS)}{swapped[0]}; must be motion over force: the "
                                 "channels may be swapped; measure again, or state the quantity if only the labels are wrong")
        file.repaired(f"{len(swapped)} responses are not stated as motion over force; read as {requested} on request")
    if requested is not None:
        one_of("quantity", requested, QUANTITIES)
        if stated and stated != {requested}:
            file.repaired(f"the file says {stated.pop()}, read as {requested} on request")
        return requested
    if not stated:
        raise ToolpointError(f"{file.path}: the responses do not say whether they are displacement, velocity or "
                             "acceleration; give quantity='accelerance' or another")
    return stated.pop()


def _table(file: UniversalFile, parts: Sequence[Function]) -> tuple[FloatArray, Array, tuple[Dof, ...], tuple[Dof, ...]]:
    parts = _rename_repeated(file, parts)
    rows = tuple(dict.fromkeys(head.response for head, _, _ in parts))
    columns = tuple(dict.fromkeys(_reference(file, head) for head, _, _ in parts))
    row_at, column_at = {dof: i for i, dof in enumerate(rows)}, {dof: i for i, dof in enumerate(columns)}
    frequency = parts[0][1]
    kind = complex if any(np.iscomplexobj(data) for _, _, data in parts) else float
    values = np.empty((len(rows), len(columns), frequency.size), kind)
    filled = np.zeros((len(rows), len(columns)), bool)
    for head, axis, data in parts:
        _check_function(file, head, axis, data, frequency)
        place = row_at[head.response], column_at[_reference(file, head)]
        values[place], filled[place] = data, True
    if not filled.all():
        row, column = np.argwhere(~filled)[0]
        raise ToolpointError(f"{file.path}: {int((~filled).sum())} of {filled.size} responses are missing, the first "
                             f"{rows[row]} / {columns[column]}; read fewer references or complete the file")
    return frequency, values.transpose(2, 0, 1), rows, columns


def _check_function(file: UniversalFile, head: FunctionHeader, axis: FloatArray, data: Array, frequency: FloatArray) -> None:
    if not np.isfinite(data).all():
        line = int(np.argmin(np.isfinite(data)))
        raise ToolpointError(f"{file.path}: {head.response} / {head.reference} is not finite at {axis[line]:g} Hz (value "
                             f"{line + 1} of {data.size}); measure it again or take the response out")
    if not (np.array_equal(axis, frequency) or (axis.size == frequency.size and np.allclose(axis, frequency, rtol=1e-6))):
        raise ToolpointError(f"{file.path}: {head.response} / {head.reference} has {axis.size} lines, "
                             f"{axis[0]:g} .. {axis[-1]:g} Hz, beside {frequency.size}, {frequency[0]:g} .. "
                             f"{frequency[-1]:g} Hz; axes must be equal; split the file")


def _rename_repeated(file: UniversalFile, parts: Sequence[Function]) -> list[Function]:
    """Return the functions, each with its own pair of Dofs: a second channel of one Dof gets a name of its own.

    Equal numbers twice are one function stored twice, which is refused: nothing says which of its neighbours are copies.
    """
    first: dict[tuple[Dof, Dof | None], list[Array]] = {}
    renamed = []
    for head, axis, data in parts:
        earlier = first.setdefault((head.response, head.reference), [])
        if any(np.array_equal(data, other) for other in earlier):
            raise ToolpointError(f"{file.path}: {head.response} / {head.reference} is there twice, with the same values; "
                                 "remove one")
        earlier.append(data)
        if len(earlier) > 1:
            name = second_channel(file, head.response, len(earlier))
            head = replace(head, response=name)
        renamed.append((head, axis, data))
    return renamed


def _reference(file: UniversalFile, head: FunctionHeader) -> Dof:
    if head.reference is None:
        raise ToolpointError(f"{file.path}: the response of {head.response} names no reference point; a frequency "
                             "response needs one")
    return head.reference


def _coherence(file: UniversalFile, coherences: Sequence[Function], frequency: FloatArray, rows: tuple[Dof, ...],
               columns: tuple[Dof, ...]) -> FloatArray | None:
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
