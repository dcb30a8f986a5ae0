"""The page of a lobes study: chart, surface location error, cuts to make, probability of stability, remarks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint.cutting import MillingProblem, StabilityChart
from toolpoint.cutting.advice.best_speed import from_chart
from toolpoint.cutting.advice.probability import ProbabilityChart
from toolpoint.cutting.surface.location import location_error, wall_side
from toolpoint.pages.remarks import with_remarks
from toolpoint.plot import Chart, Report, Table
from toolpoint.plot.figures.cutting import intervals_of, simulation_series, surface_location, with_simulations
from toolpoint.plot.figures.lobes import StabilityCurve, stability_chart
from toolpoint.plot.figures.probability import importance_chart, probability_chart
from toolpoint.studies.cuts.lobes_study import ADVICE, LobesStudy
from toolpoint.studies.cuts.uncertain_cut import CONTRADICTED, Uncertainty, contradictions


def lobes_page(result: LobesStudy, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a lobes study: the chart, surface location error where it can be told, cuts to make, probability."""
    report = _with_chart(result)
    report = _with_surface_error(report, result.problem, result.chart)
    report = report.with_section("Cuts to make", *result.contradictions, Table(ADVICE, result.advice))
    if result.probability is not None:
        report = _with_probability(report, result.probability, result.uncertainty)
    return with_remarks(report, result.chart.notes, [*warnings, *result.doubts])


def _with_chart(result: LobesStudy) -> Report:
    problem, chart, runs = result.problem, result.chart, result.runs
    report = Report("Stability of a milling cut", f"{problem!r}", subtitle=f"method {chart.method}")
    words = "Hover shows the stable interval, the chatter frequency at its end, and the stated numerical error."
    best = from_chart(chart)
    top = None if np.isfinite(chart.limit).any() else chart.depth_max  # nothing to scale the chart by
    figure = stability_chart([intervals_of(chart), StabilityCurve(chart.speeds, chart.limit, "first limit")], max_depth=top,
                           points=[(best.speed, best.depth, "best cut, with some margin")])
    if runs:
        report = report.with_section("Chart", words, Chart(with_simulations(figure, runs), name="stability"),
                                     simulation_series(runs, "stability"))
    else:
        report = report.with_section("Chart", words, Chart(figure, name="stability"))
    return report


def _with_surface_error(report: Report, problem: MillingProblem, chart: StabilityChart) -> Report:
    side = wall_side(problem.engagement)
    if problem.feed_per_tooth > 0 and problem.tool.is_regular and problem.tool.corner_radius == 0 and side is not None:
        depth = 0.5 * float(np.min(chart.limit))
        if np.isfinite(depth) and depth > 0:
            error = location_error(problem, chart.speeds, depth, side=side)
            where = "leave" if side == "exit" else "enter"
            words = f"At a depth of {1e3 * depth:.4g} mm, of the wall where the teeth {where} the cut."
            report = report.with_section("Surface location error", words, Chart(surface_location(chart.speeds, error)))
    return report


def _with_probability(report: Report, sampled: ProbabilityChart, uncertainty: Uncertainty) -> Report:
    """Return the report with the probability chart and what to measure better."""
    after = sampled.after_cuts(uncertainty.cuts)
    cuts = [(speed, depth, "stable cut" if stable else "cut with chatter") for speed, depth, stable in uncertainty.cuts]
    words = (f"{sampled.stable.shape[0]} charts with parameters drawn at random"
             + (f", weighed by the outcome of {len(cuts)} cuts." if cuts else ".")
             + (f" Not to be relied on: {CONTRADICTED}." if contradictions(sampled, uncertainty.cuts) else ""))
    report = report.with_section("Probability of stability", words, Chart(probability_chart(after, cuts), name="probability"))
    share = after.importance()
    first = next(iter(share))
    return report.with_section(
        "What to measure better", f"A better value of \"{first}\" would narrow the chart most: alone it explains "
        f"{100 * share[first]:.0f} % of the variance of the limit.", Chart(importance_chart(share), name="importance"))
