"""Loops that a simulation runs and no machine should: hardly stable, sampled too slowly, with a gain that no axis has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.drives.controller.settings import Controller

# Margins below which a loop is said to be hardly stable: usual designs keep 6 dB and 30 degrees, tuned ones more.
_DECIBELS, _DEGREES = 6.0, 30.0
# Gains of position loops of machines, 1/s, with room on both sides.
_GAINS = (2.0, 1000.0)
Figures = Sequence[tuple[str, str, float, float, float]]


def doubt_margins(figures: Figures) -> list[Doubt]:
    """Return which loops are hardly stable, or follow to half their sample rate without a fall: loop, axis, gain margin (dB),
    phase margin (deg), bandwidth (Hz) of each."""
    doubts = []
    for loop, axis, gain, phase, width in figures:
        small = [words for words, few in ((f"gain margin {gain:.1f} dB", gain < _DECIBELS),
                                          (f"phase margin {phase:.1f}°", phase < _DEGREES)) if few]
        if small:
            why = f"{' and '.join(small)}; usual are {_DECIBELS:g} dB and {_DEGREES:g}°"
            doubts.append(Doubt(f"axis {axis}, {loop} loop", why, "a little more inertia, delay or flexibility than in the file"
                                " makes it unstable: check gains and sample times"))
        elif np.isnan(width):
            doubts.append(Doubt(f"axis {axis}, {loop} loop", "no fall by 3 dB below half the sample rate",
                                "its sample time is too long for its gain, or its closed loop never follows"))
    return doubts


def doubt_gains(names: Sequence[str], controllers: Sequence[Controller]) -> list[Doubt]:
    """Return position gains that no machine's axis has."""
    return [Doubt(f"axis {name}", f"gain of the position loop {c.position.gain:.4g} 1/s is that of no machine's axis "
                  f"({_GAINS[0]:g} to {_GAINS[1]:g})", "check its unit: 1 (m/min)/mm is 16.7 1/s")
            for name, c in zip(names, controllers, strict=True) if not _GAINS[0] < c.position.gain < _GAINS[1]]
