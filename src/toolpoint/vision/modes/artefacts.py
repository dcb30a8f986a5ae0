"""Lines that the camera's work makes of true modes: images by compression, sidebands of shake, a mode that is seen twice."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import find_peaks

from toolpoint._check import FloatArray
from toolpoint.vibration import Modes
from toolpoint.vision.displacement.background import CameraMotion

# Compressed frames alternate in kind, mostly every second and fourth: images at these shares of the frame rate, less or plus f.
ALTERNATIONS = (0.5, 0.25)
# How much weaker than its mode: an image, a mode seen twice, a sideband of shake, a line by errors of following.
IMAGE, TWICE, SIDEBAND, FOLLOWING = 1.0, 0.2, 0.15, 0.015
# Lines of the camera's motion that count: share of the largest, how many, highest multiple of one in a sideband.
SHAKE_SHARE, SHAKE_LINES, SHAKE_TIMES = 0.2, 4, 2


def shake_lines(camera: CameraMotion | None, frame_rate: float) -> tuple[float, ...]:
    """Return the frequencies (Hz) of the camera's motion, the strongest first; none where it kept still."""
    if camera is None:
        return ()
    motion = camera.motion[:2]
    window = np.hanning(motion.shape[1])
    size = np.abs(np.fft.rfft((motion - motion.mean(axis=1, keepdims=True)) * window, axis=1)).max(axis=0)
    size[0] = 0.0
    at = find_peaks(size, height=SHAKE_SHARE * size.max())[0]
    order = at[np.argsort(-size[at])][:SHAKE_LINES]
    return tuple((order * frame_rate / motion.shape[1]).tolist())


def name_artefacts(modes: Modes, names: Sequence[str], frame_rate: float, *, resolution: float, is_lossy: bool,
                   shake: Sequence[float] = ()) -> tuple[str, ...]:
    """Return the names with those modes named that the camera's work may have made of stronger ones.

    modes : with shapes in one unit; names : empty for a mode so far; resolution : width of a line of the record, Hz.
    """
    strength = np.abs(modes.shape).max(axis=0)
    half = np.full(modes.count, resolution) if modes.covariance is None else np.nan_to_num(
        modes.frequency_interval, nan=resolution, posinf=resolution)
    result = list(names)
    for i in np.argsort(strength).tolist():
        if result[i]:
            continue
        for j in np.argsort(-strength).tolist():
            if strength[j] <= strength[i] or result[j]:
                continue
            result[i] = _artefact(modes, i, j, float(strength[i] / strength[j]), half=half, frame_rate=frame_rate,
                                  resolution=resolution, is_lossy=is_lossy, shake=shake)
            if result[i]:
                break
    return tuple(result)


def _artefact(modes: Modes, i: int, j: int, share: float, *, half: FloatArray, frame_rate: float, resolution: float,
              is_lossy: bool, shake: Sequence[float]) -> str:
    """Return what of mode j mode i may be, `share` times as strong; empty where nothing speaks for it."""
    f, g = float(modes.frequency[i]), float(modes.frequency[j])
    text = f"mode {j + 1} ({g:.4g} Hz)"
    near = max(resolution, float(half[i]), 0.005 * f)
    if is_lossy and share < IMAGE and min(min(abs(f - abs(part * frame_rate - g)), abs(f - part * frame_rate - g))
                                          for part in ALTERNATIONS) < max(near, 0.01 * g):
        return f"image of {text}: compressed frames alternate in kind"
    if share < SIDEBAND and any(abs(abs(f - g) - times * line) < near
                                for line in shake for times in range(1, SHAKE_TIMES + 1)):
        return f"sideband of {text} by the camera's shake"
    if share < TWICE and abs(f - g) < float(half[i] + half[j]):
        return f"doubtful: {text} seen twice, its interval holds that frequency"
    if share < SIDEBAND and any(abs(f - times * line) < near for line in shake for times in range(1, SHAKE_TIMES + 1)):
        return "the camera's shake"
    if share < FOLLOWING:
        return f"doubtful: faint beside {text}, errors of following make such lines"
    return ""
