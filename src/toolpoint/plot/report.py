"""Report: one self-contained HTML page from titled sections of parts."""

from __future__ import annotations

import datetime
import html
import os
import re
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import toolpoint
from toolpoint._check import ToolpointError, fail
from toolpoint.plot.page.charts import Chart, ClickedSeries, Lookup
from toolpoint.plot.page.frame import asset, page
from toolpoint.plot.page.markup import mark_up
from toolpoint.plot.page.parts import Listing, Notes, Picture, Text
from toolpoint.plot.page.pole_picker import SCRIPT, PolePicker
from toolpoint.plot.page.tables import Table
from toolpoint.plot.program_view.view import PROGRAM_SCRIPT, ProgramView
from toolpoint.plot.shape_view.view import ShapeView, scripts_of

Part = Text | Table | Notes | Listing | Lookup | Picture | Chart | ClickedSeries | PolePicker | ShapeView | ProgramView
_ASSUMPTIONS_TITLE = "Assumptions"


@dataclass(frozen=True)
class Section:
    """A titled group of parts; a part that is a str is a `Text`."""

    title: str
    parts: tuple[Part, ...]

    @property
    def anchor(self) -> str:
        """Identifier of the section on the page."""
        return "s-" + (re.sub(r"[^a-z0-9]+", "-", self.title.lower()).strip("-") or "section")


@dataclass(frozen=True)
class Report:
    """A page: what was asked, the answer, doubts of it, the evidence, the assumptions. Every `with_` gives a new report.

    Parameters
    ----------
    title : str
    summary : str
        The answer in a sentence with its uncertainty; further paragraphs, parted by empty lines, are set smaller.
    sections : sequence of Section
        The evidence.
    subtitle : str
        One line over the answer, for example the machine and the pose.
    date : str
        Date line; today's date and time where empty.
    doubts : sequence of str
        What the reader must know before the answer is believed; stands right under it.
    assumptions : sequence of str
        What the answer rests on; the last section.
    reload_seconds : int
        How often a browser that shows the page reloads it, s, while what it shows is still growing; 0 never.
    """

    title: str
    summary: str = ""
    sections: tuple[Section, ...] = field(default=())
    subtitle: str = ""
    date: str = ""
    doubts: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()
    reload_seconds: int = 0

    def with_section(self, title: str, *parts: Part | str) -> Report:
        """Return the report with one more section."""
        checked_parts = tuple(Text(part) if isinstance(part, str) else part for part in parts)
        for number, part in enumerate(checked_parts):
            if not isinstance(part, Part):
                fail("with_section", f"part {number} is a {type(part).__name__}",
                     "must be Text, Table, Notes, Listing, Lookup, Picture, Chart, ShapeView or ProgramView",
                     remedy="wrap a plotly figure as Chart(figure)")
        return replace(self, sections=(*self.sections, Section(str(title), checked_parts)))

    def with_doubts(self, *doubts: str) -> Report:
        """Return the report with more doubts, each once."""
        return replace(self, doubts=tuple(dict.fromkeys((*self.doubts, *doubts))))

    def preceded_by(self, *doubts: str) -> Report:
        """Return the report with these doubts before its own, each once: those of what it rests on."""
        return replace(self, doubts=tuple(dict.fromkeys((*doubts, *self.doubts))))

    def with_assumptions(self, *assumptions: str) -> Report:
        """Return the report with more assumptions, each once."""
        return replace(self, assumptions=tuple(dict.fromkeys((*self.assumptions, *assumptions))))

    def reworded(self, change: Callable[[str], str]) -> Report:
        """Return the report with the words of its notes, doubts and assumptions changed, such as names of arguments."""
        def part_of(part: Part) -> Part:
            return replace(part, lines=tuple(map(change, part.lines))) if isinstance(part, Notes) else part

        sections = tuple(replace(section, parts=tuple(map(part_of, section.parts))) for section in self.sections)
        return replace(self, sections=sections, doubts=tuple(map(change, self.doubts)),
                       assumptions=tuple(map(change, self.assumptions)))

    def html(self) -> str:
        """Return the page: the chart library once, the shape script once, data as inert blocks, no outside address.

        Raises
        ------
        ToolpointError
            Where two charts or two views have one name, or a chart's click asks for a view that is not on the page.
        """
        sections = self._named()
        parts = [part for section in sections for part in section.parts]
        charts = any(isinstance(part, (Chart, ClickedSeries)) for part in parts)
        pickers = (SCRIPT,) if any(isinstance(part, PolePicker) for part in parts) else ()
        programs = (PROGRAM_SCRIPT,) if any(isinstance(part, ProgramView) for part in parts) else ()
        scripts = [asset(name) for name in ("packed_data.js", *scripts_of(parts), *pickers, *programs, "page.js")]
        return page(self.title, self._body(sections), scripts, charts=charts, reload_seconds=self.reload_seconds)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page and return its path; a path without ``.html`` is a folder and gets ``index.html``.

        The file appears whole or not at all: it is written beside its place and moved there.
        """
        target = Path(path)
        if target.suffix.lower() not in (".html", ".htm"):
            target = target / "index.html"
        text = self.html()
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            handle, draft = tempfile.mkstemp(dir=target.parent, prefix=".report-", suffix=".tmp")
            try:
                # Names of files reach Python as escaped bytes where the locale is none of UTF-8: the bytes are written again.
                with os.fdopen(handle, "w", encoding="utf-8", errors="surrogateescape", newline="\n") as file:
                    file.write(text)
                Path(draft).chmod(0o644)
                Path(draft).replace(target)
            except BaseException:
                Path(draft).unlink(missing_ok=True)
                raise
        except OSError as error:
            raise ToolpointError(f"path: {target} cannot be written ({error.strerror or error})") from error
        return target

    def _named(self) -> list[Section]:
        """Return the sections with names given to unnamed charts; refuse a name that appears twice."""
        number, used_names, views = 0, set[str](), set[str]()
        result = []
        for section in self.sections:
            parts: list[Any] = []
            for part in section.parts:
                if isinstance(part, Chart) and not part.name:
                    number += 1
                    part = replace(part, name=f"chart-{number}")
                if isinstance(part, (Chart, ShapeView, ProgramView)):
                    key = f"{type(part).__name__} {part.name!r}"
                    if key in used_names:
                        fail("Report", f"{key} appears twice", "names must differ", remedy="give one of them another name")
                    used_names.add(key)
                if isinstance(part, ShapeView):
                    views.add(part.name)
                parts.append(part)
            result.append(replace(section, parts=tuple(parts)))
        self._check_clicks(result, views)
        return result

    @staticmethod
    def _check_clicks(sections: Sequence[Section], views: set[str]) -> None:
        """Refuse a chart that follows, or shows on a click, a part that is not on the page."""
        charts = {part.name for section in sections for part in section.parts if isinstance(part, Chart)}
        for part in (part for section in sections for part in section.parts):
            if isinstance(part, ClickedSeries) and part.follows and part.follows not in charts:
                fail("ClickedSeries.follows", repr(part.follows), "must name a Chart on the page")
            if isinstance(part, Chart) and part.click_view and part.click_view not in views:
                fail("Chart.click_view", repr(part.click_view), "must name a ShapeView on the page")

    def _body(self, sections: Sequence[Section]) -> str:
        """Return contents, sections and footer as HTML."""
        date = self.date or datetime.datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z")
        if self.assumptions:
            sections = [*sections, Section(_ASSUMPTIONS_TITLE, (Notes(self.assumptions, "assumed", "What this rests on"),))]
        anchors = [f"{section.anchor}-{i}" for i, section in enumerate(sections, start=1)]
        links = "".join(f'<a href="#{a}">{mark_up(s.title)}</a>' for a, s in zip(anchors, sections))
        contents = f'<nav aria-label="Contents">{links}</nav>' if len(sections) > 1 else ""
        content = "".join(
            f'<section id="{a}"><h2>{mark_up(s.title)}</h2>'
            + "".join(part.fragment() for part in s.parts) + "</section>\n"
            for a, s in zip(anchors, sections))
        return (
            f'<a class="skip" href="#content">To the content</a><header>{self._head()}{contents}</header>\n'
            f'<main id="content">\n{content}</main>\n'
            f"<footer>toolpoint {html.escape(toolpoint.__version__)} · {html.escape(date)} · "
            "self-contained page: it asks no host for anything</footer>")

    def _head(self) -> str:
        """Return title, answer and doubts as HTML."""
        subtitle = f'<p class="subtitle">{mark_up(self.subtitle)}</p>' if self.subtitle else ""
        answer, _, further_text = self.summary.strip().partition("\n\n")
        answer_line = f'<p class="answer">{mark_up(answer)}</p>' if answer else ""
        summary_block = f'<div class="summary">{Text(further_text).fragment()}</div>' if further_text else ""
        doubts = Notes(self.doubts, "warning", "Before you rely on this").fragment()
        return f'<div class="brand">toolpoint</div><h1>{mark_up(self.title)}</h1>{subtitle}{answer_line}{doubts}{summary_block}'
