"""Nastran OUTPUT4 files (.op4): text and binary, both byte orders, 32- and 64-bit integers, dense, sparse and big sparse.

A matrix is a header (columns, rows - negative for big sparse -, form, type, name) and its columns: a column number, a first row
(0: sparse strings), a number of words, and the values. Types: 1, 2 real, 3, 4 complex, single and double.
Source: MSC Nastran, DMAP Programmer's Guide, OUTPUT4.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.sparse import csc_array

from toolpoint._check import ToolpointError
from toolpoint.io.door import door
from toolpoint.io.matrices.labelled_matrix import LabelledMatrix, gather
from toolpoint.io.matrices.op4_text import text_matrices

KINDS = {1: np.float32, 2: np.float64, 3: np.complex64, 4: np.complex128}
# A damaged header must not ask for all of the memory: no model that is read here has so many rows.
_MAX_OP4_SIZE = 10**9


@door("OP4 file")
def read(path: Path) -> list[LabelledMatrix]:
    """Return all matrices of a file, as double precision."""
    raw = Path(path).read_bytes()
    if len(raw) < 24:
        raise ToolpointError(f"{path}: {len(raw)} bytes; must hold at least one matrix")
    for order in "<>":
        if int.from_bytes(raw[:4], _side(order)) in (24, 48):
            return list(_matrices(Path(path), raw, order))
    return [LabelledMatrix(name, matrix) for name, matrix in text_matrices(Path(path), raw)]


def _records(path: Path, raw: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    position, side = 0, _side(order)
    while position < len(raw):
        length = int.from_bytes(raw[position:position + 4], side)
        if position + 8 + length > len(raw):
            raise ToolpointError(f"{path}: record at byte {position} of {length} bytes runs past the end ({len(raw)}); it is "
                                 "cut off")
        if int.from_bytes(raw[position + 4 + length:position + 8 + length], side) != length:
            raise ToolpointError(f"{path}: record at byte {position} of {length} bytes ends with another length; it is damaged")
        yield position, raw[position + 4:position + 4 + length]
        position += 8 + length


def _side(order: str) -> Literal["little", "big"]:
    return "little" if order == "<" else "big"


def _matrices(path: Path, raw: bytes, order: str) -> Iterator[LabelledMatrix]:
    records = _records(path, raw, order)
    for position, head in records:
        if len(head) not in (24, 48):
            raise ToolpointError(f"{path}: header at byte {position} of {len(head)} bytes; must be 24 or 48")
        word_bytes = len(head) // 6
        columns, rows, _, kind = (int(v) for v in np.frombuffer(head[:4 * word_bytes], f"{order}i{word_bytes}"))
        if kind not in KINDS or not 0 < columns < _MAX_OP4_SIZE or not 0 < abs(rows) < _MAX_OP4_SIZE:
            raise ToolpointError(f"{path}: header at byte {position}: {rows} x {columns} of type {kind}; must be sizes above "
                                 "0, type 1 .. 4")
        name = head[4 * word_bytes:].decode("latin-1").strip()
        yield LabelledMatrix(name, _columns(path, records, order, word_bytes, columns, rows, kind))


def _columns(path: Path, records: Iterator[tuple[int, bytes]], order: str, word_bytes: int, columns: int, rows: int,
             kind: int) -> csc_array:
    i, j, values = [], [], []
    for position, record in records:
        column, first, _ = (int(v) for v in np.frombuffer(record[:3 * word_bytes], f"{order}i{word_bytes}"))
        if column > columns:
            break
        body = record[3 * word_bytes:]
        if column < 1:
            raise ToolpointError(f"{path}: column {column} at byte {position}; must be within 1 .. {columns}")
        for row, numbers in _strings(body, order, word_bytes, first, rows < 0, kind):
            i.append(np.arange(row, row + len(numbers)))
            j.append(np.full(len(numbers), column - 1))
            values.append(numbers)
    else:
        raise ToolpointError(f"{path}: no column after the last ({columns}), which ends a matrix; it is cut off")
    return gather(path, i, j, values=values, shape=(abs(rows), columns), kind=kind)


def _strings(body: bytes, order: str, word_bytes: int, first: int, is_big: bool, kind: int) -> Iterator[tuple[int, np.ndarray]]:
    """Yield first row (from 0) and values of each string of a column."""
    dtype = np.dtype(KINDS[kind]).newbyteorder(_side(order))
    # With 64-bit integers a word has 8 bytes, and single precision is written as double.
    if word_bytes == 8 and kind in (1, 3):
        dtype = np.dtype({1: np.float64, 3: np.complex128}[kind]).newbyteorder(_side(order))
    if first > 0:
        yield first - 1, np.frombuffer(body[:len(body) // dtype.itemsize * dtype.itemsize], dtype)
        return
    position = 0
    while position + word_bytes <= len(body):
        head = int.from_bytes(body[position:position + word_bytes], _side(order), signed=True)
        if is_big:
            row = int.from_bytes(body[position + word_bytes:position + 2 * word_bytes], _side(order), signed=True)
            words, position = head - 1, position + 2 * word_bytes
        else:
            words, row, position = (head >> 16) - 1, head & 0xFFFF, position + word_bytes
        size = words * word_bytes
        if words < 1 or position + size > len(body) or size % dtype.itemsize:
            raise ValueError(f"a string of {words} words at row {row}")
        yield row - 1, np.frombuffer(body[position:position + size], dtype)
        position += size
