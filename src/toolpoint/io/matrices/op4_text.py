"""The text form of OP4 files: fixed fields of 8 characters for integers, a Fortran format for numbers."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.sparse import csc_array

from toolpoint._check import ToolpointError
from toolpoint.io.matrices.labelled_matrix import gather


class _Op4Lines:
    def __init__(self, path: Path, raw: bytes) -> None:
        self.path, self.line_count = path, 0
        self.lines = [line for line in raw.decode("latin-1").splitlines() if line.strip()]

    def next(self) -> str:
        """Return the next line that is not empty."""
        if self.line_count >= len(self.lines):
            raise ToolpointError(f"{self.path}: ends after {self.line_count} lines in the middle of a matrix; it is cut off")
        self.line_count += 1
        return self.lines[self.line_count - 1]

    def integers(self, count: int, first: str | None = None) -> list[int]:
        """Return the integers of the next line, in fields of 8 characters or parted by blanks."""
        line = self.next() if first is None else first
        words = [line[8 * k:8 * k + 8] for k in range(count)]
        if len(line.split()) == count:
            words = line.split()
        try:
            return [int(word) for word in words]
        except ValueError:
            raise ToolpointError(f"{self.path}:{self.line_count}: {line.strip()[:40]!r}; must be {count} whole numbers"
                                 ) from None


def text_matrices(path: Path, raw: bytes) -> Iterator[tuple[str, csc_array]]:
    """Yield name and matrix of every matrix of a text file."""
    lines = _Op4Lines(path, raw)
    while lines.line_count < len(lines.lines):
        head = lines.next()
        columns, rows, _, kind = lines.integers(4, head[:32])
        match = re.search(r"(\d+)[EDFG](\d+)\.", head[40:])
        if kind not in (1, 2, 3, 4) or columns < 1 or rows == 0 or not match:
            raise ToolpointError(f"{path}:{lines.line_count}: {head.strip()[:60]!r}; must be columns, rows, form, "
                                 "type 1 .. 4, name, format")
        yield head[32:40].strip(), _matrix(lines, columns, rows, kind, int(match[1]), int(match[2]))


def _matrix(lines: _Op4Lines, columns: int, rows: int, kind: int, each: int, width: int) -> csc_array:
    i, j, values = [], [], []
    words = {1: 1, 2: 2, 3: 2, 4: 4}[kind]
    while True:
        column, first, count = lines.integers(3)
        if column > columns:
            _numbers(lines, 1, each, width)
            break
        if column < 1:
            raise ToolpointError(f"{lines.path}:{lines.line_count}: column {column}; must be within 1 .. {columns}")
        while count > 0:
            if first > 0:
                row, used, numbers = first, count, _dense(lines, count, kind, each, width)
            else:
                size, row, used = _string(lines, rows < 0)
                numbers = _numbers(lines, size // words * (2 if kind > 2 else 1), each, width)
            count -= used
            parts = numbers if kind < 3 else numbers[::2] + 1j * numbers[1::2]
            i.append(np.arange(row - 1, row - 1 + len(parts)))
            j.append(np.full(len(parts), column - 1))
            values.append(parts)
    return gather(lines.path, i, j, values=values, shape=(abs(rows), columns), kind=kind)


def _string(lines: _Op4Lines, is_big: bool) -> tuple[int, int, int]:
    """Return words of values, first row, and words with the head of a string."""
    if is_big:
        size, row = lines.integers(2)
        return size - 1, row, size + 1
    head = lines.integers(1)[0]
    return (head >> 16) - 1, head & 0xFFFF, head >> 16


def _dense(lines: _Op4Lines, count: int, kind: int, each: int, width: int) -> np.ndarray:
    """Return a dense column; some writers count numbers, some words of 4 bytes: the lines that follow tell."""
    number_lines = 0
    while lines.line_count + number_lines < len(lines.lines) and re.search(r"[.EeDd]",
                                                                           lines.lines[lines.line_count + number_lines]):
        number_lines += 1
    short = count // 2 if kind in (2, 4) else count
    is_words = -(-count // each) > number_lines and -(-short // each) <= number_lines
    return _numbers(lines, short if is_words else count, each, width)


def _numbers(lines: _Op4Lines, count: int, each: int, width: int) -> np.ndarray:
    result: list[float] = []
    while len(result) < count:
        line = lines.next()
        line_numbers = min(each, count - len(result))
        words = [line[k * width:(k + 1) * width].strip().upper().replace("D", "E") for k in range(line_numbers)]
        try:
            result += [float(word) for word in words]
        except ValueError:
            raise ToolpointError(f"{lines.path}:{lines.line_count}: {line.strip()[:40]!r}; must be {line_numbers} numbers of "
                                 f"{width} characters"
                                 ) from None
    return np.array(result)
