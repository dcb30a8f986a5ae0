r"""Phase-based magnification of a band of frequencies with a complex steerable pyramid (the way of the source).

The phase of every band against the picture at rest is filtered in time (Butterworth band-pass), smoothed in space with its
amplitude as weight (noise attenuation), multiplied and put back. All motion in the band is magnified, without a model, and
noise with it. Patents are on record for phase-based and for Riesz-pyramid magnification, some until 2035: whoever sells
what uses this method must look them up; magnification by the identified shape (`ShapeWarp`, the default) is another method.
Source: Wadhwa, Rubinstein, Durand, Freeman, ACM TOG 32 (2013) 80; Chen et al., JSV 345 (2015) 58.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.signal import butter

from toolpoint._check import ComplexArray, FloatArray, fail
from toolpoint.vision.clip import Frames
from toolpoint.vision.displacement.measure import Scan
from toolpoint.vision.magnification.pyramid import SteerablePyramid
from toolpoint.vision.magnification.warp import MAX_MAGNIFICATION

MAX_SMOOTHING_WIDTH = 8.0  # pixels of a band, smoothing at attenuation one


@dataclass(frozen=True)
class PhaseMagnification:
    """Phase-based magnification.

    Parameters
    ----------
    low, high : float
        Band, Hz.
    factor : float
        Motion in the result over that in the clip.
    attenuation : float
        0 .. 1, smoothing of the phase in space, a share of `MAX_SMOOTHING_WIDTH` pixels of each band.
    orientations : int
    """

    low: float
    high: float
    factor: float
    attenuation: float = 0.2
    orientations: int = 4

    def frames(self, scanned: Scan) -> Iterator[Frames]:
        """Yield every frame of the clip, magnified."""
        rate = scanned.clip.frame_rate
        if not 0 < self.low < self.high < rate / 2:
            fail("band", f"{self.low:g} .. {self.high:g} Hz", f"must be 0 < low < high < {rate / 2:g}, half the frame rate")
        if not 0 <= self.factor <= MAX_MAGNIFICATION or not 0 <= self.attenuation <= 1:
            fail("factor, attenuation", f"{self.factor:g}, {self.attenuation:g}",
                 f"must be 0 .. {MAX_MAGNIFICATION:g} and 0 .. 1")
        pyramid = SteerablePyramid.of_shape(scanned.clip.shape, self.orientations)
        reference_bands = [band.astype(np.complex64) for band in pyramid.split(scanned.reference.picture)[0]]
        section = butter(1, (self.low, self.high), "bandpass", fs=rate, output="sos")[0]
        filter_states = [np.zeros((2, *band.shape), np.float32) for band in reference_bands]
        for frames in scanned.clip.chunks():
            for frame in frames:
                bands, spectrum = pyramid.split(frame)
                moved_bands = [self._magnified(band, reference_band, state, section) for band, reference_band,
                               state in zip(bands, reference_bands, filter_states, strict=True)]
                picture = pyramid.join(moved_bands, spectrum)
                yield np.clip(picture + 0.5, 0, scanned.clip.white).astype(frame.dtype)

    def _magnified(self, band: ComplexArray, reference_band: ComplexArray, state: FloatArray,
                   section: FloatArray) -> ComplexArray:
        phase = np.angle(band * reference_band.conj()).astype(np.float32)
        filtered = _filtered(phase, state, section)
        width = self.attenuation * MAX_SMOOTHING_WIDTH
        if width > 0.1:
            # Phase is noise where its amplitude is small: the mean is weighted by power.
            weight = np.abs(reference_band) ** 2 + 1e-6
            filtered = gaussian_filter(filtered * weight, width) / gaussian_filter(weight, width)
        return np.asarray(band * np.exp(1j * (self.factor - 1) * filtered))


def _filtered(value: FloatArray, state: FloatArray, section: FloatArray) -> FloatArray:
    """Return the next output of a second-order section (direct form II transposed); `state` (2, ...) goes on."""
    b0, b1, b2, _, a1, a2 = section
    out = b0 * value + state[0]
    state[0] = b1 * value - a1 * out + state[1]
    state[1] = b2 * value - a2 * out
    return np.asarray(out)
