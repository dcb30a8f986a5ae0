"""Stability lobes and simulated cuts from the command line, and their pages."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.app import console
from toolpoint.app.console import spelled
from toolpoint.app.cut_options import doubts
from toolpoint.app.dynamics import read_dynamics
from toolpoint.app.source import Source
from toolpoint.app.uncertain_cut import Uncertainty, advice_rows, sampled, with_advice, with_probability
from toolpoint.cutting import MillingProblem, StabilityChart, stability
from toolpoint.cutting.advice.best_speed import from_chart
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.force.materials import literature, materials
from toolpoint.cutting.simulation.milling import Simulation, simulate
from toolpoint.cutting.stability.method import StabilityMethod
from toolpoint.cutting.surface.location import finished_side, location_error
from toolpoint.plot import Chart, Notes, Report
from toolpoint.plot.figures.cutting import (
    clicked_simulations,
    intervals_of,
    surface_location,
    with_simulations,
)
from toolpoint.plot.figures.lobes import StabilityCurve, stability_chart
from toolpoint.studies.example_cut import example_cut
from toolpoint.studies.tool_dynamics import as_modes
from toolpoint.studies.tool_point import depth_limit, milling_problem

DEEPER = 4
THINNEST, THICKEST = 1e-6, 0.1  # m, limits that are believed
ROUGH = 0.2  # stated error over limit, above which a remark says so
FEED = 1e-4  # m, feed per tooth of simulations where none is given


def problem_of(source: Source, cut: Mapping[str, Any], in_time: bool = False
               ) -> tuple[MillingProblem, CuttingDescription, list[str]]:
    """Return the milling problem, its cut, and remarks; `cut` holds values that replace those of the file or the example.

    With `in_time` measured lines are replaced by their modes, which a simulation steps through.
    """
    given = {name: value for name, value in cut.items() if value is not None}
    problem, used, notes = _problem(source, given, in_time)
    return problem, used, [*notes, f"Coefficients: {problem.coefficients.source}."] if used.coefficients.material else notes


def _problem(source: Source, given: Mapping[str, Any], in_time: bool) -> tuple[MillingProblem, CuttingDescription, list[str]]:
    dynamics = read_dynamics(source)
    dynamics = as_modes(dynamics) if in_time else dynamics
    notes = [spelled(note) for note in dynamics.notes]
    own = None if dynamics.machine is None else dynamics.machine.description.cutting
    base, more = (own, []) if own is not None else example_cut(given)
    notes += more
    used = base.with_values(given)
    notes += doubts(used)
    problem = milling_problem(used, dynamics.response, dynamics.x, dynamics.y)
    if problem.coefficients.ka > 0 and problem.z is None:
        notes.append("the response along z is not known: the axial force moves nothing here")
    return problem, used, notes


def lobes(
    source: Source, cut: Mapping[str, Any], method: str = "auto", speeds: FloatArray | None = None,
    output: str | Path = "toolpoint-report", quiet: bool = False, simulations: bool = False,
    uncertainty: Uncertainty | None = None,
) -> tuple[StabilityChart, list[list[str]]]:
    """Compute the stability chart of a cut, print its lowest and best points, and write the page.

    With `simulations` cuts on a grid of speeds and depths are simulated in time; a click on one shows its vibration. With
    samples in `uncertainty` the page shows P(stable). Returns the chart and rows of advice (what, rev/min, mm, why).
    """
    chosen = stability.method_named(method, "--method")
    uncertainty = uncertainty or Uncertainty()
    with console.collected_warnings() as warnings:
        problem, used, notes = problem_of(source, cut)
        timed = problem_of(source, cut, True)[0] if simulations and not problem.plane.is_modal else problem
        n = np.linspace(*used.speeds, 200) if speeds is None else speeds
        chart = _charted(problem, n, chosen, quiet)
        runs = _simulated(timed, chart, quiet) if simulations else []
        found = None
        if uncertainty.samples:
            found, more = sampled(problem, chart, uncertainty, chosen, quiet)
            notes += more
        advice = advice_rows(chart, found, uncertainty)
        report = with_advice(_lobes_page(problem, used, chart, runs), advice)
        report = report if found is None else with_probability(report, found, uncertainty)
        warnings += doubtful(chart)
        chart = replace(chart, notes=tuple(dict.fromkeys([*warnings, *notes, *chart.notes])))
        path = remarked(report, chart.notes, warnings).save(output)
    if not quiet:
        _print_chart(chart)
        console.table("Cuts to make", ["", "rev/min", "depth mm", "why"], advice)
        for text in chart.notes:
            console.OUT.print("note: " + text, markup=False)
        console.OUT.print(f"Page written: {path}", markup=False)
    return chart, advice


def plain(chart: StabilityChart) -> dict[str, Any]:
    """Return a chart as plain numbers, SI; with stated error and chatter frequency of every speed's limit (None: no limit)."""
    points = chart.limit_points().tolist()
    return {"speed_rpm": chart.speeds.tolist(), "stable_intervals_m": [chart.intervals(i).tolist() for i in range(len(points))],
            "limit_error_m": [None if p < 0 else float(chart.error[p]) for p in points],
            "chatter_frequency_hz": [None if p < 0 else float(chart.frequency[p]) for p in points],
            "method": chart.method, "notes": list(chart.notes)}


def print_materials() -> None:
    """Print the literature table of cutting coefficients: every set, and where it comes from."""
    rows = []
    for name in materials():
        found = literature(name)
        for number, k in enumerate(found.sets, start=1):
            values = [k.kt / 1e6, k.kn / 1e6, k.ka / 1e6, k.edge_t / 1e3, k.edge_n / 1e3, k.edge_a / 1e3]
            rows.append([f"{name}:{number}", *(f"{v:g}" if v else "" for v in values), ""])
        rows += [[f"{name}:{number}", f"{law.kc / 1e6:g}", "", "", "", "", "", f"{law.mc:g}"]
                 for number, law in enumerate(found.kienzle, start=1)]
    console.table("Cutting coefficients of the literature", ["material:set", "Kt N/mm^2", "Kn", "Ka", "Kte N/mm", "Kne", "Kae",
                                                             "exponent"], rows)
    for source in dict.fromkeys(literature(name).source for name in materials()):
        console.OUT.print(f"source: {source}", markup=False)
    console.OUT.print("Sets with an exponent are Kienzle's law (Kt at 1 mm chip thickness), tangential force only: give --kn "
                      "and --feed with them.", markup=False)


def remarked(report: Report, remarks: Sequence[str], warnings: Sequence[str] = ()) -> Report:
    """Return the report with its remarks; those that are `warnings` stand apart, above the others."""
    doubts = list(dict.fromkeys(warnings))
    lines = [line for line in dict.fromkeys(remarks) if line not in doubts]
    parts = ([Notes(doubts, "warning")] if doubts else []) + ([Notes(lines, "assumed")] if lines else [])
    return report.with_section("Remarks", *parts) if parts else report


def _charted(problem: MillingProblem, speeds: FloatArray, method: StabilityMethod | None, quiet: bool) -> StabilityChart:
    """Return the chart, deep enough to show a limit at half of the speeds at least, where there is one."""
    depth = depth_limit(problem)
    with console.steps(1, quiet) as step, _for_lines(problem):
        step(f"stability at {len(speeds)} speeds")
        chart = stability.chart(problem, speeds, method, depth_max=depth)
        for _ in range(DEEPER):
            if np.isfinite(chart.limit).mean() >= 0.5:
                break
            depth = min(2 * depth, 1.0)  # m
            chart = stability.chart(problem, speeds, method, depth_max=depth)
        return chart


def doubtful(chart: StabilityChart) -> list[str]:
    """Return remarks on limits (depths or widths) that no machine has, and on those whose stated error is large."""
    points = chart.limit_points()
    error = np.array([chart.error[p] if p >= 0 else 0.0 for p in points])
    rough = np.flatnonzero(error > ROUGH * np.minimum(chart.limit, chart.depth_max))
    lines = [f"the stated error of the limit is above {100 * ROUGH:g} % of it at {rough.size} of {chart.speeds.size} speeds, "
             f"from {chart.speeds[rough].min():.0f} to {chart.speeds[rough].max():.0f} rev/min"] if rough.size else []
    least = float(np.min(np.minimum(chart.limit, chart.depth_max)))
    if THINNEST < least < THICKEST:
        return lines
    return [*lines, f"a lowest limit of {1e3 * least:.3g} mm is doubtful: check the units of the responses (lines in Hz, m/N), "
            "--quantity, and the coefficients (N/mm^2)"]


@contextmanager
def _for_lines(problem: MillingProblem) -> Iterator[None]:
    """Say how to go on where a method wants modes and the dynamics are measured lines."""
    try:
        yield
    except ToolpointError as error:
        if problem.plane.is_modal:
            raise
        raise ToolpointError(f"{error}\nThe dynamics are measured lines, which this cut or method cannot take; identify "
                             "their modes first:\n  toolpoint identify FILE -m modes.h5, then give --modes modes.h5 instead of "
                             "the FRF") from None


def _print_chart(chart: StabilityChart) -> None:
    limit = chart.limit
    low, high = int(np.argmin(limit)), int(np.argmax(np.where(np.isfinite(limit), limit, chart.depth_max)))
    points = chart.limit_points()
    rows = []
    for name, i in (("lowest limit", low), ("highest limit", high)):
        p = int(points[i])
        end = ["", ""] if p < 0 else [f"{1e3 * chart.error[p]:.1e}", f"{chart.frequency[p]:.1f}"]
        rows.append([name, f"{chart.speeds[i]:.0f}", _depth(limit[i], chart), *end])
    console.table(f"Stability by {chart.method}", ["", "rev/min", "depth mm", "error mm", "chatter Hz"], rows)


def _depth(value: float, chart: StabilityChart) -> str:
    return f"{1e3 * value:.4f}" if np.isfinite(value) else f"above {1e3 * chart.depth_max:.3g}"


def _simulated(problem: MillingProblem, chart: StabilityChart, quiet: bool) -> list[Simulation]:
    """Simulate cuts at ten speeds and five depths around the limit."""
    fed = problem if problem.feed_per_tooth > 0 else problem.changed(feed_per_tooth=FEED)
    finite = chart.limit[np.isfinite(chart.limit)]
    top = 1.8 * float(np.median(finite)) if finite.size else chart.depth_max
    grid = [(float(n), float(w)) for n in np.linspace(chart.speeds[0], chart.speeds[-1], 10)
            for w in np.linspace(top / 5, top, 5)]
    runs = []
    with console.counted("simulated cuts", quiet or not console.interactive()) as progress:
        for i, (speed, depth) in enumerate(grid):
            runs.append(simulate(fed, speed, depth, 60))
            progress(i + 1, len(grid))
    return runs


def _lobes_page(problem: MillingProblem, cut: CuttingDescription, chart: StabilityChart,
                runs: Sequence[Simulation] = ()) -> Report:
    report = Report("Stability of a milling cut", f"{problem!r}", subtitle=f"method {chart.method}")
    words = "Hover shows the stable interval, the chatter frequency at its end, and the stated numerical error."
    best = from_chart(chart)
    top = None if np.isfinite(chart.limit).any() else chart.depth_max  # nothing to scale the chart by
    made = stability_chart([intervals_of(chart), StabilityCurve(chart.speeds, chart.limit, "first limit")], max_depth=top,
                           points=[(best.speed, best.depth, "best cut, with some margin")])
    if runs:
        report = report.with_section("Chart", words, Chart(with_simulations(made, runs), name="stability"),
                                     clicked_simulations(runs, "stability"))
    else:
        report = report.with_section("Chart", words, Chart(made, name="stability"))
    side = finished_side(problem.engagement)
    if problem.feed_per_tooth > 0 and problem.tool.is_regular and problem.tool.corner_radius == 0 and side is not None:
        depth = 0.5 * float(np.min(chart.limit))
        if np.isfinite(depth) and depth > 0:
            error = location_error(problem, chart.speeds, depth, side)
            where = "leave" if side == "exit" else "enter"
            words = f"At a depth of {1e3 * depth:.4g} mm, of the wall where the teeth {where} the cut."
            report = report.with_section("Surface location error", words, Chart(surface_location(chart.speeds, error)))
    return report
