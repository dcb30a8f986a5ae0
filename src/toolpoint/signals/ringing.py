r"""Which vibration still rings at the end of a block, mode by mode, and how much window it needs.

A broad look at the end of a block misses a slow mode under a loud fast one. The spectra of a first and a last part of the
response are compared at the peaks of the last one; :math:`a` is the larger of the two shares, of which an exponential window
with end value :math:`e` leaves :math:`a e`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray

PARTS = 6
STANDS_OUT = 8.0  # of a peak over the median of the last spectrum; noise reaches four times it
LOUD = 0.01  # of the loudest line in the first part: what is below matters to no response
LEAST = 0.003  # end value of a window beyond which too little of the response is left


@dataclass(frozen=True)
class Ringing:
    """A vibration at `frequency` (Hz) of which `share` of its first level is left at the end of the block."""

    frequency: float
    share: float


def find_ringing(responses: FloatArray, sample_rate: float) -> Ringing | None:
    """Return what rings most at the end of responses (n, n_channels) that begin at the end of the pulse; None where all is
    quiet."""
    n = responses.shape[0] // PARTS
    if n < 16:
        return None
    window = np.hanning(n)[:, None]
    frequency = np.fft.rfftfreq(n, 1 / sample_rate)
    first, last = (np.abs(np.fft.rfft((part - part.mean(axis=0)) * window, axis=0)) for part in (responses[:n], responses[-n:]))
    worst: Ringing | None = None
    for before, after in zip(first.T, last.T, strict=True):
        floor = STANDS_OUT * float(np.median(after))
        inner = np.arange(1, after.size - 1)
        peaks = inner[(after[inner] >= after[inner - 1]) & (after[inner] > after[inner + 1]) & (after[inner] > floor)]
        for line in peaks.tolist():
            level = float(before[max(line - 1, 0):line + 2].max())
            if level > LOUD * float(before.max()) and (worst is None or after[line] / level > worst.share):
                worst = Ringing(float(frequency[line]), float(after[line] / max(level, 1e-300)))
    return worst


def choose_final(ringing: Ringing | None, undecayed: float) -> tuple[float, tuple[str, ...]]:
    """Return the end value of the exponential window that a ring-down needs (1: none), and what was decided, in words."""
    if ringing is None or ringing.share <= undecayed:
        return 1.0, ()
    final = max(undecayed / ringing.share, LEAST)
    words = (f"near {ringing.frequency:.4g} Hz {100 * ringing.share:.0f} % of the vibration is left at the end of the block: "
             f"an exponential window down to {100 * final:.2g} % is applied, and its damping taken out of the poles; longer "
             "records need none")
    if ringing.share > 0.5:
        words += " (what does not decay at all may also be mains hum or a running motor)"
    return final, (words,)
