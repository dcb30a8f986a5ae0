r"""Phase-based displacement: local phase of oriented band-pass filters, scaled by the texture (the way of the source).

A window's pixels are filtered along rows and along columns by a complex band-pass of wavelength :math:`\lambda`; motion
shifts the local phase by :math:`\Delta \varphi = \nabla \varphi \cdot d`. The phase is unwrapped in time at every pixel, the
gradient is that of the texture at rest, and pixels count by their squared amplitude. Source: Fleet, Jepson, IJCV 5 (1990)
77; Chen, Wadhwa, Cha, Durand, Freeman, Buyukozturk, JSV 345 (2015) 58.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import convolve1d

from toolpoint._check import ComplexArray, FloatArray, IndexArray
from toolpoint.vision.clip import Frames
from toolpoint.vision.displacement.phase_arrays import PhaseFilter, PhaseWindows
from toolpoint.vision.displacement.points import BLIND_SIGHT, EDGE_SIGHT, Windows
from toolpoint.vision.displacement.reference import Reference
from toolpoint.vision.displacement.templates import Pass

# Standard deviations by which the amplitude of a filter must stand above its noise for its phase to be followed.
MIN_AMPLITUDE_DEVIATIONS = 4.0


@dataclass(frozen=True)
class LocalPhase:
    """Phase of two oriented band-pass filters.

    wavelength : pixels; width : standard deviation of the filters, pixels; stride : every how many pixels of a window.
    """

    wavelength: float = 7.0
    width: float = 2.0
    stride: int = 2

    @property
    def name(self) -> str:
        """Name in messages."""
        return "local phase"

    @property
    def kernels(self) -> tuple[ComplexArray, FloatArray]:
        """Complex weights along the wave, without response to a constant, and real ones across it."""
        half = int(np.ceil(3 * self.width))
        x = np.arange(-half, half + 1)
        bell = np.exp(-0.5 * (x / self.width) ** 2)
        wave = bell * np.exp(2j * np.pi * x / self.wavelength)
        wave = wave - bell * wave.sum() / bell.sum()
        return wave / np.abs(wave).sum(), bell / bell.sum()

    def prepare(self, reference: Reference, windows: Windows) -> tuple[Pass, FloatArray, IndexArray]:
        """Return the pass over a chunk of frames, the covariance (n, 2, 2) of a frame, and the counts of lost frames (n,)."""
        from toolpoint.vision.displacement.kernels import follow_phase

        wave, bell = self.kernels
        half, n, side = len(wave) // 2, len(windows.corners), windows.side
        rows, columns = reference.picture.shape
        filter_count = -(-side // self.stride)
        reference_bands, slopes = np.zeros((n, 2, 2, filter_count, filter_count),
                                           np.float32), np.zeros((n, 2, 2, filter_count, filter_count), np.float32)
        filtered = [self._filtered(reference, axis) for axis in (1, 0)]
        inside = ((windows.corners >= half) & (windows.corners + side + half <= (rows, columns))).all(axis=1)
        usable = inside & (windows.sight > BLIND_SIGHT)
        # Share of a pixel's noise, in each component of the filter
        noise_gain = float((np.abs(wave) ** 2).sum() * (bell**2).sum()) / 2
        covariance, inverse = np.zeros((n, 2, 2)), np.zeros((n, 2, 2))
        for p in np.flatnonzero(usable).tolist():
            cut = tuple(slice(start, start + side, self.stride) for start in windows.corners[p])
            for o, (value, by_right, by_down) in enumerate(filtered):
                response = value[cut]
                power = np.maximum(np.abs(response) ** 2, 1e-12)
                # Where noise turns the phase by whole turns it is unwrapped wrongly, and the error stays for all later frames.
                response = np.where(power > MIN_AMPLITUDE_DEVIATIONS**2 * noise_gain * reference.variance[cut], response, 0.0)
                reference_bands[p, o] = response.real, response.imag
                slopes[p, o] = [(slope[cut] * response.conj()).imag / power for slope in (by_right, by_down)]
            inverse[p] = _inverse(reference_bands[p], slopes[p], windows, p)
            covariance[p] = self._covariance(reference, windows, p, reference_bands=reference_bands[p], slopes=slopes[p],
                                             inverse=inverse[p])
        last, turns = np.zeros((n, 2, filter_count, filter_count), np.float32), np.zeros((n, 2, filter_count, filter_count),
                                                                                         np.int32)
        lost_frames = np.zeros(n, np.int64)
        used_windows = np.flatnonzero(usable)
        corners = np.ascontiguousarray(windows.corners[used_windows])
        phase_filter = PhaseFilter(*(np.ascontiguousarray(response, np.float32) for response in (wave.real, wave.imag, bell)))
        phase_windows = PhaseWindows(reference_bands[used_windows], slopes[used_windows], inverse[used_windows],
                                     last[used_windows], turns[used_windows])

        def measure(frames: Frames) -> FloatArray:
            displacement = np.zeros((len(frames), used_windows.size, 2), np.float32)
            follow_phase(frames, corners, side, self.stride, phase_filter, phase_windows, displacement)
            result = np.zeros((len(frames), n, 2), np.float32)
            result[:, used_windows] = displacement
            return result
        lost_frames[~usable] = 1
        return measure, covariance, lost_frames

    def _filtered(self, reference: Reference, axis: int) -> list[ComplexArray]:
        """Return the filtered picture and its derivatives by right and down of the motion."""
        wave, bell = self.kernels
        result = []
        for part in reference.moved(0.0, 0.0):
            lines = convolve1d(part.astype(float), bell[::-1], axis=1 - axis, mode="nearest")
            result.append(convolve1d(lines, wave.real[::-1], axis=axis, mode="nearest")
                          + 1j * convolve1d(lines, wave.imag[::-1], axis=axis, mode="nearest"))
        return result

    def _covariance(self, reference: Reference, windows: Windows, p: int, *, reference_bands: FloatArray, slopes: FloatArray,
                    inverse: FloatArray) -> FloatArray:
        """Return the covariance of a frame's displacement: for small motion linear in the pixels, by the adjoint filters."""
        wave, bell = self.kernels
        half, side = len(wave) // 2, windows.side
        first_row, first_column = windows.corners[p] - half
        noise = reference.variance[first_row:first_row + side + 2 * half, first_column:first_column + side + 2 * half]
        weights = np.zeros((2, *noise.shape))
        for o in range(2):
            for i in range(2):
                spread = np.zeros(noise.shape, complex)
                spread[half:half + side:self.stride, half:half + side:self.stride] = (
                    slopes[o, i] * (reference_bands[o, 0] + 1j * reference_bands[o, 1]))
                axis = 1 - o
                lines = convolve1d(spread.real, bell, axis=1 - axis) + 1j * convolve1d(spread.imag, bell, axis=1 - axis)
                weights[i] += (convolve1d(lines.real, wave.imag, axis=axis, mode="constant")
                               - convolve1d(lines.imag, wave.real, axis=axis, mode="constant"))
        middle = np.einsum("ihw,hw,jhw->ij", weights, noise, weights)
        return inverse @ middle @ inverse.T


def _inverse(reference_bands: FloatArray, slopes: FloatArray, windows: Windows, p: int) -> FloatArray:
    """Return the inverse (2, 2) of the phase gradients' normal matrix; along the normal only at an edge."""
    power = (reference_bands.astype(float) ** 2).sum(axis=1)
    gram = np.einsum("oihw,ohw,ojhw->ij", slopes, power, slopes)
    if windows.sight[p] == EDGE_SIGHT:
        n = windows.normal[p]
        return np.outer(n, n) / max(float(n @ gram @ n), 1e-30)
    return np.asarray(np.linalg.inv(gram))
