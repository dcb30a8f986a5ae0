"""Complex steerable pyramid: octave bands by orientation in the frequency domain, whose sum restores the picture.

Source: Simoncelli, Freeman, ICIP 1995; Portilla, Simoncelli, IJCV 40 (2000) 49.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial

import numpy as np
from scipy import fft

from toolpoint._check import ComplexArray, FloatArray, count


@dataclass(frozen=True, eq=False)
class SteerablePyramid:
    """Bands of pictures of one shape.

    bands : (window of the centred spectrum (rows, columns), filter on it) of every level and orientation;
    residual_filter : filter of the whole spectrum for what no band holds.
    """

    shape: tuple[int, int]
    bands: tuple[tuple[tuple[slice, slice], FloatArray], ...]
    residual_filter: FloatArray

    @classmethod
    def of_shape(cls, shape: tuple[int, int], orientations: int = 4, levels: int | None = None) -> SteerablePyramid:
        """Return the pyramid for pictures of (rows, columns); as many octaves as fit where `levels` is left out."""
        max_levels = int(np.log2(min(shape))) - 3
        level_count = max(1, max_levels if levels is None else min(count("levels", levels), max_levels))
        v = np.fft.fftshift(np.fft.fftfreq(shape[0]))[:, None] * 2
        u = np.fft.fftshift(np.fft.fftfreq(shape[1]))[None, :] * 2
        radius, angle = np.maximum(np.hypot(u, v), 1e-9), np.arctan2(v, u)
        bands, total = [], np.zeros(shape)
        for level in range(level_count):
            ring = _low_pass(radius, 2.0**-level) * _high_pass(radius, 2.0 ** -(level + 1))
            for k in range(orientations):
                mask = ring * _angular_filter(angle - np.pi * k / orientations, orientations)
                window = _window(shape, 2.0**-level)
                bands.append((window, np.ascontiguousarray(mask[window]).astype(np.float32)))
                # A band is one half of the plane; its mirror image comes with the real part.
                total += mask**2 + _mirrored(mask) ** 2
        return cls(shape, tuple(bands), np.sqrt(np.clip(1 - total / 2, 0.0, None)).astype(np.float32))

    def split(self, picture: FloatArray) -> tuple[list[ComplexArray], ComplexArray]:
        """Return the complex bands of a picture, and its centred spectrum."""
        spectrum = fft.fftshift(fft.fft2(np.asarray(picture, np.float32)))
        return [fft.ifft2(fft.ifftshift(spectrum[window] * mask)) for window, mask in self.bands], spectrum

    def join(self, bands: list[ComplexArray], spectrum: ComplexArray) -> FloatArray:
        """Return the picture of these bands and of what no band holds of the spectrum."""
        total = spectrum * self.residual_filter**2
        for band, (window, mask) in zip(bands, self.bands, strict=True):
            total[window] += fft.fftshift(fft.fft2(band)) * mask
        return np.asarray(fft.ifft2(fft.ifftshift(total)).real)


def _low_pass(radius: FloatArray, edge: float) -> FloatArray:
    """Return one below half of `edge`, a cosine of the logarithm above it, zero above `edge`."""
    x = np.clip(np.log2(radius / edge) + 1, 0.0, 1.0)
    return np.cos(np.pi / 2 * x)


def _high_pass(radius: FloatArray, edge: float) -> FloatArray:
    x = np.clip(np.log2(radius / edge) + 1, 0.0, 1.0)
    return np.sin(np.pi / 2 * x)


def _angular_filter(angle: FloatArray, orientations: int) -> FloatArray:
    order = orientations - 1
    gain = 2**order * factorial(order) / np.sqrt(orientations * factorial(2 * order))
    turned = np.angle(np.exp(1j * angle))
    return np.where(np.abs(turned) < np.pi / 2, np.sqrt(2) * gain * np.cos(turned) ** order, 0.0)


def _mirrored(mask: FloatArray) -> FloatArray:
    rows, columns = mask.shape
    flipped = mask[::-1, ::-1]
    return np.roll(flipped, (1 - rows % 2, 1 - columns % 2), axis=(0, 1))


def _window(shape: tuple[int, int], share: float) -> tuple[slice, slice]:
    slices = []
    for n in shape:
        half = min(n // 2, int(np.ceil(n * share / 2)) + 1)
        slices.append(slice(n // 2 - half, n // 2 + half) if 2 * half < n else slice(0, n))
    return slices[0], slices[1]
