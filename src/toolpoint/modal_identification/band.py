"""The band of an FRF that is identified, and the checks of it that all methods share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail, scalar
from toolpoint.vibration.frf import Frf

QUANTITY_POWERS = {"receptance": 0, "mobility": 1, "accelerance": 2}
MIN_METHOD_LINES = 8  # of a band, for methods that state no other number


@dataclass(frozen=True)
class Band:
    """Frequency band in Hz, both ends included."""

    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.low:g} .. {self.high:g} Hz"


def cut(frf: Frf, band: tuple[float, float] | None, lines: int = MIN_METHOD_LINES) -> Frf:
    """Return the lines of one pose inside the band, without a line at 0 Hz (where mobility has no information).

    Parameters
    ----------
    frf : Frf
        One pose.
    band : (low, high) in Hz, optional
        The whole axis where left out.
    lines : int
        Fewest lines that the method can work with.

    Raises
    ------
    ToolpointError
        For several poses, a band without order or outside the data, too few lines, or responses that are all zero.
    """
    if frf.values.ndim != 3:
        fail("frf", repr(frf), "must be one pose", remedy="use frf.at_pose(i)")
    limits = band_limits(frf, band)
    if limits.high <= 0 or frf.frequency[-1] <= 0:
        fail("band", f"{frf.frequency.size} lines within {limits}", f"must hold at least {lines} above 0 Hz")
    inside = frf.between(max(limits.low, np.nextafter(0.0, 1.0)), limits.high)
    if inside.frequency.size < lines:
        fail("band", f"{inside.frequency.size} lines within {limits}", f"must hold at least {lines}",
             remedy="widen the band or measure with a finer line spacing")
    if not np.any(inside.values):
        fail("frf", "all responses are zero within the band", "must hold a measurement", remedy="check the channel assignment")
    return inside


def band_limits(frf: Frf, band: tuple[float, float] | None) -> Band:
    """Return the band as checked limits; the measured range where none is given."""
    if band is None:
        return Band(float(frf.frequency[0]), float(frf.frequency[-1]))
    try:
        lower, upper = (scalar("band", end) for end in band)
    except TypeError:
        fail("band", repr(band), "must be two frequencies (low, high) in Hz")
    if not 0 <= lower < upper:
        fail("band", f"({lower:g}, {upper:g})", "must be 0 <= low < high, in Hz")
    if lower > frf.frequency[-1] or upper < frf.frequency[0]:
        fail("band", f"{lower:g} .. {upper:g} Hz",
             f"must overlap the data, {frf.frequency[0]:g} .. {frf.frequency[-1]:g} Hz")
    return Band(max(lower, float(frf.frequency[0])), min(upper, float(frf.frequency[-1])))


def line_spacing(frf: Frf) -> float:
    """Return the spacing of an even frequency axis, Hz; an uneven one is refused."""
    step = np.diff(frf.frequency)
    mean = float(step.mean())
    if np.abs(step - mean).max() > 1e-3 * mean:
        line = int(np.argmax(np.abs(step - mean)))
        fail("frf.frequency", f"a step of {step[line]:g} Hz at {frf.frequency[line]:g} Hz beside a mean of {mean:g} Hz",
             "must be evenly spaced for this method", remedy="use frf.interpolated(...), or quadrature or circle fit")
    return mean


def noise_level(values: FloatArray) -> FloatArray:
    """Return a robust standard deviation of the noise of curves along the first axis, from their third differences.

    A smooth curve leaves little in a third difference, and the median ignores the lines at sharp peaks. Differences
    are taken over 1, 2 and 4 lines and the largest estimate is kept: noise of windowed data is shared by neighbours.
    """
    strides = [stride for stride in (1, 2, 4) if values.shape[0] >= 6 * stride] or [1]
    return np.max([_scatter_of_stride(values, stride) for stride in strides], axis=0)


def _scatter_of_stride(values: FloatArray, stride: int) -> FloatArray:
    """Return the standard deviation from third differences over so many lines."""
    n = values.shape[0] - 3 * stride
    if n <= 0:
        return np.zeros(values.shape[1:])
    part = [values[k * stride:k * stride + n] for k in range(4)]
    # Third differences of lines take smooth resonances out; 20 is the sum of their squared weights, 1.4826 makes a median a
    # deviation.
    return 1.4826 * np.median(np.abs(part[3] - 3 * part[2] + 3 * part[1] - part[0]), axis=0) / np.sqrt(20.0)
