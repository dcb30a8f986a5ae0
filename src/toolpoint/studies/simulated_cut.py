"""A cut simulated in time: long enough to tell chatter from the start-up."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.cutting import MillingProblem
from toolpoint.cutting.simulation.milling import ExactSteps, Simulation, simulate
from toolpoint.studies.described_cut import build_problem
from toolpoint.studies.lobes_study import FEED
from toolpoint.studies.tool_dynamics import ToolDynamics

LEAST, MOST = 60, 2000  # revolutions taken where none are asked for
FADED = 5.0  # time constants after which the start-up of the slowest mode is below 1 %
MOST_STEPS, FASTEST, DEEPEST = 30_000_000, 1e6, 1.0


@dataclass(frozen=True, eq=False)
class SimulatedCut:
    """The simulation; `decided`: whether its start-up had time to die out, so that chatter can be told from it;
    `notes`: what was assumed."""

    run: Simulation
    decided: bool
    notes: tuple[str, ...] = ()

    @property
    def state(self) -> str:
        """``chatter``, ``stable`` or ``undecided``."""
        return "undecided" if not self.decided else "chatter" if self.run.is_chattering() else "stable"

    def rows(self) -> list[tuple[str, str]]:
        """Return rows (quantity, value) of a simulated cut."""
        run = self.run
        tail = run.force[-10 * run.steps_per_revolution:]
        moved = run.peak_to_peak()
        return [("state", self.state), ("status", run.status),
                ("force x, mean / peak", f"{tail[:, 0].mean():.1f} / {np.abs(tail[:, 0]).max():.1f} N"),
                ("force y, mean / peak", f"{tail[:, 1].mean():.1f} / {np.abs(tail[:, 1]).max():.1f} N"),
                ("torque, mean", f"{run.torque.mean():.3f} N m"), ("power, mean", f"{run.power.mean():.1f} W"),
                ("vibration x, peak to peak", f"{1e6 * moved[0]:.2f} um"),
                ("vibration y, peak to peak", f"{1e6 * moved[1]:.2f} um")]

    def table(self) -> str:
        """Return state, forces, power and vibration as text."""
        return "\n".join(f"{name:32s} {value}" for name, value in self.rows())

    def to_dict(self) -> dict[str, Any]:
        """Return state, vibration (m), power (W) as plain data; chatter None where it is undecided."""
        run = self.run
        return {"chatter": run.is_chattering() if self.decided else None, "state": self.state,
                "peak_to_peak_m": run.peak_to_peak().tolist(), "power_w": float(run.power.mean()), "status": run.status}


def simulate_cut(dynamics: ToolDynamics, values: Mapping[str, Any] | None = None, *, speed: float, depth: float,
                 revolutions: int | None = None, step: Callable[[str], None] = lambda name: None) -> SimulatedCut:
    """Simulate a cut in time on these dynamics.

    Parameters
    ----------
    dynamics : ToolDynamics
        Measured lines are replaced by their modes.
    values : mapping of flat keys of a CuttingDescription to values, optional
        In place of the machine's or the example's; the feed per tooth is 0.1 mm where there is none.
    speed, depth : float
        rev/min, m.
    revolutions : int, optional
        As many as the slowest mode needs to forget the start where left out.
    """
    check_cut(values or {}, speed, depth)
    problem, _, notes = build_problem(dynamics, values or {}, in_time=True)
    if not problem.feed_per_tooth:
        notes.append(f"feed per tooth not given: {1e3 * FEED:g} mm is taken (`feed`)")
        problem = problem.changed(feed_per_tooth=FEED)
    needed = revolutions_to_forget(problem, speed)
    count = revolutions or min(max(LEAST, needed), MOST)
    _check_steps(problem, speed, count)
    step(f"simulation of {count} revolutions")
    run = simulate(problem, speed, depth, revolutions=count)
    decided = count >= needed or run.status != "complete"
    if not decided:
        notes.append(f"{count} revolutions are too few to tell chatter from the start-up, which takes {needed}; "
                     "give `revolutions`")
    return SimulatedCut(run, decided, tuple(dict.fromkeys([*notes, *run.notes])))


def check_cut(values: Mapping[str, Any], speed: float, depth: float) -> None:
    """Refuse a speed (rev/min), a depth (m) or a feed that no cut has."""
    if not 0 < speed <= FASTEST:
        raise ToolpointError(f"`speed`: {speed:g} rev/min; must be above zero and at most {FASTEST:g}")
    if not 0 < depth <= DEEPEST:
        raise ToolpointError(f"`depth`: {1e3 * depth:g} mm; must be above zero and at most {1e3 * DEEPEST:g} mm")
    if values.get("feed_per_tooth") is not None and not values["feed_per_tooth"] > 0:
        raise ToolpointError(f"`feed`: {1e3 * values['feed_per_tooth']:g} mm; must be above zero: without feed there is no cut")


def revolutions_to_forget(problem: MillingProblem, speed: float) -> int:
    """Return the revolutions after which the slowest mode's start-up has died out, with ten more to look at."""
    slowest = float((-problem.plane_at(speed).poles.real).min())
    return int(np.ceil(FADED / slowest * speed / 60)) + 10


def _check_steps(problem: MillingProblem, speed: float, revolutions: int) -> None:
    steps = ExactSteps().chosen(problem, speed) * problem.tool.teeth * revolutions
    if steps > MOST_STEPS:
        raise ToolpointError(f"`speed` {speed:g} rev/min: {revolutions} revolutions are {steps:.2g} time steps, at most "
                             f"{MOST_STEPS:.2g} are taken; give fewer `revolutions` (at such a speed a few are enough)")
