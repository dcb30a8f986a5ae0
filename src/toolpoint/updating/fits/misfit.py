"""Misfit of responses beyond their noise: it shows what a fitted model lacks, which no interval covers."""

from __future__ import annotations

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.updating.measured.targets import Targets
from toolpoint.vibration import Frf

# Share of the responses, and of their noise power, from which what is missed is named.
MIN_MISSED_SHARE, MIN_EXCESS_POWER = 0.005, 0.03
MIN_NOISE_DEVIATIONS = 5.0  # standard deviations of the power of noise


def question_misfit(targets: Targets, predicted: Frf) -> tuple[Doubt, ...]:
    r"""Return a doubt where a model differs from measured responses by more than their noise.

    The share of the responses that it misses is :math:`\sqrt{\sum w (|e|^2 - n^2) / \sum w (|H|^2 - n^2)}`, with the weights
    w of the fit, the differences e and the noise n of every line. Masses and places that are a few per cent off, a joint or a
    damper that is no parameter, a sensor that reads too much: the parameters make up for it where they can, and their intervals
    know nothing of it.
    """
    measured = targets.frf
    if measured is None:
        return ()
    weight = targets.frf_deviation() ** -2.0
    error, noise, size = (float((weight * part).sum()) for part in (
        np.abs(predicted.values - measured.values) ** 2, targets.noise_of_lines() ** 2, np.abs(measured.values) ** 2))
    scatter = max(MIN_EXCESS_POWER, MIN_NOISE_DEVIATIONS / np.sqrt(measured.values.size))
    if noise == 0 or size <= noise or error <= noise * (1 + scatter):  # zero: too few lines to tell noise
        return ()
    share = float(np.sqrt((error - noise) / (size - noise)))
    if share < MIN_MISSED_SHARE:
        return ()
    return (Doubt("model", f"it misses {100 * share:.2g} % of the responses ({np.sqrt(error / noise):.2g} times their noise)",
                  "masses, places, joints or dampers that are off and not moved, or a wrong channel; intervals do not hold "
                  "what the model lacks", figure=share),)
