"""Writing OP4 files in every variant: text or binary, byte order, integer size, precision, dense, sparse and big sparse."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from scipy.sparse import csc_array

from toolpoint._check import fail, one_of
from toolpoint.io.matrices.labelled_matrix import LabelledMatrix

STORAGES = ("dense", "sparse", "big")
_RECTANGULAR_OP4_FORM = 2
# Rows that the 16 bits of a plain sparse string can name.
_MAX_SPARSE_ROWS = 65535


def write(path: Path, matrices: Sequence[LabelledMatrix], *, storage: str = "big", is_text: bool = False, order: str = "<",
          integers: int = 4, is_single: bool = False) -> None:
    """Write matrices; `order` is the byte order (``<`` little, ``>`` big), `integers` 4 or 8 bytes, both for binary files."""
    one_of("storage", storage, STORAGES)
    if order not in "<>" or integers not in (4, 8):
        fail("order, integers", f"{order!r}, {integers}", "must be < or > and 4 or 8")
    if storage == "sparse" and any(m.matrix.shape[0] > _MAX_SPARSE_ROWS for m in matrices):
        fail("storage", "sparse", f"must have at most {_MAX_SPARSE_ROWS} rows", remedy="take storage='big'")
    parts = [(_text if is_text else _binary)(m, storage, order, integers, is_single) for m in matrices]
    Path(path).write_bytes(b"".join(parts))


def _kind(matrix: csc_array, is_single: bool) -> int:
    return (3 if matrix.dtype.kind == "c" else 1) + (0 if is_single else 1)


def _runs(matrix: csc_array, storage: str) -> Iterator[tuple[int, list[tuple[int, np.ndarray]]]]:
    """Yield column (from 1) and its runs of rows (first row from 1, values); one run from first to last entry where dense."""
    sorted_matrix = csc_array(matrix)
    sorted_matrix.sort_indices()
    for j in range(sorted_matrix.shape[1]):
        rows, data = (part[sorted_matrix.indptr[j]:sorted_matrix.indptr[j + 1]]
                      for part in (sorted_matrix.indices, sorted_matrix.data))
        if len(rows) == 0:
            continue
        if storage == "dense":
            full = np.zeros(rows[-1] - rows[0] + 1, dtype=data.dtype)
            full[rows - rows[0]] = data
            yield j + 1, [(int(rows[0]) + 1, full)]
        else:
            cuts = np.flatnonzero(np.diff(rows) != 1) + 1
            yield j + 1, [(int(r[0]) + 1, v) for r, v in zip(np.split(rows, cuts), np.split(data, cuts), strict=True)]


def _binary(item: LabelledMatrix, storage: str, order: str, integers: int, is_single: bool) -> bytes:
    matrix, kind = item.matrix, _kind(item.matrix, is_single)
    native = np.dtype({1: "f4", 2: "f8", 3: "c8", 4: "c16"}[kind if integers == 4 else kind + kind % 2])
    number = native.newbyteorder("little" if order == "<" else "big")
    words = number.itemsize // integers
    pack = lambda *values: np.array(values, f"{order}i{integers}").tobytes()
    rows = -matrix.shape[0] if storage == "big" else matrix.shape[0]
    name = f"{item.name[:8]:<{2 * integers}s}".encode("ascii", "replace")
    records = [pack(matrix.shape[1], rows, _RECTANGULAR_OP4_FORM, kind) + name]
    for column, runs in _runs(matrix, storage):
        body = b"".join(_head(pack, storage, row, len(v) * words) + v.astype(number).tobytes() for row, v in runs)
        first = runs[0][0] if storage == "dense" else 0
        records.append(pack(column, first, len(body) // integers) + body)
    records.append(pack(matrix.shape[1] + 1, 1, 1) + np.array([1], number).tobytes())
    mark = lambda record: np.array([len(record)], f"{order}i4").tobytes()
    return b"".join(mark(record) + record + mark(record) for record in records)


def _head(pack: object, storage: str, row: int, words: int) -> bytes:
    assert callable(pack)
    if storage == "dense":
        return b""
    return pack(words + 1, row) if storage == "big" else pack(row + 65536 * (words + 1))


def _text(item: LabelledMatrix, storage: str, order: str, integers: int, is_single: bool) -> bytes:
    matrix, kind = item.matrix, _kind(item.matrix, is_single)
    words = {1: 1, 2: 2, 3: 2, 4: 4}[kind]
    rows = -matrix.shape[0] if storage == "big" else matrix.shape[0]
    lines = [f"{matrix.shape[1]:8d}{rows:8d}{_RECTANGULAR_OP4_FORM:8d}{kind:8d}{item.name[:8]:8s}1P,3E24.16"]
    for column, runs in _runs(matrix, storage):
        heads = {"dense": 0, "sparse": 1, "big": 2}[storage]
        size = sum(len(v) * (words if heads else 1 + (kind > 2)) + heads for _, v in runs)
        lines.append(f"{column:8d}{runs[0][0] if storage == 'dense' else 0:8d}{size:8d}")
        for row, values in runs:
            if storage == "big":
                lines.append(f"{len(values) * words + 1:8d}{row:8d}")
            elif storage == "sparse":
                lines.append(f"{row + 65536 * (len(values) * words + 1):12d}")
            lines += _value_lines(values.astype({1: "f4", 3: "c8"}.get(kind, values.dtype)))
    lines += [f"{matrix.shape[1] + 1:8d}{1:8d}{1:8d}", f"{1.0:24.16E}"]
    return ("\n".join(lines) + "\n").encode("ascii")


def _value_lines(values: np.ndarray) -> list[str]:
    numbers = np.column_stack([values.real, values.imag]).ravel() if values.dtype.kind == "c" else values
    fields = [f"{float(v):24.16E}" for v in numbers]
    return ["".join(fields[k:k + 3]) for k in range(0, len(fields), 3)]
