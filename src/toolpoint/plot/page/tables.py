"""Tables of a report: numbers to the digits that their uncertainty carries, marks that say where values come from."""

from __future__ import annotations

import html
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from toolpoint._check import fail, one_of
from toolpoint._rounding import number_text, with_uncertainty
from toolpoint.plot.page.markup import mark_up

MARKS = ("", "published", "chosen", "measured", "computed", "assumed", "good", "doubtful", "green", "amber", "red")
_MIN_SMALL_PRINT_COLUMNS = 7  # columns from which a table is set smaller in print
# Columns of numbers with their bounds and intervals stand to the right; one word in them, and they stand left.
_NUMERIC = re.compile(r"(above |below )?[-+−]?\d[\d.,]*(e[-+]?\d+)?( ± [\d.,e+-]+)?( %)?")


@dataclass(frozen=True)
class Cell:
    """A table cell whose `mark`, one of MARKS, says where its value comes from or how good it is.

    `uncertainty` is the half-width of the value's interval: both are then shown to the digits that it carries
    (`toolpoint._rounding`).

    >>> Cell(21.5, uncertainty=0.02).value  # written with the digits that its interval leaves
    21.5
    """

    value: Any
    mark: str = ""
    uncertainty: float | None = None

    def __post_init__(self) -> None:
        one_of("Cell.mark", self.mark, MARKS)


@dataclass(frozen=True)
class Table:
    """Rows under a header; numbers are set to the right.

    Parameters
    ----------
    header : sequence of str
    rows : sequence of rows
        Each a sequence of numbers, text or `Cell`; or a mapping from header to value.
    caption : str
    digits : int
        Significant digits of floats that come as numbers.
    """

    header: Sequence[str]
    rows: Iterable[Sequence[Any] | Mapping[str, Any]]
    caption: str = ""
    digits: int = 4

    def __post_init__(self) -> None:
        header = tuple(str(name) for name in self.header)
        rows = tuple(tuple(row.get(name, "") for name in header) if isinstance(row, Mapping) else tuple(row)
                     for row in self.rows)
        for number, row in enumerate(rows):
            if len(row) != len(header):
                fail("Table.rows", f"row {number} has {len(row)} cells", f"must have {len(header)} of them")
        object.__setattr__(self, "header", header)
        object.__setattr__(self, "rows", rows)

    def fragment(self) -> str:
        """Return the table as HTML, with a key to the marks that it uses."""
        cells = [[value if isinstance(value, Cell) else Cell(value) for value in row] for row in self.rows]
        is_numeric_column = [any(_is_numeric(row[i].value) for row in cells) for i in range(len(self.header))]
        head = "".join(f"<th scope=\"col\"{_alignment(r)}>{mark_up(name)}</th>" for name,
                       r in zip(self.header, is_numeric_column))
        texts = list(zip(*(_column([row[i] for row in cells], self.digits) for i in range(len(self.header)))))
        body = "".join("<tr>" + "".join(_cell_markup(c, t, r) for c, t, r in zip(row, text, is_numeric_column)) + "</tr>"
                       for row, text in zip(cells, texts))
        caption = f"<caption><span>{mark_up(self.caption)}</span></caption>" if self.caption else ""
        width_class = " wide" if len(self.header) > _MIN_SMALL_PRINT_COLUMNS else ""
        used = [mark for mark in MARKS if mark and any(cell.mark == mark for row in cells for cell in row)]
        key = "".join(f"<span class=\"mark {m}\">{m}</span>" for m in used)
        label = html.escape(self.caption or "Table")
        return (f"<div class=\"table{width_class}\" role=\"region\" tabindex=\"0\" aria-label=\"{label}\">"
                f"<table>{caption}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"
                + (f"<p class=\"key\">Values marked: {key}</p>" if key else ""))


def _column(cells: Sequence[Cell], digits: int) -> list[str]:
    """Return the texts of a column: floats to a common number of decimals, those with an uncertainty each by its own."""
    values = [cell.value for cell in cells]
    # Each number to its own uncertainty first; a common number of decimals only among those that state none.
    texts = [with_uncertainty(cell.value, cell.uncertainty) if cell.uncertainty is not None and _is_number(cell.value)
             else f"{cell.value:.{digits}g}" if isinstance(cell.value, float) else str(cell.value) for cell in cells]
    is_plain_float = [isinstance(cell.value, float) and cell.uncertainty is None for cell in cells]
    floats = [text for text, is_free in zip(texts, is_plain_float) if is_free]
    if any("e" in text or "n" in text for text in floats):  # exponents, nan, inf: no common number of decimals
        return [number_text(value, digits=digits) if is_free else text for value, text,
                is_free in zip(values, texts, is_plain_float)]
    decimals = max((len(text.partition(".")[2]) for text in floats), default=0)
    return [f"{value:.{decimals}f}" if is_free else text for value, text, is_free in zip(values, texts, is_plain_float)]


def _cell_markup(cell: Cell, text: str, right: bool) -> str:
    content = mark_up(text)
    if cell.mark:
        content = f"<span class=\"mark {cell.mark}\" title=\"{cell.mark}\">{content}</span>"
    return f"<td{_alignment(right)}>{content}</td>"


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _is_numeric(value: object) -> bool:
    """Return whether a cell is a number or the text of one (with its ± and sign)."""
    return _is_number(value) or (isinstance(value, str) and _NUMERIC.fullmatch(value) is not None)


def _alignment(right: bool) -> str:
    return " class=\"n\"" if right else ""
