"""Windows for blocks of samples: force, exponential (with its decay), Hann; and what overlap is worth."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, fail, positive


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
