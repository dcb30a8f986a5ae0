"""A cut simulated in time from the command line: long enough to tell chatter from the start-up, and its page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.app import console
from toolpoint.app.cutting import FEED, problem_of, remarked
from toolpoint.app.source import Source
from toolpoint.cutting import MillingProblem
from toolpoint.cutting.simulation.milling import ExactSteps, Simulation, simulate
from toolpoint.plot import Chart, Report, Table
from toolpoint.plot.figures.cutting import simulation_charts

LEAST, MOST = 60, 2000  # revolutions taken where none are asked for
FADED = 5.0  # time constants after which the start-up of the slowest mode is below 1 %
MOST_STEPS, FASTEST, DEEPEST = 30_000_000, 1e6, 1.0


@dataclass(frozen=True, eq=False)
class SimulatedCut:
    """The simulation; `decided`: whether its start-up had time to die out, so that chatter can be told from it."""

    run: Simulation
    decided: bool

    @property
    def state(self) -> str:
        """``chatter``, ``stable`` or ``undecided``."""
        return "undecided" if not self.decided else "chatter" if self.run.is_chattering() else "stable"


def mill(source: Source, cut: Mapping[str, Any], speed: float, depth: float, revolutions: int | None = None,
         output: str | Path = "toolpoint-report", quiet: bool = False) -> SimulatedCut:
    """Simulate a cut in time, print forces and whether it chatters, and write the page.

    speed : rev/min; depth : m; revolutions : as many as the slowest mode needs to forget the start where left out. The feed
    per tooth is that of the cut, 0.1 mm where it has none.
    """
    _check(cut, speed, depth)
    with console.collected_warnings() as warnings:
        problem, _, notes = problem_of(source, cut, in_time=True)
        if not problem.feed_per_tooth:
            notes.append(f"feed per tooth not given: {1e3 * FEED:g} mm is taken (--feed)")
            problem = problem.changed(feed_per_tooth=FEED)
        needed = revolutions_to_forget(problem, speed)
        count = revolutions or min(max(LEAST, needed), MOST)
        _check_steps(problem, speed, count)
        with console.steps(2, quiet) as step:
            step(f"simulation of {count} revolutions")
            run = simulate(problem, speed, depth, count)
            found = SimulatedCut(run, count >= needed or run.status != "complete")
            if not found.decided:
                notes.append(f"{count} revolutions are too few to tell chatter from the start-up, which takes {needed}; "
                             "give --revolutions")
            step("page")
            told = list(dict.fromkeys([*notes, *run.notes, *warnings]))
            path = _page(found, told).save(output)
    if not quiet:
        for name, value in rows(found):
            console.OUT.print(f"{name:32s} {value}", markup=False)
        for text in told:
            console.OUT.print("note: " + text, markup=False)
        console.OUT.print(f"Page written: {path}", markup=False)
    return found


def _check(cut: Mapping[str, Any], speed: float, depth: float) -> None:
    if not 0 < speed <= FASTEST:
        raise ToolpointError(f"--speed: {speed:g} rev/min; must be above zero and at most {FASTEST:g}")
    if not 0 < depth <= DEEPEST:
        raise ToolpointError(f"--depth: {1e3 * depth:g} mm; must be above zero and at most {1e3 * DEEPEST:g} mm")
    if cut.get("feed_per_tooth") is not None and not cut["feed_per_tooth"] > 0:
        raise ToolpointError(f"--feed: {1e3 * cut['feed_per_tooth']:g} mm; must be above zero: without feed there is no cut")


def revolutions_to_forget(problem: MillingProblem, speed: float) -> int:
    """Return the revolutions after which the slowest mode's start-up has died out, with ten more to look at."""
    slowest = float((-problem.plane_at(speed).poles.real).min())
    return int(np.ceil(FADED / slowest * speed / 60)) + 10


def _check_steps(problem: MillingProblem, speed: float, revolutions: int) -> None:
    steps = ExactSteps().chosen(problem, speed) * problem.tool.teeth * revolutions
    if steps > MOST_STEPS:
        raise ToolpointError(f"--speed {speed:g} rev/min: {revolutions} revolutions are {steps:.2g} time steps, at most "
                             f"{MOST_STEPS:.2g} are taken; give fewer --revolutions (at such a speed a few are enough)")


def rows(found: SimulatedCut) -> list[tuple[str, str]]:
    """Return rows (quantity, value) of a simulated cut."""
    run = found.run
    tail = run.force[-10 * run.steps_per_revolution:]
    moved = run.peak_to_peak()
    return [("state", found.state), ("status", run.status),
            ("force x, mean / peak", f"{tail[:, 0].mean():.1f} / {np.abs(tail[:, 0]).max():.1f} N"),
            ("force y, mean / peak", f"{tail[:, 1].mean():.1f} / {np.abs(tail[:, 1]).max():.1f} N"),
            ("torque, mean", f"{run.torque.mean():.3f} N m"), ("power, mean", f"{run.power.mean():.1f} W"),
            ("vibration x, peak to peak", f"{1e6 * moved[0]:.2f} um"),
            ("vibration y, peak to peak", f"{1e6 * moved[1]:.2f} um")]


def _page(found: SimulatedCut, notes: Sequence[str]) -> Report:
    run = found.run
    report = Report("Simulated cut", f"{run.problem!r}", subtitle=f"{run.speed:g} rev/min, depth {1e3 * run.depth:g} mm")
    report = report.with_section("Result", Table(["quantity", "value"], rows(found)))
    for name, made in simulation_charts(run).items():
        report = report.with_section(name, Chart(made))
    return remarked(report, notes)
