"""Remainders of removed harmonics: where the speed wanders, they resemble a lightly damped mode beside the line."""

from __future__ import annotations

import numpy as np

from toolpoint._check import BoolArray, FloatArray
from toolpoint._doubt import Doubt
from toolpoint.modal_identification.judgement.complexity import phase_collinearity
from toolpoint.modal_identification.operational.harmonics import Harmonic
from toolpoint.vibration.modes import Modes

MAX_REMAINDER_COLLINEARITY = 0.7  # phase collinearity: forced motion by a line has any phases, a mode nearly one
MIN_REMAINDER_DEVIATION = 0.1  # of the damping ratio, over it: a mode beside a line is known better than what the line left
MIN_DEVIATION_RATIO = 1.5  # of a remainder over that of the mode beside it that is known better
MIN_HARMONIC_POWER_RATIO = 30.0  # power of the line over that of the mode, beyond which a mode beside it is doubted


def remainders_of_lines(modes: Modes, power_share: FloatArray, harmonics: tuple[Harmonic, ...]) -> tuple[BoolArray,
                                                                                                         tuple[Doubt, ...]]:
    """Return whether each mode is what a removed harmonic left, and doubts about modes that may be.

    A mode within its half width of a line and with a shape of mixed phases is a remainder, and so is one beside a mode that is
    known better, where the line was much stronger: the line's remainder takes the shape of the mode that it drives. Any other
    mode with a shape of one phase is kept, and doubted where the line was much stronger: no record at one speed can part them.
    """
    is_remainder = np.zeros(modes.count, bool)
    doubts = []
    deviation = np.zeros(modes.count) if modes.covariance is None else np.sqrt(modes.covariance[:, 1, 1]) / modes.damping_ratio
    collinear = phase_collinearity(modes.shape) if modes.count else np.zeros(0)
    for i in range(modes.count):
        half_width = float(modes.damping_ratio[i] * modes.frequency[i])
        lines = [line for line in harmonics if line.is_removed and abs(line.frequency - modes.frequency[i]) < half_width]
        if not lines:
            continue
        strongest = max(lines, key=lambda line: line.power_share)
        if collinear[i] < MAX_REMAINDER_COLLINEARITY and deviation[i] > MIN_REMAINDER_DEVIATION and len(modes.dofs) > 2:
            is_remainder[i] = True
            continue
        ratio = strongest.power_share / max(1 - strongest.power_share, 1e-9) / max(float(power_share[i]), 1e-9)
        if ratio > MIN_HARMONIC_POWER_RATIO and _has_better_neighbour(modes, deviation, i):
            is_remainder[i] = True
        elif ratio > MIN_HARMONIC_POWER_RATIO:
            doubts.append(Doubt(
                f"mode at {modes.frequency[i]:.4g} Hz",
                f"a line of a rotating part, {ratio:.2g} times as strong, lies within its half width at "
                f"{strongest.frequency:.4g} Hz: it may be what the removal left of that line",
                "record at another speed: a mode stays where it is",
                figure=ratio))
    return is_remainder, tuple(doubts)


def _has_better_neighbour(modes: Modes, deviation: FloatArray, i: int) -> bool:
    """Whether a mode whose damping is hardly known overlaps with another one whose damping is known better."""
    half_width = modes.damping_ratio * modes.frequency
    overlaps = np.abs(modes.frequency - modes.frequency[i]) < half_width + half_width[i]
    overlaps[i] = False
    is_better = deviation * MIN_DEVIATION_RATIO < deviation[i]
    return bool(deviation[i] > MIN_REMAINDER_DEVIATION and (overlaps & is_better).any())
