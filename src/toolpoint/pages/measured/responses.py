"""The part of a page for measured FRFs: modes by quadrature picking, the responses, lobes straight from the data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._rounding import number_text, text_below
from toolpoint.cutting import build
from toolpoint.pages.remarks import with_remarks
from toolpoint.plot import Chart, Report, Table
from toolpoint.plot.figures.cuts.lobes import StabilityCurve, stability_chart
from toolpoint.plot.figures.measured.frf import bode, real_imaginary
from toolpoint.studies.cuts.measured_response import MeasuredResponse
from toolpoint.vibration import Frf, Modes


def with_measured(report: Report, result: MeasuredResponse, warnings: Sequence[str] = ()) -> Report:
    """Return the report with sections on the measured FRFs."""
    frf = result.frf
    drawn_responses = frf.selected(range(min(8, len(frf.outputs))), range(min(3, len(frf.inputs))))
    parts: list[Chart | Table | str] = [Chart(bode(drawn_responses, modes=result.modes)),
                                        Chart(real_imaginary(drawn_responses))]
    if result.modes is not None and result.modes.count:
        parts.append(_mode_table(result.modes))
    report = replace(report, summary=_answer(result) if not report.sections else f"{report.summary}\n\n{_answer(result)}")
    report = report.with_section("Measured responses", _described(frf), *parts)
    if result.chart is not None:
        curve = StabilityCurve(result.chart.speeds, result.chart.limit, "from the measured FRF")
        cut = result.cut
        doubted = "Not to be used: see the doubts. " if result.withheld else ""
        words = (f"{doubted}{build.words(cut)}. Straight from the measured lines, no modal fit. "
                 f"Method: {result.chart.method or 'default'}.")
        report = report.with_section("Stability from the measured FRF", words, Chart(stability_chart(curve)))
    return with_remarks(report, result.notes, warnings)


def _described(frf: Frf) -> str:
    outputs, inputs = len(frf.outputs), len(frf.inputs)
    return (f"{outputs} output{'s' * (outputs > 1)} and {inputs} input{'s' * (inputs > 1)}, "
            f"{frf.frequency.size} lines from {frf.frequency[0]:.4g} to {frf.frequency[-1]:.4g} Hz, {frf.quantity}.")


def _answer(result: MeasuredResponse) -> str:
    """Return the strongest mode and the lowest stable depth."""
    words = "No mode was picked"
    if result.modes is not None and result.modes.count:
        f = result.modes.frequency
        words = (f"{result.modes.count} modes from {f.min():.4g} to {f.max():.4g} Hz, picked at the peaks of the imaginary "
                 "part (a first look, without an interval: toolpoint identify gives one)")
    if result.withheld:
        first = result.withheld[0]
        words += f". No stable depth is given, as the response is doubtful: {first.what}: {first.why}"
    elif result.chart is not None:
        words += ". " + limit_words(result.chart.limit, result.chart.speeds, result.chart.depth_max)
    return words if words.endswith(".") else words + "."


def limit_words(limit: FloatArray, speeds: FloatArray, depth_max: float) -> str:
    """Return the least limit of a chart in a sentence."""
    if not np.isfinite(limit).any():
        return f"No limit was found up to {number_text(1e3 * depth_max, digits=3)} mm."
    lowest_index = int(np.argmin(limit))
    return f"Straight from the data {text_below(1e3 * float(limit[lowest_index]))} mm is stable at every charted speed " \
           f"(least at {speeds[lowest_index]:.0f} rev/min)."


def _mode_table(modes: Modes) -> Table:
    rows = [[i + 1, float(modes.frequency[i]), 100 * float(modes.damping_ratio[i])] for i in range(modes.count)]
    return Table(["mode", "frequency, Hz", "damping, %"], rows,
                 "Modes by quadrature picking (peaks of the imaginary part): a first look, closely spaced modes merge")


