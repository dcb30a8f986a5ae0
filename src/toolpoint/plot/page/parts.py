"""Parts of a report: text, tables, notes, listings and charts, small frozen objects that give their HTML."""

from __future__ import annotations

import base64
import html
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from toolpoint._check import fail, one_of
from toolpoint.plot.page.frame import data_block

if TYPE_CHECKING:
    import plotly.graph_objects as go

MARKS = ("", "published", "chosen", "measured", "computed", "assumed", "good", "doubtful")
KINDS = ("assumed", "warning", "note")


@dataclass(frozen=True)
class Text:
    """Paragraphs; an empty line starts the next one."""

    text: str

    def fragment(self) -> str:
        """Return the paragraphs as HTML."""
        blocks = [block.strip() for block in re.split(r"\n\s*\n", self.text) if block.strip()]
        return "".join(f"<p>{html.escape(block)}</p>" for block in blocks)


@dataclass(frozen=True)
class Cell:
    """A table cell whose `mark`, one of MARKS, says where its value comes from or how good it is."""

    value: Any
    mark: str = ""

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
        right = [any(_is_number(row[i].value) for row in cells) for i in range(len(self.header))]
        head = "".join(f"<th scope=\"col\"{_side(r)}>{html.escape(name)}</th>" for name, r in zip(self.header, right))
        texts = list(zip(*(_column([row[i].value for row in cells], self.digits) for i in range(len(self.header)))))
        body = "".join("<tr>" + "".join(_td(c, t, r) for c, t, r in zip(row, text, right)) + "</tr>"
                       for row, text in zip(cells, texts))
        caption = f"<caption>{html.escape(self.caption)}</caption>" if self.caption else ""
        used = [mark for mark in MARKS if mark and any(cell.mark == mark for row in cells for cell in row)]
        key = "".join(f"<span class=\"mark {m}\">{m}</span>" for m in used)
        return (f"<div class=\"table\"><table>{caption}<thead><tr>{head}</tr></thead>"
                f"<tbody>{body}</tbody></table></div>"
                + (f"<p class=\"key\">Values marked: {key}</p>" if key else ""))


@dataclass(frozen=True)
class Notes:
    """A list of remarks: what was ``assumed``, a ``warning``, or a plain ``note``."""

    lines: Sequence[str]
    kind: str = "assumed"
    title: str = ""

    def __post_init__(self) -> None:
        one_of("Notes.kind", self.kind, KINDS)
        lines = (self.lines,) if isinstance(self.lines, str) else self.lines
        object.__setattr__(self, "lines", tuple(str(line) for line in lines))

    def fragment(self) -> str:
        """Return the list in a box; nothing where there are no lines."""
        if not self.lines:
            return ""
        title = self.title or {"assumed": "What was assumed", "warning": "Warnings", "note": "Notes"}[self.kind]
        items = "".join(f"<li>{html.escape(line)}</li>" for line in self.lines)
        role = " role=\"alert\"" if self.kind == "warning" else ""
        return f"<div class=\"notes {self.kind}\"{role}><h3>{html.escape(title)}</h3><ul>{items}</ul></div>"


@dataclass(frozen=True)
class Listing:
    """Text shown as it is (an input file), folded away until asked for."""

    title: str
    text: str

    def fragment(self) -> str:
        """Return the text in a details element."""
        return f"<details><summary>{html.escape(self.title)}</summary><pre>{html.escape(self.text)}</pre></details>"


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture in the page itself: the bytes of a PNG, JPEG, GIF or WebP file, also a moving one."""

    data: bytes
    alt: str
    caption: str = ""

    KINDS = {b"\x89PNG": "png", b"\xff\xd8\xff": "jpeg", b"GIF8": "gif", b"RIFF": "webp"}

    def fragment(self) -> str:
        """Return the picture as a figure."""
        kind = next((name for start, name in self.KINDS.items() if self.data.startswith(start)), "")
        if not kind:
            fail("Picture.data", "no picture", "must be a PNG, JPEG, GIF or WebP file")
        caption = f"<figcaption>{html.escape(self.caption)}</figcaption>" if self.caption else ""
        source = f"data:image/{kind};base64," + base64.b64encode(self.data).decode()
        return (f'<figure class="tp-figure"><img src="{source}" alt="{html.escape(self.alt)}" '
                f'style="max-width:100%;height:auto">{caption}</figure>')


@dataclass(frozen=True, eq=False)
class Chart:
    """A plotly figure on the page.

    Parameters
    ----------
    figure : plotly figure
    caption : str
    name : str
        Name in `window.toolpointCharts`; given by the report where empty.
    click_view : str
        Name of a `ShapeView` on the same page: a click on a point whose customdata is (or starts with) a whole number i
        shows mode i there, as a pole of a stabilization diagram does.
    """

    figure: go.Figure
    caption: str = ""
    name: str = field(default="")
    click_view: str = ""

    def __post_init__(self) -> None:
        for what, value in (("name", self.name), ("click_view", self.click_view)):
            if value and not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", value):
                fail(f"Chart.{what}", repr(value), "must be letters, digits, _ and -, the first a letter")

    def fragment(self) -> str:
        """Return the place of the chart and its data block."""
        source, height = f"tp-chart-{self.name}", int(self.figure.layout.height or 420)
        click = f' data-click-view="{self.click_view}"' if self.click_view else ""
        caption = f"<figcaption>{html.escape(self.caption)}</figcaption>" if self.caption else ""
        text = json.dumps(json.loads(self.figure.to_json()), separators=(",", ":"))
        inner = "<noscript>This chart needs JavaScript, which is switched off.</noscript>"
        return (f'<figure class="tp-figure"><div class="tp-chart" style="min-height:{height}px" '
                f'data-name="{self.name}" data-source="{source}"{click}>{inner}</div>{caption}</figure>'
                + data_block(source, text))


@dataclass(frozen=True, eq=False)
class ClickedSeries:
    """A chart whose curves are those of the point last clicked on another chart.

    Parameters
    ----------
    figure : plotly figure
        Axes and titles; its traces are replaced.
    follows : str
        Name of the Chart that is clicked.
    trace : str
        Name of the trace there whose points have a whole number as customdata: the place in `sets`.
    names, colours : sequences of str
        One for each curve.
    sets : sequence of (label, x, curves)
        For every point: words, abscissa (n,), and one array (n,) for each name.
    caption, name : str
    """

    figure: go.Figure
    follows: str
    trace: str
    names: Sequence[str]
    colours: Sequence[str]
    sets: Sequence[tuple[str, Any, Sequence[Any]]]
    caption: str = ""
    name: str = "clicked"

    def fragment(self) -> str:
        """Return the place of the chart and its data blocks."""
        rounded = (lambda values: [float(f"{v:.5g}") for v in values])
        data = {"trace": self.trace, "names": list(self.names), "colours": list(self.colours),
                "sets": [{"label": html.escape(label), "x": rounded(x), "y": [rounded(y) for y in curves]}
                         for label, x, curves in self.sets]}
        block = f"tp-series-{self.name}"
        inner = Chart(self.figure, self.caption, self.name).fragment()
        marked = inner.replace('class="tp-chart"', f'class="tp-chart" data-series="{block}" data-follows="{self.follows}"', 1)
        return marked + data_block(block, json.dumps(data, separators=(",", ":")))


def _column(values: Sequence[Any], digits: int) -> list[str]:
    texts = [f"{value:.{digits}g}" if isinstance(value, float) else str(value) for value in values]
    floats = [text for text, value in zip(texts, values) if isinstance(value, float)]
    if any("e" in text or "n" in text for text in floats):  # exponents, nan, inf: no common number of decimals
        return texts
    decimals = max((len(text.partition(".")[2]) for text in floats), default=0)
    return [f"{value:.{decimals}f}" if isinstance(value, float) else text for text, value in zip(texts, values)]


def _td(cell: Cell, text: str, right: bool) -> str:
    inner = html.escape(text)
    if cell.mark:
        inner = f"<span class=\"mark {cell.mark}\" title=\"{cell.mark}\">{inner}</span>"
    return f"<td{_side(right)}>{inner}</td>"


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _side(right: bool) -> str:
    return " class=\"n\"" if right else ""
