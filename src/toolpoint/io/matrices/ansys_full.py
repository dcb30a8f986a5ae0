"""Ansys .full files: assembled stiffness and mass of a symmetric model, upper triangle only, with labels of the rows.

A record is its length in words, a word of flags, the words and the length again; a flag says whether the words are integers or
doubles and whether runs of equal values are packed. The header after the first record says at which word each matrix begins.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array, csc_array

from toolpoint._check import ToolpointError
from toolpoint.io.door import door
from toolpoint.io.matrices.labelled_matrix import LabelledMatrix, node_dof
from toolpoint.vibration import Dof

_INTEGER_FLAG, _PACKED_FLAG = 0x80000000, 0x10000000
_HEADER_WORD = 103
# Words of the header: counts, switches, and the first words of the matrices (low and high half of an address).
_ROW_COUNT_WORD, _MATRIX_COUNT_WORD, _DIRECTION_COUNT_WORD, _LUMPED_WORD, _UNSYMMETRIC_WORD = 1, 3, 7, 10, 13
_STIFFNESS_WORDS, _MASS_WORDS, _NODE_COUNT_WORD, _DOF_WORDS, _SCALED_WORD = (18, 19), (26, 27), 32, (35, 36), 16


@dataclass(frozen=True, eq=False)
class _FullWords:
    path: Path
    words: np.ndarray

    def record(self, position: int) -> tuple[np.ndarray, int]:
        """Return the values of the record at a word, and the word after it."""
        size = len(self.words)
        # Every length is asked before it is followed: a damaged one would lead anywhere in the file.
        if not 0 <= position < size - 2 or not 0 <= (length := int(self.words[position])) <= size - position - 3:
            raise ToolpointError(f"{self.path}: no whole record at byte {4 * position} of {4 * size}; the file is cut off or "
                                 "damaged")
        # Fortran writes the length on both sides of a record: a difference is the first sign of a damaged or misread file.
        if int(self.words[position + 2 + length]) != length:
            raise ToolpointError(f"{self.path}: record at byte {4 * position} of {length} words ends with another length; "
                                 "damaged")
        flags, raw = int(self.words[position + 1]) & 0xFFFFFFFF, self.words[position + 2:position + 2 + length]
        if flags & _PACKED_FLAG:
            return self._unpacked(raw, bool(flags & _INTEGER_FLAG), position), position + length + 3
        return (raw if flags & _INTEGER_FLAG else raw[:length // 2 * 2].view(np.float64)), position + length + 3

    def _unpacked(self, raw: np.ndarray, is_integer: bool, position: int) -> np.ndarray:
        """Unpack windows: length, number of windows, then (start, length, values), a negative length for one repeated value."""
        total, windows, offset = int(raw[0]), int(raw[1]), 2
        # A damaged count must not ask for all of the memory before it is noticed.
        if not 0 <= total <= 10**9:
            raise ToolpointError(f"{self.path}: packed record at byte {4 * position} of {total} values; damaged")
        value_words = 1 if is_integer else 2
        result = np.zeros(total, dtype=np.int32 if is_integer else np.float64)
        for _ in range(windows):
            start, length = int(raw[offset]), int(raw[offset + 1])
            count = 1 if length < 0 else length
            values = raw[offset + 2:offset + 2 + count * value_words]
            result[start:start + abs(length)] = values if is_integer else values.copy().view(np.float64)
            offset += 2 + count * value_words
        return result


@door("Ansys .full file")
def read(path: Path) -> list[LabelledMatrix]:
    """Return stiffness (``K``) and, where the file holds it, mass (``M``), whole and without held rows.

    Raises ToolpointError for files of the frontal solver, unsymmetric or lumped matrices, and for damaged ones.
    """
    raw = Path(path).read_bytes()
    if len(raw) < 4 * 300:
        raise ToolpointError(f"{path}: {len(raw)} bytes; must hold at least the headers of a .full file")
    words = np.frombuffer(raw[:len(raw) // 4 * 4], dtype="<i4")
    if words[0] != 100 or words[2] != 4:
        raise ToolpointError(f"{path}: begins with words {words[0]}, {words[2]}; must be 100 and file number 4 of a "
                             "little-endian .full file (write one with WRFULL or a modal analysis)")
    source = _FullWords(Path(path), words)
    header, following = source.record(_HEADER_WORD)
    _check_header(path, header)
    dofs, free, notes = _labels(source, header, following)
    result = [LabelledMatrix("K", _matrix(source, header, _STIFFNESS_WORDS, free), dofs, dofs, notes)]
    if int(header[_MASS_WORDS[0]]) or int(header[_MASS_WORDS[1]]):
        result.append(LabelledMatrix("M", _matrix(source, header, _MASS_WORDS, free), dofs, dofs, notes))
    return result


def _check_header(path: Path, header: np.ndarray) -> None:
    for switch, limit in ((_LUMPED_WORD, "a lumped mass"), (_UNSYMMETRIC_WORD, "unsymmetric matrices")):
        if header[switch]:
            raise ToolpointError(f"{path}: {limit}; must be consistent and symmetric (choose LUMPM,OFF and a symmetric solver)")
    if header[0] >= 0:
        raise ToolpointError(f"{path}: written by the frontal solver; take another equation solver")
    if not 0 < header[_ROW_COUNT_WORD] < 2**30 or not 0 < header[_NODE_COUNT_WORD] <= header[_ROW_COUNT_WORD]:
        raise ToolpointError(f"{path}: {header[_ROW_COUNT_WORD]} rows of {header[_NODE_COUNT_WORD]} nodes; the header is "
                             "damaged")


def _labels(source: _FullWords, header: np.ndarray, position: int) -> tuple[tuple[Dof, ...], np.ndarray, tuple[str, ...]]:
    """Return labels of the free rows, their numbers, and notes."""
    _, position = source.record(position)
    nodes, _ = source.record(position)
    counts, position = source.record(_long(header, _DOF_WORDS))
    kinds, position = source.record(position)
    rows = int(header[_ROW_COUNT_WORD])
    if len(nodes) < len(counts) or int(counts.sum()) != rows or len(kinds) < rows or (counts < 0).any():
        raise ToolpointError(f"{source.path}: {len(nodes)} nodes with {int(counts.sum())} directions for {rows} rows; damaged")
    node_of = np.repeat(nodes[:len(counts)], counts)
    held = kinds[:rows] < 0
    free = np.flatnonzero(~held)
    if (np.abs(kinds[free]) > 6).any():
        raise ToolpointError(f"{source.path}: direction {int(np.abs(kinds).max())}; must be 1 .. 6, "
                             "displacements and rotations only")
    dofs = tuple(node_dof(int(node_of[i]), int(kinds[i])) for i in free)
    notes = (f"{int(held.sum())} held rows left out",) if held.any() else ()
    return dofs, free, notes


def _long(header: np.ndarray, places: tuple[int, int]) -> int:
    return (int(header[places[0]]) & 0xFFFFFFFF) | (int(header[places[1]]) << 32)


def _matrix(source: _FullWords, header: np.ndarray, pointer: tuple[int, int], free: np.ndarray) -> csc_array:
    """Read rows of the upper triangle: a record of columns (from 1, the row itself last), then a record of values."""
    size, position = int(header[_ROW_COUNT_WORD]), _long(header, pointer)
    row_parts, column_parts, values = [], [], []
    for row in range(size):
        columns, position = source.record(position)
        numbers, position = source.record(position)
        if len(columns) != len(numbers) or columns.dtype.kind != "i" or numbers.dtype.kind != "f":
            raise ToolpointError(f"{source.path}: row {row + 1} has {len(columns)} columns and {len(numbers)} values; damaged")
        if len(columns) and (columns.min() < 1 or columns.max() > size):
            raise ToolpointError(f"{source.path}: column {int(columns.max())} in row {row + 1} of {size}; damaged")
        row_parts.append(np.full(len(columns), row))
        column_parts.append(columns - 1)
        values.append(numbers)
    rows, columns, data = (np.concatenate(part) for part in (row_parts, column_parts, values))
    if not np.isfinite(data).all():
        raise ToolpointError(f"{source.path}: {int((~np.isfinite(data)).sum())} values are not finite; damaged")
    # The mirror image of the diagonal is itself: added twice it would double.
    is_off_diagonal = rows != columns
    places = np.concatenate([rows, columns[is_off_diagonal]]), np.concatenate([columns, rows[is_off_diagonal]])
    both = coo_array((np.concatenate([data, data[is_off_diagonal]]), places), shape=(size, size))
    return csc_array(csc_array(both)[free][:, free])
