"""The page of the published milling robot: from its datasheet to what to change."""

from __future__ import annotations

from collections.abc import Sequence

from toolpoint.pages.remarks import with_remarks
from toolpoint.pages.robots.accuracy import accuracy_page
from toolpoint.pages.robots.places import place_page
from toolpoint.pages.robots.robot import robot_page
from toolpoint.pages.robots.screening import screening_page
from toolpoint.plot import Chart, Notes, Report
from toolpoint.plot.figures.machines.pose_map import frequency_curves
from toolpoint.studies.screening.robot_demo import SPEEDS, RobotDemo


def robot_demo_page(result: RobotDemo, text: str, name: str, *, warnings: Sequence[str] = ()) -> Report:
    """Return the page of the demo; `text` is the datasheet's file."""
    report = robot_page(result.datasheet, text, name)
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
                "In the middle of the source's region; zero-order method, depth up to the chart's end where no limit is drawn.")
    report = report.with_section("The source's conclusions", Notes(result.findings(), "note", "Agree or differ"))
    return with_remarks(report, list(warnings))
