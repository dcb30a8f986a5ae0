"""Matrix Market files (.mtx, .mm): coordinate and array, real, integer, complex or pattern, general to Hermitian."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.sparse import coo_array, csc_array, tril

from toolpoint._check import ToolpointError, fail
from toolpoint.io.door import door
from toolpoint.io.matrices.labelled_matrix import LabelledMatrix

_FIELDS = {"real": 1, "integer": 1, "double": 1, "complex": 2, "pattern": 0}
_SYMMETRIES = ("general", "symmetric", "skew-symmetric", "hermitian")


@door("Matrix Market file")
def read(path: Path) -> list[LabelledMatrix]:
    """Return the one matrix of a Matrix Market file. Source: Boisvert, Pozo, Remington, NISTIR 5935 (1996)."""
    lines = Path(path).read_text(encoding="utf-8", errors="replace").splitlines()
    words = lines[0].lower().split() if lines else []
    if len(words) != 5 or words[0] != "%%matrixmarket" or words[1] != "matrix":
        raise ToolpointError(f"{path}:1: {lines[0][:60]!r} if any; must read %%MatrixMarket matrix FORMAT FIELD SYMMETRY"
                             if lines else f"{path}: empty; must begin with %%MatrixMarket matrix")
    layout, field, symmetry = words[2:]
    if layout not in ("coordinate", "array") or field not in _FIELDS or symmetry not in _SYMMETRIES:
        raise ToolpointError(f"{path}:1: {' '.join(words[2:])!r}; must be coordinate or array, {', '.join(_FIELDS)}, "
                             f"{', '.join(_SYMMETRIES)}")
    size_line = next((i for i, line in enumerate(lines) if i and line.strip() and not line.startswith("%")), len(lines))
    if size_line == len(lines):
        raise ToolpointError(f"{path}: no line of sizes; it is cut off")
    sizes = [int(word) for word in lines[size_line].split()]
    body = [line for line in lines[size_line + 1:] if line.strip() and not line.startswith("%")]
    reader = _coordinate if layout == "coordinate" else _array
    return [LabelledMatrix(Path(path).stem, _whole(reader(path, sizes, body, field, symmetry), symmetry))]


def _coordinate(path: Path, sizes: list[int], body: list[str], field: str, symmetry: str) -> csc_array:
    if len(sizes) != 3:
        raise ToolpointError(f"{path}: sizes {sizes}; must be rows, columns and entries")
    rows, columns, entries = sizes
    width = 2 + _FIELDS[field]
    if len(body) != entries:
        raise ToolpointError(f"{path}: {len(body)} lines of {entries} entries; it is cut off or two files in one")
    numbers = np.array([line.split() for line in body] or np.empty((0, width)), dtype=object)
    if numbers.ndim != 2 or numbers.shape[1] != width:
        raise ToolpointError(f"{path}: entries must have {width} numbers each")
    i, j = (numbers[:, k].astype(np.int64) - 1 for k in (0, 1))
    if entries and (i.min() < 0 or j.min() < 0 or i.max() >= rows or j.max() >= columns):
        raise ToolpointError(f"{path}: entry ({i.max() + 1}, {j.max() + 1}); must be within {rows} x {columns}, from 1")
    values = numbers[:, 2:].astype(float)
    data = np.ones(entries) if field == "pattern" else values[:, 0] + 1j * values[:, 1] if field == "complex" else values[:, 0]
    return csc_array(coo_array((data, (i, j)), shape=(rows, columns)))


def _array(path: Path, sizes: list[int], body: list[str], field: str, symmetry: str) -> csc_array:
    rows, columns = sizes[:2]
    numbers = np.array([line.split() for line in body], dtype=object).astype(float)
    data = numbers[:, 0] + 1j * numbers[:, 1] if field == "complex" else numbers[:, 0]
    dense = np.zeros((rows, columns), dtype=data.dtype)
    strict = 1 if symmetry == "skew-symmetric" else 0
    places = [(i, j) for j in range(columns) for i in range(0 if symmetry == "general" else j + strict, rows)]
    if len(data) != len(places):
        raise ToolpointError(f"{path}: {len(data)} numbers, {len(places)} for this size and symmetry; it is cut off")
    if places:
        dense[tuple(np.array(places).T)] = data
    return csc_array(dense)


def _whole(matrix: csc_array, symmetry: str) -> csc_array:
    if symmetry == "general":
        return matrix
    lower = csc_array(tril(matrix, -1))
    other = lower.T.conj() if symmetry == "hermitian" else -lower.T if symmetry == "skew-symmetric" else lower.T
    return csc_array(matrix + other)


def write(path: Path, matrix: LabelledMatrix, *, symmetry: str = "general", layout: str = "coordinate") -> None:
    """Write a matrix; a symmetric one may be written as its lower triangle."""
    if symmetry not in ("general", "symmetric"):
        fail("symmetry", repr(symmetry), "must be general or symmetric")
    matrix_entries = csc_array(matrix.matrix)
    if symmetry == "symmetric" and abs(matrix_entries - matrix_entries.T).max() > 0:
        fail("matrix", "not symmetric to the last bit", "must be for symmetry='symmetric'", remedy="write it as general")
    part = csc_array(tril(matrix_entries)) if symmetry == "symmetric" else matrix_entries
    field = "complex" if matrix_entries.dtype.kind == "c" else "real"
    text = [f"%%MatrixMarket matrix {layout} {field} {symmetry}"]
    if layout == "array":
        rows = range(matrix_entries.shape[0])
        dense = matrix_entries.toarray()
        text += [f"{matrix_entries.shape[0]} {matrix_entries.shape[1]}"]
        text += [_number(dense[i, j]) for j in range(matrix_entries.shape[1]) for i in rows if symmetry == "general" or i >= j]
    else:
        entries = part.tocoo()
        text += [f"{matrix_entries.shape[0]} {matrix_entries.shape[1]} {part.nnz}"]
        text += [f"{i + 1} {j + 1} {_number(v)}" for i, j, v in zip(*entries.coords, entries.data, strict=True)]
    Path(path).write_text("\n".join(text) + "\n", encoding="utf-8")


def _number(value: complex) -> str:
    return f"{value.real!r} {value.imag!r}".replace("np.float64(", "").replace(")", "") if isinstance(value, complex) else (
        repr(float(value)))
