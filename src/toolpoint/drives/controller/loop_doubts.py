"""Doubts of loops that a simulation accepts and no machine should: hardly stable, sampled too slowly, of an unusual gain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.drives.controller.settings import Controller

# Margins below which a loop is said to be hardly stable: usual designs keep 6 dB and 30 degrees, tuned ones more.
_USUAL_GAIN_MARGIN_DB, _USUAL_PHASE_MARGIN_DEG = 6.0, 30.0
# Gains of position loops of machines, 1/s, with room on both sides.
USUAL_POSITION_GAINS = (2.0, 1000.0)
Figures = Sequence[tuple[str, str, float, float, float]]


def doubt_margins(figures: Figures) -> list[Doubt]:
    """Return doubts of loops that are hardly stable, or whose closed response does not fall to half their sample rate; figures
    : loop, axis, gain margin (dB), phase margin (deg), bandwidth (Hz) of each."""
    doubts = []
    for loop, axis, gain, phase, width in figures:
        low_margins = [words for words, is_low in ((f"gain margin {gain:.1f} dB", gain < _USUAL_GAIN_MARGIN_DB),
                                                   (f"phase margin {phase:.1f}°", phase < _USUAL_PHASE_MARGIN_DEG)) if is_low]
        if low_margins:
            why = f"{' and '.join(low_margins)}; usual are {_USUAL_GAIN_MARGIN_DB:g} dB and {_USUAL_PHASE_MARGIN_DEG:g}°"
            doubts.append(Doubt(f"axis {axis}, {loop} loop", why, "a little more inertia, delay or flexibility than in the file"
                                " makes it unstable: check gains and sample times"))
        elif np.isnan(width):
            doubts.append(Doubt(f"axis {axis}, {loop} loop", "no fall by 3 dB below half the sample rate",
                                "its sample time is too long for its gain, or its closed loop never follows"))
    return doubts


def doubt_gains(names: Sequence[str], controllers: Sequence[Controller]) -> list[Doubt]:
    """Return doubts of position gains outside those of machines."""
    return [Doubt(f"axis {name}", f"gain of the position loop {c.position.gain:.4g} 1/s is that of no machine's axis "
                  f"({USUAL_POSITION_GAINS[0]:g} to {USUAL_POSITION_GAINS[1]:g})", "check its unit: 1 (m/min)/mm is 16.7 1/s")
            for name, c in zip(names, controllers, strict=True)
            if not USUAL_POSITION_GAINS[0] < c.position.gain < USUAL_POSITION_GAINS[1]]
