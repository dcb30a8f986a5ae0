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
_MOST = 10**9


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
    at, side = 0, _side(order)
    while at < len(raw):
        length = int.from_bytes(raw[at:at + 4], side)
        if at + 8 + length > len(raw):
            raise ToolpointError(f"{path}: record at byte {at} of {length} bytes runs past the end ({len(raw)}); it is cut off")
        if int.from_bytes(raw[at + 4 + length:at + 8 + length], side) != length:
            raise ToolpointError(f"{path}: record at byte {at} of {length} bytes ends with another length; it is damaged")
        yield at, raw[at + 4:at + 4 + length]
        at += 8 + length


def _side(order: str) -> Literal["little", "big"]:
    return "little" if order == "<" else "big"


def _matrices(path: Path, raw: bytes, order: str) -> Iterator[LabelledMatrix]:
    records = _records(path, raw, order)
    for at, head in records:
        if len(head) not in (24, 48):
            raise ToolpointError(f"{path}: header at byte {at} of {len(head)} bytes; must be 24 or 48")
        wide = len(head) // 6
        columns, rows, _, kind = (int(v) for v in np.frombuffer(head[:4 * wide], f"{order}i{wide}"))
        if kind not in KINDS or not 0 < columns < _MOST or not 0 < abs(rows) < _MOST:
            raise ToolpointError(f"{path}: header at byte {at}: {rows} x {columns} of type {kind}; must be sizes above 0, "
                                 "type 1 .. 4")
        name = head[4 * wide:].decode("latin-1").strip()
        yield LabelledMatrix(name, _columns(path, records, order, wide, columns, rows, kind))


def _columns(path: Path, records: Iterator[tuple[int, bytes]], order: str, wide: int, columns: int, rows: int,
             kind: int) -> csc_array:
    i, j, values = [], [], []
    for at, record in records:
        column, first, _ = (int(v) for v in np.frombuffer(record[:3 * wide], f"{order}i{wide}"))
        if column > columns:
            break
        body = record[3 * wide:]
        if column < 1:
            raise ToolpointError(f"{path}: column {column} at byte {at}; must be within 1 .. {columns}")
        for row, numbers in _strings(body, order, wide, first, rows < 0, kind):
            i.append(np.arange(row, row + len(numbers)))
            j.append(np.full(len(numbers), column - 1))
            values.append(numbers)
    else:
        raise ToolpointError(f"{path}: no column after the last ({columns}), which ends a matrix; it is cut off")
    return gather(path, i, j, values=values, shape=(abs(rows), columns), kind=kind)


def _strings(body: bytes, order: str, wide: int, first: int, is_big: bool, kind: int) -> Iterator[tuple[int, np.ndarray]]:
    """Yield first row (from 0) and values of each string of a column."""
    dtype = np.dtype(KINDS[kind]).newbyteorder(_side(order))
    # With 64-bit integers a word has 8 bytes, and single precision is written as double.
    if wide == 8 and kind in (1, 3):
        dtype = np.dtype({1: np.float64, 3: np.complex128}[kind]).newbyteorder(_side(order))
    if first > 0:
        yield first - 1, np.frombuffer(body[:len(body) // dtype.itemsize * dtype.itemsize], dtype)
        return
    at = 0
    while at + wide <= len(body):
        head = int.from_bytes(body[at:at + wide], _side(order), signed=True)
        if is_big:
            row = int.from_bytes(body[at + wide:at + 2 * wide], _side(order), signed=True)
            words, at = head - 1, at + 2 * wide
        else:
            words, row, at = (head >> 16) - 1, head & 0xFFFF, at + wide
        size = words * wide
        if words < 1 or at + size > len(body) or size % dtype.itemsize:
            raise ValueError(f"a string of {words} words at row {row}")
        yield row - 1, np.frombuffer(body[at:at + size], dtype)
        at += size
