r"""Vibration that still rings at the end of a block, mode by mode, and the window that it needs.

The level at the end of a block hides a slow mode under a loud fast one, so the spectra of a first and a last part of the
response are compared at the peaks of the last one; :math:`a` is the larger of the two shares, of which an exponential window
with end value :math:`e` leaves :math:`a e`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray

BLOCK_PARTS = 6  # first and last of which are compared
MIN_RINGING_PEAK = 8.0  # of a peak over the median of the last spectrum; noise reaches four times it
MIN_RINGING_LEVEL = 0.01  # of the loudest line in the first part: below, a mode is negligible in every response
MIN_WINDOW_END = 0.003  # end value of a window: below, too little of the response is left


@dataclass(frozen=True)
class Ringing:
    """Vibration at `frequency` (Hz) with `share` of its first level left at the end of the block."""

    frequency: float
    share: float


def find_ringing(responses: FloatArray, sample_rate: float) -> Ringing | None:
    """Return the vibration with the largest share left at the end of responses (n, n_channels), None where all has decayed.

    The responses begin at the end of the pulse.
    """
    n = responses.shape[0] // BLOCK_PARTS
    if n < 16:
        return None
    window = np.hanning(n)[:, None]
    frequency = np.fft.rfftfreq(n, 1 / sample_rate)
    first, last = (np.abs(np.fft.rfft((part - part.mean(axis=0)) * window, axis=0)) for part in (responses[:n], responses[-n:]))
    longest: Ringing | None = None
    for begin, end in zip(first.T, last.T, strict=True):
        min_peak = MIN_RINGING_PEAK * float(np.median(end))
        k = np.arange(1, end.size - 1)
        peaks = k[(end[k] >= end[k - 1]) & (end[k] > end[k + 1]) & (end[k] > min_peak)]
        for line in peaks.tolist():
            level = float(begin[max(line - 1, 0):line + 2].max())
            if level > MIN_RINGING_LEVEL * float(begin.max()) and (longest is None
                                                                            or end[line] / level > longest.share):
                longest = Ringing(float(frequency[line]), float(end[line] / max(level, 1e-300)))
    return longest


def choose_final(ringing: Ringing | None, undecayed: float) -> tuple[float, tuple[str, ...]]:
    """Return the end value of the exponential window that a ring-down needs (1: none), and this decision in words."""
    if ringing is None or ringing.share <= undecayed:
        return 1.0, ()
    final = max(undecayed / ringing.share, MIN_WINDOW_END)
    words = (f"near {ringing.frequency:.4g} Hz {100 * ringing.share:.0f} % of the vibration is left at the end of the block: "
             f"an exponential window down to {100 * final:.2g} % is applied, and its damping taken out of the poles; longer "
             "records need none")
    if ringing.share > 0.5:
        words += " (what does not decay at all may also be mains hum or a running motor)"
    return final, (words,)
