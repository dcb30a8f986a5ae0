"""Cut simulated in time, long enough to distinguish chatter from the start-up."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt, grave_among
from toolpoint._notebook import NotebookText
from toolpoint.cutting import MillingProblem
from toolpoint.cutting.description import check_cut
from toolpoint.cutting.simulation.march import KEPT_STEPS
from toolpoint.cutting.simulation.milling import ExactSteps, RunningCut, run_until_decided
from toolpoint.cutting.simulation.simulated_run import Simulation
from toolpoint.cutting.simulation.verdict import Verdict
from toolpoint.studies.cuts.cut_stability import CutStability, cut_stability
from toolpoint.studies.cuts.described_cut import build_problem
from toolpoint.studies.cuts.drawn_cut import DrawnCut, question_cut
from toolpoint.studies.cuts.lobes_study import DEFAULT_SIMULATED_FEED
from toolpoint.studies.cuts.simulated_wall import SimulatedWall, measure_wall
from toolpoint.studies.cuts.tip_doubts import WITHHELD, withheld_words
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics

MIN_FIRST_REVOLUTIONS = 60  # of the first run
FORGOTTEN_TIME_CONSTANTS = 5.0  # of the slowest mode, after which its start-up is below 1 %
MAX_SIMULATED_STEPS = 300_000_000  # time steps of one simulation
MIN_KEPT_REVOLUTIONS = 12  # of a long cut, for its page
MAX_RUN_ON_STEPS = 20_000_000  # time steps up to which an undecided cut is run on


@dataclass(frozen=True, eq=False)
class SimulatedCut(NotebookText):
    """Simulated cut with its verdict.

    linear : multiplier and limit of the stability chart; drawn : verdicts of equally likely responses, None where the dynamics
    have none; wall : that the cut leaves, None where it leaves none; notes : assumptions.
    """

    run: Simulation
    verdict: Verdict
    linear: CutStability = field(default_factory=CutStability)
    notes: tuple[str, ...] = ()
    drawn: DrawnCut | None = None
    wall: SimulatedWall | None = None

    @property
    def withheld(self) -> list[Doubt]:
        """The grave doubts for which no verdict is given."""
        return grave_among(self.notes)

    @property
    def state(self) -> str:
        """``chatter``, ``stable``, ``undecided``, or ``withheld`` where the dynamics are gravely doubted."""
        return WITHHELD if self.withheld else self.verdict.state

    @property
    def reason(self) -> str:
        """Reason of the state."""
        return withheld_words(self.withheld) if self.withheld else self.verdict.reason

    def rows(self) -> list[tuple[str, str]]:
        """Return rows (quantity, value) of a simulated cut."""
        run = self.run
        tail = run.force[-10 * run.steps_per_revolution:]
        moved = run.peak_to_peak()
        drawn = [] if self.drawn is None else self.drawn.rows()
        verdict = [] if self.withheld else [*self._growth(), *self.linear.rows(), *drawn]
        return [("state", self.state), ("because", self.reason), *verdict,
                ("status", run.status),
                ("force x, mean / peak", f"{tail[:, 0].mean():.1f} / {np.abs(tail[:, 0]).max():.1f} N"),
                ("force y, mean / peak", f"{tail[:, 1].mean():.1f} / {np.abs(tail[:, 1]).max():.1f} N"),
                ("torque, mean", f"{run.torque.mean():.3f} N m"), ("power, mean", f"{run.power.mean():.1f} W"),
                ("vibration x, peak to peak", f"{1e6 * moved[0]:.2f} µm"),
                ("vibration y, peak to peak", f"{1e6 * moved[1]:.2f} µm"), *([] if self.wall is None else self.wall.rows())]

    def _growth(self) -> list[tuple[str, str]]:
        v = self.verdict
        return [] if np.isnan(v.growth) else [("growth in the simulation", f"{v.growth:.5f} ± {v.error:.1e} a period")]

    def table(self) -> str:
        """Return state, growth, multiplier and limit, forces, power and vibration as text."""
        return "\n".join(f"{name:32s} {value}" for name, value in self.rows())

    def to_dict(self) -> dict[str, Any]:
        """Return verdict, growth, multiplier, limit, vibration (m), power (W) as plain data; chatter None where undecided."""
        run, v = self.run, self.verdict
        growth = {"growth": None, "growth_error": None} if np.isnan(v.growth) else {"growth": v.growth, "growth_error": v.error}
        linear = {} if self.withheld else self.linear.to_dict()
        if self.drawn is not None and not self.withheld:
            linear |= {"probability_stable": self.drawn.stable_share,
                       "limit_interval_m": [self.drawn.limit_min, self.drawn.limit_max]}
        return {"chatter": None if self.withheld else v.chatters, "state": self.state, "reason": self.reason,
                "withheld": list(self.withheld), **growth, **linear,
                "revolutions": run.revolutions, "notes": list(self.notes),
                "peak_to_peak_m": run.peak_to_peak().tolist(), "power_w": float(run.power.mean()),
                "wall": None if self.wall is None else self.wall.to_dict(), "status": run.status}


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
        Where left out the cut is run on until its state is decided, up to 20 million time steps.

    >>> from toolpoint.studies import modal_dynamics
    >>> from toolpoint.vibration import Modes
    >>> tip = Modes([900.0, 900.0], 0.02, 1.5 * np.eye(2), ("tip:+x", "tip:+y"))
    >>> cut = {"diameter": 0.012, "teeth": 2, "direction": "slot", "tangential": 8e8, "normal": 3e8}
    >>> simulate_cut(modal_dynamics(tip), cut, speed=9000.0, depth=2e-5, revolutions=15).verdict.state
    'stable'
    """
    check_cut(values or {}, speed, depth)
    problem, _, notes = build_problem(dynamics, values or {}, in_time=True)
    if not problem.feed_per_tooth:
        notes.append(f"feed per tooth not given: {1e3 * DEFAULT_SIMULATED_FEED:g} mm is taken (`feed`)")
        problem = problem.changed(feed_per_tooth=DEFAULT_SIMULATED_FEED)
    first = revolutions or max(MIN_FIRST_REVOLUTIONS, count_start_up_revolutions(problem, speed))
    per_turn = ExactSteps().chosen(problem, speed) * problem.tool.teeth
    if not revolutions and per_turn * MIN_FIRST_REVOLUTIONS <= MAX_SIMULATED_STEPS:
        first = min(first, MAX_SIMULATED_STEPS // per_turn)
    _check_steps(problem, speed, first)
    step("simulation")
    cut = RunningCut(problem, speed, depth, kept=max(KEPT_STEPS, MIN_KEPT_REVOLUTIONS * per_turn))
    if revolutions:
        cut.advance(revolutions)
        run = cut.result()
    else:
        run = run_until_decided(cut, first, max(first, MAX_RUN_ON_STEPS // per_turn))
    verdict, linear = run.verdict(), cut_stability(run)
    drawn = question_cut(dynamics, values or {}, speed=speed, depth=depth)
    said = [*([] if drawn is None else [drawn.note]), *notes, *run.notes, *_remarks(verdict, linear)]
    return SimulatedCut(run, verdict, linear, tuple(dict.fromkeys(said)), drawn, measure_wall(run))


def _remarks(verdict: Verdict, linear: CutStability) -> list[str]:
    """Return remarks on an undecided cut, and on a disagreement of simulation and chart."""
    if verdict.state == "undecided":
        return [f"undecided: {verdict.reason}; give more `revolutions`, or go by the multiplier"]
    if linear.stable is None or linear.stable != verdict.chatters:
        return []
    if linear.stable:
        return ["the stability chart calls this cut stable, yet its simulation chatters: the blow of the start throws edges "
                "out of the material and the vibration stays; the cut is safe from small disturbances only"]
    return ["the stability chart calls this cut unstable, yet its simulation fades: they differ by their steps and slices near "
            "the limit; do not rely on it"]


def count_start_up_revolutions(problem: MillingProblem, speed: float) -> int:
    """Return the revolutions until the start-up of the slowest mode has decayed, with ten more to judge."""
    slowest = float((-problem.plane_at(speed).poles.real).min())
    return int(np.ceil(FORGOTTEN_TIME_CONSTANTS / slowest * speed / 60)) + 10


def _check_steps(problem: MillingProblem, speed: float, revolutions: int) -> None:
    steps = ExactSteps().chosen(problem, speed) * problem.tool.teeth * revolutions
    if steps > MAX_SIMULATED_STEPS:
        raise ToolpointError(f"`speed` {speed:g} rev/min: {revolutions} revolutions are {steps:.2g} time steps, at most "
                             f"{MAX_SIMULATED_STEPS:.2g} are taken; give fewer `revolutions` (at such a speed a few are "
                             f"enough)")
