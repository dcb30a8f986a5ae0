"""Bands of operational records: wide records are searched at several sample rates, each for a quarter of the next higher
band."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import signal

from toolpoint._check import FloatArray, fail

BAND_SAMPLES_PER_CYCLE = 2.56  # of the highest frequency of a band
BAND_WIDTH_RATIO = 4.0  # of the ends of a band; lower frequencies are sought at a rate as much lower
MIN_BLOCKS = 15  # a variance of fewer has no use
MIN_PLANNED_BLOCK_LAGS = 3.0  # block over the longest lag


@dataclass(frozen=True)
class SearchBand:
    """Modes are sought between these frequencies (Hz), in records decimated by a factor, in so many blocks."""

    frequency_min: float
    frequency_max: float
    decimation: int
    blocks: int


def plan_bands(lengths: list[int], rate: float, rows: int, *, blocks: int, band: tuple[float,
                                                                                       float] | None) -> list[SearchBand]:
    """Return the bands of records of these lengths (samples), highest first.

    Each reaches over a factor of four, as correlations of so many rows (`rows` before and after) see the periods of no wider
    one well; the lowest for which the records are long enough takes all that lies below.

    Raises
    ------
    ToolpointError
        For a band outside the data or upside down, or records too short for it.
    """
    rate_limit = rate / BAND_SAMPLES_PER_CYCLE
    lower_end, upper_end = (0.0, rate_limit) if band is None else (float(band[0]), float(band[1]))
    if not 0 <= lower_end < upper_end:
        fail("band", f"{lower_end:g} .. {upper_end:g} Hz", "must rise from 0 or more")
    # A band that ends just at the limit must not fail by the rounding of a product.
    if upper_end > rate_limit * (1 + 1e-9):
        fail("band", f"{upper_end:g} Hz",
             f"must end at {rate_limit:.5g} Hz or below: {rate:g} samples a second over {BAND_SAMPLES_PER_CYCLE:g}")
    plan: list[SearchBand] = []
    band_end = upper_end
    while band_end > lower_end:
        decimation = max(1, int(rate / (BAND_SAMPLES_PER_CYCLE * band_end) * (1 + 1e-9)))
        lags = (2 * rows - 1) * decimation
        possible = int(sum(length / (MIN_PLANNED_BLOCK_LAGS * lags) for length in lengths))
        if possible < MIN_BLOCKS:
            break
        if plan:
            plan[-1] = replace(plan[-1], frequency_min=band_end)
        plan.append(SearchBand(lower_end, band_end, decimation, min(blocks, possible)))
        band_end /= BAND_WIDTH_RATIO
    if not plan:
        needed = MIN_BLOCKS * MIN_PLANNED_BLOCK_LAGS * (2 * rows - 1) / (BAND_SAMPLES_PER_CYCLE * upper_end)
        fail("records", f"{sum(lengths) / rate:.4g} s", f"must be at least {needed:.3g} s for a band up to {upper_end:.4g} Hz",
             remedy="record longer")
    return plan


def decimate(samples: FloatArray, factor: int) -> FloatArray:
    """Return every `factor`-th sample after a linear-phase low-pass filter, shape (n, n_channels)."""
    if factor == 1:
        return samples
    return np.asarray(signal.resample_poly(samples, 1, factor, axis=0))
