"""Part of a record in which something cuts, from its level over time; clipped samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.signals.hits import MAX_SMOOTH_STEPS

BLOCK_SECONDS = 0.02
MIN_LEVEL_RATIO = 1.5  # of the two levels of a record, amplitudes: nearer levels are no cut beside no cut
MIN_CUT_SECONDS = 0.65  # of a loud part: a shorter one is a beat or a knock
MARGIN_SECONDS = 0.06  # left out at both ends of a cut: entry, exit, and what rings down
LARGE_SAMPLE_RATIO = 0.98  # of the largest sample: what clipped samples exceed
MIN_CLIPPED_RUN = 3  # samples in a row
MAX_FLAT_STEP = 2e-3  # of the largest sample, between two samples of a flat top


@dataclass(frozen=True)
class CuttingPart:
    """First and last sample of the cut, and whether the record shows level differences that tell it from the rest."""

    first: int
    last: int
    is_told: bool


def find_cutting_part(samples: FloatArray, rate: float) -> CuttingPart:
    """Return the longest loud part of a record, its ends left out; the whole record where there is one level.

    The level of blocks is split in two by the threshold of the largest variance between classes (Otsu, 1979); silences
    shorter than 0.1 s within the loud part are bridged.
    """
    block = max(int(BLOCK_SECONDS * rate), 1)
    count = samples.size // block
    all_samples = CuttingPart(0, samples.size, False)
    if count < 10:
        return all_samples
    level = np.log(np.std(samples[:count * block].reshape(count, block), axis=1) + 1e-12)
    middle = np.array([np.median(level[max(k - 2, 0):k + 3]) for k in range(count)])
    threshold = _split(middle)
    loud = middle > threshold
    if not loud.any() or loud.all() or np.median(middle[loud]) - np.median(middle[~loud]) < np.log(MIN_LEVEL_RATIO):
        return all_samples
    first, last = _longest(loud)
    if (last - first) * BLOCK_SECONDS < MIN_CUT_SECONDS:
        return all_samples
    margin = int(MARGIN_SECONDS * rate)
    start = first * block + (margin if first > 0 else 0)
    stop = last * block - (margin if last < count else 0)
    return CuttingPart(start, stop if last < count else samples.size, True)


def measure_clipping(samples: FloatArray) -> float:
    """Return the fraction of samples that stand in flat runs of at least three near the largest sample; a sine has none."""
    largest = float(np.abs(samples).max())
    if largest == 0:
        return 0.0
    return max(_flat_fraction(samples, largest), _flat_fraction(-samples, largest))


def _flat_fraction(samples: FloatArray, largest: float) -> float:
    """Return the fraction of samples in flat tops: runs of high samples that a smooth signal would not leave so steeply."""
    is_high = samples >= LARGE_SAMPLE_RATIO * largest
    steps = np.diff(samples)
    flat = is_high[1:] & is_high[:-1] & (np.abs(steps) < MAX_FLAT_STEP * largest)
    sizes = np.abs(steps)
    quantum = float(sizes[sizes > 0].min(initial=largest))  # of the converter, within which samples are equal
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flat, [False]])))
    count = 0
    for first, last in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):  # of steps: samples first .. last
        if last - first + 1 < MIN_CLIPPED_RUN or first == 0 or last == len(steps):
            continue
        spread = max(float(np.ptp(samples[first:last + 1])), quantum)
        # A parabola that falls by so much within three samples has fallen by four times that at the next.
        if min(float(sizes[first - 1]), float(sizes[last])) > MAX_SMOOTH_STEPS * spread:
            count += last - first + 1
    return count / samples.size


def _split(level: FloatArray) -> float:
    order = np.sort(level)
    count = np.arange(1, order.size)
    below = np.cumsum(order)[:-1] / count
    above = (order.sum() - np.cumsum(order)[:-1]) / (order.size - count)
    between = count * (order.size - count) * (above - below) ** 2
    index = int(np.argmax(between))
    return float(0.5 * (order[index] + order[index + 1]))


def _longest(loud: np.ndarray) -> tuple[int, int]:
    """Return first and last block of the longest loud run, silences of up to five blocks bridged."""
    bridged = loud.copy()
    quiet = np.flatnonzero(np.diff(np.concatenate([[0], (~loud).astype(int), [0]])))
    for start, stop in zip(quiet[::2], quiet[1::2], strict=True):
        if stop - start <= 5 and start > 0 and stop < loud.size:
            bridged[start:stop] = True
    edges = np.flatnonzero(np.diff(np.concatenate([[0], bridged.astype(int), [0]])))
    lengths = edges[1::2] - edges[::2]
    index = int(np.argmax(lengths))
    return int(edges[2 * index]), int(edges[2 * index + 1])
