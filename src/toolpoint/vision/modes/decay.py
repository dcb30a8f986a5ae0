r"""Free decay of a displacement field as responses for modal identification.

Every channel is divided by its standard deviation, so noise is alike in all; singular values tell motion from noise, and
the components above it carry all of the motion. The discrete transform of a decay :math:`A e^{s t}` over N samples is, on
its own lines, :math:`A (1 - e^{s N \Delta t}) / (1 - e^{(s - i \omega) \Delta t})`: one pole exactly, without leakage and
without a window (a Hann window on a decay would bias the damping). So the transforms are responses to one reference.
Source: Marchenko, Pastur, Math. USSR Sbornik 1 (1967) 457 (singular values of noise).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from toolpoint._check import ComplexArray, FloatArray, fail, scalar
from toolpoint._notebook import NotebookText
from toolpoint.vibration import Dof, Frf
from toolpoint.vision.displacement.result import DisplacementField

MAX_DECAY_COMPONENTS = 10  # singular components of a decay
LINE_LOG_ODDS = float(np.log(1e3))  # logarithm of one over the chance that noise has such a line
BLOW_SETTLING_TIME = 0.006  # s from the onset until the blow is over
MIN_DECAY_FRAMES = 48  # of a decay
# Above this share of the frame rate a pole's image beyond half the rate is too near to be a term outside the band.
MAX_FREQUENCY_FRACTION = 0.42
# Chance that noise alone is taken for the onset in a frame.
ONSET_FALSE_ALARM = 1e-4


@dataclass(frozen=True, eq=False)
class FreeDecay(NotebookText):
    """Components of a decay.

    Parameters
    ----------
    components : (frames, k) floats
        Singular components, the strongest first, in units of the noise of one channel.
    shapes : (m, k) floats
        Part of every measured channel (of `DisplacementField.measured`, over its standard deviation) in each.
    singular : (frames or m,) floats
        All singular values, relative to the edge of those of noise.
    first : int
        Frame in which the decay begins.
    frame_rate : float
    """

    components: FloatArray
    shapes: FloatArray
    singular: FloatArray
    first: int
    frame_rate: float

    @property
    def stop(self) -> int:
        """Frame after the last one of the decay."""
        return self.first + len(self.components)

    def responses(self, frequency_min: float = 0.0) -> Frf:
        """Return the transforms of the components as responses to one reference, from `frequency_min` (Hz) up."""
        n = len(self.components)
        spectra = np.fft.rfft(self.components, axis=0) / self.frame_rate
        frequency = np.fft.rfftfreq(n, 1 / self.frame_rate)
        keep = (frequency > max(frequency_min, 0.5 / n * self.frame_rate)) & (frequency <= MAX_FREQUENCY_FRACTION
                                                                              * self.frame_rate)
        labels = tuple(Dof(f"component {k + 1}", "+x") for k in range(spectra.shape[1]))
        values = spectra[keep][:, :, None]
        noise = np.full(values.shape, n / self.frame_rate**2)
        return Frf(frequency[keep], values, labels, (Dof("impulse", "+x"),), "receptance", variance=noise)

    def spectrum(self, windows: int = 0) -> tuple[FloatArray, ComplexArray]:
        """Return frequencies (n_f,), Hz, and transforms (n_f, k) of the components."""
        n = len(self.components)
        return np.fft.rfftfreq(n, 1 / self.frame_rate), np.fft.rfft(self.components, axis=0) / n

    def __repr__(self) -> str:
        return (f"FreeDecay({self.components.shape[1]} components above the noise, {len(self.components)} frames from frame "
                f"{self.first} on)")


def find_decay(field: DisplacementField, start: float | None = None, stop: float | None = None) -> FreeDecay:
    """Return the free decay of a field.

    Parameters
    ----------
    field : DisplacementField
    start, stop : float, optional
        Seconds from the first frame; the decay begins a moment after the onset of motion where left out.

    Raises
    ------
    ToolpointError
        Where no window sees motion, no motion stands out of the noise, or the decay has fewer than 48 frames.

    >>> from scipy import ndimage
    >>> from toolpoint.vision import choose_points, clip_of, measure, scan
    >>> rng, time = np.random.default_rng(0), np.arange(60) / 200  # s
    >>> texture = 128 + 60 * ndimage.zoom(rng.standard_normal((12, 16)), 4)
    >>> decay = 0.5 * np.exp(-3 * time) * np.cos(2 * np.pi * 20 * time)  # pixels to the right
    >>> frames = [ndimage.shift(texture, (0, x), mode="nearest") + rng.normal(0, 1, texture.shape) for x in decay]
    >>> scanned = scan(clip_of(np.clip(frames, 0, 255).astype(np.uint8), 200.0))
    >>> find_decay(measure(scanned, choose_points(scanned.reference, scanned.survey, 4, side=15))).first  # rings from the start
    0
    """
    values, sigma, _, _ = field.measured()
    if values.shape[1] == 0:
        fail("field", "no window that sees motion", "must be one at least", remedy="add texture, light or focus")
    # In place: of a long clip this is the largest array.
    return decay_of(np.divide(values, sigma, out=values), field.frame_rate, start=start, stop=stop)


def decay_of(scaled: FloatArray, rate: float, *, start: float | None = None, stop: float | None = None) -> FreeDecay:
    """Return the free decay of histories (frames, m) in units of their noise, changed in place; see `find_decay`."""
    scaled -= scaled.mean(axis=0)
    end_frame = len(scaled) if stop is None else min(len(scaled), round(scalar("stop", stop) * rate))
    first_frame = _onset(scaled[:end_frame], rate) if start is None else round(scalar("start", start) * rate)
    if end_frame - first_frame < MIN_DECAY_FRAMES or first_frame < 0:
        fail("start", f"{max(0, end_frame - first_frame)} frames of decay after frame {first_frame}",
             f"must be {MIN_DECAY_FRAMES} at least",
             remedy="film longer after the blow, or state where the decay starts and stops")
    histories = scaled[first_frame:end_frame]
    left_vectors, singular, right_vectors, edge, components = _components(histories)
    if not components:
        fail("field", "no motion stands out of the noise of the camera",
             f"no component has a spectral line above that of noise (largest singular value {singular[0] / edge:.2f} of the "
             "noise's)",
             remedy="strike harder, come closer, light better; motion along the line of sight does not show")
    return FreeDecay(left_vectors[:, components] * singular[components], right_vectors[components].T, singular / edge,
                     first_frame, rate)


def _stands_out(history: FloatArray) -> bool:
    """Return whether the strongest spectral line is above what white noise has once in a thousand times (Fisher's test).

    Windows that overlap share noise, so that some of its singular values stand out: in time it is white all the same.
    """
    power = np.abs(np.fft.rfft(history)[1:]) ** 2
    return bool(power.max() > (np.log(power.size) + LINE_LOG_ODDS) * power.mean())


def _components(histories: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, float, list[int]]:
    """Return the singular value decomposition of histories less their means (in place), the edge of the singular values of
    noise, and the numbers of the components that stand out of it."""
    histories -= histories.mean(axis=0)
    left_vectors, singular, right_vectors = _gram_svd(histories)
    edge = _noise_edge(singular, *histories.shape)
    candidates = np.flatnonzero(singular[:MAX_DECAY_COMPONENTS] > edge)
    return left_vectors, singular, right_vectors, edge, [int(k) for k in candidates if _stands_out(left_vectors[:, k])]


def _gram_svd(values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the singular value decomposition through the smaller Gram matrix: quick, and precise above the noise."""
    frames, channels = values.shape
    if frames <= channels:
        eigenvalues, left_vectors = np.linalg.eigh(values @ values.T)
        singular, left_vectors = np.sqrt(np.maximum(eigenvalues[::-1], 0.0)), left_vectors[:, ::-1]
        return left_vectors, singular, (left_vectors.T @ values) / np.maximum(singular, 1e-12)[:, None]
    eigenvalues, right_vectors = np.linalg.eigh(values.T @ values)
    singular, right_vectors = np.sqrt(np.maximum(eigenvalues[::-1], 0.0)), right_vectors[:, ::-1]
    return (values @ right_vectors) / np.maximum(singular, 1e-12), singular, right_vectors.T


def _noise_edge(singular: FloatArray, frames: int, channels: int) -> float:
    """Return the largest singular value of noise, its size taken from the median singular value."""
    ratio = min(frames, channels) / max(frames, channels)
    # Median of the Marchenko-Pastur law, by its density on a grid.
    eigenvalue_min, eigenvalue_max = (1 - np.sqrt(ratio)) ** 2, (1 + np.sqrt(ratio)) ** 2
    x = np.linspace(eigenvalue_min, eigenvalue_max, 2001)[1:-1]
    density = np.sqrt((eigenvalue_max - x) * (x - eigenvalue_min)) / x
    total = np.cumsum(density)
    median = float(x[int(np.searchsorted(total, 0.5 * total[-1]))])
    used = singular[:min(frames, channels)]
    if used.size > 8:
        return float(np.median(used) * np.sqrt(eigenvalue_max / median))
    return float(np.sqrt(max(frames, channels)) * (1 + np.sqrt(ratio)))


def _onset(scaled: FloatArray, rate: float) -> int:
    """Return the frame at which free motion begins: just after the onset, the first one where it is under way already.

    The onset is looked for in what stands out of the noise, and beyond what noise has there: a decay that begins in frames
    before the blow comes out with half its damping, one that begins late as it is.
    """
    left_vectors, singular, _, edge, components = _components(scaled.copy())
    if not components:
        return 0
    energy = ((left_vectors[:, components] * singular[components]) ** 2).mean(axis=1)
    # A mean over some milliseconds and at least three frames: the noise of single ones would pass for the onset.
    average_frames = max(3, round(0.004 * rate))
    smooth = np.convolve(energy, np.ones(average_frames) / average_frames, "same")
    freedom = len(components) * average_frames
    start_energy = float(smooth[:average_frames].mean())
    noise_energy = edge**2 / len(scaled) * float(chi2.isf(ONSET_FALSE_ALARM, freedom)) / freedom
    if start_energy > max(0.2 * smooth.max(), noise_energy) or smooth.max() < noise_energy:
        return 0
    return int(np.argmax(smooth > max(start_energy + 0.1 * (smooth.max() - start_energy),
                                      noise_energy))) + max(1, round(BLOW_SETTLING_TIME * rate))
