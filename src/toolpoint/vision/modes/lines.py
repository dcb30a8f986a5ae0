"""Lines that are no modes (lamps, harmonics, steady forces), and the true frequencies behind an alias."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from toolpoint._check import BoolArray, ComplexArray, FloatArray
from toolpoint.vibration import Modes
from toolpoint.vision.modes.decay import LINE_LOG_ODDS, FreeDecay

MAINS_FREQUENCIES = (50.0, 60.0)  # Hz
MAX_STEADY_DAMPING = 5e-4  # damping ratio below which a line is driven
COMBINATION_STRENGTH_RATIO = 10.0  # of two modes over the line at their sum or difference
MAX_COMBINATION_WIDTH = 0.02  # of that frequency: a wider interval may hold a mode of its own
MOTION_HARMONICS = (2, 3)  # times the frequency of a mode: large motion shows squared and cubed
SIDE_LOBE_LINES = 24  # lines of the spectrum: side lobes of the window around a strong one
# Share of its frequency by which a harmonic may be off its multiple, whatever its interval.
HARMONIC_TOLERANCE = 0.001
# The same for a line so much fainter than its mode: errors of the strong one pull it by more than its interval.
FAINT_STRENGTH_RATIO, FAINT_TOLERANCE = 20.0, 0.003
# Grey level below which a block tells nothing of the light; share of the mean change of light that half of the blocks have.
MIN_BLOCK_BRIGHTNESS, MIN_COMMON_LIGHT_FRACTION = 8.0, 0.4
# Logarithm by which a decay must fall within the record to be none of a steady line, by its whole interval.
MIN_LOG_DECREASE = 1.0


def lamp_lines(brightness: FloatArray, frame_rate: float) -> tuple[float, ...]:
    """Return the frequencies (Hz) of lines in the brightness of whole frames that stand out of its noise, strongest first."""
    n = len(brightness)
    window = np.hanning(n)
    power = np.abs(np.fft.rfft((brightness - brightness.mean()) * window)) ** 2
    first_line = max(3, int(20 * n / frame_rate))
    upper_power = power[first_line:]
    if upper_power.size < 8:
        return ()
    level = np.median(upper_power) / np.log(2)
    lines: list[float] = []
    for k in np.argsort(-upper_power):
        if upper_power[k] < 4 * (np.log(upper_power.size) + LINE_LOG_ODDS) * level or len(lines) == 4:
            break
        f = _interpolated(power, int(k) + first_line) * frame_rate / n
        # The window's own side lobes stand around a strong line.
        if all(abs(f - other) > SIDE_LOBE_LINES * frame_rate / n for other in lines):
            lines.append(f)
    return tuple(lines)


def lamps_everywhere(lamps: Sequence[float], means: FloatArray, frame_rate: float) -> tuple[float, ...]:
    """Return the lines that half of the picture shares: a lamp lights all of it, motion changes the light at edges only.

    means : (frames, rows, columns) of blocks of pixels.
    """
    flat = means.reshape(len(means), -1).astype(float)
    flat = flat[:, flat.mean(axis=0) > MIN_BLOCK_BRIGHTNESS]
    if not lamps or not flat.size:
        return tuple(lamps)
    relative = (flat / flat.mean(axis=0) - 1) * np.hanning(len(flat))[:, None]
    times = np.arange(len(flat)) / frame_rate
    kept = []
    for lamp in lamps:
        size = np.exp(-2j * np.pi * lamp * times) @ relative
        mean = size.mean()
        if float(np.median((size * mean.conj()).real)) > MIN_COMMON_LIGHT_FRACTION * abs(mean) ** 2:
            kept.append(lamp)
    return tuple(kept)


def _interpolated(power: FloatArray, k: int) -> float:
    if not 0 < k < power.size - 1:
        return float(k)
    a, b, c = np.log(np.maximum(power[k - 1:k + 2], 1e-300))
    return k + 0.5 * (a - c) / (a - 2 * b + c) if a - 2 * b + c < 0 else float(k)


def name_line(frequency: float, frame_rate: float) -> str:
    """Return what a lamp line is: twice the mains, or what that is seen as at this frame rate."""
    for mains in MAINS_FREQUENCIES:
        for multiple in (2, 4, 6):
            true_frequency = multiple * mains
            alias = abs(true_frequency - frame_rate * round(true_frequency / frame_rate))
            # Mains wander by some tenths of a hertz, and a camera's rate by as much as its clock.
            if abs(alias - frequency) < max(0.6, 0.004 * frequency):
                return f"lamp line, {true_frequency:g} Hz of {mains:g} Hz mains" + ("" if true_frequency < frame_rate / 2
                                                                                    else ", aliased")
    return "lamp line"


def fading(modes: Modes, resolution: float) -> BoolArray:
    """Return which modes fade beyond doubt within the record: a lamp and what is driven do not.

    resolution : width of a line of the record, Hz. The amplitude falls by e to the power of -2 pi ratio f / resolution.
    """
    ratio = modes.damping_ratio if modes.covariance is None else modes.damping_ratio - np.nan_to_num(modes.damping_interval,
                                                                                                     nan=np.inf)
    return np.asarray(2 * np.pi * ratio * modes.frequency / resolution > MIN_LOG_DECREASE)


def lamps_alone(lamps: Sequence[float], modes: Modes, frame_rate: float, *, resolution: float) -> tuple[float, ...]:
    """Return the lines of brightness that no fading mode explains: bodies that move towards the camera or over a bright wall
    change the brightness of the whole picture at their own frequencies."""
    fading_frequencies = modes.frequency[fading(modes, resolution)]
    return tuple(lamp for lamp in lamps if name_line(lamp, frame_rate) != "lamp line" or not fading_frequencies.size
                 or np.abs(fading_frequencies - lamp).min() > 0.5 * resolution)


def name_modes(modes: Modes, lamps: Sequence[float], frame_rate: float, *, resolution: float) -> tuple[str, ...]:
    """Return for every identified mode what it may be instead of a mode of the machine, empty where nothing speaks for it.

    resolution : width of a line of the record, Hz.
    """
    is_fading = fading(modes, resolution)
    names = []
    for i in range(modes.count):
        f, ratio = float(modes.frequency[i]), float(modes.damping_ratio[i])
        near_lamp = next((lamp for lamp in lamps if abs(lamp - f) < max(2 * resolution, 0.01 * f)), None)
        harmonic = _harmonic(modes, i) or _combination(modes, i)
        if near_lamp is not None and not is_fading[i]:
            names.append(name_line(near_lamp, frame_rate))
        elif harmonic or _sideband(modes, i, lamps):
            names.append(harmonic or _sideband(modes, i, lamps))
        elif ratio < MAX_STEADY_DAMPING:
            names.append("steady line: something drives it (spindle, pump, mains), no decay")
        else:
            names.append("")
    return tuple(names)


def alias_candidates(frequency: float, frame_rate: float) -> tuple[float, float]:
    """Return the two lowest frequencies above half the frame rate that would be seen at this one."""
    return frame_rate - frequency, frame_rate + frequency


def _harmonic(modes: Modes, i: int) -> str:
    """Return the remark on mode i with n times the frequency and decay of a stronger mode: large motion shows squared."""
    strength = np.abs(modes.shape).max(axis=0)
    for j in range(modes.count):
        if j == i or strength[j] < 5 * strength[i]:
            continue
        for n in MOTION_HARMONICS:
            width = max(0.015 * n * modes.frequency[j], n * modes.damping_ratio[j] * modes.frequency[j])
            if modes.covariance is not None:  # a mode of its own near the multiple is told by its interval
                combined_interval = modes.frequency_interval[i] + n * modes.frequency_interval[j]
                tolerance = FAINT_TOLERANCE if strength[j] > FAINT_STRENGTH_RATIO * strength[i] else HARMONIC_TOLERANCE
                width = min(width, max(2 * combined_interval, tolerance * n * modes.frequency[j]))
            if abs(modes.frequency[i] - n * modes.frequency[j]) < width:
                return f"{n} times mode {j + 1} ({modes.frequency[j]:.4g} Hz): a harmonic of large motion"
    return ""


def _combination(modes: Modes, i: int) -> str:
    """Return the remark on mode i at the sum or difference of two far stronger modes, which decays about as fast as they do.

    The product of two decays falls with the sum of their rates; the fit of so faint a line rarely tells its rate better than by
    a factor of two.
    """
    if modes.covariance is None:
        return ""
    strength, f, decay = np.abs(modes.shape).max(axis=0), modes.frequency, modes.damping_ratio * modes.frequency
    interval = np.nan_to_num(modes.frequency_interval, nan=np.inf)
    stronger = np.flatnonzero(strength > COMBINATION_STRENGTH_RATIO * strength[i]).tolist()
    for j, k in combinations(stronger, 2):
        width = max(2 * (interval[i] + interval[j] + interval[k]), HARMONIC_TOLERANCE * (f[j] + f[k]))
        for word, place in (("difference", abs(f[j] - f[k])), ("sum", f[j] + f[k])):
            if (abs(f[i] - place) < min(width, MAX_COMBINATION_WIDTH * place)
                    and 0.5 * max(decay[j], decay[k]) < decay[i] < 2 * (decay[j] + decay[k])):
                return f"{word} of modes {j + 1} and {k + 1} ({f[j]:.4g} and {f[k]:.4g} Hz): a product of large motion"
    return ""


def _sideband(modes: Modes, i: int, lamps: Sequence[float]) -> str:
    """Return the remark on mode i beside a lamp line by the frequency of a stronger mode: light times motion."""
    strength = np.abs(modes.shape).max(axis=0)
    f = modes.frequency
    for j in np.flatnonzero(strength > 3 * strength[i]):
        for lamp in lamps:
            if min(abs(f[i] - abs(lamp - f[j])), abs(f[i] - lamp - f[j])) < max(0.01 * f[i], 0.5):
                return f"sideband of the lamp line at {lamp:.4g} Hz and mode {j + 1}"
    return ""


def find_break(decay: FreeDecay, poles: ComplexArray) -> tuple[int, float]:
    """Return the frame after which one set of amplitudes fits least well with those before, and by how much (chi-squared).

    Two separate decays explain a clip better than one where frames were dropped or repeated, or at a second blow. The gain
    is chi-squared with two degrees of freedom for every mode and component if nothing is wrong.
    """
    n = len(decay.components)
    waves = np.exp(poles * (np.arange(n) / decay.frame_rate)[:, None])
    columns = np.concatenate([waves.real, -waves.imag], axis=1)
    size = columns.shape[1]
    joint_fit = _explained_power(columns.T @ columns, columns.T @ decay.components)
    best = (0, 0.0)
    # A part shorter than its slowest mode's period and a half fits drift as well as a break.
    slowest = 1.5 * decay.frame_rate * 2 * np.pi / float(np.abs(poles.imag).min())
    min_part_frames = max(24, 2 * size, min(int(slowest), n // 3))
    for k in range(min_part_frames, n - min_part_frames, max(1, n // 240)):
        parts = [_explained_power(part.T @ part, part.T @ values)
                 for part, values in ((columns[:k], decay.components[:k]), (columns[k:], decay.components[k:]))]
        gain = sum(parts) - joint_fit
        if gain > best[1]:
            best = (k + decay.first, float(gain))
    return best


def _explained_power(gram: FloatArray, moments: FloatArray) -> float:
    """Return the squared length that columns explain, from their normal equations."""
    scale = 1 / np.sqrt(np.maximum(np.diagonal(gram), 1e-300))
    matrix = gram * scale[:, None] * scale + 1e-9 * np.eye(len(gram))
    right = moments * scale[:, None]
    return float((right * np.linalg.solve(matrix, right)).sum())
