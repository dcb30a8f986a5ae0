"""The page of the published milling robot: from its datasheet to what to change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from toolpoint.pages.remarks import with_remarks
from toolpoint.pages.robots.accuracy import accuracy_page
from toolpoint.pages.robots.places import place_page
from toolpoint.pages.robots.robot import robot_page
from toolpoint.pages.robots.screening import screening_page
from toolpoint.plot import Chart, Notes, Report
from toolpoint.plot.figures.machines.pose_map import frequency_curves
from toolpoint.studies.screening.robot_demo import SPEEDS, RobotDemo
from toolpoint.studies.screening.source_figures import SourceFigures

_DRAWN_LINE_STEP = 8  # lines of a response from one that is drawn to the next: 2 Hz


def answer_of(result: RobotDemo) -> str:
    """Return the most even place of the robot, its milling error there, and the change of the screened ones that helps most."""
    best, screening = result.search.best, result.screening.screening
    error = screening.metric("position error")[0]
    change = error / error[0] - 1
    best_variant = int(change.argmin())
    start, end = (" ".join(f"{1e3 * v:.0f}" for v in place) for place in (best.start, best.end))
    return (f"The wrist's most even 200 mm run from ({start}) to ({end}) mm: {best.total:.2g} Hz over four modes from "
            f"{result.datasheet.frequency[0]:.3g} Hz on. A side of 200 mm is milled with a mean error of "
            f"{1e6 * result.accuracy.position_error:.2g} \u00b5m; of {len(change) - 1} changes screened, "
            f"{screening.design.words(best_variant)} helps most, {100 * change[best_variant]:+.1f} %.")


def robot_demo_page(result: RobotDemo, text: str, name: str, *, warnings: Sequence[str] = ()) -> Report:
    """Return the page of the demo; `text` is the datasheet's file."""
    report = robot_page(result.datasheet, text, name)
    report = replace(report, title=f"{result.datasheet.sheet.name}: from its datasheet to what to change",
                     summary=answer_of(result), sections=())
    first = robot_page(result.datasheet, text, name).sections
    report = report.with_section("The source's conclusions",
                                 Notes(result.findings(), "note", "Position error beside the source's"))
    for section in first:
        report = report.with_section(section.title, *section.parts)
    limit = 1e3 * result.chart.limit[:, None]
    parts = [place_page(result.map, result.search, "wrist centre, tool along x"), accuracy_page(result.accuracy, 2),
             screening_page(result.screening, "23 variants")]
    for part in parts:
        for section in part.sections:
            report = report.with_section(section.title, *section.parts)
        report = report.with_doubts(*part.doubts).with_assumptions(*part.assumptions)
        if part is parts[0]:
            report = report.with_section("Beside the source", Notes(result.region_lines(), "note", "The region"))
            report = report.with_section("Stable depths", Chart(frequency_curves(
                SPEEDS, limit, axis="spindle speed", unit="rev/min", names=["limit"], quantity="Stable depth, mm")),
                f"In the middle of the source's region; {result.chart.method}, first loss of stability alone; none is drawn "
                "where no depth charted has it.")
    report = report.with_section("The source's figures 34 to 37 and 41",
                                 Notes(result.figures.words(), "note", "Numbers of both"), *_source_charts(result.figures))
    return with_remarks(report, list(warnings))


def _source_charts(figures: SourceFigures) -> list[Chart | str]:
    """Return real parts, zero-order limit and forces of a tooth."""
    real, limit = 1e6 * figures.real[::_DRAWN_LINE_STEP], 1e3 * figures.limit[:, None]
    return [Chart(frequency_curves(figures.lines[::_DRAWN_LINE_STEP], real, axis="frequency", unit="Hz", names=["x", "y", "z"],
                                   quantity="Real part, µm/N")),
            Chart(frequency_curves(figures.speeds, limit, axis="spindle speed", unit="rev/min", names=["zero order, z"],
                                   quantity="Depth, mm"), "One direction alone, modes below 150 Hz left out, as the source."),
            Chart(frequency_curves(np.degrees(figures.angle), figures.force, axis="turn of a tooth", unit="°",
                                   names=["along the feed", "across it"], quantity="Force, N for a millimetre"))]
