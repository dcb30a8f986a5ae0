"""Part of a record in which something cuts, from its level over time; clipped samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray

BLOCK_SECONDS = 0.02
MIN_LEVEL_RATIO = 1.5  # of the two levels of a record, amplitudes: nearer levels are no cut beside no cut
MIN_CUT_SECONDS = 0.65  # of a loud part: a shorter one is a beat or a knock
MARGIN_SECONDS = 0.06  # left out at both ends of a cut: entry, exit, and what rings down
LARGE_SAMPLE_RATIO = 0.98  # of the largest sample: what clipped samples exceed
MIN_CLIPPED_RUN = 3  # samples in a row


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
    """Return the fraction of samples that stand in runs of at least three near the largest sample; a sine has few."""
    largest = float(np.abs(samples).max())
    if largest == 0:
        return 0.0
    return max(_flat_fraction(samples, largest), _flat_fraction(-samples, largest))


def _flat_fraction(samples: FloatArray, largest: float) -> float:
    is_high = samples >= LARGE_SAMPLE_RATIO * largest
    steps = np.abs(np.diff(samples, prepend=samples[:1])) < 2e-3 * largest
    flat = is_high & steps
    runs = np.convolve(flat, np.ones(MIN_CLIPPED_RUN - 1), mode="same") >= MIN_CLIPPED_RUN - 1
    return float(np.mean(runs & flat))


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
