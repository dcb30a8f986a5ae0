"""The page of a tool coupled to a spindle: its response with the 95 % interval, stick-outs, stability, remarks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import doubts_among
from toolpoint._rounding import number_text
from toolpoint.cutting import StabilityChart
from toolpoint.pages.cuts.cut_words import no_cut_words
from toolpoint.pages.remarks import with_remarks
from toolpoint.plot import Chart, Report, Table
from toolpoint.plot.figures.cuts.lobes import StabilityCurve, stability_chart
from toolpoint.plot.figures.measured.response_bands import magnitude_bands
from toolpoint.studies.cuts.coupling.peaks import peaks_of
from toolpoint.studies.cuts.lobes_study import ADVICE
from toolpoint.studies.cuts.tool_coupling import HEADER, ToolCoupling
from toolpoint.substructuring.receptance import PlaneReceptance


def tool_coupling_page(result: ToolCoupling, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a coupled tool; doubts stand first.

    >>> import numpy as np
    >>> from toolpoint.studies import study_tool
    >>> from toolpoint.substructuring import SegmentDescription, ShaftDescription
    >>> from toolpoint.substructuring.receptance import PlaneReceptance
    >>> spindle = PlaneReceptance(np.arange(1.0, 99.0), np.tile(np.diag([1e-8, 1e-6]), (98, 1, 1)), "x")  # m/N, rad/(N m)
    >>> page = tool_coupling_page(study_tool([spindle], ShaftDescription({"rod": SegmentDescription(0.1, 0.02)})))
    >>> page.summary[:36]
    'The tip is most compliant along x at'
    """
    source = f"; {result.tool.source}" if result.tool.source else ""
    report = Report("Tool-point response by receptance coupling", _answer(result), subtitle=f"{result.tool.words}{source}")
    report = report.with_doubts(*doubts_among(result.notes))
    curves = {f"tool along {tip.plane}": _with_band(tip) for tip in result.tips}
    report = report.with_section(
        "Response at the tip", "The line is what is predicted, the tint holds it with 95 % probability, line by line, as far "
        "as the noise of the measurement and the deviations that were stated go.",
        Chart(magnitude_bands(result.tips[0].frequency, curves), name="response"), Table(list(HEADER), result.rows()))
    if result.lobes is not None:
        report = report.with_section("Stability", Chart(_lobes({"first limit": result.lobes.chart}), name="stability"),
                                     Table(ADVICE, result.lobes.advice))
    if result.stick_outs:
        report = _with_stick_outs(report, result)
    notes = result.notes if result.lobes is None else (*result.notes, *result.lobes.chart.notes)
    return with_remarks(report, notes, warnings)


def _answer(result: ToolCoupling) -> str:
    """Return the greatest compliance of the tip, with its interval and frequency."""
    tip, peak = max(((tip, peaks_of(tip)[0]) for tip in result.tips), key=lambda pair: pair[1].height)
    band = ""
    if peak.intervals is not None:
        ends = [number_text(1e6 * end, digits=3) for end in peak.intervals[1]]
        band = f" ({ends[0]} to {ends[1]}, 95 %)"
    return (f"The tip is most compliant along {tip.plane} at {peak.frequency:.0f} Hz: "
            f"{number_text(1e6 * peak.height, digits=3)} µm/N{band}."
            + (f" {no_cut_words(result.withheld)}" if result.withheld else ""))


def _with_stick_outs(report: Report, result: ToolCoupling) -> Report:
    names = {f"{1e3 * part.length:.4g} mm": part for part in result.stick_outs}
    curves = {name: _with_band(part.tips[0]) for name, part in names.items()}
    parts = [Chart(magnitude_bands(result.tips[0].frequency, curves), name="stick-outs")]
    charts = {name: part.chart for name, part in names.items() if part.chart is not None}
    if charts:
        parts.append(Chart(_lobes(charts), name="stick-out-stability"))
    return report.with_section("Stick-out", *parts, Table(result.stick_out_header(), result.stick_out_rows()))


def _with_band(tip: PlaneReceptance) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return magnitude of the response with its 95 % ends, line by line; three times the magnitude without draws."""
    size = np.abs(tip.values[:, 0, 0])
    if tip.draws is None:
        return size, size, size
    # Weibull's plotting positions: of few draws the plain percentiles lie inside the interval that they stand for.
    lower_end, upper_end = np.percentile(np.abs(tip.draws[:, :, 0, 0]), [2.5, 97.5], axis=0, method="weibull")
    return size, lower_end, upper_end


def _lobes(charts: dict[str, StabilityChart]) -> object:
    """Return the stability charts of several tools in one."""
    finite = any(np.isfinite(chart.limit).any() for chart in charts.values())
    return stability_chart([StabilityCurve(chart.speeds, chart.limit, name) for name, chart in charts.items()],
                           max_depth=None if finite else max(chart.depth_max for chart in charts.values()))
