"""Stability lobes and simulated cuts from the command line, and their pages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, one_of
from toolpoint.app import console, measured_page
from toolpoint.app.cut_options import changed
from toolpoint.app.uncertain_cut import Uncertainty, advice_rows, sampled, with_advice, with_probability
from toolpoint.cutting import (
    Collocation,
    FloquetDeterminant,
    MillingProblem,
    MultiFrequency,
    PanelArnoldi,
    SemiDiscretization,
    StabilityChart,
    ZeroOrder,
    stability,
)
from toolpoint.cutting.best_speed import from_chart
from toolpoint.cutting.location import location_error
from toolpoint.cutting.materials import literature, materials
from toolpoint.cutting.stability import Method
from toolpoint.cutting.time_domain import Simulation, simulate
from toolpoint.io import hdf5, machine_yaml
from toolpoint.machine.description import CuttingDescription
from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.cutting import (
    clicked_simulations,
    intervals_of,
    simulation_charts,
    surface_location,
    with_simulations,
)
from toolpoint.plot.lobes import StabilityCurve, stability_chart
from toolpoint.studies.tool_point import depth_limit, milling_problem, tool_point
from toolpoint.vibration import Modes

DEEPER = 4
FEED = 1e-4  # m, feed per tooth of simulations where none is given
METHODS: dict[str, Method | None] = {
    "auto": None, "floquet": FloquetDeterminant(), "panel": PanelArnoldi(), "zero-order": ZeroOrder(),
    "multi-frequency": MultiFrequency(),
    "semi-discretization": SemiDiscretization(), "collocation": Collocation()}


@dataclass(frozen=True)
class Source:
    """Where the dynamics of a cut come from: a machine file at a pose, FRF files, or saved modes."""

    machine: Path | None = None
    pose: Mapping[str, float] | None = None
    frf: tuple[Path, ...] = ()
    modes: Path | None = None
    band: tuple[float, float] | None = None


def problem_of(source: Source, cut: Mapping[str, Any]) -> tuple[MillingProblem, CuttingDescription, list[str]]:
    """Return the milling problem, its cut, and remarks; `cut` holds values that replace those of the file or the example."""
    given = {name: value for name, value in cut.items() if value is not None}
    problem, used, notes = _problem(source, given)
    return problem, used, [*notes, f"Coefficients: {problem.coefficients.source}."] if used.material else notes


def _problem(source: Source, given: Mapping[str, Any]) -> tuple[MillingProblem, CuttingDescription, list[str]]:
    notes: list[str] = []
    if source.machine is not None:
        machine = machine_yaml.read(source.machine)
        base = machine.description.cutting or _example(given, notes)
        study = tool_point(machine, [dict(source.pose)] if source.pose else [{}])
        used = changed(base, given)
        labels = (f"{study.point}:+x", f"{study.point}:+y")
        return milling_problem(used, study.modes.at_pose(0), *labels), used, notes
    used = changed(_example(given, notes), given)
    if source.modes is not None:
        modes = hdf5.read(source.modes)
        if not isinstance(modes, Modes):
            raise ToolpointError(f"{source.modes}: holds {type(modes).__name__}; needs Modes")
        return milling_problem(used, modes), used, notes
    if not source.frf:
        raise ToolpointError("dynamics: none given; name a machine file, --frf files, or --modes")
    frf = measured_page.read(source.frf, "receptance", source.band).selected([0], [0])
    notes += [*frf.notes, "the response across is taken as that along"]
    return milling_problem(used, frf, str(frf.outputs[0]), "same"), used, notes


def _example(given: Mapping[str, Any], notes: list[str]) -> CuttingDescription:
    """Return the example's cut; a note says which of its values are used."""
    cut = measured_page.EXAMPLE_CUT
    slot, material = given.get("direction") == "slot", "material" in given
    values = {"diameter": f"diameter {1e3 * cut.diameter:g} mm", "teeth": f"{cut.teeth} teeth",
              "direction": f"direction {cut.direction}", "immersion": f"immersion {cut.immersion:g}",
              "tangential": f"kt {1e-6 * (cut.tangential or 0):g} N/mm^2", "normal": f"kn {1e-6 * (cut.normal or 0):g} N/mm^2"}
    needless = {"immersion"} if slot else {"direction", "immersion"} if "entry" in given else set()
    needless |= {"tangential", "normal"} if material else set()
    taken = [words for name, words in values.items() if name not in given and name not in needless]
    if taken:
        notes.append(f"Not given and taken from an example: {', '.join(taken)} ({cut.source}).")
    return cut


def lobes(
    source: Source, cut: Mapping[str, Any], method: str = "auto", speeds: FloatArray | None = None,
    output: str | Path = "toolpoint-report", quiet: bool = False, simulations: bool = False,
    uncertainty: Uncertainty | None = None,
) -> tuple[StabilityChart, list[list[str]]]:
    """Compute the stability chart of a cut, print its lowest and best points, and write the page.

    With `simulations` cuts on a grid of speeds and depths are simulated in time; a click on one shows its vibration. With
    samples in `uncertainty` the page shows P(stable). Returns the chart and rows of advice (what, rev/min, mm, why).
    """
    one_of("--method", method, METHODS)
    uncertainty = uncertainty or Uncertainty()
    with console.collected_warnings() as warnings:
        problem, used, notes = problem_of(source, cut)
        n = np.linspace(*used.speeds, 200) if speeds is None else speeds
        chosen = METHODS[method]
        chart = _charted(problem, n, chosen, quiet)
        runs = _simulated(problem, chart, quiet) if simulations else []
        found = None
        if uncertainty.samples:
            found, more = sampled(problem, chart, uncertainty, chosen or stability.default_method(problem), quiet)
            notes += more
        advice = advice_rows(chart, found, uncertainty)
        report = with_advice(_lobes_page(problem, used, chart, runs), advice)
        report = report if found is None else with_probability(report, found, uncertainty)
        path = _remarked(report, [*notes, *chart.notes, *warnings]).save(output)
    if not quiet:
        _print_chart(chart)
        console.table("Cuts to make", ["", "rev/min", "depth mm", "why"], advice)
        for text in dict.fromkeys([*notes, *chart.notes, *warnings]):
            console.OUT.print("note: " + text, markup=False)
        console.OUT.print(f"Page written: {path}", markup=False)
    return chart, advice


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


def _remarked(report: Report, remarks: Sequence[str]) -> Report:
    lines = list(dict.fromkeys(remarks))
    return report.with_section("Remarks", Notes(lines, "assumed")) if lines else report


def _charted(problem: MillingProblem, speeds: FloatArray, method: Method | None, quiet: bool) -> StabilityChart:
    """Return the chart, deep enough to show a limit at half of the speeds at least, where there is one."""
    depth = depth_limit(problem)
    with console.steps(1, quiet) as step:
        step(f"stability at {len(speeds)} speeds")
        chart = stability.chart(problem, speeds, method, depth)
        for _ in range(DEEPER):
            if np.isfinite(chart.limit).mean() >= 0.5:
                break
            depth *= 2
            chart = stability.chart(problem, speeds, method, depth)
        return chart


def _print_chart(chart: StabilityChart) -> None:
    limit = chart.limit
    low, high = int(np.argmin(limit)), int(np.argmax(np.where(np.isfinite(limit), limit, chart.depth_max)))
    rows = [["lowest limit", f"{chart.speeds[low]:.0f}", _depth(limit[low], chart)],
            ["highest limit", f"{chart.speeds[high]:.0f}", _depth(limit[high], chart)]]
    console.table(f"Stability by {chart.method}", ["", "rev/min", "depth mm"], rows)


def _depth(value: float, chart: StabilityChart) -> str:
    return f"{1e3 * value:.4f}" if np.isfinite(value) else f"above {1e3 * chart.depth_max:.3g}"


def _simulated(problem: MillingProblem, chart: StabilityChart, quiet: bool) -> list[Simulation]:
    """Simulate cuts at ten speeds and five depths around the limit; a measured response has no modes to step through."""
    if not problem.plane.is_modal:
        raise ToolpointError("--simulate: the dynamics are measured lines; identify modes first and give them with --modes")
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
    made = stability_chart([intervals_of(chart), StabilityCurve(chart.speeds, chart.limit, "first limit")],
                           points=[(best.speed, best.depth, "best cut, with some margin")])
    if runs:
        report = report.with_section("Chart", words, Chart(with_simulations(made, runs), name="stability"),
                                     clicked_simulations(runs, "stability"))
    else:
        report = report.with_section("Chart", words, Chart(made, name="stability"))
    if problem.feed_per_tooth > 0 and problem.tool.is_regular:
        depth = 0.5 * float(np.min(chart.limit))
        if np.isfinite(depth) and depth > 0:
            error = location_error(problem, chart.speeds, depth)
            report = report.with_section("Surface location error", f"At a depth of {1e3 * depth:.4g} mm.",
                                         Chart(surface_location(chart.speeds, error)))
    return report


def mill(
    source: Source, cut: Mapping[str, Any], speed: float, depth: float, feed_per_tooth: float | None = None,
    revolutions: int = 60, output: str | Path = "toolpoint-report", quiet: bool = False,
) -> Simulation:
    """Simulate a cut in time, print forces and whether it chatters, and write the page.

    The feed per tooth is that of the cut, 0.1 mm where it has none.
    """
    with console.collected_warnings() as warnings:
        problem, _, notes = problem_of(source, cut)
        with console.steps(2, quiet) as step:
            step("simulation")
            feed = feed_per_tooth or problem.feed_per_tooth or FEED
            run = simulate(problem.changed(feed_per_tooth=feed), speed, depth, revolutions)
            step("page")
            path = _mill_page(run, [*notes, *warnings]).save(output)
    if not quiet:
        for name, value in _mill_rows(run):
            console.OUT.print(f"{name:32s} {value}", markup=False)
        for text in dict.fromkeys([*notes, *run.notes, *warnings]):
            console.OUT.print("note: " + text, markup=False)
        console.OUT.print(f"Page written: {path}", markup=False)
    return run


def _mill_rows(run: Simulation) -> list[tuple[str, str]]:
    tail = run.force[-10 * run.steps_per_revolution:]
    moved = run.peak_to_peak()
    return [("state", "chatter" if run.is_chattering() else "stable"), ("status", run.status),
            ("force x, mean / peak", f"{tail[:, 0].mean():.1f} / {np.abs(tail[:, 0]).max():.1f} N"),
            ("force y, mean / peak", f"{tail[:, 1].mean():.1f} / {np.abs(tail[:, 1]).max():.1f} N"),
            ("torque, mean", f"{run.torque.mean():.3f} N m"), ("power, mean", f"{run.power.mean():.1f} W"),
            ("vibration x, peak to peak", f"{1e6 * moved[0]:.2f} um"),
            ("vibration y, peak to peak", f"{1e6 * moved[1]:.2f} um")]


def _mill_page(run: Simulation, notes: Sequence[str]) -> Report:
    report = Report("Simulated cut", f"{run.problem!r}", subtitle=f"{run.speed:g} rev/min, depth {1e3 * run.depth:g} mm")
    report = report.with_section("Result", Table(["quantity", "value"], _mill_rows(run)))
    for name, made in simulation_charts(run).items():
        report = report.with_section(name, Chart(made))
    return _remarked(report, [*notes, *run.notes])
