"""Arrays that the kernel of local phase takes: the filter and the windows that are followed."""

from __future__ import annotations

from typing import NamedTuple

from toolpoint._check import FloatArray, IndexArray


class PhaseFilter(NamedTuple):
    """A wave, real and imaginary part, along the motion, and a bell across it."""

    real: FloatArray
    imaginary: FloatArray
    bell: FloatArray


class PhaseWindows(NamedTuple):
    """Windows that are followed by their phase.

    reference_bands : (n, 2, 2, k, k) real and imaginary part at rest for both orientations; slopes : (n, 2, 2, k, k) derivative
    of the phase by right and down; inverse : (n, 2, 2); last, turns : (n, 2, k, k) phase of the frame before and whole turns
    since the first.
    """

    reference_bands: FloatArray
    slopes: FloatArray
    inverse: FloatArray
    last: FloatArray
    turns: IndexArray
