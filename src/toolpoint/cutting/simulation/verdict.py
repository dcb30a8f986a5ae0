"""Verdict on a simulated cut: stable, chatter or undecided, from the growth of the change between its periods."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from toolpoint._check import FloatArray

if TYPE_CHECKING:
    from toolpoint.cutting.simulation.milling import RunningCut, Simulation

BLOCKS, CERTAIN = 12, 4.587  # blocks of the last half of a run; Student's t, 10 degrees of freedom, 99.9 % both ways
LEAST_PERIODS = 2 * BLOCKS
START_TIME = 5.0  # time constants of the slowest mode after which the start-up is below 1 %
LEVEL_TIME = 10.0  # time constants over which the change must keep its level
LEVEL_DRIFT = 0.05  # drift of the level over them, log
DOUBLED = 0.7  # log of the growth that is taken for growth
IRREGULAR = 1.0  # error of the drift of a level that wanders, over ten times as many time constants, log
FADED, ROUNDED = 1e-3, 1e-9  # change over the thickest chip: below the smallest chatter; below rounding


@dataclass(frozen=True)
class Verdict:
    """What a simulated cut does.

    Parameters
    ----------
    state : str
        ``stable``: the change between periods has faded and goes on fading. ``chatter``: it grows, or keeps a level (the edges
        leave the material). ``undecided``: neither within this run.
    growth, error : float
        Growth of the change a period of the cut over the last half of the run, and its 99.9 % error; NaN in a run of fewer
        periods than the fit needs.
    reason : str
    """

    state: str
    growth: float
    error: float
    reason: str

    @property
    def chatters(self) -> bool | None:
        """True, False, or None where it is undecided."""
        return None if self.state == "undecided" else self.state == "chatter"


def judge(run: Simulation) -> Verdict:
    """Return the verdict on a run.

    Decay alone proves nothing: beyond the limit a hard start-up may decay to a small vibration that stays. So a cut is
    stable only when the change between its periods has fallen below a thousandth of the thickest chip, which throws no edge
    out of the material any more, and still falls or has settled; it chatters when the change grows, or keeps a higher level
    over ten time constants of the slowest mode. What is left of a settled change is no vibration that regenerates: edges that
    slip out of the thinnest part of their chip a little earlier or later each time.
    """
    if run.status != "complete":
        return Verdict("chatter", float("nan"), float("nan"), run.status)
    change = run.changes
    if change.size < LEAST_PERIODS:
        return Verdict("undecided", float("nan"), float("nan"),
                       f"{change.size} periods of the cut are too few; at least {LEAST_PERIODS} are needed")
    half = change[-(change.size // 2 // BLOCKS) * BLOCKS:]
    level = np.sqrt(np.mean(half.reshape(BLOCKS, -1)**2, axis=1))
    slope, error = _slope(np.log(np.maximum(level, 1e-300)))
    each = half.size // BLOCKS
    relative = float(level[-1] / max(float(run.chip[-run.steps_per_revolution:].max()), 1e-300))
    state, reason = _state(slope * BLOCKS, error * BLOCKS, relative, _time_constants(run, half.size))
    growth = float(np.exp(slope / each))
    return Verdict(state, growth, growth * error / each, reason)


def _slope(values: FloatArray) -> tuple[float, float]:
    """Return the slope of a straight line a block, and its error from the scatter of the blocks."""
    place = np.arange(values.size) - (values.size - 1) / 2
    slope = float(place @ values / (place @ place))
    scatter = values - values.mean() - slope * place
    return slope, CERTAIN * float(np.sqrt(scatter @ scatter / (values.size - 2) / (place @ place)))


def _time_constants(run: Simulation, periods: int) -> float:
    slowest = float((-run.problem.plane_at(run.speed).poles.real).min())
    # Periods of the cut are of one length, also where the speed varies within them.
    return slowest * periods * run.steps_per_repeat / run.steps_per_revolution * 60 / run.speed


def _state(drift: float, error: float, relative: float, constants: float) -> tuple[str, str]:
    """Return state and reason from the drift of log change over the half run, its error, the change over the thickest chip,
    and the length of the half run in time constants of the slowest mode."""
    if relative < ROUNDED:
        return "stable", "the periods of the cut repeat to rounding"
    if relative < FADED and drift + error < 0:
        return "stable", f"the change between periods has faded to {relative:.1e} of the thickest chip and still fades"
    if relative < FADED and abs(drift) + error < LEVEL_DRIFT and constants > LEVEL_TIME:
        return "stable", (f"the change between periods has settled at {relative:.1e} of the thickest chip, too little to throw "
                          "an edge out of the material")
    if drift - error > DOUBLED and 2 * constants > START_TIME:
        return "chatter", "the change between periods grows"
    if relative > FADED and abs(drift) + error < LEVEL_DRIFT and constants > LEVEL_TIME:
        return "chatter", f"the change between periods stays at {relative:.2g} of the thickest chip"
    if relative > FADED and abs(drift) < max(LEVEL_DRIFT, error) and error < IRREGULAR and constants > 10 * LEVEL_TIME:
        return "chatter", f"the change between periods stays, unevenly, at {relative:.2g} of the thickest chip"
    return "undecided", (f"over the last {constants:.2g} time constants of the slowest mode the change between periods went "
                         f"by a factor {np.exp(drift):.3g}, to {relative:.2g} of the thickest chip")


def run_until_decided(cut: RunningCut, first: int, most: int) -> Simulation:
    """Take a cut to `first`, twice, four times as many revolutions until it is decided, at most to `most`; return it."""
    variation = cut.problem.speed_variation
    whole = 1 if variation is None else variation.revolutions
    revolutions = min(first, most)
    while True:
        cut.advance(max(-(-(revolutions - cut.revolutions) // whole) * whole, whole))
        run = cut.result()
        if cut.revolutions >= most or run.verdict().state != "undecided":
            return run
        revolutions = min(2 * revolutions, most)
