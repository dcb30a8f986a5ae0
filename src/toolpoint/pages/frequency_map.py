"""The page of a frequency map: every mode over the workspace."""

from __future__ import annotations

from toolpoint.plot import Chart, Notes, Report
from toolpoint.plot.figures.pose_map import frequency_curves, frequency_map
from toolpoint.studies.machines.pose_map import PoseMap


def frequency_map_page(result: PoseMap, name: str) -> Report:
    """Return a page with the map of every mode over the first two axes (the others at their first position)."""
    report = Report(f"Natural frequencies over the workspace: {name}", repr(result))
    names = list(result.axes)
    values = result.frequency
    while values.ndim > 3:
        values = values[..., 0, :]
    if len(names) == 1:
        report = report.with_section("Frequencies", Chart(frequency_curves(result.axes[names[0]], values, axis=names[0])))
    else:
        chart = frequency_map(result.axes[names[0]], result.axes[names[1]], values, axes=(names[0], names[1]))
        report = report.with_section("Frequencies", Chart(chart))
    if len(names) > 2:
        report = report.with_section("Cut", f"Axes {', '.join(names[2:])} stand at their first position.")
    if result.failures:
        report = report.with_section("Failed poses", Notes(result.failed(), "warning"))
    return report
