"""The part of a page for measured FRFs: modes by quadrature picking, the responses, lobes straight from the data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.app.console import spelled
from toolpoint.app.dynamics import read_responses
from toolpoint.cutting import StabilityChart, build, stability
from toolpoint.cutting.description import CuttingDescription
from toolpoint.modal_identification.quadrature import quadrature
from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.frf import bode, real_imaginary
from toolpoint.plot.figures.lobes import StabilityCurve, stability_chart
from toolpoint.studies.tool_directions import along_positive_axes, checked_driving_points, tool_directions
from toolpoint.studies.tool_dynamics import banded
from toolpoint.studies.tool_point import depth_limit, milling_problem
from toolpoint.vibration import Frf, Modes

EXAMPLE_CUT = CuttingDescription.of(
    diameter=0.02, teeth=4, immersion=0.5, tangential=767.0e6, normal=168.8e6, speeds=(3000.0, 20000.0),
    source="example: 20 mm end mill, four teeth, half immersion; Al 7075-T6, "
           "Chin. J. Mech. Eng. 2021, 10.1186/s10033-021-00536-9")


@dataclass(frozen=True, eq=False)
class MeasuredResults:
    """Measured FRFs: the band used, their modes, and the chart of the first (driving-point) one."""

    frf: Frf
    modes: Modes | None
    chart: StabilityChart | None
    cut: CuttingDescription
    notes: tuple[str, ...]


def read(files: Sequence[str | Path], quantity: str | None, band: tuple[float, float] | None) -> Frf:
    """Return the files as one receptance cut to a band (Hz), along positive axes."""
    return banded(along_positive_axes(read_responses([Path(file) for file in files], quantity)), band)


def computed(frf: Frf, cut: CuttingDescription | None) -> MeasuredResults:
    """Return modes by quadrature picking and the stability chart from the driving point, along x and y alike where
    only one direction was measured."""
    notes = list(frf.notes)
    modes: Modes | None = None
    try:
        modes = quadrature(frf)
    except ToolpointError as error:
        notes.append(f"No modes were picked: {error}")
    used = cut or EXAMPLE_CUT
    if cut is None:
        notes.append(f"No cut was given; the lobes are those of an {used.source}.")
    chart: StabilityChart | None = None
    try:
        ways = tool_directions(checked_driving_points(frf, "the measurement"), what="the measurement")
        x, y = ways.x, ways.y
        notes.append(f"The lobes take the response of {x} to {x} as driving-point response of the tool tip, "
                     + ("and the same across." if y == "same" else f"and that of {y} across."))
        direct = frf.selected([x], [x]) if y in (None, "same") else frf.selected([x, str(y)], [x, str(y)])
        problem = milling_problem(used, direct, x, y)
        chart = stability.chart(problem, np.linspace(*used.speeds, 400), depth_max=depth_limit(problem))
        notes += chart.notes
    except ToolpointError as error:  # unequal pitch, process damping and the like need modes
        notes.append(f"No stability chart from the measured lines: {error}")
    return MeasuredResults(frf, modes, chart, used, tuple(spelled(note) for note in dict.fromkeys(notes)))


def with_measured(report: Report, results: MeasuredResults, warnings: Sequence[str] = ()) -> Report:
    """Return the report with sections on the measured FRFs."""
    frf = results.frf
    shown = frf.selected(range(min(8, len(frf.outputs))), range(min(3, len(frf.inputs))))
    parts: list[Chart | Table | Notes | str] = [Chart(bode(shown, modes=results.modes)), Chart(real_imaginary(shown))]
    if results.modes is not None and results.modes.count:
        parts.append(_mode_table(results.modes))
    report = report.with_section("Measured responses", f"{frf!r}", *parts)
    if results.chart is not None:
        curve = StabilityCurve(results.chart.speeds, results.chart.limit, "from the measured FRF")
        cut = results.cut
        words = (f"{build.words(cut)}. Straight from the measured lines, no modal fit. "
                 f"Method: {results.chart.method or 'default'}.")
        report = report.with_section("Stability from the measured FRF", words, Chart(stability_chart(curve)))
    return report.with_section("Remarks on the measurement", *([Notes(warnings, "warning")] if warnings else []),
                               Notes(results.notes, "assumed"))


def _mode_table(modes: Modes) -> Table:
    rows = [[i + 1, float(modes.frequency[i]), 100 * float(modes.damping_ratio[i])] for i in range(modes.count)]
    return Table(["mode", "frequency Hz", "damping %"], rows,
                 "Modes by quadrature picking (peaks of the imaginary part): a first look, closely spaced modes merge")


