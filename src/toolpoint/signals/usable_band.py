r"""The part of measured lines that can be believed: above where integrated accelerations drift, below where noise takes over.

Noise is the stated variance, else the third differences along the lines; its share of the responses is looked at in windows of
lines, the median over the responses, and over the root of their number where there are many: a mode that all share stands
out of noise that hides it in each. From the strongest window the band grows to both sides until several windows in a row are
mostly noise (antiresonances are narrower). Drift is loud but rough: a window at the low end whose accelerance is a small part
of the strongest one's and whose noise is not small does not belong to the band.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.vibration.frf import Frf

WINDOW, FEWEST = 0.006, 16  # of the lines in a window; at least so many
NOISY, IN_A_ROW = 0.25, 4  # share of noise; windows in a row that end the band
CLEAR_AGAIN = 2  # windows in a row behind a gap of noise that belong to the band again: a narrow mode fills no more
FEW = 5  # responses; more of them show a mode through more noise
ROUGH, FAINT = 0.1, 0.05  # at the low end: noise above the first and accelerance below the second share
CLEAR, HIDDEN = 0.1, 0.05  # noise in a window whose peak counts; noise of the receptance over the highest peak, at the end
_POWER = {"receptance": 2, "mobility": 1, "accelerance": 0}


@dataclass(frozen=True)
class UsableBand:
    """Lowest and highest line (Hz) to be believed, and why each is where it is (empty: the end of the lines)."""

    low: float
    high: float
    notes: tuple[str, ...] = ()

    @property
    def ends(self) -> tuple[float, float]:
        """Both ends, Hz."""
        return self.low, self.high


def usable_band(frf: Frf, excited: float | None = None) -> UsableBand:
    """Return the band of responses of one pose that can be believed; `excited`: where the force ends, Hz, if known."""
    lines = frf.frequency
    first = int(np.searchsorted(lines, np.nextafter(0, 1)))
    size = max(FEWEST, round(WINDOW * lines.size))
    starts = np.arange(first, lines.size - size + 1, size)
    top = float(lines[-1]) if excited is None else min(excited, float(lines[-1]))
    if starts.size < 3:
        return UsableBand(float(lines[first]), top, _force_note(excited, lines))
    share, level = _looked_at(frf, starts, size)
    below = lines[starts] < top
    loudest = int(np.argmax(np.where(below, level * (share < NOISY), 0.0)))
    low, high = _grown(share, loudest)
    # What an accelerometer says is not integrated: only noise that hides the response counts as drift there.
    drift, notes = _drift_end(share, level, loudest, NOISY if frf.quantity == "accelerance" else ROUGH), []
    if max(low, drift) > 0:
        why = (f"noise is more than {100 * NOISY:.0f} % of the responses there" if low >= drift else
               "noise and the drift of integrated accelerations are what they show")
        notes.append(f"lines below {lines[starts[max(low, drift)]]:.4g} Hz are left out: {why}")
    low = max(low, drift)
    end = float(lines[-1]) if high == starts.size - 1 else float(lines[starts[high] + size - 1])
    if end < float(lines[-1]) and end < top:
        notes.append(f"lines above {end:.4g} Hz are left out: noise is more than {100 * NOISY:.0f} % of the responses there")
    elif excited is not None and top < float(lines[-1]):
        notes += _force_note(excited, lines)
    return UsableBand(float(lines[starts[low]]) if low else float(lines[first]), min(end, top), tuple(notes))


def find_compliant_band(frf: Frf, band: UsableBand) -> UsableBand:
    """Return the band of a driving point for questions of compliance (limits of cuts), from the `usable_band` of its lines.

    Its low end is where the noise of the receptance is a small part of the highest peak: soft modes far below fast ones are
    faint in the accelerance, and lines between them, where noise hides the little that is there, do no harm.
    """
    lines = frf.frequency
    first = int(np.searchsorted(lines, np.nextafter(0, 1)))
    size = max(FEWEST, round(WINDOW * lines.size))
    starts = np.arange(first, int(np.searchsorted(lines, band.high)) - size + 1, size)
    if starts.size < 3:
        return band
    share, _ = _looked_at(frf, starts, size)
    values = np.abs(frf.values.reshape(lines.size, -1)[:, 0]) / (2 * np.pi * np.maximum(lines, lines[first])) ** (
        2 - _POWER[frf.quantity])
    peak = np.array([values[start:start + size].max() for start in starts])
    noise = share * np.array([np.sqrt((values[start:start + size] ** 2).mean()) for start in starts])
    clear = share < CLEAR
    if not clear.any():
        return band
    highest = int(np.argmax(np.where(clear, peak, 0.0)))
    hidden = np.flatnonzero(noise[:highest] > HIDDEN * peak[highest])
    low = float(lines[starts[int(hidden[-1]) + 1 if hidden.size else 0]])
    kept = [note for note in band.notes if not note.startswith("lines below")]
    notes = [f"lines below {low:.4g} Hz are left out: noise is more than {100 * HIDDEN:g} % of the highest peak of the "
             "receptance there"] if hidden.size else []
    return UsableBand(low, max(band.high, low), (*notes, *kept))


def _force_note(excited: float | None, lines: FloatArray) -> tuple[str, ...]:
    if excited is None or excited >= lines[-1]:
        return ()
    return (f"lines above {excited:.4g} Hz are left out: the force is 20 dB down there (a harder tip excites more)",)


def _looked_at(frf: Frf, starts: np.ndarray, size: int) -> tuple[FloatArray, FloatArray]:
    """Return of every window the share of noise (median over responses, less where they are many) and the level, both as
    accelerance."""
    factor = (frf.omega ** _POWER[frf.quantity])[:, None]
    values = frf.values.reshape(frf.frequency.size, -1) * factor
    variance = None if frf.variance is None else frf.variance.reshape(frf.frequency.size, -1) * factor**2
    share, level = np.empty(starts.size), np.empty(starts.size)
    for k, start in enumerate(starts.tolist()):
        part = values[start:start + size]
        power = np.maximum((np.abs(part) ** 2).mean(axis=0), 1e-300)
        noise = _differences(part) if variance is None else variance[start:start + size].mean(axis=0)
        share[k] = float(np.median(np.sqrt(noise / power)) / np.sqrt(max(part.shape[1] / FEW, 1.0)))
        level[k] = float(np.median(np.sqrt(power)))
    return share, level


def _differences(part: np.ndarray) -> FloatArray:
    """Return the noise power of every response from third differences (1, -3, 3, -1: twenty times the power)."""
    return (np.abs(np.diff(part, 3, axis=0)) ** 2).mean(axis=0) / 20


def _drift_end(share: FloatArray, level: FloatArray, loudest: int, limit: float) -> int:
    """Return the first window above the drift at the low end: all windows below are faint, and most of them rough.

    Several smooth windows in a row are no drift but a structure that moves: a machine on its feet is faint, as accelerance,
    beside its spindle.
    """
    faint = level[:loudest] < FAINT * level[loudest]
    run = int(np.argmin(faint)) if not faint.all() else loudest
    smooth = _runs(share[:run] <= limit, IN_A_ROW)
    rough = share[:int(smooth[0]) if smooth.size else run] > limit
    ends = [k + 1 for k in np.flatnonzero(rough).tolist() if 2 * rough[:k + 1].sum() >= k + 1]
    return max(ends, default=0)


def _grown(share: FloatArray, start: int) -> tuple[int, int]:
    """Return the ends of the band about its strongest window, grown over gaps behind which responses stand out again.

    A gap of noise between two resonances is an antiresonance that the sensor cannot resolve: what lies behind it is a mode like
    any other. Behind the end of the force there is nothing but noise, whose share stays near one.
    """
    low = high = start
    for step in (-1, 1):
        at = start
        while (after := _next_clear(share, at, step)) is not None:
            at = after
        low, high = (at, high) if step < 0 else (low, at)
    return low, high


def _next_clear(share: FloatArray, at: int, step: int) -> int | None:
    """Return the next window outwards that belongs to the band, or None: one within reach of the last, or the first of a clear
    stretch behind a gap."""
    outwards = share[at + step::step] if at + step >= 0 else share[:0]
    clear = outwards <= NOISY
    near = np.flatnonzero(clear[:IN_A_ROW])
    if near.size:
        return int(at + step * (near[0] + 1))
    for first in _runs(clear, CLEAR_AGAIN).tolist():
        if outwards[first:first + CLEAR_AGAIN].min() <= ROUGH:
            return int(at + step * (first + 1))
    return None


def _runs(true: np.ndarray, length: int) -> np.ndarray:
    """Return where runs of at least this length begin, at every place of a longer one."""
    return np.flatnonzero(np.convolve(true, np.ones(length), "valid") == length) if true.size >= length else np.zeros(0, int)
