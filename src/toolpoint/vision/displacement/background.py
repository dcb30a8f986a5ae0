"""Background: what does not move shows how the camera moved; its motion is taken off."""

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

FEWEST_DIRECTIONS = 6
# Share of the picture's diagonal that background windows must span for a turn of the camera to be told.
SPREAD = 0.2
# Windows that show the camera's motion alone leave at most so much, in their own noise; the power of the motion that they share
# over that of their noise, from which it is taken off.
MAX_OWN_MOTION, MIN_SHAKE = 2.0, 3.0
# Parts of a clip, and power of the last over the largest below which a motion dies out; share of the strongest line's power.
QUARTERS, FADED, STRONG = 4, 0.05, 0.2
# Lines that share an estimate of their power, and how far it must stand above the noise: the mean of five squares of noise
# exceeds three times its variance once in a hundred.
LINES, ABOVE = 5, 3.0
# Frames by which the slope at an end is told, and how many standard deviations it must differ from none.
END, CLEAR = 24, 4.0


def windows_inside(windows: Windows, regions: Sequence[Region]) -> BoolArray:
    """Return which windows lie wholly in a region."""
    half = windows.side / 2
    inside = np.zeros(len(windows.centres), bool)
    for region in regions:
        inside |= region.holds(windows.centres - half) & region.holds(windows.centres + half)
    return inside


@dataclass(frozen=True, eq=False)
class CameraMotion:
    """Motion of the camera in every frame, by windows of what stands still.

    motion : (3, frames) right, down (pixels) and turn times `length`; variance : (2,) of a frame's right and down; middle :
    (2,) place about which it turns; length : pixels; scatter : median scatter of the windows about it, in their noise; clear :
    power of the motion that they share over that of their noise.
    """

    motion: FloatArray
    variance: FloatArray
    middle: FloatArray
    length: float
    scatter: float
    clear: float

    @property
    def size(self) -> float:
        """Largest motion, peak to peak, pixels."""
        return float(np.ptp(self.motion[:2], axis=1).max())

    @property
    def stands_out(self) -> bool:
        """Whether the windows show one motion, and nothing else, that stands out of their noise."""
        return self.scatter < MAX_OWN_MOTION and self.clear > MIN_SHAKE

    @property
    def fades(self) -> bool:
        """Whether it dies out as a free decay does: then it is a part of the machine that moves, and not the camera."""
        power = np.array([np.var(part, axis=1).sum() for part in np.array_split(self.motion[:2], QUARTERS, axis=1)])
        return bool(power[-1] < FADED * power.max())

    def shared_by(self, field: DisplacementField) -> float:
        """Return the share of this motion (1 for a camera's) that windows of a field have, in the lines where it is strong."""
        values, sigma, window, direction = field.measured()
        camera = np.einsum("tmi,mi->tm", self.at(field.windows.centres)[:, window], direction) / sigma
        bell = np.hanning(len(values))[:, None]
        spectrum, other = (np.fft.rfft((part - part.mean(axis=0)) * bell, axis=0) for part in (camera, values / sigma))
        power = (np.abs(spectrum) ** 2).sum(axis=1)
        strong = power > STRONG * power.max()
        return float((spectrum[strong].conj() * other[strong]).sum().real / power[strong].sum())

    def at(self, centres: FloatArray) -> FloatArray:
        """Return the motion (frames, n, 2) that the camera gives places of the picture (n, 2)."""
        arm = (centres - self.middle) / self.length
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
    if values.shape[1] < FEWEST_DIRECTIONS:
        fail("background", f"{values.shape[1]} measured directions in it", f"must be {FEWEST_DIRECTIONS} at least",
             remedy="a plain wall shows no motion: put a fixed pattern there, or use a stiff tripod")
    centres = field.windows.centres
    middle = centres.mean(axis=0)
    length = max(float(np.ptp(centres, axis=0).max()), 1.0)
    arm = (centres - middle) / length
    turns = length > SPREAD * float(np.hypot(*field.windows.corners.max(axis=0)))
    columns = slice(0, 3 if turns else 2)
    weighted = _rows(direction, arm[window])[:, columns] / sigma[:, None]
    scaled = (values / sigma).T
    motion, _, rank, _ = np.linalg.lstsq(weighted, scaled, rcond=None)
    variance = np.diag(np.linalg.pinv(weighted.T @ weighted, hermitian=True))
    left = scaled - weighted @ motion
    left -= left.mean(axis=1, keepdims=True)
    scatter = float(np.median(np.sqrt((left**2).mean(axis=1))))
    shared = weighted @ (motion - motion.mean(axis=1, keepdims=True))
    clear = float((shared**2).sum() / (max(int(rank), 1) * len(field.values) * max(scatter, 1.0) ** 2))
    whole = np.zeros((3, len(field.values)))
    whole[columns] = smooth_motion(motion, variance)
    return CameraMotion(whole, variance[:2], middle, length, scatter, clear)


def without_camera(field: DisplacementField, camera: CameraMotion) -> DisplacementField:
    """Return the field less the motion of the camera."""
    size = camera.size
    # What the filter lets through of the background's noise, and what it hides of the shake, is at most that noise.
    return replace(field, common=camera.variance).changed(
        (field.values - camera.at(field.windows.centres)).astype(np.float32),
        *([Doubt("camera", f"camera shake of {size:.2f} px peak to peak taken off by the background")] if size > 0.1 else []))


def without_shake(field: DisplacementField, still: BoolArray) -> DisplacementField:
    """Return the field less the motion of the camera, by those of its windows that show the fixed background."""
    return without_camera(field, camera_motion(field.selected(np.flatnonzero(still))))


def smooth_motion(motion: FloatArray, variance: FloatArray) -> FloatArray:
    """Return the camera's motion (components, frames) without its noise, where it does not stand above it.

    The background's noise is common to all windows, so no mean over them takes it away: taken off with the shake it would
    double the errors of weak modes. Every line of the cosine transform (no jump at the ends) is weighed by what it holds
    beyond the noise; lines about the level of the noise alone are left out, and may hide a shake of that size.

    variance : (components,) of a frame.
    Source: Wiener filter, Press et al., Numerical Recipes, 3rd ed., 13.3.
    """
    bend = _end_slopes(motion, variance)
    lines = dct(motion - bend, axis=1, norm="ortho")
    power = uniform_filter1d(lines**2, LINES, axis=1, mode="nearest")
    share = variance[:, None] / np.maximum(power, 1e-300)
    gain = np.where(power > ABOVE * variance[:, None], 1 - share, 0.0)
    return np.asarray(idct(gain * lines, axis=1, norm="ortho") + bend)


def _end_slopes(motion: FloatArray, variance: FloatArray) -> FloatArray:
    """Return parabolas with the slopes that a motion (components, frames) has at its ends, where the noise lets them be seen.

    A cosine has none there: without them, lines far above the shake's would hold the corners, and lose them to the noise.
    """
    frames = motion.shape[1]
    if frames < 2 * END:
        return np.zeros_like(motion)
    design = np.arange(END, dtype=float)[:, None] ** np.arange(3)
    inverse = np.linalg.inv(design.T @ design)
    slopes = []
    for part in (motion[:, :END], motion[:, :-END - 1:-1]):
        numbers = part @ design @ inverse
        left = ((part - numbers @ design.T) ** 2).mean(axis=1)
        # A motion that turns within these frames has no slope that they could tell.
        clear = (left < 2 * variance) & (numbers[:, 1] ** 2 > CLEAR**2 * variance * inverse[1, 1])
        slopes.append(np.where(clear, numbers[:, 1], 0.0))
    first, last, t = slopes[0], -slopes[1], np.arange(frames, dtype=float)
    return np.asarray(first[:, None] * t + (last - first)[:, None] * t**2 / (2 * (frames - 1)))


def _rows(direction: FloatArray, arm: FloatArray) -> FloatArray:
    turn = -direction[:, 0] * arm[:, 1] + direction[:, 1] * arm[:, 0]
    return np.column_stack([direction, turn])
