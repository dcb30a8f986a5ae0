"""Camera motion from windows of the fixed background, and its removal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import dct, idct
from scipy.ndimage import uniform_filter1d

from toolpoint._check import BoolArray, FloatArray, fail
from toolpoint._doubt import Doubt
from toolpoint.vision.clip import Region
from toolpoint.vision.displacement.points import Windows
from toolpoint.vision.displacement.result import DisplacementField

MIN_BACKGROUND_DIRECTIONS = 6  # measured directions of background windows
# Share of the picture's diagonal that background windows must span for a turn of the camera to be identified.
MIN_TURN_SPAN_FRACTION = 0.2
# Windows that show the camera's motion alone leave at most so much, in their own noise; the power of the motion that they share
# over that of their noise, from which it is taken off.
MAX_BACKGROUND_SCATTER, MIN_SHAKE_POWER_RATIO = 2.0, 3.0
# Parts of a clip, and power of the last over the largest below which a motion dies out; share of the strongest line's power.
FADE_PARTS, MAX_FADE_POWER_FRACTION, STRONG_LINE_FRACTION = 4, 0.05, 0.2
# Lines that share an estimate of their power, and how far it must stand above the noise: the mean of five squares of noise
# exceeds three times its variance once in a hundred.
POWER_AVERAGE_LINES, MIN_LINE_POWER_RATIO = 5, 3.0
# Frames from which the slope at an end is fitted, and the standard deviations by which it must differ from zero.
END_SLOPE_FRAMES, MIN_END_SLOPE_DEVIATIONS = 24, 4.0


def windows_inside(windows: Windows, regions: Sequence[Region]) -> BoolArray:
    """Return which windows lie wholly in a region."""
    half = windows.side / 2
    inside = np.zeros(len(windows.centres), bool)
    for region in regions:
        inside |= region.holds(windows.centres - half) & region.holds(windows.centres + half)
    return inside


@dataclass(frozen=True, eq=False)
class CameraMotion:
    """Motion of the camera in every frame, from windows of the fixed background.

    motion : (3, frames) right, down (pixels) and turn times `arm_scale`; variance : (2,) of a frame's right and down; middle :
    (2,) place about which it turns; arm_scale : pixels; scatter : median scatter of the windows about it, in their noise;
    power_ratio : power of the motion that they share over that of their noise.
    """

    motion: FloatArray
    variance: FloatArray
    middle: FloatArray
    arm_scale: float
    scatter: float
    power_ratio: float

    @property
    def size(self) -> float:
        """Largest motion, peak to peak, pixels."""
        return float(np.ptp(self.motion[:2], axis=1).max())

    @property
    def stands_out(self) -> bool:
        """Whether the windows show one common motion, and nothing else, above their noise."""
        return self.scatter < MAX_BACKGROUND_SCATTER and self.power_ratio > MIN_SHAKE_POWER_RATIO

    @property
    def fades(self) -> bool:
        """Whether it dies out as a free decay does: the windows then show a part of the machine, not the camera."""
        power = np.array([np.var(part, axis=1).sum() for part in np.array_split(self.motion[:2], FADE_PARTS, axis=1)])
        return bool(power[-1] < MAX_FADE_POWER_FRACTION * power.max())

    def shared_by(self, field: DisplacementField) -> float:
        """Return the part of this motion (1 for a camera's) in windows of a field, over the strong spectral lines."""
        values, sigma, window, direction = field.measured()
        camera = np.einsum("tmi,mi->tm", self.motion_at(field.windows.centres)[:, window], direction) / sigma
        taper = np.hanning(len(values))[:, None]
        spectrum, field_spectrum = (np.fft.rfft((part - part.mean(axis=0)) * taper, axis=0)
                                    for part in (camera, values / sigma))
        power = (np.abs(spectrum) ** 2).sum(axis=1)
        is_strong = power > STRONG_LINE_FRACTION * power.max()
        return float((spectrum[is_strong].conj() * field_spectrum[is_strong]).sum().real / power[is_strong].sum())

    def motion_at(self, centres: FloatArray) -> FloatArray:
        """Return the motion (frames, n, 2) that the camera gives places of the picture (n, 2)."""
        arm = (centres - self.middle) / self.arm_scale
        right, down, turn = self.motion
        return np.stack([right[:, None] - turn[:, None] * arm[:, 1], down[:, None] + turn[:, None] * arm[:, 0]], axis=2)


def camera_motion(field: DisplacementField) -> CameraMotion:
    """Return the motion of the camera by windows that show the fixed background.

    In every frame a translation, and a turn where the background spans enough of the picture, by weighted least squares.

    Raises
    ------
    ToolpointError
        Where the background has fewer than six measured directions.
    """
    values, sigma, window, direction = field.measured()
    if values.shape[1] < MIN_BACKGROUND_DIRECTIONS:
        fail("background", f"{values.shape[1]} measured directions in it", f"must be {MIN_BACKGROUND_DIRECTIONS} at least",
             remedy="a plain wall shows no motion: put a fixed pattern there, or use a stiff tripod")
    centres = field.windows.centres
    middle = centres.mean(axis=0)
    arm_scale = max(float(np.ptp(centres, axis=0).max()), 1.0)
    arm = (centres - middle) / arm_scale
    has_turn = arm_scale > MIN_TURN_SPAN_FRACTION * float(np.hypot(*field.windows.corners.max(axis=0)))
    columns = slice(0, 3 if has_turn else 2)
    design = _rows(direction, arm[window])[:, columns] / sigma[:, None]
    scaled_values = (values / sigma).T
    motion, _, rank, _ = np.linalg.lstsq(design, scaled_values, rcond=None)
    variance = np.diag(np.linalg.pinv(design.T @ design, hermitian=True))
    residual = scaled_values - design @ motion
    residual -= residual.mean(axis=1, keepdims=True)
    scatter = float(np.median(np.sqrt((residual**2).mean(axis=1))))
    shared = design @ (motion - motion.mean(axis=1, keepdims=True))
    power_ratio = float((shared**2).sum() / (max(int(rank), 1) * len(field.values) * max(scatter, 1.0) ** 2))
    complete_motion = np.zeros((3, len(field.values)))
    complete_motion[columns] = smooth_motion(motion, variance)
    return CameraMotion(complete_motion, variance[:2], middle, arm_scale, scatter, power_ratio)


def without_camera(field: DisplacementField, camera: CameraMotion) -> DisplacementField:
    """Return the field less the motion of the camera."""
    size = camera.size
    # What the filter lets through of the background's noise, and what it hides of the shake, is at most that noise.
    return replace(field, common=camera.variance).changed(
        (field.values - camera.motion_at(field.windows.centres)).astype(np.float32),
        *([Doubt("camera", f"camera shake of {size:.2f} px peak to peak taken off by the background")] if size > 0.1 else []))


def without_shake(field: DisplacementField, is_background: BoolArray) -> DisplacementField:
    """Return the field less the camera motion that its fixed background windows show.

    >>> from scipy import ndimage
    >>> from toolpoint.vision import choose_points, clip_of, measure, scan
    >>> rng, time = np.random.default_rng(0), np.arange(60) / 200  # s
    >>> texture = 128 + 60 * ndimage.zoom(rng.standard_normal((12, 16)), 4)
    >>> decay = 0.5 * np.exp(-3 * time) * np.cos(2 * np.pi * 20 * time)  # pixels to the right
    >>> frames = [ndimage.shift(texture, (0, x), mode="nearest") + rng.normal(0, 1, texture.shape) for x in decay]
    >>> scanned = scan(clip_of(np.clip(frames, 0, 255).astype(np.uint8), 200.0))
    >>> field = measure(scanned, choose_points(scanned.reference, scanned.survey, 4, side=15))
    >>> still = without_shake(field, np.array([False, True, True, True]))  # all windows move alike: it is the camera
    >>> bool(np.abs(still.values[:, 0, 0]).max() < 0.1 * np.abs(field.values[:, 0, 0]).max())
    True
    """
    return without_camera(field, camera_motion(field.selected(np.flatnonzero(is_background))))


def smooth_motion(motion: FloatArray, variance: FloatArray) -> FloatArray:
    """Return the camera's motion (components, frames) without its noise, where it does not stand above it.

    The background's noise is common to all windows, so no mean over them takes it away: taken off with the shake it would
    double the errors of weak modes. Every line of the cosine transform (no jump at the ends) is weighed by what it holds
    beyond the noise; lines about the level of the noise alone are left out, and may hide a shake of that size.

    variance : (components,) of a frame.
    Source: Wiener filter, Press et al., Numerical Recipes, 3rd ed., 13.3.
    """
    end_parabolas = _end_slopes(motion, variance)
    lines = dct(motion - end_parabolas, axis=1, norm="ortho")
    power = uniform_filter1d(lines**2, POWER_AVERAGE_LINES, axis=1, mode="nearest")
    noise_share = variance[:, None] / np.maximum(power, 1e-300)
    gain = np.where(power > MIN_LINE_POWER_RATIO * variance[:, None], 1 - noise_share, 0.0)
    return np.asarray(idct(gain * lines, axis=1, norm="ortho") + end_parabolas)


def _end_slopes(motion: FloatArray, variance: FloatArray) -> FloatArray:
    """Return parabolas with the slopes of a motion (components, frames) at its ends, where they stand out of the noise.

    A cosine has none there: without them, lines far above the shake's would hold the corners, and lose them to the noise.
    """
    frames = motion.shape[1]
    if frames < 2 * END_SLOPE_FRAMES:
        return np.zeros_like(motion)
    design = np.arange(END_SLOPE_FRAMES, dtype=float)[:, None] ** np.arange(3)
    inverse = np.linalg.inv(design.T @ design)
    slopes = []
    for end_motion in (motion[:, :END_SLOPE_FRAMES], motion[:, :-END_SLOPE_FRAMES - 1:-1]):
        coefficients = end_motion @ design @ inverse
        residual_variance = ((end_motion - coefficients @ design.T) ** 2).mean(axis=1)
        # A motion that turns within these frames has no slope that they could tell.
        is_significant = (residual_variance < 2 * variance) & (coefficients[:, 1] ** 2 > MIN_END_SLOPE_DEVIATIONS**2 * variance
                                                               * inverse[1, 1])
        slopes.append(np.where(is_significant, coefficients[:, 1], 0.0))
    start_slope, end_slope, t = slopes[0], -slopes[1], np.arange(frames, dtype=float)
    return np.asarray(start_slope[:, None] * t + (end_slope - start_slope)[:, None] * t**2 / (2 * (frames - 1)))


def _rows(direction: FloatArray, arm: FloatArray) -> FloatArray:
    """Return the rows (m, 3) of right, down and turn for measured directions (m, 2) at arms (m, 2)."""
    turn = -direction[:, 0] * arm[:, 1] + direction[:, 1] * arm[:, 0]
    return np.column_stack([direction, turn])
