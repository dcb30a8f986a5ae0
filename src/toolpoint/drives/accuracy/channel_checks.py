"""Consistency of the channels of a record: units, signs, names, times, gaps, limits; each doubt with its ratio."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.ndimage import label, uniform_filter1d

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.drives.accuracy.axis_record import AxisSignal

Signals = Mapping[str, AxisSignal | None]
_SAME_QUANTITY_RATIO_TOLERANCE = 0.02  # of the ratio of two channels of one quantity
_MIN_CHANNEL_CORRELATION = 0.9  # of the rates of two channels of one axis
_SAME_QUANTITY_MAX_DELAY = 0.01  # s, between two channels of one quantity
# Set point and actual agree less well: a slow loop rounds what it follows. Wrong units are factors of 6 and more.
_FOLLOWING_RATIO_TOLERANCE = 0.1
# Channels may be this many samples apart: of a following error of few milliseconds that is a large share.
_MAX_SAMPLES_APART = 3
_MIN_GAP_STEPS, _MIN_GAP_DURATION = 8.0, 0.05  # usual steps, and s: a time without samples longer than both is a gap
_MAX_SEARCHED_LAG = 0.4  # s
_MAX_CLIPPED_FRACTION, _MIN_CLIPPED_ROW = 0.02, 5  # of the samples at the largest value; samples of a row that counts
_FACTORS = {60.0: "per minute against per second", 1e3: "mm against m", 25.4: "inch against mm", 180 / np.pi: "deg against rad",
            9.549297: "rev/min against rad/s", 6.0: "rev/min against deg/s", 360.0: "revolutions against deg"}
# What should go together; the first two are one quantity, the others set points and what follows.
_PAIRS = (("velocity", "position"), ("velocity_set", "velocity"), ("position_set", "velocity_set"),
          ("position_set", "position"), ("velocity_set", "position"), ("position_set", "velocity"))
_WORDS = {"velocity_set": "speed set", "velocity": "speed", "position_set": "position set", "position": "position",
          "following_error": "following error"}


def steps_without_samples(signals: Sequence[AxisSignal], time: FloatArray) -> tuple[np.ndarray, list[Doubt]]:
    """Return at which times the record holds samples, (n,), and a doubt that says where it does not.

    A time without a new sample of any signal is a gap; one signal alone may hold its value.
    """
    times = np.unique(np.concatenate([s.time for s in signals]))
    steps = np.diff(times)
    usual = float(np.median(np.diff(max(signals, key=lambda s: s.time.size).time)))
    gaps = np.flatnonzero(steps > max(_MIN_GAP_STEPS * usual, _MIN_GAP_DURATION))
    usable = np.ones(time.size, bool)
    for k in gaps:
        usable &= ~((time > times[k] - usual) & (time < times[k + 1] + usual))
    if not gaps.size:
        return usable, []
    return usable, [Doubt("record", f"{gaps.size} gaps without samples, the longest {steps[gaps].max():.3g} s",
                          "runs that reach into them are left out; largest values may be missing",
                          figure=float(steps[gaps].sum() / np.ptp(times)))]


def disagreements(signals: Signals, time: FloatArray) -> list[Doubt]:
    """Return doubts where channels that follow from each other disagree: by ratio, by sign, by time, or at all."""
    speeds = {role: _rate(signals[role], time, differenced=role.startswith("position"))
              for role in ("velocity_set", "velocity", "position_set", "position") if signals[role] is not None}
    doubts = []
    for a, b in _PAIRS:
        if a in speeds and b in speeds:
            doubts += _compare_rates(_WORDS[a], _WORDS[b], speeds[a], speeds[b], step=float(time[1] - time[0]),
                                     together=(a, b) == _PAIRS[0])
    return [*doubts, *_error_against(signals, speeds, time)]


def _rate(signal: AxisSignal | None, time: FloatArray, *, differenced: bool) -> FloatArray:
    assert signal is not None
    # Differences of quantised positions are steps of resolution over sample time: the mean over 50 ms is compared.
    width = max(round(0.05 / float(time[1] - time[0])), 1)
    if not differenced:
        return uniform_filter1d(signal.at(time), width)
    return uniform_filter1d(np.gradient(np.interp(time, signal.time, signal.way), time), width)


def _compare_rates(a: str, b: str, first: FloatArray, second: FloatArray, *, step: float, together: bool) -> list[Doubt]:
    lag, correlation, slope = _best_lag(first, second, step)
    if not np.isfinite(correlation) or np.ptp(first) == 0 or np.ptp(second) == 0:
        idle = a if np.ptp(first) == 0 else b
        return [Doubt(f"{a} and {b}", f"the {idle} stands still while the other moves", "channels of two axes, or a dead one")]
    if abs(correlation) < _MIN_CHANNEL_CORRELATION:
        return [Doubt(f"{a} and {b}", f"do not go together (correlation {correlation:.2f})",
                      "channels of two axes, or exchanged", figure=1 - abs(correlation))]
    doubts = []
    if slope < 0:
        doubts.append(Doubt(f"{a} and {b}", "have opposite signs", "one is recorded with its sign turned", figure=1.0))
    if abs(abs(slope) - 1) > (_SAME_QUANTITY_RATIO_TOLERANCE if together else _FOLLOWING_RATIO_TOLERANCE):
        doubts.append(Doubt(f"{a} and {b}", f"do not fit: the {b} changes {_ratio_words(abs(slope))} times as much "
                            f"as the {a} says",
                            f"a unit or the sample time is wrong{_unit_words(abs(slope))}", figure=abs(abs(slope) - 1)))
    if together and abs(lag) > max(_SAME_QUANTITY_MAX_DELAY, 3 * step):
        doubts.append(Doubt(f"{a} and {b}", f"are {1e3 * abs(lag):.0f} ms apart, one quantity twice",
                            "channels recorded at different times: K_v and following error hold that time too",
                            figure=abs(lag)))
    elif not together and lag < -max(_SAME_QUANTITY_MAX_DELAY, 3 * step):
        doubts.append(Doubt(f"{a} and {b}", f"the {b} is {-1e3 * lag:.0f} ms before the {a}",
                            "exchanged, or recorded at different times", figure=-lag))
    return doubts


def _ratio_words(ratio: float) -> str:
    return f"{ratio:.4g}" if ratio >= 1e-3 else f"{ratio:.2e}"


def _unit_words(ratio: float) -> str:
    """Return the pair of units that a ratio points to."""
    return next((f" ({words})" for factor, words in _FACTORS.items()
                 if min(abs(ratio / factor - 1), abs(ratio * factor - 1)) < _SAME_QUANTITY_RATIO_TOLERANCE), "")


def _best_lag(first: FloatArray, second: FloatArray, step: float) -> tuple[float, float, float]:
    """Return the lag of the second behind the first (s), their correlation there, and the slope of second over first."""
    a, b = first - first.mean(), second - second.mean()
    size = float(np.sqrt((a**2).sum() * (b**2).sum()))
    if size == 0:
        return 0.0, float("nan"), float("nan")
    # Twice as long as the record, or the correlation of its end with its begin would be added.
    fft_size = 1 << int(np.ceil(np.log2(2 * a.size)))
    product = np.fft.irfft(np.fft.rfft(b, fft_size) * np.fft.rfft(a, fft_size).conj(), fft_size)
    reach = min(round(_MAX_SEARCHED_LAG / step), a.size // 3)
    lags = np.arange(-reach, reach + 1)
    candidates = product[lags]
    best = int(lags[int(np.argmax(np.abs(candidates)))])
    c, d = (a[:a.size - best], b[best:]) if best >= 0 else (a[-best:], b[:best])
    together = float((c * d).sum())
    return best * step, together / float(np.sqrt((c**2).sum() * (d**2).sum())), together / float((c**2).sum())


def _error_against(signals: Signals, speeds: Mapping[str, FloatArray], time: FloatArray) -> list[Doubt]:
    """Return a doubt where the recorded following error is not set point less actual, by integration of the other channels."""
    recorded = signals["following_error"]
    set_speed = speeds.get("velocity_set", speeds.get("position_set"))
    actual = speeds.get("position", speeds.get("velocity"))
    if recorded is None or set_speed is None or actual is None:
        return []
    width = max(round(0.05 / float(time[1] - time[0])), 1)
    rate = np.gradient(uniform_filter1d(recorded.at(time), width), time)
    _, correlation, slope = _best_lag(uniform_filter1d(set_speed - actual, width), uniform_filter1d(rate, width),
                                        float(time[1] - time[0]))
    if not np.isfinite(correlation) or abs(correlation) < _MIN_CHANNEL_CORRELATION:
        return []  # an error too small to be seen in the difference of two speeds
    if slope < 0:
        return [Doubt("following error", "has the sign opposite to set point less actual", "its sign is turned, or set and "
                      "actual are exchanged", figure=1.0)]
    error_difference = float(np.abs(recorded.at(time)).max()) * abs(1 - 1 / slope) / max(float(np.abs(set_speed).max()), 1e-300)
    sampled = max(float(np.median(np.diff(s.time))) for s in signals.values() if s is not None)
    if not 0.5 < slope < 2 and error_difference > _MAX_SAMPLES_APART * sampled:
        return [Doubt("following error", f"is {_ratio_words(slope)} times the set point less the actual",
                      f"a unit is wrong{_unit_words(slope)}", figure=abs(slope - 1))]
    return []


def load_doubts(speed: FloatArray, load: FloatArray, time: FloatArray, *, actual: bool) -> list[Doubt]:
    """Return doubts on a load: later than the speed of its axis, or of another axis.

    The load is taken as steps with the direction, a part with speed and one with acceleration, at every lag in turn; the lag
    that fits best is that of the recording. A set point is before the axis: only an `actual` speed can tell.
    """
    step = float(time[1] - time[0])
    # Loads and speeds of axes change over tens of milliseconds: finer samples cost time in every one of the lags and tell
    # nothing.
    stride = max(1, round(4e-3 / step))
    width = max(round(0.02 / step), 1)
    v = uniform_filter1d(speed, width)[::stride]
    y = uniform_filter1d(load, width)[::stride]
    a = np.gradient(v, step * stride)
    moving = np.abs(v) > 0.01 * np.abs(v).max()
    columns = np.column_stack([np.where(moving, np.sign(v), 0.0), v, a, np.ones(v.size)])
    reach = min(round(_MAX_SEARCHED_LAG / (step * stride)), v.size // 4)
    unexplained_by_lag = np.array([_unexplained(columns, moving, y, shift=shift) for shift in range(-reach, reach + 1)])
    if not np.isfinite(unexplained_by_lag).any():
        return []
    best, now = int(np.nanargmin(unexplained_by_lag)) - reach, unexplained_by_lag[reach]
    doubts = []
    lag = best * step * stride
    if (actual and unexplained_by_lag[best + reach] < 0.5 and now - unexplained_by_lag[best + reach] > 0.05
            and abs(lag) > max(0.02, 3 * step)):
        doubts.append(Doubt("load", f"{1e3 * abs(lag):.0f} ms {'behind' if lag > 0 else 'before'} the speed",
                            "channels recorded at different times: means over short runs are mixed with standstill",
                            figure=abs(lag)))
    unexplained = float(unexplained_by_lag[best + reach])
    if unexplained > 0.5:
        doubts.append(Doubt("load", f"speed, direction and acceleration explain {100 * (1 - unexplained):.0f} % of it only",
                            "the load of another axis, cutting, or a force that depends on the place", figure=unexplained))
    return doubts


def _unexplained(columns: FloatArray, moving: np.ndarray, load: FloatArray, *, shift: int) -> float:
    """Return the share of the load's variance that the motion `shift` samples before does not explain, while it moves."""
    n = load.size
    c, m = (columns[:n - shift], moving[:n - shift]) if shift >= 0 else (columns[-shift:], moving[-shift:])
    y = load[shift:] if shift >= 0 else load[:shift]
    c, y = c[m], y[m]
    total = float(((y - y.mean())**2).sum()) if y.size > 8 else 0.0
    if total == 0:
        return float("nan")
    return float(((y - c @ np.linalg.lstsq(c, y, rcond=None)[0])**2).sum()) / total


def swing_doubts(load: FloatArray, time: FloatArray, runs: Sequence[tuple[float, float]], *, dry: float, unit: str
                 ) -> list[Doubt]:
    """Return a doubt where the load swings at one frequency by more than half the friction while the speed is constant; `runs`
    are their first and last times."""
    if not runs:
        return []
    begin, end = max(runs, key=lambda ends: ends[1] - ends[0])
    inside = (time >= begin) & (time <= end)
    y = load[inside] - load[inside].mean()
    if y.size < 32:
        return []
    lines = np.abs(np.fft.rfft(y * np.hanning(y.size))) * 4 / y.size
    k = int(np.argmax(lines[2:])) + 2
    if not lines[k] > 0.5 * abs(dry):
        return []
    hertz = k / (y.size * float(time[1] - time[0]))
    return [Doubt("load", f"swings by ±{lines[k]:.3g} {unit} at {hertz:.3g} Hz while the speed is constant",
                  "a resonance, a ripple of the motor, or another axis moves; it may hide friction",
                  figure=float(lines[k] / max(abs(dry), 1e-300)))]


def cut_off(signal: AxisSignal) -> list[Doubt]:
    """Return a doubt where a signal stands still at its largest size while it moves elsewhere: the end of a range."""
    y = signal.values
    largest = float(np.abs(y).max())
    is_moving = np.abs(np.diff(y)) > 0
    if largest == 0 or is_moving.mean() < 0.3:
        return []
    rows, number = label(np.abs(y) >= largest * (1 - 1e-9))
    if not number:
        return []
    row_lengths = np.bincount(rows)[1:]
    share = float(row_lengths[row_lengths >= _MIN_CLIPPED_ROW].sum() / y.size)
    if share < _MAX_CLIPPED_FRACTION:
        return []
    return [Doubt("load", f"{100 * share:.0f} % of its samples stand at ±{largest:.4g} {signal.unit}",
                  "a limit was reached (of the drive or of the recording): friction and levels are too small", figure=share)]
