"""Stability of a turning cut from the command line, and its page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.app import console
from toolpoint.app.console import spelled
from toolpoint.app.cutting import doubtful
from toolpoint.app.dynamics import read_dynamics
from toolpoint.app.source import Source
from toolpoint.cutting import StabilityChart, stability
from toolpoint.cutting.advice.best_speed import from_chart
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.cut.problem import TurningProblem
from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.cutting import chip_response, intervals_of
from toolpoint.plot.figures.lobes import StabilityCurve, StabilityIntervals, stability_chart
from toolpoint.studies.tool_directions import driving_points, tool_directions
from toolpoint.studies.tool_dynamics import ToolDynamics
from toolpoint.studies.turning import UnconditionalLimit, oriented, unconditional_limit, unit_vector, width_range
from toolpoint.vibration import Dof, Frf

HEADER = ["", "rev/min", "width mm", ""]
SPEEDS = (300.0, 6000.0, 400)  # rev/min, a lathe's usual range


@dataclass(frozen=True)
class TurningCut:
    """An orthogonal cut, SI.

    cutting : K_f along the thickness of the chip, Pa; tangential : K_t along the cutting speed, Pa; normal : direction in which
    the chip is thick, from the work into the tool; velocity : direction in which the work moves past the edge (None: y).
    """

    cutting: float
    tangential: float = 0.0
    normal: tuple[float, float, float] | None = None
    velocity: tuple[float, float, float] | None = None
    process_damping: float = 0.0
    cutting_speed: float | None = None
    diameter: float | None = None


@dataclass(frozen=True, eq=False)
class TurningRun:
    """The problem, its chart, and the unconditional limit (None with process damping, where it depends on the speed)."""

    problem: TurningProblem
    chart: StabilityChart
    limit: UnconditionalLimit | None

    def as_dict(self) -> dict[str, object]:
        """Return the result as plain numbers and text."""
        best = from_chart(self.chart)
        least = None if self.limit is None or not np.isfinite(self.limit.width) else {
            "width_m": self.limit.width, "chatter_frequency_hz": self.limit.frequency,
            "least_real_part_m_per_n": self.limit.real, "speed_rpm": self.limit.tips.tolist()}
        return {"speed_rpm": self.chart.speeds.tolist(), "unconditional": least, "method": self.chart.method,
                "stable_intervals_m": [self.chart.intervals(i).tolist() for i in range(self.chart.speeds.size)],
                "best_cut": {"speed_rpm": best.speed, "width_m": best.depth, "reason": best.reason},
                "notes": list(self.chart.notes)}


def turning_problem(dynamics: ToolDynamics, cut: TurningCut) -> tuple[TurningProblem, list[str]]:
    """Return the turning problem of a cut on these dynamics, and what was assumed."""
    labels, notes = _labels(dynamics)
    normal = unit_vector("--direction", cut.normal or _axis(next(iter(labels))))
    force, notes = normal, list(notes)
    if cut.tangential:
        velocity = unit_vector("--cutting-direction", cut.velocity or (0.0, 1.0, 0.0))
        if abs(float(velocity @ normal)) > 1e-6:
            raise ToolpointError(f"--cutting-direction: {_vector(velocity)} is not normal to the chip's thickness along "
                                 f"{_vector(normal)}; must be (give another --cutting-direction)")
        force = normal + cut.tangential / cut.cutting * velocity
        notes.append(f"K_t acts along {_vector(velocity)}, the way of the work past the edge")
    notes.append(f"the chip is thick along {_vector(normal)}")
    plane = oriented(dynamics.response, labels, normal, force)
    return TurningProblem(cut.cutting, plane, None, cut.process_damping, cut.cutting_speed, cut.diameter), notes


def _labels(dynamics: ToolDynamics) -> tuple[dict[str, str], list[str]]:
    """Return axis to label of the directions that are known at the point that cuts; a lone response is that of its axis."""
    if Dof.parse(dynamics.x).direction[1:] != "x":
        return {"x": dynamics.x}, [f"{dynamics.x} is taken as x"]
    z = tool_directions(driving_points(dynamics.response), dynamics.x, "same").z
    ways = {"x": dynamics.x} | ({} if dynamics.y in (None, "same") else {"y": str(dynamics.y)})
    return ways | ({} if z is None else {"z": z}), []


def _axis(name: str) -> tuple[float, float, float]:
    return (float(name == "x"), float(name == "y"), float(name == "z"))


def _vector(direction: Sequence[float] | FloatArray) -> str:
    parts = np.asarray(direction, float)
    for k, name in enumerate("xyz"):
        if abs(abs(parts[k]) - 1) < 1e-9:
            return ("-" if parts[k] < 0 else "") + name
    return "(" + ", ".join(f"{v:.4g}" for v in parts) + ")"


def turn(source: Source, cut: TurningCut, speeds: FloatArray | None = None, output: str | Path = "toolpoint-report",
         quiet: bool = False) -> TurningRun:
    """Compute the stability chart of a turning cut, print its limits and best cut, and write the page."""
    with console.collected_warnings() as warnings:
        dynamics = read_dynamics(source)
        problem, assumed = turning_problem(dynamics, cut)
        given = None if dynamics.machine is None else dynamics.machine.description.cutting
        n = speeds if speeds is not None else np.linspace(*(given.speeds if given else SPEEDS[:2]), SPEEDS[2])
        chart = stability.chart(problem, n, None, depth_max=width_range(problem))
        for _ in range(4):
            if np.isfinite(chart.limit).mean() >= 0.5:
                break
            chart = stability.chart(problem, n, None, depth_max=2 * chart.depth_max)
        limit = unconditional_limit(problem) if cut.process_damping == 0 else None
        told = [spelled(note) for note in dynamics.notes if "across" not in note and "rigid along y" not in note]
        chart = chart.noted(*dict.fromkeys([*warnings, *doubtful(chart), *told, *assumed]))
        run = TurningRun(problem, chart, limit)
        path = page(run, cut).save(output)
    if not quiet:
        console.table("Turning: stable widths", HEADER, rows(run))
        for text in dict.fromkeys(chart.notes):
            console.OUT.print("note: " + text, markup=False)
        console.OUT.print(f"Page written: {path}", markup=False)
    return run


def rows(run: TurningRun) -> list[list[str]]:
    """Return rows (what, rev/min, mm, remark) of the limits and the best cut."""
    chart, limit = run.chart, run.limit
    made = []
    if limit is not None:
        finite = np.isfinite(limit.width)
        made.append(["stable at every speed", "", f"below {1e3 * limit.width:.4f}" if finite else "every width",
                     f"chatter at {limit.frequency:.1f} Hz above" if finite else "no negative real part"])
    low, high = int(np.argmin(chart.limit)), int(np.argmax(np.minimum(chart.limit, chart.depth_max)))
    for name, at in (("lowest limit of the chart", low), ("highest limit of the chart", high)):
        value = float(chart.limit[at])
        made.append([name, f"{chart.speeds[at]:.0f}",
                     f"{1e3 * value:.4f}" if np.isfinite(value) else f"above {1e3 * chart.depth_max:.3g}", ""])
    best = from_chart(chart)
    return [*made, ["best cut of the chart", f"{best.speed:.0f}", f"{1e3 * best.depth:.3g}", best.reason]]


def page(run: TurningRun, cut: TurningCut) -> Report:
    """Return the page of a turning cut."""
    chart, limit = run.chart, run.limit
    words = f"K_f {cut.cutting / 1e6:g} N/mm^2" + (f", K_t {cut.tangential / 1e6:g} N/mm^2" if cut.tangential else "") + (
        f", process damping {cut.process_damping:g} N/m" if cut.process_damping else "")
    report = Report("Stability of a turning cut", f"{words}; {run.problem.plane!r}", subtitle=f"method {chart.method}")
    curves: list[StabilityCurve | StabilityIntervals] = [intervals_of(chart),
                                                         StabilityCurve(chart.speeds, chart.limit, "first limit")]
    if limit is not None and np.isfinite(limit.width):
        always = np.full(chart.speeds.size, limit.width)
        curves.append(StabilityCurve(chart.speeds, always, "stable at every speed"))
    best, finite = from_chart(chart), np.isfinite(chart.limit).any()
    made = stability_chart(curves, max_depth=None if finite else chart.depth_max, depth_name="Width of cut",
                           points=[(best.speed, best.depth, "best cut, with some margin")])
    report = report.with_section(
        "Chart", "Hover shows the stable interval, the chatter frequency at its end, and the stated numerical error.",
        Chart(made, name="stability"), Table(HEADER, rows(run)))
    least = (limit.frequency, limit.real) if limit is not None and np.isfinite(limit.width) else None
    report = report.with_section(
        "Response of the chip thickness", "The part of the receptance that the cutting force turns into chip thickness. Its "
        "least real part sets the width that is stable at every speed: b = -1/(2 K_f min Re G).",
        Chart(chip_response(_response(run.problem.plane), least), name="oriented"))
    notes = list(dict.fromkeys(chart.notes))
    return report.with_section("Remarks", Notes(notes, "assumed")) if notes else report


def _response(plane: PlaneDynamics) -> Frf:
    low, high = plane.span
    f = np.linspace(0.3 * low, 1.5 * high, 3000) if plane.is_modal else np.asarray(plane.frequency)
    return Frf(f, plane.response(f)[:, :1, :1], (Dof("chip", "+x"),), (Dof("chip", "+x"),))
