"""An exponential window that the analyser has put on the records already, told by noise that dies away along them.

The noise of sensors and front end does not depend on time; a window multiplies it with the signal. What changes fastest from
sample to sample, before the blow and at the end of its block, is compared: what still rings can only add to it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.signals.hits import Hit
from toolpoint.vibration.record import Record

FEWEST = 48  # samples before the blow that tell their noise
CLEAR_OF = 40  # samples before the peak in which filters ring
LATE = 0.05  # of the block, at its end
DIED = 0.3  # noise at the end over that before the blow
DIFFERENCE = np.array([1.0, -4.0, 6.0, -4.0, 1.0])


def doubt_window(hits: Sequence[Hit], records: Sequence[Record], block: int) -> tuple[Doubt, ...]:
    """Return the doubt that records were windowed before they were stored; none where their noise stays, or is not seen."""
    parts = [(records[hit.record].samples[hit.start:hit.start + block], hit.peak - hit.start) for hit in hits if hit.accepted]
    shares = [share for part, peak in parts for share in _shares(part, peak)]
    if not shares or np.median(shares) > DIED:
        return ()
    left = float(np.median(shares))
    return (Doubt("window", f"the noise of the records dies away to {max(100 * left, 1.0):.2g} % or less along them: the "
                  "analyser has put an exponential window on them, whose damping makes limits come out too high",
                  "switch the window of the analyser off and strike again (what is needed is applied here, and taken out)",
                  figure=left),)


def _shares(part: FloatArray, peak: int) -> list[float]:
    """Return the noise at the end over that before the blow, of every channel whose noise is seen."""
    before = part[:max(peak - CLEAR_OF, 0)]
    late = part[-max(int(LATE * part.shape[0]), FEWEST):]
    if before.shape[0] < FEWEST or part.shape[0] < 4 * FEWEST:
        return []
    sizes = [(_rough(a), _rough(b), np.abs(channel).max()) for a, b, channel in zip(before.T, late.T, part.T, strict=True)]
    return [b / a for a, b, top in sizes if a > 1e-12 * top and b > 0]


def _rough(values: FloatArray) -> float:
    return float(np.sqrt((np.convolve(values, DIFFERENCE, "valid") ** 2).mean()))
