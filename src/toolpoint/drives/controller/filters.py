"""Filters of the torque command: notch, low-pass of first and second order, and their discrete forms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, fail, positive, scalar


@dataclass(frozen=True)
class Filter:
    """Second-order filter (n2 s^2 + n1 s + n0) / (d2 s^2 + d1 s + d0), discretised by Tustin's rule.

    `match` (Hz) is the frequency kept exact by prewarping; 0 for none.
    """

    numerator: tuple[float, float, float]
    denominator: tuple[float, float, float]
    match: float = 0.0

    def coefficients(self, sample_time: float) -> FloatArray:
        """Return (b0, b1, b2, a1, a2) of the discrete filter."""
        if self.match * sample_time >= 0.5:
            fail("Filter", f"{self.match:g} Hz", f"must be below half the sample rate, {0.5 / sample_time:g} Hz")
        w = 2 * np.pi * self.match
        # The bilinear rule bends frequencies; with this k the one that matters stays where it is written.
        k = w / np.tan(w * sample_time / 2) if w > 0 else 2 / sample_time
        n, d = (_tustin(part, k) for part in (self.numerator, self.denominator))
        return np.array([*(n / d[0]), *(d[1:] / d[0])])

    def response(self, frequency: FloatArray, sample_time: float | None = None) -> ComplexArray:
        """Return the frequency response, continuous or as sampled."""
        if sample_time is None:
            s = 2j * np.pi * np.asarray(frequency)
            return np.polyval(self.numerator, s) / np.polyval(self.denominator, s)
        b0, b1, b2, a1, a2 = self.coefficients(sample_time)
        z = np.exp(-2j * np.pi * np.asarray(frequency) * sample_time)
        return (b0 + b1 * z + b2 * z**2) / (1 + a1 * z + a2 * z**2)


def _tustin(p: tuple[float, float, float], k: float) -> FloatArray:
    a, b, c = p
    return np.array([a * k * k + b * k + c, 2 * (c - a * k * k), a * k * k - b * k + c])


def notch(frequency: float, damping: float = 0.1, depth: float = 0.0) -> Filter:
    """Return the notch (s^2 + 2 depth zeta w s + w^2)/(s^2 + 2 zeta w s + w^2): gain `depth` at `frequency` (Hz).

    Examples
    --------
    >>> import numpy as np
    >>> [round(float(abs(notch(200.0, depth=0.1).response(np.array(f)))), 6) for f in (1e-3, 200.0)]
    [1.0, 0.1]
    """
    w = 2 * np.pi * positive("frequency", frequency)
    zeta = positive("damping", damping)
    if scalar("depth", depth) < 0:
        fail("depth", f"{depth:g}", "must not be negative")
    return Filter((1.0, 2 * depth * zeta * w, w * w), (1.0, 2 * zeta * w, w * w), frequency)


def low_pass(frequency: float, damping: float = 0.7071) -> Filter:
    """Return the second-order low-pass w^2/(s^2 + 2 zeta w s + w^2).

    Examples
    --------
    >>> import numpy as np
    >>> round(float(abs(low_pass(200.0, damping=0.5).response(np.array(200.0)))), 6)
    1.0
    """
    w = 2 * np.pi * positive("frequency", frequency)
    return Filter((0.0, 0.0, w * w), (1.0, 2 * positive("damping", damping) * w, w * w), frequency)


def low_pass_1(time_constant: float) -> Filter:
    """Return the first-order low-pass 1/(T s + 1).

    Examples
    --------
    >>> import numpy as np
    >>> f = 1 / (2 * np.pi * 1e-3)
    >>> round(float(abs(low_pass_1(1e-3).response(np.array(f)))), 6)
    0.707107
    """
    return Filter((0.0, 0.0, 1.0), (0.0, positive("time_constant", time_constant), 1.0))
