r"""Band of measured lines that can be believed: above the drift of integrated accelerations, below the noise.

Noise is the stated variance, else the third differences along the lines. Its fraction of the responses is computed in windows
of lines, as the median over the responses, divided by the root of their number where there are many: a mode that all share is
visible in noise that hides it in each. From the strongest window the band grows to both sides until several windows in a row
are mostly noise (antiresonances are narrower). Drift is loud but rough: a window at the low end whose accelerance is a small
part of the strongest one's and whose noise is not small does not belong to the band.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.vibration.frf import Frf

WINDOW_FRACTION, MIN_WINDOW_LINES = 0.006, 16  # of all lines, in a window; at least so many
MAX_NOISE_FRACTION, NOISY_WINDOW_COUNT = 0.25, 4  # of the responses; windows in a row above it that end the band
CLEAR_WINDOW_COUNT = 2  # in a row behind a gap of noise that belong to the band again: a narrow mode fills no more
FEW_RESPONSES = 5  # more of them show a mode through more noise
MIN_DRIFT_NOISE, MAX_DRIFT_LEVEL = 0.1, 0.05  # of drift: noise fraction; accelerance over that of the strongest window
MIN_PEAK_PLACE = 3  # of the lines of a window, from which its largest receptance is a peak
QUIET_QUANTILE = 0.25  # of the third differences of a window, by which its noise is told from a narrow resonance
MAX_PEAK_NOISE, MAX_HIDING_NOISE = 0.1, 0.05  # noise fraction where a peak counts; noise at the low end over that peak
_ACCELERANCE_POWER = {"receptance": 2, "mobility": 1, "accelerance": 0}


@dataclass(frozen=True)
class UsableBand:
    """Lowest and highest line (Hz) to be believed, and the reason for each end (none: the end of the lines)."""

    low: float
    high: float
    notes: tuple[str, ...] = ()

    @property
    def ends(self) -> tuple[float, float]:
        """Both ends, Hz."""
        return self.low, self.high


def usable_band(frf: Frf, excited: float | None = None) -> UsableBand:
    """Return the band of responses of one pose that can be believed; `excited` is the end of the force's band, Hz, if known."""
    lines = frf.frequency
    first = int(np.searchsorted(lines, np.nextafter(0, 1)))
    size = max(MIN_WINDOW_LINES, round(WINDOW_FRACTION * lines.size))
    starts = np.arange(first, lines.size - size + 1, size)
    highest = float(lines[-1]) if excited is None else min(excited, float(lines[-1]))
    if starts.size < 3:
        return UsableBand(float(lines[first]), highest, _force_note(excited, lines))
    noise_fraction, level = _measure_windows(frf, starts, size)
    roughness = noise_fraction if frf.variance is not None else np.minimum(noise_fraction, _peak_fractions(frf, starts, size))
    is_excited = lines[starts] < highest
    strongest = int(np.argmax(np.where(is_excited, level * (noise_fraction < MAX_NOISE_FRACTION), 0.0)))
    first_window, last_window = _grow_band(noise_fraction, strongest)
    # An accelerance is not integrated: only noise that hides the response counts as drift there.
    drift, notes = _drift_end(roughness, level, strongest, MAX_NOISE_FRACTION if frf.quantity == "accelerance"
                              else MIN_DRIFT_NOISE), []
    if max(first_window, drift) > 0:
        why = (f"noise is more than {100 * MAX_NOISE_FRACTION:.0f} % of the responses there" if first_window >= drift else
               "noise and the drift of integrated accelerations are what they show")
        notes.append(f"lines below {lines[starts[max(first_window, drift)]]:.4g} Hz are left out: {why}")
    first_window = max(first_window, drift)
    end = float(lines[-1]) if last_window == starts.size - 1 else float(lines[starts[last_window] + size - 1])
    if end < float(lines[-1]) and end < highest:
        notes.append(f"lines above {end:.4g} Hz are left out: noise is more than {100 * MAX_NOISE_FRACTION:.0f} % of the "
                     "responses there")
    elif excited is not None and highest < float(lines[-1]):
        notes += _force_note(excited, lines)
    return UsableBand(float(lines[starts[first_window]]) if first_window else float(lines[first]), min(end, highest),
                      tuple(notes))


def find_compliant_band(frf: Frf, band: UsableBand) -> UsableBand:
    """Return the band of a driving point for questions of compliance (limits of cuts), from the `usable_band` of its lines.

    Its low end is where the noise of the receptance is a small part of the highest peak: soft modes far below fast ones are
    faint in the accelerance, and noisy lines between them, where the receptance is small, do no harm.
    """
    lines = frf.frequency
    first = int(np.searchsorted(lines, np.nextafter(0, 1)))
    size = max(MIN_WINDOW_LINES, round(WINDOW_FRACTION * lines.size))
    starts = np.arange(first, int(np.searchsorted(lines, band.high)) - size + 1, size)
    if starts.size < 3:
        return band
    noise_fraction, _ = _measure_windows(frf, starts, size)
    values = _receptance_windows(frf, starts, size)[..., 0]
    peak = values.max(axis=1)
    if frf.variance is None:
        noise_fraction = np.where(_has_peak(values), _quiet_fractions(frf, starts, size)[:, 0], noise_fraction)
    noise = noise_fraction * np.sqrt((values**2).mean(axis=1))
    is_clear = noise_fraction < MAX_PEAK_NOISE
    if not is_clear.any():
        return band
    highest = int(np.argmax(np.where(is_clear, peak, 0.0)))
    hiding = np.flatnonzero(noise[:highest] > MAX_HIDING_NOISE * peak[highest])
    frequency_min = float(lines[starts[int(hiding[-1]) + 1 if hiding.size else 0]])
    other_notes = [note for note in band.notes if not note.startswith("lines below")]
    notes = [f"lines below {frequency_min:.4g} Hz are left out: noise is more than {100 * MAX_HIDING_NOISE:g} % of the "
             "highest peak of the receptance there"] if hiding.size else []
    return UsableBand(frequency_min, max(band.high, frequency_min), (*notes, *other_notes))


def _force_note(excited: float | None, lines: FloatArray) -> tuple[str, ...]:
    """Return the note on lines above the end of the force's band."""
    if excited is None or excited >= lines[-1]:
        return ()
    return (f"lines above {excited:.4g} Hz are left out: the force is 20 dB down there (a harder tip excites more)",)


def _measure_windows(frf: Frf, starts: np.ndarray, size: int) -> tuple[FloatArray, FloatArray]:
    """Return the noise fraction of every window (median over responses, less where they are many) and its level, as
    accelerance.
    """
    factor = (frf.omega ** _ACCELERANCE_POWER[frf.quantity])[:, None]
    values = frf.values.reshape(frf.frequency.size, -1) * factor
    variance = None if frf.variance is None else frf.variance.reshape(frf.frequency.size, -1) * factor**2
    # Windows follow each other without a gap, so that all are taken at once: two medians a window were most of the time.
    lines = slice(int(starts[0]), int(starts[0]) + starts.size * size)
    windows = values[lines].reshape(starts.size, size, -1)
    power = np.maximum((np.abs(windows) ** 2).mean(axis=1), 1e-300)
    noise = _noise_power(windows) if variance is None else variance[lines].reshape(starts.size, size, -1).mean(axis=1)
    noise_fraction = np.median(np.sqrt(noise / power), axis=1) / np.sqrt(max(values.shape[1] / FEW_RESPONSES, 1.0))
    return noise_fraction, np.median(np.sqrt(power), axis=1)


def _receptance_windows(frf: Frf, starts: np.ndarray, size: int) -> FloatArray:
    """Return the magnitudes of the receptances in every window, (n_windows, size, n_responses)."""
    lines = slice(int(starts[0]), int(starts[0]) + starts.size * size)
    factor = (2 * np.pi * np.maximum(frf.frequency, frf.frequency[starts[0]])) ** (_ACCELERANCE_POWER[frf.quantity] - 2)
    values = np.abs(frf.values.reshape(frf.frequency.size, -1)) * factor[:, None]
    return np.asarray(values[lines].reshape(starts.size, size, -1))


def _has_peak(windows: FloatArray) -> np.ndarray:
    """Return whether each window's largest receptance is a peak inside (lines along axis 1).

    What falls from the first lines of a window on may be drift, which a resonance inside is not.
    """
    return np.asarray(windows.argmax(axis=1) >= MIN_PEAK_PLACE)


def _peak_fractions(frf: Frf, starts: np.ndarray, size: int) -> FloatArray:
    """Return the noise fraction of the quieter lines of every window (median over responses) where most of them have a peak
    inside, else infinity."""
    has_peak = _has_peak(_receptance_windows(frf, starts, size)).mean(axis=1) >= 0.5
    return np.where(has_peak, np.median(_quiet_fractions(frf, starts, size), axis=1), np.inf)


def _quiet_fractions(frf: Frf, starts: np.ndarray, size: int) -> FloatArray:
    """Return the noise fraction of every window and response, (n_windows, n_responses), by its quieter lines.

    A resonance of few lines has third differences of its own, about its peak alone: by their mean the softest mode of a tip
    counts as noise, which is in all lines of a window.
    """
    values = frf.values.reshape(frf.frequency.size, -1) * (frf.omega ** _ACCELERANCE_POWER[frf.quantity])[:, None]
    windows = values[int(starts[0]):int(starts[0]) + starts.size * size].reshape(starts.size, size, -1)
    differences = np.abs(np.diff(windows, 3, axis=1)) ** 2 / 20
    # Squared differences of noise are exponentially distributed: their quantile q is -log(1 - q) of their mean.
    noise = np.quantile(differences, QUIET_QUANTILE, axis=1) / -np.log1p(-QUIET_QUANTILE)
    power = np.maximum((np.abs(windows) ** 2).mean(axis=1), 1e-300)
    return np.asarray(np.sqrt(noise / power))


def _noise_power(windows: np.ndarray) -> FloatArray:
    """Return the noise power (n_windows, n_responses) from third differences (1, -3, 3, -1: twenty times the power)."""
    return (np.abs(np.diff(windows, 3, axis=1)) ** 2).mean(axis=1) / 20


def _drift_end(noise_fraction: FloatArray, level: FloatArray, strongest: int, limit: float) -> int:
    """Return the first window above the drift at the low end: all windows below are faint, and most of them noisy.

    Several smooth windows in a row are no drift but motion of the structure: a machine on its feet is faint, as accelerance,
    beside its spindle.
    """
    is_faint = level[:strongest] < MAX_DRIFT_LEVEL * level[strongest]
    faint_count = int(np.argmin(is_faint)) if not is_faint.all() else strongest
    smooth_runs = _find_runs(noise_fraction[:faint_count] <= limit, NOISY_WINDOW_COUNT)
    is_rough = noise_fraction[:int(smooth_runs[0]) if smooth_runs.size else faint_count] > limit
    ends = [k + 1 for k in np.flatnonzero(is_rough).tolist() if 2 * is_rough[:k + 1].sum() >= k + 1]
    return max(ends, default=0)


def _grow_band(noise_fraction: FloatArray, start: int) -> tuple[int, int]:
    """Return the ends of the band about its strongest window, grown over gaps behind which responses stand out again.

    A gap of noise between two resonances is an antiresonance that the sensor cannot resolve; behind it is a mode like any
    other. Behind the end of the force there is only noise, whose fraction stays near one.
    """
    first_window = last_window = start
    for step in (-1, 1):
        window = start
        while (next_window := _next_clear(noise_fraction, window, step)) is not None:
            window = next_window
        first_window, last_window = (window, last_window) if step < 0 else (first_window, window)
    return first_window, last_window


def _next_clear(noise_fraction: FloatArray, window: int, step: int) -> int | None:
    """Return the next window outwards that belongs to the band, or None.

    It is one within reach of the last, or the first of a clear stretch behind a gap.
    """
    outwards = noise_fraction[window + step::step] if window + step >= 0 else noise_fraction[:0]
    is_clear = outwards <= MAX_NOISE_FRACTION
    within_reach = np.flatnonzero(is_clear[:NOISY_WINDOW_COUNT])
    if within_reach.size:
        return int(window + step * (within_reach[0] + 1))
    for first in _find_runs(is_clear, CLEAR_WINDOW_COUNT).tolist():
        if outwards[first:first + CLEAR_WINDOW_COUNT].min() <= MIN_DRIFT_NOISE:
            return int(window + step * (first + 1))
    return None


def _find_runs(mask: np.ndarray, length: int) -> np.ndarray:
    """Return the begins of runs of at least this length, with every place of a longer one."""
    return np.flatnonzero(np.convolve(mask, np.ones(length), "valid") == length) if mask.size >= length else np.zeros(0, int)
