"""Probability of chatter from the evidence: a logistic model whose coefficients were fitted to random cuts with known truth."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.studies.listening.evidence import Evidence

MIN_LOG_RATIO, MAX_LOG_RATIO = -4.0, 2.0  # log10 of the family's power over that of the orders
MAX_BROADBAND_RATIO = 3.0  # of power in no line over that of the orders: beyond, chatter without a period cannot be excluded
UNDECIDED_PROBABILITY = 0.5  # probability that such power leaves at least
MIN_HALF_FRACTION = 1e-3  # of the power of the orders at half tooth passings: less says nothing
MIN_HALF_DOMINANCE = 10.0  # of that power over the other orders of run-out: run-out alone spreads over all of them
MIN_EVEN_TEETH = 4  # of a tool whose flip can be told from run-out: with two teeth half a tooth passing is the spindle
# Constant, log ratio, log of side bands: fitted with a ridge of 0.001 by
# `benchmarks/listening/chatter_probability.py` to 221 of 240 random cuts (seed 0, without those of broadband power); the bars
# tell other seeds.
LOGISTIC_COEFFICIENTS = (4.86, 5.49, 4.61)

# Constant and slope of the log odds where the speed was searched: a wrong speed can make either verdict sure. Fitted by
# `benchmarks/listening/searched_speeds.py --fit` to 84 random cuts (seed 4000), 27 % with a wrong speed; the bars tell
# another seed.
SEARCHED_ODDS_COEFFICIENTS = (-0.42, 0.69)
MIN_TEMPERED_PROBABILITY = 1e-6  # at either end: of what is certain the odds are no number


def temper_searched(probability: float) -> float:
    """Return the probability of chatter that holds where the spindle speed was searched, not given.

    Examples
    --------
    >>> [round(temper_searched(p), 2) for p in (0.02, 0.5, 0.999)]
    [0.04, 0.4, 0.99]
    """
    bounded = min(max(probability, MIN_TEMPERED_PROBABILITY), 1 - MIN_TEMPERED_PROBABILITY)
    constant, slope = SEARCHED_ODDS_COEFFICIENTS
    return float(1 / (1 + np.exp(-(constant + slope * np.log(bounded / (1 - bounded))))))


def has_hidden_flip(evidence: Evidence) -> bool:
    """Whether an even number of teeth has its power of run-out at half tooth passings, as a flip has."""
    lines = evidence.lines
    return (evidence.teeth % 2 == 0 and evidence.teeth >= MIN_EVEN_TEETH
            and lines.half_tooth > MIN_HALF_FRACTION * lines.order_power
            and lines.half_tooth > MIN_HALF_DOMINANCE * lines.between
            and (evidence.family is None or lines.half_tooth > evidence.family.power))


def features_of(evidence: Evidence) -> FloatArray:
    """Return what the model takes, shape (3,): a one, the log ratio of the family's power over the orders', and the log of its
    side bands a tooth passing apart beyond chance. The lines of a hidden flip are taken for a family."""
    family, lines = evidence.family, evidence.lines
    ratio, members = evidence.ratio, 0.0
    if family is not None:
        members = max(family.tooth_members - 1 - 2 * family.tooth_chance, 0.0)
    if has_hidden_flip(evidence):
        ratio = lines.half_tooth / max(lines.order_power - lines.half_tooth, 1e-300)
        half = lines.orders[evidence.teeth // 2 - 1::evidence.teeth]
        members = float(np.sum(half > 0)) - 1
    # Clipped to the range of the cuts that the weights were fitted to: beyond it the line would be extrapolated to
    # certainty.
    return np.array([1.0, np.clip(np.log10(max(ratio, 1e-12)), MIN_LOG_RATIO, MAX_LOG_RATIO), np.log(1 + members)])


def chatter_probability(evidence: Evidence) -> float:
    """Return the probability of chatter.

    Lines nearer to an order than can be told are hidden: where none is seen, chatter remains as likely as the hidden share of
    the frequencies, before the record chatter and no chatter being equally likely. Power in no line may be coolant, or chatter
    without a period: it leaves the verdict open.
    """
    logit = float(features_of(evidence) @ np.array(LOGISTIC_COEFFICIENTS))
    from_lines = 1 / (1 + np.exp(-np.clip(logit, -30, 30)))
    hidden = evidence.lines.hidden
    lower_bound = UNDECIDED_PROBABILITY if evidence.broadband > MAX_BROADBAND_RATIO else hidden / (1 + hidden)
    return float(max(from_lines, lower_bound))
