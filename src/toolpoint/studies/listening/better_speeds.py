r"""Spindle speeds to try against a chatter line whose phase is known, with an interval that damping leaves open.

The line of a regenerating mode lies above its natural frequency: with the phase :math:`\varepsilon = 2 \pi (f_c/f_z - k)`
between the waves of successive teeth and :math:`r = f_c/f_n`, one mode has
:math:`r^2 - 1 = 2 \zeta r / \tan((\varepsilon - \pi)/2)`
(Altintas, Manufacturing Automation, 2012, section 4). The lobes are where the tooth passing is a whole fraction of :math:`f_n`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

DAMPING_RATIOS = (0.01, 0.025, 0.05)  # low, usual, high, of tools in spindles
MAX_LOBE = 6  # beyond, the pockets are too narrow to be of use
MAX_SHIFT = 1.15  # of a chatter line over its mode
MIN_SPEED_CHANGE = 0.02  # relative: a nearer speed is the one that chatters
DEFAULT_HEADROOM = 1.25  # of the present speed, where the highest speed of the spindle is not given


@dataclass(frozen=True)
class SpeedToTry:
    """A spindle speed, rev/min, with the interval that the unknown damping leaves, and its lobe."""

    speed: float
    lower: float
    upper: float
    lobe: int


def propose_lobes(frequency: float, tooth: float, teeth: int, *, highest: float, lowest: float = 0.0,
                  mode: float | None = None) -> tuple[SpeedToTry, ...]:
    """Return speeds of lobes within the spindle's range, fastest (widest pocket) first, without the present one.

    Parameters
    ----------
    frequency : float
        Chatter frequency, Hz.
    tooth : float
        Present tooth-passing frequency, Hz.
    teeth : int
    highest, lowest : float
        Limits of the spindle, rev/min.
    mode : float, optional
        Natural frequency of the mode that chatters, Hz, where it is known.
    """
    natural = [mode] * 3 if mode else [natural_frequency(frequency, tooth, zeta) for zeta in DAMPING_RATIOS]
    present = 60 * tooth / teeth
    speeds = []
    for lobe in range(1, MAX_LOBE + 1):
        values = sorted(60 * f / (teeth * lobe) for f in natural)
        if lowest <= values[1] <= highest and abs(values[1] / present - 1) > MIN_SPEED_CHANGE:
            speeds.append(SpeedToTry(values[1], values[0], values[2], lobe))
    return tuple(speeds)


def natural_frequency(frequency: float, tooth: float, damping: float) -> float:
    """Return the natural frequency behind a chatter line, Hz, for one mode of a damping ratio."""
    phase = 2 * np.pi * (frequency / tooth % 1)
    slope = np.tan(0.5 * max(phase - np.pi, 0.0))
    if slope == 0:  # the line is on the unusual side of its mode: the phase of one mode says nothing
        return float(frequency / (1 + damping))
    ratio = damping / slope + np.sqrt((damping / slope) ** 2 + 1)
    return float(frequency / min(ratio, MAX_SHIFT))
