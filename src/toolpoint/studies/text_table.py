"""Tables as text, for a terminal: a title, a header, rows; words to the left, numbers to the right."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from itertools import zip_longest

from toolpoint._rounding import plain_numbers

MAX_WORD_COLUMN_WIDTH = 48  # characters, before cells of words are broken into lines


def text_table(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table as lines of text; the first column and columns of words are aligned left, numbers right."""
    rows = [[plain_numbers(cell) for cell in row] for row in rows]
    columns = [[name, *(row[k] for row in rows)] for k, name in enumerate(header)]
    is_left = [k == 0 or _is_words(column[1:]) for k, column in enumerate(columns)]
    lines = [line for row in rows for line in zip_longest(
        *(textwrap.wrap(cell, MAX_WORD_COLUMN_WIDTH) or [""] if left else [cell] for cell,
          left in zip(row, is_left, strict=True)),
        fillvalue="")]
    widths = [max(len(name), *(len(row[k]) for row in lines)) if lines else len(name) for k, name in enumerate(header)]

    def text_line(cells: Sequence[str], bar: str) -> str:
        padded = [cell.ljust(width) if left else cell.rjust(width)
                  for cell, width, left in zip(cells, widths, is_left, strict=True)]
        return f"{bar} " + f" {bar} ".join(padded) + f" {bar}"

    def rule(marks: str) -> str:
        left, fill, cross, right = tuple(marks)
        return left + cross.join(fill * (width + 2) for width in widths) + right

    return "\n".join([title, rule("┏━┳┓"), text_line(header, "┃"), rule("┡━╇┩"),
                      *(text_line(row, "│") for row in lines), rule("└─┴┘")])


def _is_words(cells: Sequence[str]) -> bool:
    return any(len(cell) > 1 and " " in cell and cell[0].isalpha() for cell in cells)
