"""Cut to try next: the depth whose outcome, whichever it is, leaves the narrowest interval of the limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.cutting.advice.probability import OUTCOME_RELIABILITY
from toolpoint.project.limits.drawn_limits import DrawnLimits, quantile_of

CANDIDATE_LEVELS = np.linspace(0.1, 0.9, 9)  # quantiles of the limit that are candidates
SAME_SPEED_RATIO, SAME_DEPTH_RATIO = 0.01, 0.03  # relative differences below which two cuts are one


@dataclass(frozen=True)
class NextCut:
    """Cut to try: speed (rev/min), depth (m), the width of the interval after it over that of today, P(stable) of it."""

    speed: float
    depth: float
    width_ratio: float
    stable_probability: float

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"speed_rpm": self.speed, "depth_m": self.depth, "interval_over_today": self.width_ratio,
                "stable_probability": self.stable_probability}


def choose_cut(limits: DrawnLimits, weights: FloatArray, tried: Sequence[tuple[float, float]] = ()) -> NextCut:
    """Return the depth at the asked speed whose trial narrows the interval of the limit most, in the mean of its outcomes.

    tried : speed (rev/min) and depth (m) of cuts that were made. Made again, one would count as new evidence, and whatever was
    wrong with it the first time is wrong again; it is proposed only where no other depth is left.
    """
    draws = np.minimum(limits.draws[:, 0], limits.depth_max)
    today, candidates = _width(draws, weights), []
    for level in CANDIDATE_LEVELS:
        depth = quantile_of(draws, weights, float(level))
        stable = draws > depth
        likelihoods = [np.where(stable == outcome, OUTCOME_RELIABILITY, 1 - OUTCOME_RELIABILITY) for outcome in (True, False)]
        chances = [float(weights @ likelihood) for likelihood in likelihoods]
        widths = [_width(draws, weights * likelihood / chance)
                  for likelihood, chance in zip(likelihoods, chances, strict=True)]
        ratio = sum(chance * width for chance, width in zip(chances, widths, strict=True)) / max(today, 1e-300)
        candidates.append(NextCut(limits.question.speeds[0], depth, ratio, float(weights @ stable)))
    new_cuts = [cut for cut in candidates if not any(_is_same(cut, speed, depth) for speed, depth in tried)]
    return min(new_cuts or candidates, key=lambda cut: cut.width_ratio)


def _is_same(cut: NextCut, speed: float, depth: float) -> bool:
    return abs(cut.speed - speed) <= SAME_SPEED_RATIO * speed and abs(cut.depth - depth) <= SAME_DEPTH_RATIO * depth


def _width(draws: FloatArray, weights: FloatArray) -> float:
    """Return the width of the 95 % interval of draws."""
    return quantile_of(draws, weights, 0.975) - quantile_of(draws, weights, 0.025)
