"""Windows for blocks of samples: force, exponential (with its decay), Hann; and the worth of overlapping blocks.

An exponential window that the analyser has already applied shows by noise that decays along the records: the noise of sensors
and front end does not depend on time, and a window multiplies it with the signal. The fastest changes from sample to sample,
before the blow and at the end of its block, are compared: vibration that still rings can only add to them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray, fail, positive
from toolpoint._doubt import Doubt
from toolpoint.signals.hits import Hit
from toolpoint.vibration.record import Record

MIN_NOISE_SAMPLES = 48  # before the blow, from which the noise is computed
# Anti-aliasing filters ring for tens of samples around a pulse: cut off, that biases damping by some tenths of a per mille.
FILTER_RINGING_SAMPLES = 40
WINDOW = "window"  # what its doubts are about
END_FRACTION = 0.05  # of the block, whose noise is compared
MAX_NOISE_RATIO = 0.3  # noise at the end over that before the blow: below, a window was applied
FOURTH_DIFFERENCE = np.array([1.0, -4.0, 6.0, -4.0, 1.0])


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
    r"""Return the number of independent blocks equivalent to overlapping ones: :math:`n / (1 + 2 \sum (1 - j/n) \rho_j^2)`.

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
    """Return the doubt that records were windowed before they were stored; none where their noise is constant or unseen."""
    ratios = [r for hit in hits if hit.accepted for r in _noise_ratios(records[hit.record].samples, hit, block)]
    if not ratios or np.median(ratios) > MAX_NOISE_RATIO:
        return ()
    ratio = float(np.median(ratios))
    return (Doubt(WINDOW, f"the noise of the records dies away to {max(100 * ratio, 1.0):.2g} % or less along them: the "
                  "analyser has put an exponential window on them, whose damping makes limits come out too high",
                  "switch the window of the analyser off and strike again (what is needed is applied here, and taken out)",
                  figure=ratio),)


def _noise_ratios(samples: FloatArray, hit: Hit, block: int) -> list[float]:
    """Return the noise at the end of a block over that before its blow, of every channel with noise.

    Where the pretrigger of the block is too short for it, what the record holds before counts as well.
    """
    part, quiet_end = samples[hit.start:hit.start + block], max(hit.peak - FILTER_RINGING_SAMPLES, 0)
    before_blow = samples[max(min(hit.start, quiet_end - MIN_NOISE_SAMPLES), 0):quiet_end]
    block_end = part[-max(int(END_FRACTION * part.shape[0]), MIN_NOISE_SAMPLES):]
    if before_blow.shape[0] < MIN_NOISE_SAMPLES or part.shape[0] < 4 * MIN_NOISE_SAMPLES:
        return []
    sizes = [(_fast_noise(a), _fast_noise(b), np.abs(channel).max()) for a, b,
             channel in zip(before_blow.T, block_end.T, part.T, strict=True)]
    return [b / a for a, b, largest in sizes if a > 1e-12 * largest and b > 0]


def _fast_noise(values: FloatArray) -> float:
    """Return the root mean square of fourth differences."""
    return float(np.sqrt((np.convolve(values, FOURTH_DIFFERENCE, "valid") ** 2).mean()))
