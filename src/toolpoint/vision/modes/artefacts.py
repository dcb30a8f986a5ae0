"""Spectral lines that the camera makes of true modes: images by compression, sidebands of shake, modes seen twice."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from scipy.signal import find_peaks

from toolpoint._check import FloatArray
from toolpoint.vibration import Modes
from toolpoint.vision.displacement.background import CameraMotion

# Compressed frames alternate in kind, mostly every second and fourth: images at these shares of the frame rate, less or plus f.
ALTERNATION_FRACTIONS = (0.5, 0.25)
# Largest strength over that of its mode: an image, a mode seen twice, a sideband of shake, a line by errors of tracking.
MAX_IMAGE_RATIO, MAX_TWIN_RATIO, MAX_SIDEBAND_RATIO, MAX_TRACKING_RATIO = 1.0, 0.2, 0.15, 0.015
SPLIT_LINES = 2.0  # of the spectrum: two modes nearer than this in a compressed clip may be one
# Of a line at the camera's own frequency, which its motion makes and no mode: over the strongest mode that is none of it.
MAX_SHAKE_RATIO = 0.25
# Lines of the camera's motion that count: share of the largest, number of lines, highest multiple of one in a sideband.
MIN_SHAKE_LINE_FRACTION, MAX_SHAKE_LINES, MAX_SHAKE_MULTIPLE = 0.2, 4, 2


def shake_lines(camera: CameraMotion | None, frame_rate: float) -> tuple[float, ...]:
    """Return the frequencies (Hz) of the camera's motion, the strongest first; none where it kept still."""
    if camera is None:
        return ()
    motion = camera.motion[:2]
    window = np.hanning(motion.shape[1])
    size = np.abs(np.fft.rfft((motion - motion.mean(axis=1, keepdims=True)) * window, axis=1)).max(axis=0)
    size[0] = 0.0
    peaks = find_peaks(size, height=MIN_SHAKE_LINE_FRACTION * size.max())[0]
    strongest = peaks[np.argsort(-size[peaks])][:MAX_SHAKE_LINES]
    return tuple((strongest * frame_rate / motion.shape[1]).tolist())


def name_artefacts(modes: Modes, names: Sequence[str], frame_rate: float, *, resolution: float, is_lossy: bool,
                   shake: Sequence[float] = ()) -> tuple[str, ...]:
    """Return the names with those modes named that the camera's work may have made of stronger ones.

    modes : with shapes in one unit; names : empty for a mode so far; resolution : width of a line of the record, Hz.
    """
    strength = np.abs(modes.shape).max(axis=0)
    half_width = np.full(modes.count, resolution) if modes.covariance is None else np.nan_to_num(
        modes.frequency_interval, nan=resolution, posinf=resolution)
    result = list(names)
    for i in np.argsort(strength).tolist():
        if result[i]:
            continue
        for j in np.argsort(-strength).tolist():
            if strength[j] <= strength[i] or result[j]:
                continue
            result[i] = _artefact(modes, i, j, float(strength[i] / strength[j]), half_width=half_width, frame_rate=frame_rate,
                                  resolution=resolution, is_lossy=is_lossy, shake=shake)
            if result[i]:
                break
    return tuple(_name_split_modes(modes, result, resolution) if is_lossy else result)


def _name_split_modes(modes: Modes, names: Sequence[str], resolution: float) -> list[str]:
    """Return the names with both of two unnamed modes doubted that lie within two lines of each other in a compressed clip."""
    result = list(names)
    for i, j in combinations([k for k in range(modes.count) if not names[k]], 2):
        if abs(modes.frequency[i] - modes.frequency[j]) < SPLIT_LINES * resolution:
            for k, other in ((i, j), (j, i)):
                result[k] = (f"doubtful: within two lines of the spectrum of mode {other + 1} "
                             f"({modes.frequency[other]:.4g} Hz); compression can split one mode in two")
    return result


def _artefact(modes: Modes, i: int, j: int, strength_ratio: float, *, half_width: FloatArray, frame_rate: float,
              resolution: float,
              is_lossy: bool, shake: Sequence[float]) -> str:
    """Return what of mode j mode i may be, `strength_ratio` times as strong; empty where nothing speaks for it."""
    f, g = float(modes.frequency[i]), float(modes.frequency[j])
    text = f"mode {j + 1} ({g:.4g} Hz)"
    # Whichever is least exact: the lines, the pole, or the rate of the camera, which is stated to some tenths of a per
    # cent.
    tolerance = max(resolution, float(half_width[i]), 0.005 * f)
    if is_lossy and strength_ratio < MAX_IMAGE_RATIO and min(min(abs(f - abs(fraction * frame_rate - g)),
                                                                 abs(f - fraction * frame_rate - g))
                                                             for fraction in ALTERNATION_FRACTIONS) < max(tolerance, 0.01 * g):
        return f"image of {text}: compressed frames alternate in kind"
    if strength_ratio < MAX_SIDEBAND_RATIO and any(abs(abs(f - g) - times * line) < tolerance
                                                   for line in shake for times in range(1, MAX_SHAKE_MULTIPLE + 1)):
        return f"sideband of {text} by the camera's shake"
    if strength_ratio < MAX_TWIN_RATIO and abs(f - g) < float(half_width[i] + half_width[j]):
        return f"doubtful: {text} seen twice, its interval holds that frequency"
    if strength_ratio < MAX_SHAKE_RATIO and any(abs(f - times * line) < tolerance for line in shake
                                                   for times in range(1, MAX_SHAKE_MULTIPLE + 1)):
        return "the camera's shake"
    if strength_ratio < MAX_TRACKING_RATIO:
        return f"doubtful: faint beside {text}, errors of following make such lines"
    return ""
