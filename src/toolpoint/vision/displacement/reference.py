r"""Reference: the mean of frames in which the machine is at the same place, its noise, and the texture that motion is seen by.

The noise of a pixel has the variance :math:`\sigma^2 = a + b I`; the texture's bound on displacement is the inverse of
:math:`J = \sum \nabla I \nabla I^T / \sigma^2` over a window (Cramer-Rao). Source: Healey, Kondepudy, IEEE PAMI 16 (1994)
267 (noise); Shi, Tomasi, CVPR 1994 (structure tensor).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.ndimage import correlate1d, spline_filter1d, uniform_filter

from toolpoint._check import BoolArray, FloatArray
from toolpoint.vision.clip import Clip
from toolpoint.vision.displacement.survey import Survey

BRIGHTNESS_CLASSES = 24  # of equal numbers of pixels, for noise over brightness
PLAIN_PIXEL_FRACTION = 0.3  # of the pixels, those with the least slope
LEVEL_ROUNDING_VARIANCE = 1 / 12  # variance of rounding to whole grey levels: the least that noise can have


@dataclass(frozen=True, eq=False)
class Reference:
    """The picture at rest.

    picture : (rows, columns), grey levels; constant, slope : variance of a pixel's noise, a + b I; whiteness : correlation
    of a pixel's successive changes, -0.5 for white noise; grain : correlation of neighbours' changes, 0 for a sensor's noise;
    kurtosis : of the changes, 3 for normal noise; frames : how many were averaged.
    """

    picture: FloatArray
    constant: float
    slope: float
    whiteness: float
    grain: float
    kurtosis: float
    frames: int

    @property
    def variance(self) -> FloatArray:
        """Variance of the noise of every pixel of a single frame, (rows, columns)."""
        return np.maximum(self.constant + self.slope * self.picture, LEVEL_ROUNDING_VARIANCE)

    @property
    def noise(self) -> float:
        """Standard deviation of the noise at the mean grey level."""
        return float(np.sqrt(self.variance.mean()))

    def moved(self, right: float, down: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the picture moved by part of a pixel, and its derivatives by right and down of the motion."""
        value_x, slope_x = _weights(right)
        value_y, slope_y = _weights(down)
        inside = correlate1d(self._coefficients, value_x, axis=1, mode="mirror")
        picture = correlate1d(inside, value_y, axis=0, mode="mirror")
        by_down = -correlate1d(inside, slope_y, axis=0, mode="mirror")
        by_right = -correlate1d(correlate1d(self._coefficients, slope_x, axis=1, mode="mirror"), value_y, axis=0, mode="mirror")
        return picture, by_right, by_down

    @cached_property
    def _coefficients(self) -> FloatArray:
        lines = spline_filter1d(self.picture.astype(np.float64), 5, axis=0, mode="mirror")
        return np.asarray(spline_filter1d(lines, 5, axis=1, mode="mirror").astype(np.float32))

    def false_information(self, window: int) -> float:
        """Return what noise in the reference adds to J along each direction of a square window, 1/px^2."""
        return window * window * _slope_noise() / self.frames

    def information(self, window: int) -> FloatArray:
        """Return J over a window around every pixel, less what noise in the reference adds, (rows, columns, 2, 2), 1/px^2."""
        _, x, y = self.moved(0.0, 0.0)
        weight, area = 1 / self.variance, float(window * window)
        false = self.false_information(window)
        result = np.empty((*self.picture.shape, 2, 2))
        for i, j, product in ((0, 0, x * x), (1, 1, y * y), (0, 1, x * y)):
            total = area * uniform_filter(product * weight, window, mode="constant")
            result[..., i, j] = result[..., j, i] = total - (false if i == j else 0.0)
        return result


@lru_cache(maxsize=1)
def _slope_noise() -> float:
    """Return the variance of the spline's slope for white noise of variance one."""
    impulse = np.zeros(65)
    impulse[32] = 1.0
    return float((correlate1d(spline_filter1d(impulse, 5, mode="mirror"), _weights(0.0)[1].astype(float)) ** 2).sum())


def _weights(shift: float) -> tuple[FloatArray, FloatArray]:
    """Return the weights (7,) on spline coefficients that give value and slope at -shift, |shift| < 1."""
    places = np.arange(-3, 4) + shift
    return _spline5(places).astype(np.float32), (-_slope5(places)).astype(np.float32)


def _spline5(x: FloatArray) -> FloatArray:
    """Return the quintic B-spline at x."""
    s = np.abs(x)
    inner_piece, middle_piece = (66 - 60 * s**2 + 30 * s**4 - 10 * s**5,
                                 51 + 75 * s - 210 * s**2 + 150 * s**3 - 45 * s**4 + 5 * s**5)
    return np.select([s < 1, s < 2, s < 3], [inner_piece, middle_piece, np.maximum(3 - s, 0) ** 5], 0.0) / 120


def _slope5(x: FloatArray) -> FloatArray:
    """Return the derivative of the quintic B-spline at x."""
    s, sign = np.abs(x), np.sign(x)
    inner_piece = -120 * s + 120 * s**3 - 50 * s**4
    middle_piece = 75 - 420 * s + 450 * s**2 - 180 * s**3 + 25 * s**4
    return sign * np.select([s < 1, s < 2, s < 3], [inner_piece, middle_piece, -5 * np.maximum(3 - s, 0) ** 4], 0.0) / 120


def take_reference(clip: Clip, survey: Survey) -> Reference:
    """Return the reference of a clip: mean of its reference frames, noise from its quiet ones."""
    from toolpoint.vision.displacement.kernels import add_differences

    rows, columns = clip.shape
    total = np.zeros((rows, columns), np.int64)
    sums = np.zeros((4, rows, columns), np.float32)
    gain = (1 / (1 + survey.brightness)).astype(np.float32)
    start, stop = survey.quiet
    reference_frames = set(survey.reference_frames.tolist())
    frame_index = 0
    recent_frames: list[np.ndarray] = []
    for frames in clip.chunks():
        for k, frame in enumerate(frames, start=frame_index):
            if k in reference_frames:
                total += frame
            if start <= k < stop:
                recent_frames = [*recent_frames[-2:], frame * gain[k]]  # lamps are no noise
                if len(recent_frames) == 3:
                    add_differences(recent_frames[0], recent_frames[1], recent_frames[2], sums)
        frame_index += len(frames)
    change_count = stop - start - 2
    picture, variance = total / len(reference_frames), sums[0] / (2 * change_count)
    a, b = _fit_noise(picture, variance, change_count)
    return Reference(picture.astype(np.float32), a, b, *_noise_shape(sums[:, _plain(picture)], change_count),
                     len(reference_frames))


def _noise_shape(sums: FloatArray, frames: int) -> tuple[float, float, float]:
    """Return correlation in time, correlation of neighbours, and kurtosis of the changes of pixels, from their sums (4, n)."""
    squares, products, neighbour_products, fourths = sums.astype(float).sum(axis=1)
    power = max(squares, 1e-9)
    return products / power, neighbour_products / power, fourths * frames * sums.shape[1] / power**2


def _plain(picture: FloatArray) -> BoolArray:
    """Return the pixels with the least texture: what changes there is noise, also where the machine moves."""
    down, right = np.gradient(picture)
    slope = np.hypot(down, right)
    return slope <= np.quantile(slope, PLAIN_PIXEL_FRACTION)


def _fit_noise(picture: FloatArray, variance: FloatArray, frames: int) -> tuple[float, float]:
    """Return a and b of the variance a + b I through the medians of classes of equal brightness."""
    order = np.argsort(picture, axis=None)
    groups = np.array_split(order, BRIGHTNESS_CLASSES)
    level = np.array([np.median(picture.flat[group]) for group in groups])
    # Medians, so that moving edges do not swell the noise; that of a chi-squared variable lies below its mean.
    freedoms = 2 * frames / 3
    noise = np.array([np.median(variance.flat[group]) for group in groups]) / (1 - 2 / (9 * freedoms)) ** 3
    is_used = (level > 2) & (noise > 0)
    if is_used.sum() < 3 or np.ptp(level[is_used]) < 20:
        return max(float(noise.mean()), LEVEL_ROUNDING_VARIANCE), 0.0
    slope, constant = np.polyfit(level[is_used], noise[is_used], 1)
    if slope <= 0 or constant < 0:
        return (max(float(noise[is_used].mean()), LEVEL_ROUNDING_VARIANCE),
                0.0) if slope <= 0 else (0.0, float((noise / level)[is_used].mean()))
    return float(constant), float(slope)
