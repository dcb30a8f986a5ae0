"""HarmonicResponse: a response at the harmonics of a cut, from a measured FRF or modes, and the parts of its error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray
from toolpoint.cutting.cut.interpolation import interpolate
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.stability.hill.noise import line_variance

UPPER_BAND_FRACTION = 0.1  # of a measured band: its upper part, left out for the stated error
# Upper part of a band over which the response fades to zero: with a harmonic that vanished at once the determinant would jump
# as theta grows.
FADE_BAND_FRACTION = 0.03
MAX_RESONANCE_HINTS = 40  # resonances of a measured response about which theta nodes are laid
ALL_LINES = slice(None)
HARMONICS_BEYOND_MODES = 4  # tooth passings beyond the highest mode


@dataclass(frozen=True, eq=False)
class HarmonicResponse:
    """Receptance (d, d), m/N, at any frequency up to `frequency_max`, zero beyond: the response that the matrix takes.

    Modes enter exactly, a measured FRF by the cubic through four lines. That is zero below `frequency_min` too, its first line.
    Frequencies are in Hz; at a negative one the response is the conjugate.
    """

    plane: PlaneDynamics
    frequency_max: float
    frequency_min: float
    variance: FloatArray | None = None  # of the lines of a measured FRF

    @classmethod
    def of(cls, plane: PlaneDynamics, reach: float, tooth: float) -> HarmonicResponse:
        """Return the response with its limits.

        Modes are taken up to `reach` times the highest frequency that matters and four times the tooth passing frequency
        `tooth` (Hz) further, as entries and exits of edges excite harmonics there. The limits of a measured FRF are its band.
        """
        if plane.is_modal:
            return cls(plane, reach * highest(plane) + HARMONICS_BEYOND_MODES * tooth, 0.0)
        frequency_min, frequency_max = plane.span
        return cls(plane, frequency_max, frequency_min, line_variance(plane))

    def at(self, hz: FloatArray) -> ComplexArray:
        """Return G at these frequencies (Hz, of either sign), shape (n, d, d)."""
        f = np.abs(hz)
        fade = np.sin(np.pi / 2 * np.clip((self.frequency_max - f)
                                          / (FADE_BAND_FRACTION * (self.frequency_max - self.frequency_min)), 0.0, 1.0)) ** 2
        return np.where((f >= self.frequency_min) & (f <= self.frequency_max), fade, 0.0)[:, None, None] * self.whole(hz)

    def whole(self, hz: FloatArray, lines: slice = ALL_LINES) -> ComplexArray:
        """Return the response (n, d, d) without the limits of its band, a measured FRF interpolated from these lines only."""
        if self.plane.is_modal:
            return self.plane.response(hz)
        f, values = self.plane.lines
        value = interpolate(f[lines], values[lines], np.abs(hz))
        return np.where(hz[:, None, None] < 0, value.conj(), value)

    def beyond(self, hz: FloatArray) -> ComplexArray:
        """Return the rest (n, d, d) that `at` leaves out: the faded part, and the response above `frequency_max`.

        Modes give it exactly. A measured FRF is continued by a mass line, 1/omega^2, through the last twentieth of its band.
        """
        if self.plane.is_modal:
            return self.plane.response(hz) - self.at(hz)
        above = (np.abs(hz) > self.frequency_max)[:, None, None]
        f, values = self.plane.lines
        last = f >= self.frequency_max - 0.05 * (self.frequency_max - self.frequency_min)
        line = (f[last, None, None] ** 2 * values[last]).mean(0).real
        faded = np.where((np.abs(hz) >= self.frequency_min)[:, None, None], self.whole(hz) - self.at(hz), 0.0)
        return np.where(above, line / np.maximum(np.abs(hz), self.frequency_max)[:, None, None] ** 2, faded)

    def upper(self, hz: FloatArray) -> ComplexArray:
        """Return the response in the upper tenth of the band, zero elsewhere."""
        edge = self.frequency_max - UPPER_BAND_FRACTION * (self.frequency_max - self.frequency_min)
        return np.where((np.abs(hz) > edge)[:, None, None], self.at(hz), 0.0)

    def below(self, hz: FloatArray) -> ComplexArray:
        """Return the possible response below a measured band: the real part at its first line."""
        if self.plane.is_modal:
            return np.zeros((hz.size, self.plane.size, self.plane.size), complex)
        return np.where((np.abs(hz) < self.frequency_min)[:, None, None], self.plane.lines[1][0].real + 0j, 0.0)

    def between(self, hz: FloatArray, first: int) -> ComplexArray:
        """Return the change of the interpolation where only every other line stays, from the `first` on, (n, d, d).

        The error of a cubic goes with the fourth power of the spacing: the change is fifteen times the error of fine lines.
        """
        if self.plane.is_modal or self.plane.lines[0].size < 8:
            return np.zeros((hz.size, self.plane.size, self.plane.size), complex)
        inside = ((np.abs(hz) <= self.frequency_max) & (np.abs(hz) >= self.frequency_min))[:, None, None]
        return np.where(inside, self.whole(hz, slice(first, None, 2)) - self.whole(hz), 0.0)

    def hints(self) -> tuple[FloatArray, FloatArray]:
        """Return the frequencies (n,) of resonances and their half widths (n,), Hz: of modes, or of measured peaks."""
        if self.plane.is_modal:
            return np.abs(self.plane.poles.imag) / (2 * np.pi), -self.plane.poles.real / (2 * np.pi)
        f, values = self.plane.lines
        size = np.linalg.norm(values, axis=(1, 2))
        peaks = np.flatnonzero((size[1:-1] >= size[:-2]) & (size[1:-1] > size[2:]) & (size[1:-1] > 0.02 * size.max())) + 1
        peaks = peaks[np.argsort(-size[peaks])][:MAX_RESONANCE_HINTS]
        return f[peaks], np.array([_half_width(size, f, i) for i in peaks.tolist()])


def highest(plane: PlaneDynamics) -> float:
    """Return the highest frequency (Hz) of a mode with at least a thousandth of the largest dynamic flexibility."""
    size = np.abs(plane.residues).max(axis=(1, 2)) / np.maximum(-plane.poles.real, 1e-3 * np.abs(plane.poles))
    return float(np.abs(plane.poles[size > 1e-3 * size.max()]).max()) / (2 * np.pi)


def _half_width(size: Array, f: FloatArray, peak: int) -> float:
    """Return the distance (Hz) from a peak to the first line above it with less than 0.7 of its size."""
    below = np.flatnonzero(size[peak:] < 0.7 * size[peak])
    return float(f[min(peak + (below[0] if below.size else 1), f.size - 1)] - f[peak]) or float(f[1] - f[0])
