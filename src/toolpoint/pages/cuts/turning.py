"""The page of a turning cut: chart, response of the chip thickness, remarks."""

from __future__ import annotations

import numpy as np

from toolpoint._rounding import text_below
from toolpoint.cutting.advice.best_speed import from_chart
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.stability.catalogue import method_words
from toolpoint.pages.cuts.cut_words import depth_answers, dynamics_parts, limit_sentence, no_cut_words, plane_words
from toolpoint.pages.remarks import with_remarks
from toolpoint.plot import Chart, Lookup, Report, Table
from toolpoint.plot.figures.cuts.cutting import chip_response, intervals_of
from toolpoint.plot.figures.cuts.lobes import StabilityCurve, StabilityIntervals, stability_chart
from toolpoint.studies.cuts.turning.study import HEADER, TurningStudy
from toolpoint.vibration import Dof, Frf


def turning_page(result: TurningStudy) -> Report:
    """Return the page of a turning cut.

    >>> from toolpoint.studies import TurningCut, chart_turning, modal_dynamics
    >>> from toolpoint.vibration import Modes
    >>> stiffness, ratio, cutting = 2e7, 0.03, 1.5e9
    >>> tip = Modes([150.0], ratio, [[2 * np.pi * 150.0 / np.sqrt(stiffness)]], ("tip:+x",))
    >>> result = chart_turning(modal_dynamics(tip), TurningCut(cutting), np.linspace(500, 5000, 20))
    >>> page = turning_page(result)
    >>> "stable at any speed" in page.summary
    True
    """
    chart, limit, cut = result.chart, result.limit, result.cut
    words = f"K_f {cut.cutting / 1e6:g} N/mm^2" + (f", K_t {cut.tangential / 1e6:g} N/mm^2" if cut.tangential else "") + (
        f", process damping {cut.process_damping:g} N/m" if cut.process_damping else "")
    report = Report("Stability of a turning cut", _answer(result), subtitle=f"{words}; {plane_words(result.problem.plane)}")
    curves: list[StabilityCurve | StabilityIntervals] = [intervals_of(chart),
                                                         StabilityCurve(chart.speeds, chart.limit, "first limit")]
    if limit is not None and np.isfinite(limit.width) and not result.withheld:
        always = np.full(chart.speeds.size, limit.width)
        curves.append(StabilityCurve(chart.speeds, always, "stable at every speed"))
    # Without any limit the chart has no scale of its own: it ends where the search did.
    best, finite = from_chart(chart), np.isfinite(chart.limit).any()
    figure = stability_chart(curves, max_depth=None if finite else chart.depth_max, depth_name="Width of cut",
                             points=[] if result.withheld else [(best.speed, best.depth, "best cut, with some margin")])
    lookup = Lookup("How wide at my speed", "rev/min", chart.speeds.tolist(), chart.limit.tolist(), depth_answers(chart),
                    float(best.speed if best.depth > 0 else np.median(chart.speeds)), "width")
    report = report.with_section(
        "Chart", *([] if result.withheld else [lookup]),
        "Hover shows the stable interval, the chatter frequency at its end, and the stated error.",
        Chart(figure, name="stability"), Table(list(HEADER), result.rows()))
    lowest_real_part = (limit.frequency, limit.real) if limit is not None and np.isfinite(limit.width) else None
    report = report.with_section(
        "Response of the chip thickness", "The part of the receptance that the cutting force turns into chip thickness. Its "
        "least real part sets the width that is stable at every speed: b = -1/(2 K_f min Re G).",
        Chart(chip_response(_response(result.problem.plane), lowest_real_part), name="oriented"))
    report = report.with_section("The dynamics it stands on", *dynamics_parts(result.problem.plane))
    return with_remarks(report, [*chart.notes, f"Solved by {method_words(chart.method)}; dynamics and coefficients are "
                                                "taken as exact."])


def _answer(result: TurningStudy) -> str:
    """Return the least stable width in a sentence, and the width that is stable at any speed."""
    if result.withheld:
        return no_cut_words(result.withheld)
    limit = result.limit
    words = limit_sentence(result.chart, width=True)
    if limit is not None and np.isfinite(limit.width):
        words += f" Below {text_below(1e3 * limit.width)} mm it is stable at any speed at all."
        words += " That is doubtful: see below." if result.doubts else ""
    return words


def _response(plane: PlaneDynamics) -> Frf:
    """Return the response of the chip thickness over the modes, or on the measured lines."""
    frequency_min, frequency_max = plane.span
    f = np.linspace(0.3 * frequency_min, 1.5 * frequency_max, 3000) if plane.is_modal else np.asarray(plane.frequency)
    return Frf(f, plane.response(f)[:, :1, :1], (Dof("chip", "+x"),), (Dof("chip", "+x"),))
