"""Best spindle speed: from a chart, from a chatter frequency alone, from a few cuts with known outcome."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, count, fail, positive
from toolpoint.cutting.advice.probability import ProbabilityChart
from toolpoint.cutting.stability.result import StabilityChart


@dataclass(frozen=True)
class Advice:
    """A proposed cut.

    Parameters
    ----------
    speed : float
        rev/min.
    depth : float
        m; NaN where only a speed can be given.
    reason : str
    """

    speed: float
    depth: float
    reason: str


def from_chart(chart: StabilityChart, margin: float = 0.1, speed_margin: float = 0.02) -> Advice:
    """Return the cut with the largest product of speed and depth that stays stable when both are off by the margins.

    The depth must lie below the limit less its stated error at all charted speeds within +- `speed_margin`, and at both ends
    of that range by the straight line between charted speeds; it is reduced by `margin`. Where the chart cannot show the
    margin of speed, because it ends there or its speeds lie farther apart, the reason says so.
    """
    limit, speeds = chart.sure_limit, chart.speeds
    within_margin = np.abs(speeds[:, None] / speeds[None, :] - 1) <= speed_margin
    order = np.argsort(speeds)
    ends = [np.interp(speeds * (1 + way), speeds[order], limit[order]) for way in (-speed_margin, speed_margin)]
    safe = np.minimum(np.where(within_margin, limit[:, None], np.inf).min(0), np.minimum(*ends)) * (1 - margin)
    best = int(np.argmax(safe * speeds))
    speed = float(speeds[best])
    ended = "" if np.isfinite(chart.limit[best]) else "; no limit was found there: this is the end of the searched depths"
    return Advice(speed, float(safe[best]), f"largest removal rate with {100 * margin:g} % of depth and "
                  f"{100 * speed_margin:g} % of speed in hand{ended}{_margin_words(np.sort(speeds), speed, speed_margin)}")


def _margin_words(speeds: FloatArray, speed: float, margin: float) -> str:
    """Return what the chart does not show of the margin of speed, as words for the end of a reason."""
    if speed * (1 - margin) < speeds[0] * (1 - 1e-9) or speed * (1 + margin) > speeds[-1] * (1 + 1e-9):
        return "; the chart ends here: look beyond"
    gaps = np.diff(speeds)[(speeds[1:] > speed * (1 - margin)) & (speeds[:-1] < speed * (1 + margin))]
    return "; the chart is coarse here: chart more speeds" if gaps.max(initial=0.0) > margin * speed else ""


def from_chatter_frequency(frequency: float, teeth: int, speed_max: float, *, speed_min: float = 0.0) -> tuple[Advice, ...]:
    r"""Return the speeds whose tooth-passing frequency is a whole fraction of the chatter frequency, fastest first.

    :math:`n_k = 60 f_c/(N k)`, k = 1, 2, ...: there successive waves are in phase. The lobe lies at or slightly below.
    Source: Smith, Tlusty, CIRP Annals 39 (1990) 517.
    """
    f, n = positive("frequency", frequency), count("teeth", teeth)
    fastest = positive("speed_max", speed_max)
    k = np.arange(1, 200)
    speeds = 60 * f / (n * k)
    keep = (speeds <= fastest) & (speeds >= speed_min)
    if not keep.any():
        fail("speed_max", f"{fastest:g} rev/min", f"no lobe of {f:g} Hz lies between {speed_min:g} and {fastest:g} rev/min")
    return tuple(Advice(float(s), float("nan"), f"tooth passing at 1/{i} of the chatter frequency")
                 for s, i in zip(speeds[keep][:8], k[keep][:8]))


def from_cuts(prior: ProbabilityChart, cuts: list[tuple[float, float, bool]], level: float = 0.95) -> Advice:
    """Return the cut with the largest product of speed and depth that is stable with at least this probability, given
    the outcome of cuts (speed, depth, stable) already made."""
    posterior = prior.after_cuts(cuts)
    depth = posterior.depth_at(level)
    best = int(np.argmax(depth * prior.speeds))
    cut_off = "; deeper cuts were not looked at" if depth[best] >= prior.depths[-1] * (1 - 1e-9) else ""
    return Advice(float(prior.speeds[best]), float(depth[best]),
                  f"P(stable) at least {level:g} after {len(cuts)} cuts with known outcome{cut_off}")


def most_informative(prior: ProbabilityChart) -> Advice:
    """Return the test cut whose outcome is least certain (P(stable) nearest 1/2, largest removal rate among equals)."""
    p = prior.probability
    rate = prior.speeds[:, None] * prior.depths / (prior.speeds.max() * prior.depths.max())
    doubt: FloatArray = p * (1 - p) * (1 + 1e-3 * rate)
    i, d = np.unravel_index(int(np.argmax(doubt)), doubt.shape)
    return Advice(float(prior.speeds[i]), float(prior.depths[d]), f"P(stable) {p[i, d]:.2f}: its outcome tells most")
