"""The page of a drive experiment: errors, path with enlarged error, histories, loops, inputs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint.plot import Chart, Listing, Notes, Report, Table
from toolpoint.plot.figures.drives import histories, loop_bode, path_with_error
from toolpoint.studies.servos.drive_experiment import DriveExperiment


def drive_page(result: DriveExperiment, *, source_text: str = "", warnings: Sequence[str] = ()) -> Report:
    """Return the page of a result; `source_text` is the drive file's, `warnings` those of the run."""
    drives = result.drives
    report = Report(drives.name, "Feed drives and servo along a programmed path.", subtitle=drives.source)
    first = [Notes(list(result.remarks), "warning")] if result.remarks else []
    report = report.with_section("Result", *first, Table(["quantity", "value"], result.rows()))
    report = report.with_section("Path with enlarged error", Chart(path_with_error(dict(result.errors))))
    for heading, chart in histories(result.result, dict(result.errors)).items():
        report = report.with_section(heading, Chart(chart))
    report = _with_loops(report, result)
    notes = list(dict.fromkeys([*warnings, *result.notes]))
    listing = [Listing("Drive file", source_text)] if source_text else []
    return report.with_section("Inputs and assumptions", *([Notes(notes, "warning")] if notes else []),
                               Notes(drives.assumptions, "assumed"), *listing)


def _with_loops(report: Report, result: DriveExperiment) -> Report:
    bodes = [Chart(loop_bode(level, k, axis)) for k, axis in enumerate(result.result.axes)
             for level in (result.loops.velocity, result.loops.position)]
    margins = [[loop, axis, *(f"{value:.1f}" if np.isfinite(value) else "none" for value in row)]
               for loop, axis, *row in result.loops.figures]
    return report.with_section("Loops", Table(["loop", "axis", "gain margin dB", "phase margin °", "bandwidth Hz"], margins),
                               *bodes)
