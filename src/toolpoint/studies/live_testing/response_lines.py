"""Driving response and coherence in two lines of a terminal, while they build up."""

from __future__ import annotations

import itertools

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.signals.usable_band import UsableBand
from toolpoint.vibration import Frf

LEVEL_MARKS = " ▁▂▃▄▅▆▇█"
COLUMN_COUNT = 60  # characters of a line
DYNAMIC_RANGE_DECIBELS = 50.0  # dB of the response below its peak that the marks show
COHERENT_SHARE = 0.9  # of the power: lines above it are counted as coherent


def draw_response(frf: Frf, band: UsableBand) -> list[str]:
    """Return the size of the first response and its coherence over the band to be believed, as lines of text."""
    inside = (frf.frequency >= band.low) & (frf.frequency <= band.high)
    if np.count_nonzero(inside) < 2:
        return []
    frequency = frf.frequency[inside]
    size = np.abs(frf.values[inside, 0, 0])
    decibels = 20 * np.log10(np.maximum(size / max(float(size.max()), 1e-300), 1e-12))
    edges = np.linspace(0, frequency.size, min(COLUMN_COUNT, frequency.size) + 1).astype(int)
    peaks = np.array([decibels[a:b].max() for a, b in itertools.pairwise(edges)])
    lines = [f"response  {_marks(1 + peaks / DYNAMIC_RANGE_DECIBELS)}  {frequency[0]:.4g} .. {frequency[-1]:.4g} Hz, peak at "
             f"{frequency[int(np.argmax(size))]:.4g} Hz"]
    if frf.coherence is not None:
        coherence = np.asarray(frf.coherence)[inside, 0, 0]
        means = np.array([coherence[a:b].mean() for a, b in itertools.pairwise(edges)])
        share = float(np.mean(coherence > COHERENT_SHARE))
        lines.append(f"coherence {_marks(means)}  above {COHERENT_SHARE:g} on {100 * share:.0f} % of the lines")
    return lines


def _marks(share: FloatArray) -> str:
    steps = np.clip(np.round(share * (len(LEVEL_MARKS) - 1)), 0, len(LEVEL_MARKS) - 1).astype(int)
    return "".join(LEVEL_MARKS[k] for k in steps)
