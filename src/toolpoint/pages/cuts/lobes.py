"""The page of a lobes study: the answer, how deep at a speed, the chart, its dynamics, cuts to make, probability, remarks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._rounding import number_text, text_below
from toolpoint.cutting import MillingProblem, StabilityChart
from toolpoint.cutting.advice.best_speed import from_chart
from toolpoint.cutting.advice.probability import ProbabilityChart
from toolpoint.cutting.stability.catalogue import method_words
from toolpoint.cutting.surface.location import location_error, wall_side
from toolpoint.pages.cuts.cut_words import depth_answers, dynamics_parts, limit_sentence, no_cut_words, problem_words
from toolpoint.pages.remarks import with_remarks
from toolpoint.plot import Chart, ClickedSeries, InverseField, Lookup, Report, Table, TableFields
from toolpoint.plot.figures.cuts.cutting import (
    chatter_frequencies,
    intervals_of,
    simulation_series,
    surface_location,
    with_simulations,
)
from toolpoint.plot.figures.cuts.lobes import StabilityCurve, stability_chart
from toolpoint.plot.figures.cuts.probability import importance_chart, probability_chart
from toolpoint.studies.cuts.lobes_study import ADVICE, LobesStudy, least_limit, needs_long_edges
from toolpoint.studies.cuts.uncertain_cut import CONTRADICTED, Uncertainty, contradictions


def lobes_page(result: LobesStudy, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a lobes study: the chart, surface location error where it can be told, cuts to make, probability.

    >>> from toolpoint.cutting import ZeroOrder
    >>> from toolpoint.studies import chart_lobes, modal_dynamics
    >>> from toolpoint.vibration import Modes
    >>> tip = Modes([900.0, 900.0], 0.02, 1.5 * np.eye(2), ("tip:+x", "tip:+y"))
    >>> cut = {"diameter": 0.012, "teeth": 2, "direction": "slot", "tangential": 8e8, "normal": 3e8}
    >>> page = lobes_page(chart_lobes(modal_dynamics(tip), cut, speeds=np.linspace(6e3, 9e3, 5), method=ZeroOrder()))
    >>> page.title
    'Stability of a milling cut'
    """
    report = Report("Stability of a milling cut", _answer(result), subtitle=problem_words(result.problem))
    report = _with_chart(report, result)
    report = report.with_section("Cuts to make", *result.contradictions, Table(ADVICE, result.advice))
    report = report.with_section("The dynamics it stands on", *dynamics_parts(result.problem.plane))
    report = _with_surface_error(report, result.problem, result.chart)
    if result.probability is not None:
        report = _with_probability(report, result.probability, result.uncertainty)
    doubts = [*warnings, *result.doubts, *result.contradictions]
    return with_remarks(report, [*result.chart.notes, *_rests(result)], doubts)


def _answer(result: LobesStudy) -> str:
    """Return what is stable at every speed, with its interval where one is known, and the best cut; or why none is given."""
    if result.withheld:
        return no_cut_words(result.withheld)
    chart, best = result.chart, from_chart(result.chart)
    words = limit_sentence(chart, result.lowest)
    if result.spread is not None and np.isfinite(chart.limit).any():
        # Rounded both ways alike: only a depth that is advised is rounded down.
        lower_end, upper_end = (1e3 * end for end in result.spread.lowest_ends(*least_limit(chart, result.lowest)))
        words += f" Its 95 % interval from the machine's identified numbers: {number_text(lower_end, digits=3)} to " \
                 f"{number_text(upper_end, digits=3)} mm."
    if best.depth <= 0:
        return words
    edge = ", if its edges are so long" if needs_long_edges(result.problem, best.depth) else ""
    return f"{words} The best cut with a margin: {text_below(1e3 * best.depth)} mm at {best.speed:.0f} rev/min{edge}."


def _rests(result: LobesStudy) -> list[str]:
    """Return the basis of the limits, where nothing else states it."""
    lines = [f"Solved by {method_words(result.chart.method)}; stated errors are those of the computation alone."]
    if result.spread is None and result.probability is None:
        lines.append("Dynamics and cutting coefficients are taken as exact: an interval of the limits needs a machine with "
                     "identified numbers, or --probability.")
    return lines


def _with_chart(report: Report, result: LobesStudy) -> Report:
    chart, runs = result.chart, result.runs
    words = "Hover shows the stable interval, the chatter frequency at its end, and the stated error."
    best = from_chart(chart)
    depth_top = None if np.isfinite(chart.limit).any() else chart.depth_max  # nothing to scale the chart by
    if result.withheld:
        words = f"What the dynamics as they were given would allow: not to be used. {words}"
    points = [] if result.withheld else [(best.speed, best.depth, "best cut, with some margin")]
    lowest = None if result.lowest is None else (float(result.lowest.speed), float(result.lowest.depth))
    figure = stability_chart([intervals_of(chart), StabilityCurve(chart.speeds, chart.limit, "first limit", lowest=lowest)],
                             max_depth=depth_top,
                             points=points)
    # Without a best cut any charted speed will do: the field must begin with an answer.
    start = round(best.speed if best.depth > 0 else np.median(chart.speeds))
    lookup = Lookup("How deep at my speed", "rev/min", chart.speeds.tolist(), chart.limit.tolist(), depth_answers(chart), start,
                    "depth", _coefficient_field(result.problem, chart), _other_cuts(result))
    # A field that answers with a depth recommends it, whatever stands beside it.
    looked_up = [] if result.withheld else [lookup]
    parts: list[Chart | ClickedSeries]
    if runs:
        parts = [Chart(with_simulations(figure, runs), name="stability"), simulation_series(runs, "stability")]
    else:
        parts = [Chart(figure, name="stability")]
    if np.isfinite(chart.limit).any():
        parts.append(Chart(chatter_frequencies(chart), "Frequency at which chatter begins at the first limit of each speed.",
                           name="chatter"))
    return report.with_section("Chart", *looked_up, words, *parts)


def _coefficient_field(problem: MillingProblem, chart: StabilityChart) -> InverseField | None:
    """Return the field of K_t, None where the limit is not proportional to its inverse.

    Straight edges of one depth: the equation of motion holds the depth only as its product with the coefficients. A helix
    turns the teeth over the depth, a corner changes their arc, and process damping has a coefficient of its own.
    """
    tool = problem.tool
    if np.abs(tool.helix).max() > 0 or tool.corner_radius > 0 or problem.process_damping > 0:
        return None
    k = problem.coefficients
    ratio = f"Kn/Kt stays {k.kn / k.kt:.3g}" + (f" and Ka/Kt {k.ka / k.kt:.3g}" if k.ka else "")
    return InverseField("K_t", "N/mm²", k.kt / 1e6, 1e3, "mm", chart.depth_max,
                        f"Exact for straight edges without process damping: the limit goes with 1/Kt, {ratio}.")


def _other_cuts(result: LobesStudy) -> TableFields | None:
    """Return the fields of immersion and teeth, None where other cuts were not computed."""
    table = result.other_cuts
    if table is None:
        return None
    return TableFields(("immersion", "teeth"), (table.immersion, table.tooth_count), table.immersions.tolist(), table.teeth,
                       table.speeds.tolist(), table.limit, table.depth_max, 1e3, "mm", table.words,
                       "For it run the same command with --immersion {0} --teeth {1}.")


def _with_surface_error(report: Report, problem: MillingProblem, chart: StabilityChart) -> Report:
    """Return the report with the surface location error at half the lowest limit, where a flank leaves a wall."""
    side = wall_side(problem.engagement)
    if problem.feed_per_tooth > 0 and problem.tool.is_regular and problem.tool.corner_radius == 0 and side is not None:
        # At half the lowest limit the cut is stable at every charted speed: forced vibration alone makes the error.
        depth = 0.5 * float(np.min(chart.limit))
        if np.isfinite(depth) and depth > 0:
            error = location_error(problem, chart.speeds, depth, side=side)
            where = "leave" if side == "exit" else "enter"
            words = f"At a depth of {number_text(1e3 * depth, digits=3)} mm, of the wall where the teeth {where} the cut."
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
    # After the tried cuts: they may have settled what mattered most before.
    share = after.importance()
    first = next(iter(share))
    return report.with_section(
        "What to measure better", f"A better value of \"{first}\" would narrow the chart most: alone it explains "
        f"{100 * share[first]:.0f} % of the variance of the limit.", Chart(importance_chart(share), name="importance"))
