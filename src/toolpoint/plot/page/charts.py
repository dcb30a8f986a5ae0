"""Charts of a report: a plotly figure, curves of the point that is clicked, and a field that answers a number."""

from __future__ import annotations

import html
import json
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from toolpoint._check import fail
from toolpoint.plot.page.chart_data import chart_text
from toolpoint.plot.page.frame import deflate_block
from toolpoint.plot.page.markup import mark_up

if TYPE_CHECKING:
    import plotly.graph_objects as go


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
    narrowest : int
        Width in pixels below which the chart would crowd: on a smaller screen it scrolls sideways. A figure may state its own
        (`theme.needs_width`).
    """

    figure: go.Figure
    caption: str = ""
    name: str = field(default="")
    click_view: str = ""
    narrowest: int = 0

    def __post_init__(self) -> None:
        for what, value in (("name", self.name), ("click_view", self.click_view)):
            # Names become identifiers of the document and of its scripts: anything else could break out of the attribute.
            if value and not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", value):
                fail(f"Chart.{what}", repr(value), "must be letters, digits, _ and -, the first a letter")

    def fragment(self) -> str:
        """Return the place of the chart and its data block."""
        source, height = f"tp-chart-{self.name}", int(self.figure.layout.height or 420)
        max_width = f";max-width:{int(self.figure.layout.width)}px" if self.figure.layout.width else ""
        narrowest = max(self.narrowest, int((self.figure.layout.meta or {}).get("narrowest", 0)))
        min_width = f";min-width:{narrowest}px" if narrowest else ""
        title = _plain_title(self.figure)
        heading = f'<h3 class="tp-title">{mark_up(title)}</h3>' if title else ""
        click = f' data-click-view="{self.click_view}"' if self.click_view else ""
        caption = f"<figcaption>{mark_up(self.caption)}</figcaption>" if self.caption else ""
        label = html.escape(_screen_reader_text(self.figure, self.caption))
        no_script = "<noscript>This chart needs JavaScript, which is switched off.</noscript>"
        return (f'<figure class="tp-figure">{heading}<div class="tp-chart" style="min-height:{height}px{max_width}{min_width}" '
                f'role="img" aria-label="{label}" data-name="{self.name}" data-source="{source}"{click}>{no_script}</div>'
                f"{caption}</figure>" + deflate_block(source, chart_text(self.figure)))


@dataclass(frozen=True, eq=False)
class ClickedSeries:
    """A chart whose curves are those of the point last clicked on another chart, or of the name chosen from a list.

    Parameters
    ----------
    figure : plotly figure
        Axes and titles; its traces are replaced.
    follows : str
        Name of the Chart that is clicked; empty where there is none.
    trace : str
        Name of the trace there whose points have a whole number as customdata: the place in `sets`.
    names, colours : sequences of str
        One for each curve.
    sets : sequence of (label, x, curves)
        For every point: words, abscissa (n,), and one array (n,) for each name.
    caption, name : str
    label : str
        Words before a list from which a set is chosen by its label; no list where empty.
    mode : str
        How curves are drawn: ``lines``, ``lines+markers``.

    >>> import plotly.graph_objects as go
    >>> sets = [("limit", [1.0, 2.0], [[3.0, 4.0], [5.0, 6.0]])]  # one curve for each point of the other chart
    >>> series = ClickedSeries(go.Figure(), "map", "depth", ["X 0", "X 100 mm"], ["#000"], sets)
    >>> series.names
    ['X 0', 'X 100 mm']
    """

    figure: go.Figure
    follows: str
    trace: str
    names: Sequence[str]
    colours: Sequence[str]
    sets: Sequence[tuple[str, Any, Sequence[Any]]]
    caption: str = ""
    name: str = "clicked"
    label: str = ""
    mode: str = "lines"

    def fragment(self) -> str:
        """Return the place of the chart and its data blocks."""
        def short(values: Any, digits: int) -> list[float | None]:
            # Six digits for places and five for values: more than a chart of 2000 pixels shows, at half the size of the
            # page.
            return [float(f"{v:.{digits}g}") if math.isfinite(v) else None for v in values]

        data = {"trace": self.trace, "mode": self.mode, "names": list(self.names), "colours": list(self.colours),
                "sets": [{"label": label, "x": short(x, 6), "y": [short(y, 5) for y in curves]}
                         for label, x, curves in self.sets]}
        block = f"tp-series-{self.name}"
        chart = Chart(self.figure, self.caption, self.name).fragment()
        marked = chart.replace('class="tp-chart"', f'class="tp-chart" data-series="{block}" data-follows="{self.follows}"', 1)
        options = "".join(f'<option value="{k}">{html.escape(label)}</option>' for k, (label, _, _) in enumerate(self.sets))
        choice = (f'<p class="tp-lookup"><label for="{block}-list">{mark_up(self.label)}</label> '
                  f'<select id="{block}-list" data-series="{block}">{options}</select></p>') if self.label else ""
        return choice + marked + deflate_block(block, json.dumps(data, separators=(",", ":")))


@dataclass(frozen=True)
class InverseField:
    """Second field of a `Lookup`: a quantity with which its values go inversely, exactly.

    label, unit, start : of the field, start the number of which the values were computed; factor : from a value to
    `value_unit`, in which it is printed; words : when the rule holds, printed small; upper : the largest value that was
    searched, for places without a limit.

    >>> pressure = InverseField("cutting force coefficient", "MPa", 800.0, 1e3, "mm", 5e-3, "above 5 mm")
    >>> pressure.start
    800.0
    """

    label: str
    unit: str
    start: float
    factor: float
    value_unit: str
    upper: float
    words: str

    def fragment(self, name: str) -> str:
        """Return the label and the field."""
        field_id = f"tp-inverse-{name}"
        return (f' <span class="tp-second"><label for="{field_id}">{mark_up(self.label)}</label> '
                f'<input id="{field_id}" class="tp-inverse" '
                f'type="number" inputmode="decimal" step="any" min="{self.start / 10:g}" max="{self.start * 10:g}" '
                f'value="{self.start:.6g}"> <span>{html.escape(self.unit)}</span></span>')

    def to_dict(self) -> dict[str, Any]:
        """Return what the script of the page needs."""
        return {"label": self.label, "unit": self.unit, "start": float(f"{self.start:.6g}"), "factor": self.factor,
                "valueUnit": self.value_unit, "upper": self.upper, "words": self.words}


@dataclass(frozen=True, eq=False)
class TableFields:
    """Two further fields of a `Lookup`, for whose numbers the values were computed too: one between, one whole number.

    Parameters
    ----------
    labels : (str, str)
        Of the fields.
    starts : (float, int)
        Those of the lookup's own values.
    rows, columns : sequences of numbers
        Increasing.
    abscissae : sequence of floats
    values : (n_rows, n_columns, n) floats
        Infinite where none was found, down to `upper` (n_rows, n_columns).
    factor, value_unit : from a value to the unit in which it is printed
    words : str
        What the values are, printed small.
    remedy : str
        The command for numbers that were not computed; `{0}` and `{1}` stand for them.

    >>> import numpy as np
    >>> values = np.array([[[1e-3, 3e-3]], [[6e-4, np.inf]]])  # immersions 0.25 and 0.5, two teeth, two speeds
    >>> fields = TableFields(("immersion", "teeth"), (0.5, 2), (0.25, 0.5), (2,), (1000, 2000), values, np.full((2, 1), 4e-3),
    ...                      1e3, "mm", "By the engine.", "Run --immersion {0} --teeth {1}.")
    >>> fields.labels
    ('immersion', 'teeth')
    """

    labels: tuple[str, str]
    starts: tuple[float, int]
    rows: Sequence[float]
    columns: Sequence[int]
    abscissae: Sequence[float]
    values: Any
    upper: Any
    factor: float
    value_unit: str
    words: str
    remedy: str

    def fragment(self, name: str) -> str:
        """Return labels and fields."""
        return "".join(
            f' <span class="tp-second"><label for="tp-{kind}-{name}">{mark_up(label)}</label> '
            f'<input id="tp-{kind}-{name}" class="tp-{kind}" type="number" inputmode="decimal" step="any" min="{numbers[0]:g}" '
            f'max="{numbers[-1]:g}" value="{start:g}"></span>'
            for kind, label, start, numbers in zip(("row", "column"), self.labels, self.starts, (self.rows, self.columns),
                                                   strict=True))

    def to_dict(self) -> dict[str, Any]:
        """Return what the script of the page needs; values have four digits."""
        values = [[[float(f"{v:.4g}") if math.isfinite(v) else None for v in line] for line in row] for row in self.values]
        return {"labels": list(self.labels), "starts": list(self.starts), "rows": [float(f"{v:.6g}") for v in self.rows],
                "columns": list(self.columns), "at": [float(f"{v:.7g}") for v in self.abscissae], "values": values,
                "upper": [[float(f"{v:.4g}") for v in row] for row in self.upper], "factor": self.factor,
                "valueUnit": self.value_unit, "words": self.words, "remedy": self.remedy}


@dataclass(frozen=True)
class Lookup:
    """A field for a number and the answer to it, from answers computed beforehand: "how deep at my speed".

    Between two abscissae the answer with the lower value is given, and both are named.

    Parameters
    ----------
    label, unit : str
        Words before the field, and the unit behind it.
    abscissae : sequence of floats
        Increasing.
    values : sequence of floats
        By which the lower of two answers is found.
    answers : sequence of str
        A sentence for each abscissa.
    start : float
        What the field holds at first.
    name : str
    inverse : InverseField, optional
        A second number with which the values go inversely.
    table : TableFields, optional
        Two further numbers for which the values were computed too.

    >>> lookup = Lookup("spindle speed", "rev/min", [6000.0, 8000.0], [1e-3, 2e-3], ["1 mm", "2 mm"], 6000.0)
    >>> "2 mm" in lookup.fragment()
    True
    """

    label: str
    unit: str
    abscissae: Sequence[float]
    values: Sequence[float]
    answers: Sequence[str]
    start: float
    name: str = "lookup"
    inverse: InverseField | None = None
    table: TableFields | None = None

    def __post_init__(self) -> None:
        if not len(self.abscissae) == len(self.values) == len(self.answers) or len(self.abscissae) == 0:
            fail("Lookup", f"{len(self.abscissae)} places, {len(self.values)} values, {len(self.answers)} answers",
                 "must be equally many, at least one")

    def fragment(self) -> str:
        """Return the field, the place of the answer, and the data block."""
        abscissae = [float(f"{v:.7g}") for v in self.abscissae]
        values = [float(f"{v:.7g}") if math.isfinite(v) else None for v in self.values]
        data = {"at": abscissae, "values": values, "answers": list(self.answers), "unit": self.unit,
                "inverse": None if self.inverse is None else self.inverse.to_dict(),
                "table": None if self.table is None else self.table.to_dict()}
        second = "" if self.inverse is None else self.inverse.fragment(self.name)
        second += "" if self.table is None else self.table.fragment(self.name)
        field_id, source = f"tp-field-{self.name}", f"tp-lookup-{self.name}"
        return (f'<div class="tp-lookup" data-source="{source}"><label for="{field_id}">{mark_up(self.label)}</label> '
                f'<input id="{field_id}" type="number" inputmode="decimal" step="any" '
                f'min="{abscissae[0]:g}" max="{abscissae[-1]:g}" value="{self.start:g}"> '
                f'<span>{html.escape(self.unit)}</span>{second}'
                f'<output for="{field_id}" aria-live="polite"><noscript>This field needs JavaScript.</noscript></output></div>'
                + deflate_block(source, json.dumps(data, separators=(",", ":"))))


def _plain_title(figure: go.Figure) -> str:
    """Return the title of a figure without plotly's markup; the page sets it over the chart, where it can break lines."""
    return html.unescape(re.sub(r"<[^>]+>", " ", str(figure.layout.title.text or ""))).strip()


def _screen_reader_text(figure: go.Figure, caption: str) -> str:
    """Return what a screen reader says of a chart: its title, what is drawn over what, and its caption."""
    title = _plain_title(figure)
    named = [axis.title.text for axis in (figure.layout.yaxis, figure.layout.xaxis) if axis.title.text]
    axes = [re.sub(r"<[^>]+>", "", str(name)) for name in named]
    words = [title, " over ".join(axes), caption]
    return html.unescape(". ".join(word.strip().rstrip(".") for word in words if word.strip())) or "Chart"
