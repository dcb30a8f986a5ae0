"""The part of a page for measured FRFs: modes by quadrature picking, the responses, lobes straight from the data."""

from __future__ import annotations

from collections.abc import Sequence

from toolpoint.cutting import build
from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.frf import bode, real_imaginary
from toolpoint.plot.figures.lobes import StabilityCurve, stability_chart
from toolpoint.studies.cuts.measured_response import MeasuredResponse
from toolpoint.vibration import Modes


def with_measured(report: Report, result: MeasuredResponse, warnings: Sequence[str] = ()) -> Report:
    """Return the report with sections on the measured FRFs."""
    frf = result.frf
    shown = frf.selected(range(min(8, len(frf.outputs))), range(min(3, len(frf.inputs))))
    parts: list[Chart | Table | Notes | str] = [Chart(bode(shown, modes=result.modes)), Chart(real_imaginary(shown))]
    if result.modes is not None and result.modes.count:
        parts.append(_mode_table(result.modes))
    report = report.with_section("Measured responses", f"{frf!r}", *parts)
    if result.chart is not None:
        curve = StabilityCurve(result.chart.speeds, result.chart.limit, "from the measured FRF")
        cut = result.cut
        words = (f"{build.words(cut)}. Straight from the measured lines, no modal fit. "
                 f"Method: {result.chart.method or 'default'}.")
        report = report.with_section("Stability from the measured FRF", words, Chart(stability_chart(curve)))
    return report.with_section("Remarks on the measurement", *([Notes(warnings, "warning")] if warnings else []),
                               Notes(result.notes, "assumed"))


def _mode_table(modes: Modes) -> Table:
    rows = [[i + 1, float(modes.frequency[i]), 100 * float(modes.damping_ratio[i])] for i in range(modes.count)]
    return Table(["mode", "frequency Hz", "damping %"], rows,
                 "Modes by quadrature picking (peaks of the imaginary part): a first look, closely spaced modes merge")


