"""Background: what does not move shows how the camera moved; its motion is taken off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.fft import dct, idct
from scipy.ndimage import uniform_filter1d

from toolpoint._check import BoolArray, FloatArray, fail
from toolpoint._doubt import Doubt
from toolpoint.vision.clip import Region
from toolpoint.vision.displacement.points import BLIND
from toolpoint.vision.displacement.result import DisplacementField

FEWEST_DIRECTIONS = 6
# Share of the picture's diagonal that background windows must span for a turn of the camera to be told.
SPREAD = 0.2
# Lines that share an estimate of their power, and how far it must stand above the noise: the mean of five squares of noise
# exceeds three times its variance once in a hundred.
LINES, ABOVE = 5, 3.0
# Frames by which the slope at an end is told, and how many standard deviations it must differ from none.
END, CLEAR = 24, 4.0


def background_windows(field: DisplacementField, regions: Sequence[Region]) -> BoolArray:
    """Return which windows lie wholly in regions that stand still, and see motion."""
    half = field.windows.side / 2
    centres = field.windows.centres
    inside = np.zeros(len(centres), bool)
    for region in regions:
        inside |= region.holds(centres - half) & region.holds(centres + half)
    return inside & (field.windows.sight > BLIND)


def without_shake(field: DisplacementField, still: BoolArray) -> DisplacementField:
    """Return the field less the motion of the camera, by windows that show the fixed background.

    In every frame a translation, and a turn where the background spans enough of the picture, by weighted least squares.

    Raises
    ------
    ToolpointError
        Where the background has fewer than six measured directions.
    """
    values, sigma, window, direction = field.measured()
    used = still[window]
    if used.sum() < FEWEST_DIRECTIONS:
        fail("background", f"{int(used.sum())} measured directions in it", f"must be {FEWEST_DIRECTIONS} at least",
             remedy="a plain wall shows no motion: put a fixed pattern there, or use a stiff tripod")
    centres = field.windows.centres
    middle = centres[still].mean(axis=0)
    length = float(np.ptp(centres, axis=0).max())
    arm = (centres - middle) / max(length, 1.0)
    design = _rows(direction, arm[window])
    turns = float(np.ptp(arm[still], axis=0).max()) > SPREAD
    columns = slice(0, 3 if turns else 2)
    weighted = design[used][:, columns] / sigma[used][:, None]
    motion = np.linalg.lstsq(weighted, (values[:, used] / sigma[used]).T, rcond=None)[0]
    variance = np.diag(np.linalg.inv(weighted.T @ weighted))
    motion = smooth_motion(motion, variance)
    whole = np.zeros((3, len(values)))
    whole[columns] = motion
    shift = np.stack([whole[0][:, None] - whole[2][:, None] * arm[:, 1], whole[1][:, None] + whole[2][:, None] * arm[:, 0]],
                     axis=2)
    size = float(np.ptp(motion[:2], axis=1).max())
    # What the filter lets through of the background's noise, and what it hides of the shake, is at most that noise.
    return replace(field, common=variance[:2]).changed((field.values - shift).astype(np.float32),
                         *([Doubt("camera", f"camera shake of {size:.2f} px peak to peak taken off by the background")]
                           if size > 0.1 else []))


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
