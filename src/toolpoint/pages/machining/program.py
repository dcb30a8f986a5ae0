"""The page of a program on a machine: the answer, the path in space by its load, the worst blocks with their lines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint.pages.machining.path_view import path_view
from toolpoint.pages.remarks import with_remarks
from toolpoint.plot import Cell, Chart, Listing, Report, ShapeView, Table
from toolpoint.plot.figures.machining import course_over_time
from toolpoint.studies.machining.result import HEADER, VERDICTS, MachiningStudy

LISTED_BLOCKS = 40  # worst ones, with their lines
MAX_LISTED_LINES = 3000  # of the program's text
MARK_OF_VERDICT = {"chatters": "doubtful", "stable": "good"}
MAX_SHOWN_RATIO = 4.0  # of limit over depth: more in hand is one colour


def machining_page(result: MachiningStudy, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a program."""
    report = Report(f"Program on a machine: {result.name}", result.answer,
                    subtitle=f"{result.setup.stock.words}; {len(result.laid.numbers)} tools")
    cutting = np.flatnonzero(result.blocks.verdict > 0)
    if cutting.size:
        report = report.with_section("Blocks, worst first", _worst(result), *_advice(result))
        report = report.with_section("The path in space", *_views(result))
        report = report.with_section("Over the time of the program", *_course(result))
    report = report.with_section("The whole program", Table(["quantity", "value"], result.figures), *_text(result))
    return with_remarks(report.with_doubts(*result.doubts), result.notes, warnings)


def _worst(result: MachiningStudy) -> Table:
    """Return the worst blocks, each with its line of the program."""
    rows: list[list[object]] = []
    for cells in result.worst_rows(LISTED_BLOCKS):
        line = int(cells[0])
        text = result.text[line - 1].strip() if 0 < line <= len(result.text) else ""
        rows.append([cells[0], Cell(cells[1], MARK_OF_VERDICT.get(cells[1], "")), *cells[2:], text[:60]])
    return Table([*HEADER, "block"], rows, "The first line is the most doubtful; depth and limit are axial depths at the "
                                           "block's own arc")


def _advice(result: MachiningStudy) -> list[str]:
    return [] if result.advice is None else result.advice.words.split("\n")


def _views(result: MachiningStudy) -> list[ShapeView]:
    """Return the path coloured by what it has in hand, where that is known, and by force."""
    blocks, views = result.blocks, list[ShapeView]()
    if (blocks.verdict == 1).any() or (blocks.verdict == 2).any():
        ratio = np.where(np.isfinite(blocks.ratio) & (blocks.ratio > 0), blocks.ratio, MAX_SHOWN_RATIO)
        demand = np.where(blocks.verdict > 0, 1 / np.clip(ratio, 1 / MAX_SHOWN_RATIO, MAX_SHOWN_RATIO), 0.0)
        views.append(path_view(result, demand, name="margin", title="Depth over stable depth: above 1 it chatters", unit=""))
    views.append(path_view(result, blocks.loads["lateral"], name="force", title="Largest force across the tool, N", unit="N"))
    return views


def _course(result: MachiningStudy) -> list[Chart]:
    blocks, time = result.blocks, np.cumsum(result.laid.time)
    labels = [f"line {line}, {VERDICTS[v]}" for line, v in zip(blocks.line.tolist(), blocks.verdict.tolist(), strict=True)]
    force = course_over_time(time, {"force, N": blocks.loads["lateral"]}, labels=labels, quantity="Force across the tool, N")
    power = course_over_time(time, {"power, W": blocks.loads["power"]}, labels=labels, quantity="Mean power, W")
    return [Chart(force, name="force-course"), Chart(power, name="power-course")]


def _text(result: MachiningStudy) -> list[Listing]:
    """Return the text of the program with the verdict beside the lines that cut."""
    if not result.text:
        return []
    verdict = dict[int, str]()
    for k in result.blocks.order[::-1].tolist():
        verdict[int(result.blocks.line[k])] = VERDICTS[result.blocks.verdict[k]]
    lines = [f"{number:6d}  {verdict.get(number, ''):10s} {line}" for number, line in enumerate(result.text[:MAX_LISTED_LINES],
            1)]
    left_out = [] if len(result.text) <= MAX_LISTED_LINES else [f"... {len(result.text) - MAX_LISTED_LINES} more lines"]
    return [Listing("The program, with its verdicts", "\n".join([*lines, *left_out]))]
