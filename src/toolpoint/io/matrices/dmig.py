"""Nastran DMIG cards (.pch, .bdf): matrices by grid point and direction, in small, large and free fields."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array, csc_array, triu

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.io.door import door
from toolpoint.io.matrices.bulk_cards import BulkCard, bulk_cards, bulk_lines
from toolpoint.io.matrices.labelled_matrix import DIRECTIONS, LabelledMatrix, node_dof
from toolpoint.vibration import Dof

_SYMMETRIC_FORM = 6
_RECTANGULAR_FORMS = (2, 9)
# Cards that add stiffness, mass or ties to a model beside the matrices of the same file.
_MODEL_CARDS = frozenset({
    "RBE1", "RBE2", "RBE3", "RBAR", "MPC", "CBAR", "CBEAM", "CBEND", "CROD", "CONROD", "CELAS1", "CELAS2", "CELAS3", "CELAS4",
    "CBUSH", "CONM1", "CONM2", "CMASS1", "CMASS2", "CDAMP1", "CDAMP2", "CVISC", "CQUAD4", "CQUAD8", "CTRIA3", "CTRIA6", "CHEXA",
    "CPENTA", "CTETRA", "CPYRAM"})
Entry = tuple[tuple[int, int], tuple[int, int], complex]


@door("DMIG file")
def read(path: Path) -> list[LabelledMatrix]:
    """Return every matrix of the file; symmetric ones whole. Rows and columns are those that hold an entry, by label."""
    heads: dict[str, tuple[int, int]] = {}
    entries: dict[str, list[Entry]] = {}
    for card in bulk_cards(path, ("DMIG",)):
        name = card.word(1)
        if card.word(2) == "0":
            heads[name] = (card.whole(3), card.whole(4))
            entries.setdefault(name, [])
        elif name not in heads:
            raise ToolpointError(f"{card.path}:{card.line}: column of {name!r} before its header card; must begin with "
                                 f"DMIG {name} 0 ...")
        else:
            entries[name] += list(_entries(card, heads[name][1] in (3, 4)))
    if not heads:
        raise ToolpointError(f"{path}: no DMIG card; must hold matrices as DMIG (PARAM,EXTOUT,DMIGPCH writes them)")
    notes = question_other_cards(path)
    return [replace(_matrix(path, name, form, entries[name], kind in (3, 4)), notes=notes)
            for name, (form, kind) in heads.items()]


def question_other_cards(path: Path, read_keywords: Collection[str] = ()) -> tuple[Doubt, ...]:
    """Return the doubt about elements and ties that stand beside the matrices and are not read."""
    lines: dict[str, list[int]] = {}
    for _, number, raw in bulk_lines(Path(path)):
        keyword = raw.split(",")[0][:8].strip().rstrip("*").upper()
        if keyword in _MODEL_CARDS and keyword not in read_keywords:
            lines.setdefault(keyword, []).append(number)
    if not lines:
        return ()
    named = ", ".join(f"{len(numbers)} {keyword} (the first in line {numbers[0]})" for keyword, numbers in lines.items())
    return (Doubt(Path(path).name, f"{named} beside the matrices: what they add is not in them", "write the matrices of the "
                  "whole model (PARAM,EXTOUT,DMIGPCH), or take these cards out where the matrices hold them"),)


def _entries(card: BulkCard, is_complex: bool) -> Iterator[Entry]:
    column = (card.whole(2), card.whole(3, 0))
    for k in range(5, len(card.fields), 4):
        if not card.word(k):
            continue
        value = complex(card.real(k + 2), card.real(k + 3, 0.0) if is_complex else 0.0)
        yield (card.whole(k), card.whole(k + 1, 0)), column, value


def _matrix(path: Path, name: str, form: int, entries: list[Entry], is_complex: bool) -> LabelledMatrix:
    row_keys = sorted({row for row, _, _ in entries})
    column_keys = sorted({column for _, column, _ in entries})
    if form not in _RECTANGULAR_FORMS:
        row_keys = column_keys = sorted({*row_keys, *column_keys})
    i = _positions(row_keys, [e[0] for e in entries])
    j = _positions(column_keys, [e[1] for e in entries])
    data = np.array([value for _, _, value in entries], dtype=complex)
    matrix = csc_array(coo_array((data if is_complex else data.real, (i, j)), shape=(len(row_keys), len(column_keys))))
    if form == _SYMMETRIC_FORM:
        is_off_diagonal = np.array(i) != np.array(j)
        pairs = set(zip(i, j, strict=True))
        if any((b, a) in pairs for a, b, o in zip(i, j, is_off_diagonal, strict=True) if o):
            raise ToolpointError(f"{path}: {name}: symmetric (form 6), and both triangles are given; must be one of them")
        matrix = csc_array(matrix + coo_array(((data if is_complex else data.real)[is_off_diagonal],
                                               (np.array(j)[is_off_diagonal], np.array(i)[is_off_diagonal])),
                                              shape=matrix.shape))
    return LabelledMatrix(name, matrix, tuple(node_dof(*k) for k in row_keys) if _labels_differ(row_keys) else (),
                          tuple(node_dof(*k) for k in column_keys) if _labels_differ(column_keys) else ())


def _positions(keys: list[tuple[int, int]], places: list[tuple[int, int]]) -> list[int]:
    table = {key: k for k, key in enumerate(keys)}
    return [table[place] for place in places]


def _labels_differ(keys: list[tuple[int, int]]) -> bool:
    """Whether the keys can be labels: columns of a rectangular matrix are often numbered by one point and no direction."""
    return all(node > 0 and 0 <= direction <= 6 for node, direction in keys)


def write(path: Path, matrices: Sequence[LabelledMatrix]) -> None:
    """Write matrices as large-field DMIG cards with 16 characters a number: what is written has 9 to 13 digits."""
    lines = []
    for item in matrices:
        matrix = csc_array(item.matrix)
        is_symmetric = matrix.shape[0] == matrix.shape[1] and abs(matrix - matrix.T).max() == 0
        is_complex = matrix.dtype.kind == "c"
        form = _SYMMETRIC_FORM if is_symmetric else 1 if item.rows == item.columns else _RECTANGULAR_FORMS[1]
        tail = f"{'':24s}{matrix.shape[1]:8d}" if form == _RECTANGULAR_FORMS[1] else ""
        lines.append(f"DMIG    {item.name[:8]:8s}{0:8d}{form:8d}{4 if is_complex else 2:8d}{0:8d}{tail}")
        part = csc_array(triu(matrix).T) if is_symmetric else matrix
        lines += _cards(item, csc_array(part), is_complex)
    Path(path).write_text("\n".join(lines) + "\n", encoding="ascii")


def _cards(item: LabelledMatrix, part: csc_array, is_complex: bool) -> Iterator[str]:
    rows = item.rows or tuple(Dof(k + 1, "+x") for k in range(part.shape[0]))
    columns = item.columns or tuple(Dof(k + 1, "+x") for k in range(part.shape[1]))
    part.sort_indices()
    for j in range(part.shape[1]):
        where = slice(part.indptr[j], part.indptr[j + 1])
        if where.start == where.stop:
            continue
        yield f"DMIG*   {item.name[:8]:16s}{columns[j].point:16d}{DIRECTIONS.index(columns[j].direction) + 1:16d}"
        for i, value in zip(part.indices[where], part.data[where], strict=True):
            imaginary = _sixteen(value.imag) if is_complex else ""
            yield f"*       {rows[i].point:16d}{DIRECTIONS.index(rows[i].direction) + 1:16d}{_sixteen(value.real)}{imaginary}"


def _sixteen(value: float) -> str:
    """Return a number in 16 characters with as many digits as fit: 9 to 13, all of them where fewer say it."""
    for digits in range(16, 7, -1):
        mantissa, _, exponent = f"{value:.{digits}E}".partition("E")
        text = f"{mantissa.rstrip('0') if '.' in mantissa else mantissa}D{int(exponent)}"
        if len(text) <= 16:
            return f"{text:>16s}"
    raise AssertionError("nine digits fit every number")  # sign, point, D, and four of the exponent
