"""Verdict on a simulated cut: stable, chatter or undecided, from the growth of the change between its periods."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray

GROWTH_BLOCK_COUNT = 12  # blocks of the last half of a run
STUDENT_T_999 = 4.587  # two-sided 99.9 % quantile of Student's t, 10 degrees of freedom (12 blocks less the two of a line)
MIN_VERDICT_PERIODS = 2 * GROWTH_BLOCK_COUNT  # periods of the cut
START_UP_TIME_CONSTANTS = 5.0  # time constants of the slowest mode after which the start-up is below 1 %
LEVEL_TIME_CONSTANTS = 10.0  # time constants over which the change must keep its level
MAX_LEVEL_DRIFT = 0.05  # log of the change, over LEVEL_TIME_CONSTANTS: a smaller drift is a level
MIN_LOG_GROWTH = 0.7  # log of the change, over the half run: a larger one is growth (a doubling)
MAX_DRIFT_ERROR = 0.1  # log of the change, over LEVEL_TIME_CONSTANTS: error of the drift of a level that wanders
WANDER_TIME_CONSTANTS = 20.0  # time constants over which a level that wanders must stay
FADED_CHANGE_RATIO = 1e-3  # of the thickest chip: a smaller change is below the smallest chatter
STEP_LEVEL_RATIO = 0.02  # of the thickest chip: a lower level that stays may be one that the time steps keep up
ROUNDING_CHANGE_RATIO = 1e-9  # of the thickest chip: a smaller change is rounding


@dataclass(frozen=True)
class Verdict:
    """Verdict on a simulated cut.

    Parameters
    ----------
    state : str
        ``stable``: the change between periods has faded and goes on fading. ``chatter``: it grows, or keeps a level (the edges
        leave the material). ``undecided``: neither within this run.
    growth, error : float
        Growth of the change a period of the cut over the last half of the run, and its 99.9 % error; NaN in a run of fewer
        periods than the fit needs.
    reason : str
    level : float
        Change between periods at the end of the run over the thickest chip; NaN where there is no growth.
    """

    state: str
    growth: float
    error: float
    reason: str
    level: float = float("nan")

    @property
    def chatters(self) -> bool | None:
        """True, False, or None where it is undecided."""
        return None if self.state == "undecided" else self.state == "chatter"

    @property
    def may_be_of_steps(self) -> bool:
        """Whether it is chatter at so low a level that finer time steps may let it fade: edges slip out of a thin chip a step
        earlier or later each period."""
        return self.state == "chatter" and self.level < STEP_LEVEL_RATIO and self.growth < 1 + self.error


def judge(changes: FloatArray, *, status: str, thickest_chip: float, time_constants: Callable[[int], float]) -> Verdict:
    """Return the verdict on a run from the change between its periods.

    Decay alone proves nothing: beyond the limit a hard start-up may decay to a small vibration that stays. So a cut is
    stable only when the change between its periods has fallen below a thousandth of the thickest chip, which throws no edge
    out of the material any more, and still falls or has settled; it chatters when the change grows, or keeps a higher level
    over ten time constants of the slowest mode. What is left of a settled change is no vibration that regenerates: edges that
    slip out of the thinnest part of their chip a little earlier or later each time.

    Parameters
    ----------
    changes : (n,) floats
        Root mean square change of the displacement from each period of the cut to the next, m.
    status : str
        ``complete``, or why the run was stopped: by a vibration without bound.
    thickest_chip : float
        Of the last revolution, m.
    time_constants : callable
        Time constants of the slowest mode in a number of periods.
    """
    if status != "complete":
        return Verdict("chatter", float("nan"), float("nan"), status)
    if changes.size < MIN_VERDICT_PERIODS:
        return Verdict("undecided", float("nan"), float("nan"),
                       f"{changes.size} periods of the cut are too few; at least {MIN_VERDICT_PERIODS} are needed")
    half = changes[-(changes.size // 2 // GROWTH_BLOCK_COUNT) * GROWTH_BLOCK_COUNT:]
    level = np.sqrt(np.mean(half.reshape(GROWTH_BLOCK_COUNT, -1)**2, axis=1))
    slope, error = _slope(np.log(np.maximum(level, 1e-300)))
    each = half.size // GROWTH_BLOCK_COUNT
    relative = float(level[-1] / max(thickest_chip, 1e-300))
    state, reason = _state(slope * GROWTH_BLOCK_COUNT, error * GROWTH_BLOCK_COUNT, relative, time_constants(half.size))
    growth = float(np.exp(slope / each))
    return Verdict(state, growth, growth * error / each, reason, relative)


def _slope(values: FloatArray) -> tuple[float, float]:
    """Return the slope of a straight line a block, and its error from the scatter of the blocks."""
    place = np.arange(values.size) - (values.size - 1) / 2
    slope = float(place @ values / (place @ place))
    scatter = values - values.mean() - slope * place
    return slope, STUDENT_T_999 * float(np.sqrt(scatter @ scatter / (values.size - 2) / (place @ place)))


def _state(drift: float, error: float, relative: float, constants: float) -> tuple[str, str]:
    """Return state and reason from the drift of log change over the half run, its error, the change over the thickest chip,
    and the length of the half run in time constants of the slowest mode."""
    if relative < ROUNDING_CHANGE_RATIO:
        return "stable", "the periods of the cut repeat to rounding"
    if relative < FADED_CHANGE_RATIO and drift + error < 0:
        return "stable", f"the change between periods has faded to {relative:.1e} of the thickest chip and still fades"
    if relative < FADED_CHANGE_RATIO and abs(drift) + error < MAX_LEVEL_DRIFT and constants > LEVEL_TIME_CONSTANTS:
        return "stable", (f"the change between periods has settled at {relative:.1e} of the thickest chip, too little to throw "
                          "an edge out of the material")
    if drift - error > MIN_LOG_GROWTH and 2 * constants > START_UP_TIME_CONSTANTS:
        return "chatter", "the change between periods grows"
    if relative > FADED_CHANGE_RATIO and abs(drift) + error < MAX_LEVEL_DRIFT and constants > LEVEL_TIME_CONSTANTS:
        return "chatter", f"the change between periods stays at {relative:.2g} of the thickest chip"
    # Chatter that wanders between levels: no fall that its scatter does not explain, and none of a percent a time constant.
    if (relative > FADED_CHANGE_RATIO and abs(drift) < max(MAX_LEVEL_DRIFT, error) and constants > WANDER_TIME_CONSTANTS
            and error < MAX_DRIFT_ERROR * constants / LEVEL_TIME_CONSTANTS):
        return "chatter", f"the change between periods stays, unevenly, at {relative:.2g} of the thickest chip"
    return "undecided", (f"over the last {constants:.2g} time constants of the slowest mode the change between periods went "
                         f"by a factor {np.exp(drift):.3g}, to {relative:.2g} of the thickest chip")
