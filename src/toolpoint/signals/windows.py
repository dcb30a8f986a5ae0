"""Windows for blocks of samples: force, exponential (with its decay), Hann; and what overlap is worth.

An exponential window that the analyser has put on the records already shows by noise that dies away along them: the noise of
sensors and front end does not depend on time, a window multiplies it with the signal. What changes fastest from sample to
sample, before the blow and at the end of its block, is compared: what still rings can only add to it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray, fail, positive
from toolpoint._doubt import Doubt
from toolpoint.signals.hits import Hit
from toolpoint.vibration.record import Record

FEWEST = 48  # samples before the blow that tell their noise
CLEAR_OF = 40  # samples before the peak in which filters ring
LATE = 0.05  # of the block, at its end
DIED = 0.3  # noise at the end over that before the blow
DIFFERENCE = np.array([1.0, -4.0, 6.0, -4.0, 1.0])


def exponential(n: int, sample_rate: float, final: float) -> tuple[FloatArray, float]:
    r"""Return :math:`e^{-a t}` that falls to `final` at the end of the block, and its decay a in 1/s.

    Applied to force and response alike it turns H(s) into exactly H(s + a): every pole moves by -a, identification
    takes it back from `Frf.decay`. Source: Ewins, Modal Testing, 2nd ed., section 3.7; Fladung, Rost, MSSP 11 (1997) 789.
    """
    if not 0 < final <= 1:
        fail("final", f"{final:g}", "must be above 0 and at most 1", remedy="0.01 .. 0.1 is usual; 1 is no window")
    decay = -np.log(final) / (n / positive("sample_rate", sample_rate))
    return np.exp(-decay * np.arange(n) / sample_rate), float(decay)


def force(n: int, start: int, stop: int) -> FloatArray:
    """Return one from `start` to `stop`, a half cosine of the pulse's own length after it, zero elsewhere."""
    window = np.zeros(n)
    taper = max(stop - start, 4)
    window[start:stop] = 1.0
    end = min(stop + taper, n)
    window[stop:end] = 0.5 * (1 + np.cos(np.pi * np.arange(1, end - stop + 1) / (taper + 1)))
    return window


def hann(n: int) -> FloatArray:
    """Return the periodic Hann window."""
    return 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(n) / n)


def independent_blocks(count: int, window: FloatArray, step: int) -> float:
    r"""Return how many independent blocks overlapping ones are worth: :math:`n / (1 + 2 \sum (1 - j/n) \rho_j^2)`.

    Source: Welch, IEEE Trans. Audio Electroacoustics 15 (1967) 70.
    """
    n, power = window.size, float(window @ window)
    total = 1.0
    for j in range(1, count):
        shift = j * step
        if shift >= n:
            break
        total += 2 * (1 - j / count) * (float(window[shift:] @ window[:n - shift]) / power) ** 2
    return count / total


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
