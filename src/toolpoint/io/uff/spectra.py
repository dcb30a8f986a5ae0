r"""Functions of any type in universal files, and H1 of auto and cross spectra or spectral densities.

:math:`H_1 = G_{XF} G_{FF}^{-1}` (Bendat, Piersol, Random Data, 4th ed., chapter 7). A cross spectrum is taken as response times
conjugate reference, as the writers of universal files agree; where that is wrong the responses run backward in time, which the
notes then say.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray, ToolpointError
from toolpoint._notebook import NotebookText
from toolpoint.io.door import door
from toolpoint.io.uff import functions
from toolpoint.io.uff.functions import FunctionHeader
from toolpoint.io.uff.sets import UniversalFile, UniversalSet
from toolpoint.vibration import Dof

AUTO_SPECTRUM_TYPE, CROSS_SPECTRUM_TYPE, POWER_DENSITY_TYPE = 2, 3, 9
TYPES = {0: "general", 1: "time response", 2: "auto spectrum", 3: "cross spectrum", 4: "frequency response",
         5: "transmissibility", 6: "coherence", 7: "auto correlation", 8: "cross correlation", 9: "power spectral density",
         10: "energy spectral density", 11: "probability density", 12: "spectrum", 13: "cumulative distribution",
         14: "peaks", 15: "stress/cycles", 16: "orbit", 17: "mode indicator", 18: "force pattern", 19: "partial power",
         20: "partial coherence", 21: "eigenvalue", 22: "eigenvector", 23: "shock response spectrum",
         24: "impulse response filter", 25: "multiple coherence", 26: "order function", 27: "phase compensation"}
Part = tuple[UniversalSet, FunctionHeader]


@dataclass(frozen=True, eq=False)
class UniversalFunction(NotebookText):
    """One function of a file as it stands there: values in the file's own units (`unit`), no factor applied.

    `type` is its name (``auto spectrum``, ``power spectral density``, ``coherence`` ...), `abscissa` (n,) in Hz or s,
    `values` (n,) real or complex.

    >>> import numpy as np
    >>> lines = np.array([1.0, 2.0])
    >>> function = UniversalFunction("auto spectrum", Dof("tip", "+x"), None, lines, np.ones(2), "(m/s^2)^2", "run-out")
    >>> function.unit, function.reference
    ('(m/s^2)^2', None)
    """

    type: str
    response: Dof
    reference: Dof | None
    abscissa: FloatArray
    values: Array
    unit: str
    title: str

    def __repr__(self) -> str:
        reference = f" / {self.reference}" if self.reference else ""
        count = f"{self.abscissa.size} values in {self.unit or 'an unknown unit'}"
        return f"UniversalFunction({self.type} of {self.response}{reference}, {count})"


@door("universal file")
def read_functions(path: str | Path | UniversalFile, type: str | None = None) -> list[UniversalFunction]:
    """Return the functions (sets 58) of a file, all or those of one type of `TYPES`, in the file's own units.

    Raises
    ------
    ToolpointError
        For a file that is no universal file, an unknown type, or a function that is cut short.

    >>> import tempfile
    >>> import numpy as np
    >>> from toolpoint.io import uff
    >>> from toolpoint.vibration import Frf
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "tip.uff")
    ...     uff.write(path, Frf([10.0, 20.0], np.full((2, 1, 1), 1e-8 + 0j), ["7:+x"], ["7:+x"]))
    ...     [function.type for function in read_functions(path)]
    ['frequency response']
    """
    if type is not None and type not in TYPES.values():
        raise ToolpointError(f"type: {type!r}; must be one of {', '.join(TYPES.values())}")
    file = path if isinstance(path, UniversalFile) else UniversalFile(path)
    heads = [(dataset, functions.header(file, dataset)) for dataset in file.sets if dataset.number == 58]
    chosen = [(dataset, head) for dataset, head in heads if type is None or TYPES.get(head.kind) == type]
    return [UniversalFunction(TYPES.get(head.kind, f"type {head.kind}"), head.response, head.reference,
                              *functions.values(file, dataset, head), head.numerator_unit, head.title)
            for dataset, head in chosen]


def holds_spectra(heads: list[FunctionHeader]) -> bool:
    """Return whether functions hold cross spectra of which responses could be formed."""
    return any(_is_cross(head) for head in heads)


def responses_of_spectra(file: UniversalFile,
                         function_parts: list[Part]) -> tuple[list[tuple[FunctionHeader, FloatArray, ComplexArray]],
                                                                   list[tuple[FunctionHeader, FloatArray, ComplexArray]]]:
    """Return H1 of every cross spectrum of motion and force, and the coherences where the auto spectrum of the motion is there.

    Headers, lines (Hz) and values. Forces that were measured together (cross spectra between them) are taken apart by the
    inverse of their matrix; without such cross spectra they are taken as applied one after the other, which a note says.
    """
    crosses = [part for part in function_parts if _is_cross(part[1])]
    kind = crosses[0][1].kind
    if any(head.kind != kind for _, head in crosses):
        raise ToolpointError(f"{file.path}: cross spectra and spectral densities of one and the other scaling; split the file")
    power = [part for part in function_parts if part[1].kind
             == (AUTO_SPECTRUM_TYPE if kind == CROSS_SPECTRUM_TYPE else POWER_DENSITY_TYPE) and _is_auto(part[1])]
    sources = list(dict.fromkeys(head.reference for _, head in crosses if head.reference is not None))
    motions = [part for part in crosses if functions.KINDS.get(part[1].numerator) != "force"]
    between = [part for part in crosses if functions.KINDS.get(part[1].numerator) == "force"]
    if not motions:
        raise ToolpointError(f"{file.path}: {len(crosses)} cross spectra, none of them of a motion over a force")
    axis, force = _force_matrix(file, sources, power, between)
    inverse = np.linalg.inv(force)
    rows = list(dict.fromkeys(head.response for _, head in motions))
    table = _table(file, motions, rows, sources, axis) @ inverse
    _judge_direction(file, table)
    notes = "their spectra between forces are used" if between else "each force is taken as applied alone"
    file.repaired(f"no frequency responses: H1 of {len(motions)} cross spectra; {notes}")
    heads = {(head.response, head.reference): head for _, head in motions}
    pairs = [(i, j) for i in range(len(rows)) for j in range(len(sources)) if (rows[i], sources[j]) in heads]
    responses = [(heads[rows[i], sources[j]], axis, table[:, i, j]) for i, j in pairs]
    return responses, [] if len(sources) > 1 else _coherences(file, motions, power, force[:, 0, 0])


def _is_cross(head: FunctionHeader) -> bool:
    return head.kind in (CROSS_SPECTRUM_TYPE, POWER_DENSITY_TYPE) and head.is_complex and head.reference is not None


def _is_auto(head: FunctionHeader) -> bool:
    return not _is_cross(head) and head.reference in (None, head.response)


def _force_matrix(file: UniversalFile, sources: list[Dof], power: list[Part], between: list[Part]) -> tuple[
        FloatArray, ComplexArray]:
    axis: FloatArray | None = None
    matrix: ComplexArray = np.empty((0, 0, 0), complex)
    for j, source in enumerate(sources):
        parts = [part for part in power if part[1].response == source and functions.KINDS.get(part[1].numerator) == "force"]
        if len(parts) != 1:
            raise ToolpointError(f"{file.path}: {len(parts)} auto spectra of the force at {source}; must be one, stated as "
                                 "force (specific data type 13), so that a response can be formed of the cross spectra")
        lines, values = functions.values(file, *parts[0])
        if axis is None:
            axis, matrix = lines, np.zeros((lines.size, len(sources), len(sources)), complex)
        _check_lines(file, lines, axis, source)
        if not (values.real > 0).all():
            raise ToolpointError(f"{file.path}: the auto spectrum of the force at {source} is {values.real.min():g} at "
                                 f"{lines[int(np.argmin(values.real))]:g} Hz; must be above zero at every line; cut the band")
        matrix[:, j, j] = values.real
    assert axis is not None
    for dataset, head in between:
        if head.response in sources and head.reference in sources:
            lines, values = functions.values(file, dataset, head)
            _check_lines(file, lines, axis, head.response)
            i, j = sources.index(head.response), sources.index(head.reference)
            matrix[:, i, j], matrix[:, j, i] = values, values.conj()
    return axis, matrix


def _check_lines(file: UniversalFile, lines: FloatArray, axis: FloatArray, dof: Dof) -> None:
    if lines.size != axis.size or not np.allclose(lines, axis, rtol=1e-6):
        raise ToolpointError(f"{file.path}: the spectrum of {dof} has {lines.size} lines, {lines[0]:g} .. {lines[-1]:g} Hz, "
                             f"beside {axis.size}, {axis[0]:g} .. {axis[-1]:g} Hz; must be equal; split the file")


def _table(file: UniversalFile, parts: list[Part], rows: list[Dof], columns: list[Dof], axis: FloatArray) -> ComplexArray:
    table = np.full((axis.size, len(rows), len(columns)), np.nan, complex)
    for dataset, head in parts:
        lines, values = functions.values(file, dataset, head)
        _check_lines(file, lines, axis, head.response)
        assert head.reference is not None
        table[:, rows.index(head.response), columns.index(head.reference)] = values
    if np.isnan(table).any():
        _, i, j = np.argwhere(np.isnan(table))[0]
        raise ToolpointError(f"{file.path}: the cross spectrum {rows[i]} / {columns[j]} is missing or not finite; complete the "
                             "file or take the point out")
    return table


def _coherences(file: UniversalFile, motions: list[Part], power: list[Part], force: ComplexArray) -> list[
        tuple[FunctionHeader, FloatArray, ComplexArray]]:
    autos = {part[1].response: part for part in power if functions.KINDS.get(part[1].numerator) != "force"}
    coherences = []
    for dataset, head in motions:
        if head.response not in autos:
            file.repaired("no coherence: auto spectra of the motions are missing")
            return []
        axis, cross = functions.values(file, dataset, head)
        _, auto = functions.values(file, *autos[head.response])
        ratio = np.abs(cross) ** 2 / np.maximum(auto.real * force.real, np.finfo(float).tiny)
        coherences.append((head, axis, ratio.astype(complex)))
    return coherences


def _judge_direction(file: UniversalFile, table: ComplexArray) -> None:
    """Note responses that run backward in time: a causal one has its impulse response in the first half."""
    impulse = np.fft.irfft(table, axis=0) ** 2
    half = impulse.shape[0] // 2
    if impulse[half:].sum() > 2 * impulse[:half].sum():
        file.repaired("the responses formed of the cross spectra run backward in time: the file may hold the conjugate cross "
                      "spectra (reference times conjugate response); conjugate them before use")
