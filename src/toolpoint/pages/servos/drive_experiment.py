"""The page of a drive experiment: the answer, the ballbar's plot or the path with its error, histories, loops, inputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from toolpoint._rounding import number_text
from toolpoint.plot import Chart, Listing, Notes, Report, Table
from toolpoint.plot.figures.servos.ballbar import ballbar_plot
from toolpoint.plot.figures.servos.drives import histories, loop_bode, path_with_error
from toolpoint.studies.servos.circle_study import CircleStudy
from toolpoint.studies.servos.drive_experiment import DriveExperiment


def circle_page(study: CircleStudy, *, source_text: str = "", warnings: Sequence[str] = ()) -> Report:
    """Return the page of a circle beside its goal: the answer, what would meet it, then the page of the simulation.

    Examples
    --------
    Runs in ``examples/drive_a_circle.py``.
    """
    page = drive_page(study.experiment, source_text=source_text, warnings=warnings)
    answer = f"{study.status[0].upper()}{study.status[1:]}."
    report = Report(page.title, f"{answer} {page.summary}", subtitle=page.subtitle, date=page.date).with_doubts(*study.doubts)
    if study.lines():
        report = report.with_section("What would meet the goal", Notes(study.lines(), "note"))
    return replace(report.with_doubts(*page.doubts), sections=(*report.sections, *page.sections))


def drive_page(result: DriveExperiment, *, source_text: str = "", warnings: Sequence[str] = ()) -> Report:
    """Return the page of a result; `source_text` is the drive file's, `warnings` those of the run.

    Examples
    --------
    Runs in ``examples/drive_a_circle.py``.
    """
    drives = result.drives
    report = Report(drives.name, _answer(result), subtitle=drives.source)
    report = report.with_doubts(*result.doubts, *result.remarks, *warnings)
    report = report.with_section("Result", Table(["quantity", "value"], result.rows()))
    if result.turn is not None:
        report = report.with_section("Ballbar plot", Chart(
            ballbar_plot(result.turn.points, result.turn.radius, result.turn.peaks, axes=result.turn.axes),
            "Radial deviation from the nominal circle over one turn, enlarged to the scale of the rings. Peaks: of the tool, "
            f"outward over the median radius, at the reversals of {' and '.join(result.turn.axes)}.", name="ballbar"))
    else:
        report = report.with_section("Path with enlarged error", Chart(
            path_with_error(dict(result.errors)), "The error is drawn 50 times enlarged.", name="path"))
    for heading, chart in histories(result.result, dict(result.errors)).items():
        report = report.with_section(heading, Chart(chart))
    report = _with_loops(report, result)
    listing = [Listing("Drive file", source_text)] if source_text else []
    notes = [note for note in result.notes if note not in result.remarks]
    rests = [Notes(notes, "note", "What the simulation rests on")] if notes else []
    return report.with_section("Inputs and assumptions", *rests, Notes(drives.assumptions, "assumed"), *listing)


def _answer(result: DriveExperiment) -> str:
    """Return the circular deviation, or the largest contour error of the cuts, in a sentence."""
    if result.circle is not None and result.turn is not None:
        test, peak = result.circle, float(np.abs(result.turn.peaks).max())
        return (f"On a circle of {1e3 * result.turn.radius:g} mm radius the tool's circular deviation G is "
                f"{number_text(1e6 * test.deviation, digits=3)} µm; the highest quadrant peak is "
                f"{number_text(1e6 * peak, digits=3)} µm.")
    largest = result.largest_error("tool")
    if largest is None:
        return "The program cuts nothing: it has no contour error."
    return (f"The tool's contour error is at most {number_text(1e6 * largest, digits=3)} µm over "
            f"{result.result.time[-1]:.1f} s of motion, as simulated.")


def _with_loops(report: Report, result: DriveExperiment) -> Report:
    """Return the report with margins, bandwidths and Bode plots of the velocity and position loop of each axis."""
    bodes = [Chart(loop_bode(level, k, axis)) for k, axis in enumerate(result.result.axes)
             for level in (result.loops.velocity, result.loops.position)]
    margins = [[loop, axis, *(f"{value:.1f}" if np.isfinite(value) else "none" for value in row)]
               for loop, axis, *row in result.loops.figures]
    return report.with_section("Loops", Table(["loop", "axis", "gain margin, dB", "phase margin, °", "bandwidth, Hz"], margins),
                               *bodes)
