"""Bands of operational records: wide records are searched at several sample rates, each for a quarter of the next higher
band."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import signal

from toolpoint._check import FloatArray, fail

SAMPLES_PER_CYCLE = 2.56  # of the highest frequency of a band
BAND_RATIO = 4.0  # of the ends of a band; lower frequencies are sought at a rate as much lower
MIN_BLOCKS = 15  # a variance of fewer has no use
MIN_BLOCK_LENGTH_LAGS = 3.0  # block over the longest lag


@dataclass(frozen=True)
class Band:
    """Modes are sought between these frequencies (Hz), in records decimated by a factor, in so many blocks."""

    frequency_min: float
    frequency_max: float
    decimation: int
    blocks: int


def plan_bands(lengths: list[int], rate: float, rows: int, *, blocks: int, band: tuple[float, float] | None) -> list[Band]:
    """Return the bands of records of these lengths (samples), highest first.

    Each reaches over a factor of four, as correlations of so many rows (`rows` before and after) see the periods of no wider
    one well; the lowest for which the records are long enough takes all that lies below.

    Raises
    ------
    ToolpointError
        For a band outside the data or upside down, or records too short for it.
    """
    highest = rate / SAMPLES_PER_CYCLE
    low, high = (0.0, highest) if band is None else (float(band[0]), float(band[1]))
    if not 0 <= low < high:
        fail("band", f"{low:g} .. {high:g} Hz", "must rise from 0 or more")
    if high > highest * (1 + 1e-9):
        fail("band", f"{high:g} Hz",
             f"must end at {highest:.5g} Hz or below: {rate:g} samples a second over {SAMPLES_PER_CYCLE:g}")
    plan: list[Band] = []
    top = high
    while top > low:
        decimation = max(1, int(rate / (SAMPLES_PER_CYCLE * top) * (1 + 1e-9)))
        lags = (2 * rows - 1) * decimation
        possible = int(sum(length / (MIN_BLOCK_LENGTH_LAGS * lags) for length in lengths))
        if possible < MIN_BLOCKS:
            break
        if plan:
            plan[-1] = replace(plan[-1], frequency_min=top)
        plan.append(Band(low, top, decimation, min(blocks, possible)))
        top /= BAND_RATIO
    if not plan:
        needed = MIN_BLOCKS * MIN_BLOCK_LENGTH_LAGS * (2 * rows - 1) / (SAMPLES_PER_CYCLE * high)
        fail("records", f"{sum(lengths) / rate:.4g} s", f"must be at least {needed:.3g} s for a band up to {high:.4g} Hz",
             remedy="record longer")
    return plan


def decimate(samples: FloatArray, factor: int) -> FloatArray:
    """Return every `factor`-th sample after a linear-phase low-pass filter, shape (n, n_channels)."""
    if factor == 1:
        return samples
    return np.asarray(signal.resample_poly(samples, 1, factor, axis=0))
