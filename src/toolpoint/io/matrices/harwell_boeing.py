"""Harwell-Boeing files (.hb, .rua, .rsa, .psa): compressed columns in fixed Fortran fields."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from scipy.sparse import csc_array, tril

from toolpoint._check import ToolpointError, fail
from toolpoint.io.door import door
from toolpoint.io.matrices.labelled_matrix import LabelledMatrix, complete


@door("Harwell-Boeing file")
def read(path: Path) -> list[LabelledMatrix]:
    """Return the one assembled matrix. Source: Duff, Grimes, Lewis, Users' Guide for the Harwell-Boeing Collection (1992)."""
    lines = Path(path).read_text(encoding="latin-1").splitlines()
    if len(lines) < 5:
        raise ToolpointError(f"{path}: {len(lines)} lines; must begin with four of header")
    cards = [int(lines[1][k:k + 14] or 0) for k in range(0, 56, 14)]
    kind = lines[2][:3].upper()
    if not re.fullmatch("[RP][USZR]A", kind):
        raise ToolpointError(f"{path}:3: type {kind!r}; must be real or pattern, assembled (RUA, RSA, RZA, RRA, PUA, PSA)")
    rows, columns, entries = (int(lines[2][k:k + 14]) for k in (14, 28, 42))
    formats = [lines[3][a:b] for a, b in ((0, 16), (16, 32), (32, 52))]
    first_line = 4 + (1 if len(lines[1]) >= 70 and lines[1][56:70].strip() not in ("", "0") else 0)
    blocks = []
    for number, (count, layout) in enumerate(zip(cards[1:4], formats, strict=True)):
        blocks.append(_fields(path, lines[first_line:first_line + count], layout, first_line + 1)
                      if not (kind[0] == "P" and number == 2) else [])
        first_line += count
    indptr, indices = (np.array(block, dtype=np.int64) - 1 for block in blocks[:2])
    data = np.array(blocks[2], dtype=float) if kind[0] == "R" else np.ones(len(indices))
    _check(path, indptr, indices, data, (rows, columns, entries))
    matrix = csc_array((data, indices, indptr), shape=(rows, columns))
    if kind[1] == "Z":
        matrix = csc_array(matrix - csc_array(tril(matrix, -1)).T)
    return [LabelledMatrix(lines[0][72:80].strip() or Path(path).stem, complete(matrix) if kind[1] == "S" else matrix)]


def _check(path: Path, indptr: np.ndarray, indices: np.ndarray, data: np.ndarray, sizes: tuple[int, int, int]) -> None:
    rows, columns, entries = sizes
    if len(indptr) != columns + 1 or indptr[0] != 0 or (np.diff(indptr) < 0).any() or indptr[-1] != entries:
        raise ToolpointError(f"{path}: {len(indptr)} pointers that end at {indptr[-1] + 1 if len(indptr) else 'nothing'}; must "
                             f"be {columns + 1} that grow to {entries + 1}")
    if len(indices) != entries or len(data) != entries:
        raise ToolpointError(f"{path}: {len(indices)} rows and {len(data)} values; must be {entries} of each; it is cut off")
    if entries and (indices.min() < 0 or indices.max() >= rows):
        raise ToolpointError(f"{path}: row {indices.max() + 1}; must be within 1 .. {rows}")
    if not np.isfinite(data).all():
        raise ToolpointError(f"{path}: {int((~np.isfinite(data)).sum())} values are not finite; must be finite")


def _fields(path: Path, lines: list[str], layout: str, first: int) -> list[float] | list[int]:
    match = re.search(r"\(?\s*(?:\d+P\s*,?)?\s*(\d*)\s*([IEDFG])\s*(\d+)", layout.upper())
    if not match:
        raise ToolpointError(f"{path}:4: format {layout.strip()!r}; must be like (10I8) or (1P,4E20.12)")
    width = int(match[3])
    number = int if match[2] == "I" else float
    result = []
    for n, line in enumerate(lines):
        for start in range(0, len(line.rstrip()), width):
            word = line[start:start + width].strip().upper().replace("D", "E")
            try:
                result.append(number(word))
            except ValueError:
                raise ToolpointError(f"{path}:{first + n}:{start + 1}: {word!r}; must be a number of {width} characters"
                                     ) from None
    return result


def write(path: Path, matrix: LabelledMatrix, *, symmetry: str = "unsymmetric") -> None:
    """Write a real matrix, its lower triangle where `symmetry` is ``symmetric``; values with 17 digits."""
    if symmetry not in ("unsymmetric", "symmetric"):
        fail("symmetry", repr(symmetry), "must be unsymmetric or symmetric")
    part = csc_array(tril(matrix.matrix)) if symmetry == "symmetric" else csc_array(matrix.matrix)
    part.sort_indices()
    blocks = [_lines([f"{v + 1:12d}" for v in part.indptr], 6), _lines([f"{v + 1:12d}" for v in part.indices], 6),
              _lines([f"{v:25.16E}" for v in part.data], 3)]
    counts = [len(block) for block in blocks]
    kind = "RSA" if symmetry == "symmetric" else "RUA"
    head = [f"{matrix.name[:72]:72s}{matrix.name[:8]:8s}",
            "".join(f"{v:14d}" for v in (sum(counts), *counts, 0)),
            f"{kind:14s}" + "".join(f"{v:14d}" for v in (*part.shape, part.nnz, 0)),
            f"{'(6I12)':16s}{'(6I12)':16s}{'(3E25.16)':20s}{'':20s}"]
    Path(path).write_text("\n".join([*head, *blocks[0], *blocks[1], *blocks[2]]) + "\n", encoding="ascii")


def _lines(fields: list[str], each: int) -> list[str]:
    return ["".join(fields[k:k + each]) for k in range(0, len(fields), each)]
