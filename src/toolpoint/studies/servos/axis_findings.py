"""Findings of one axis of a controller's record: friction and following error with intervals, and gaps of the record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.drives.accuracy.axis_record import AxisRecord, AxisSignal
from toolpoint.drives.accuracy.channel_checks import cut_off, disagreements, load_doubts, steps_without_samples, swing_doubts
from toolpoint.drives.accuracy.constant_runs import ConstantRuns, find_constant_runs
from toolpoint.drives.controller.loop_doubts import USUAL_POSITION_GAINS
from toolpoint.drives.friction.steady_line import SteadyLine, fit_steady_line, mean_with_interval

_MAX_RECORD_SAMPLES = 4_000_000  # of one channel, 32 MB; some ten are held side by side
_ROLES = ("position_set", "position", "velocity_set", "velocity", "following_error", "current", "torque")
# Scatter about the line that is doubted, of the dry friction; speed of the fast runs over the largest.
_MAX_SCATTER_FRACTION, _FAST_RUN_RATIO = 0.05, 0.9
# Values below which a record has levels, not steps of rounding.
_MIN_ROUNDED_STEPS = 12
# Share of the following error that changes with direction alone, from which on it is doubted.
_MIN_DIRECTION_FRACTION = 0.02
_NAN = float("nan")
_UNKNOWN = (_NAN, _NAN)

PER_CENT_NOTE = ("the load is in % of what the drive calls 100 % (its rated torque or current): friction and offset are shares "
                 "of it")

@dataclass(frozen=True, eq=False)
class AxisFindings:
    """Findings of one axis.

    runs : of constant speed; velocity_gain : speed over following error, 1/s (K_v where no feed-forward acts), with its 95 %
    interval; friction : None where the runs do not separate dry and viscous part; levels : mean loads forward and backward at
    the largest speed, with intervals; notes : what the record does not show.
    """

    axis: str
    unit: str
    runs: ConstantRuns
    velocity_gain: float
    gain_interval: tuple[float, float]
    largest_following_error: float
    friction: SteadyLine | None
    levels: tuple[float, float]
    level_intervals: tuple[tuple[float, float], tuple[float, float]]
    force_unit: str
    doubts: tuple[Doubt, ...]
    notes: tuple[str, ...] = ()

    def rows(self) -> list[list[str]]:
        """Return axis, quantity and value as words."""
        factor, unit = (180 / np.pi, "deg") if self.unit == "rad" else (1e3, "mm")
        force, (forward, backward) = self.force_unit, self.levels
        fastest = factor * np.abs(self.runs.velocity).max(initial=0)
        rows = [["runs of constant speed", f"{self.runs.velocity.size}, to {fastest:.5g} {unit}/s"]]
        if np.isfinite(self.velocity_gain):
            rows.append(["speed over following error (K_v if no feed-forward acts)",
                         f"{self.velocity_gain:.4g} 1/s{_interval_words(self.gain_interval)}"])
        if np.isfinite(self.largest_following_error):
            rows.append(["largest following error", f"{factor * self.largest_following_error:.6g} {unit}"])
        for name, level, ends in zip(("forward", "backward"), self.levels, self.level_intervals, strict=True):
            if np.isfinite(level):
                rows.append([f"mean load {name} at the largest speed", f"{level:+.4g} {force}{_interval_words(ends)}"])
        line = self.friction
        if line is None and np.isfinite(forward + backward):
            rows += [["half their difference (dry and viscous together)", f"{abs(forward - backward) / 2:.4g} {force}"],
                     ["offset, half their sum", f"{(forward + backward) / 2:+.3g} {force}"]]
        if line is not None:
            per = f"{force} per {'rad/s' if self.unit == 'rad' else 'm/s'}"
            rows += [["dry friction", f"{line.dry:.4g} {force}{_interval_words(line.dry_interval)}"],
                     ["viscous friction", f"{line.slope:.4g} {per}{_interval_words(line.slope_interval)}"],
                     ["offset (weight, preload, zero of the sensor)",
                      f"{line.offset:+.4g} {force}{_interval_words(line.offset_interval)}"]]
        return [[self.axis, *row] for row in rows]

    def to_dict(self) -> dict[str, Any]:
        """Return the findings as plain values, SI; None where the record does not determine them."""
        line = self.friction
        friction = None if line is None else {
            name: {"value": _finite_or_none(value), "interval": [_finite_or_none(end) for end in ends]} for name, value, ends in
            (("dry", line.dry, line.dry_interval), ("viscous", line.slope, line.slope_interval),
             ("offset", line.offset, line.offset_interval))} | {"slowest": line.slowest, "fastest": line.fastest}
        return {"unit": self.unit, "velocity_gain_1_s": _finite_or_none(self.velocity_gain),
                "velocity_gain_interval_1_s": [_finite_or_none(end) for end in self.gain_interval],
                "friction_levels": [_finite_or_none(level) for level in self.levels],
                "friction_level_intervals": [[_finite_or_none(end) for end in ends] for ends in self.level_intervals],
                "friction_unit": self.force_unit, "friction": friction,
                "largest_following_error": _finite_or_none(self.largest_following_error), "doubts": list(self.doubts),
                "notes": list(self.notes)}


def _finite_or_none(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _interval_words(interval: tuple[float, float]) -> str:
    """Return a 95 % interval in brackets, nothing where it is not known."""
    if not np.isfinite(interval).all():
        return ""
    ends = [f"{end:.4g}" for end in interval]
    return f" ({' to '.join(ends)})" if ends[0] != ends[1] else " (its interval is within the last digit)"


def judge_axis(record: AxisRecord, axis: str) -> AxisFindings | None:
    """Return the findings of one axis of a record, None where it holds neither a speed nor a position of it."""
    signals = {role: record.signal(role, axis) for role in _ROLES}
    present = [s for s in signals.values() if s is not None]
    # The finest recorded step, unless the longest record would have too many samples by it.
    step = max(min(float(np.median(np.diff(s.time))) for s in present),
               max(float(s.time[-1]) for s in present) / _MAX_RECORD_SAMPLES)
    # The time that all channels share.
    time = np.arange(max(float(s.time[0]) for s in present), min(float(s.time[-1]) for s in present) + step / 2, step)
    if time.size < 10:
        return None
    speed, measured = _speed(signals, time)
    if speed is None:
        return None
    usable, doubts = steps_without_samples([s for s in record.signals if s.axis == axis], time)
    error = _following_error(signals, time)
    force = signals["current"] or signals["torque"]
    load = np.full(time.size, np.nan) if force is None else force.at(time)
    runs = find_constant_runs(time, speed, load, error=error, usable=usable, measured=measured)
    gain, ends, further_doubts = _gain(runs, _resolution(signals["following_error"] or signals["position"]))
    doubts += [*disagreements(signals, time), *further_doubts]
    unit = next((s.unit.split("/")[0] for s in present if s.unit.split("/")[0] in ("m", "rad")), "m")
    line, levels, further_doubts, notes = _friction(runs, resolution=_resolution(force), unit=unit)
    doubts += further_doubts
    if force is not None:
        actual = _actual_speed(signals, time)
        doubts += cut_off(force) + load_doubts(speed if actual is None else actual, load, time, actual=actual is not None)
        dry = (levels[0][0] - levels[1][0]) / 2 if line is None else line.dry
        doubts += _question_swings(runs, load, time, dry=dry, unit=force.unit)
        notes += [PER_CENT_NOTE] if force.unit == "%" else []
    elif runs.velocity.size:
        notes.append("no current or torque is recorded: nothing is said of friction")
    if not runs.velocity.size:
        doubts.append(Doubt("record", "no run of constant speed in it: no friction and no K_v", "record to and fro at several "
                            f"speeds, each for half a second or more; it lasts {time[-1] - time[0]:.3g} s"))
    # Channels that are not there stay not-a-number.
    largest = float(np.nanmax(np.abs(error))) if np.isfinite(error).any() else _NAN
    (forward, *_), (backward, *_) = levels
    return AxisFindings(axis, unit, runs, gain, ends, largest, line, (forward, backward), (levels[0][1:], levels[1][1:]),
                        "" if force is None else force.unit, tuple(doubts), tuple(notes))


def _question_swings(runs: ConstantRuns, load: FloatArray, time: FloatArray, *, dry: float, unit: str) -> list[Doubt]:
    stretches = [(s, s + d) for s, d in zip(runs.start, runs.duration, strict=True)]
    return swing_doubts(load, time, stretches, dry=dry, unit=unit) if np.isfinite(dry) else []


def _speed(signals: Mapping[str, AxisSignal | None], time: FloatArray) -> tuple[FloatArray | None, bool]:
    """Return the speed, and whether it is measured: the set point, which has no noise, is preferred."""
    if signals["velocity_set"] is not None:
        return signals["velocity_set"].at(time), False
    wish = signals["position_set"]
    if signals["velocity"] is not None and wish is None:
        return signals["velocity"].at(time), True
    position = wish or signals["position"]
    if position is None:
        return None, False
    return np.gradient(np.interp(time, position.time, position.way), time), True


def _actual_speed(signals: Mapping[str, AxisSignal | None], time: FloatArray) -> FloatArray | None:
    """Return the actual speed of the axis, None where set points alone are recorded."""
    velocity, position = signals["velocity"], signals["position"]
    if velocity is not None:
        return velocity.at(time)
    return None if position is None else np.gradient(np.interp(time, position.time, position.way), time)


def _resolution(signal: AxisSignal | None) -> float:
    """Return the least step between values, 0 where they are not rounded."""
    if signal is None:
        return 0.0
    steps = np.diff(np.unique(signal.values))
    # Steps of round-off are no steps of the recording; a quantile keeps one odd value from deciding.
    steps = steps[steps > 1e-9 * max(float(np.abs(signal.values).max()), 1e-300)]
    # Changes of a rounded signal are multiples of its resolution: the small ones are single steps, the smallest may be
    # rounding.
    return float(np.quantile(steps, 0.1)) if _MIN_ROUNDED_STEPS <= steps.size < signal.values.size / 2 else 0.0


def _following_error(signals: Mapping[str, AxisSignal | None], time: FloatArray) -> FloatArray:
    """Return set point less actual, as recorded or from the two positions; a turn of difference is none."""
    recorded, wish, actual = signals["following_error"], signals["position_set"], signals["position"]
    if recorded is not None:
        return recorded.at(time)
    if wish is None or actual is None:
        return np.full(time.size, np.nan)
    error = wish.at(time) - actual.at(time)
    return (error + np.pi) % (2 * np.pi) - np.pi if wish.unit == "rad" else error


def _gain(runs: ConstantRuns, resolution: float) -> tuple[float, tuple[float, float], list[Doubt]]:
    """Return speed over following error with its interval, and doubts on it."""
    kept = np.isfinite(runs.following_error)
    v, e, error = runs.velocity[kept], runs.following_error[kept], runs.following_scatter[kept]
    wander = runs.following_wander[kept]
    if not v.size:
        return _NAN, _UNKNOWN, []
    line = fit_steady_line(v, e, error, wander=wander, resolution=resolution)
    doubts: list[Doubt] = []
    if line is not None:
        share = line.dry / max(abs(line.slope) * line.fastest, 1e-300)
        if abs(share) > _MIN_DIRECTION_FRACTION and line.dry_interval[0] * line.dry_interval[1] > 0:
            doubts.append(Doubt("K_v", f"{100 * abs(share):.0f} % of the following error change with direction, not with speed",
                                "friction in a speed loop without integral part, or lost motion: speed over following error is "
                                "no K_v, and another one at another speed", figure=abs(share)))
    # An interval that holds zero bounds no gain, which is one over it.
    slope, lower, upper = _ratio(v, e, error, wander=wander, resolution=resolution)
    if lower <= 0 <= upper:
        return _NAN, _UNKNOWN, [*doubts, Doubt("K_v", "not told: the following error does not grow with speed",
                                               "feed-forward takes it away, or its step of rounding is too large")]
    gain, ends = 1 / slope, (min(1 / lower, 1 / upper), max(1 / lower, 1 / upper))
    if gain < 0:
        doubts.append(Doubt("K_v", f"is negative ({gain:.3g} 1/s)", "set point and actual exchanged, the sign of the following "
                            "error turned, or feed-forward above 100 %"))
    elif not USUAL_POSITION_GAINS[0] < gain < USUAL_POSITION_GAINS[1]:
        doubts.append(Doubt("K_v", f"{gain:.3g} 1/s is no gain of a machine's axis ({USUAL_POSITION_GAINS[0]:g} to "
                                   f"{USUAL_POSITION_GAINS[1]:g})",
                            "a unit of speed or following error is wrong, channels are apart in time, or feed-forward acts"))
    if line is not None and line.scatter > 0.05 * abs(slope) * line.fastest:
        share = line.scatter / (abs(slope) * line.fastest)
        doubts.append(Doubt("K_v", f"differs by {100 * share:.0f} % between runs", "feed-forward, or other settings",
                            figure=share))
    return gain, ends, doubts


def _ratio(v: FloatArray, e: FloatArray, error: FloatArray, *, wander: FloatArray, resolution: float) -> Level:
    """Return following error over speed of the fastest runs with its interval.

    The mean of both directions is taken: an offset of the error is in neither.
    """
    fast = np.abs(v) > _FAST_RUN_RATIO * np.abs(v).max()
    sides = []
    for is_side in (fast & (v > 0), fast & (v < 0)):
        if is_side.any():
            size = np.abs(v[is_side])
            sides.append(mean_with_interval(e[is_side] / v[is_side], error[is_side] / size,
                                            resolution=resolution / float(size.min()),
                                            wander=float((wander[is_side] / size).max())))
    mean = float(np.mean([side[0] for side in sides]))
    half_width = float(np.sqrt(sum((side[2] - side[0])**2 for side in sides))) / len(sides)
    return mean, mean - half_width, mean + half_width


Level = tuple[float, float, float]


Friction = tuple[SteadyLine | None, tuple[Level, Level], list[Doubt], list[str]]


def _friction(runs: ConstantRuns, *, resolution: float, unit: str) -> Friction:
    """Return the line of the load over speed, the levels at the largest speed with intervals, doubts and notes."""
    kept = np.isfinite(runs.current)
    v, load, error = runs.velocity[kept], runs.current[kept], runs.current_error[kept]
    none = (_NAN, _NAN, _NAN)
    if not v.size:
        return None, (none, none), [], []
    fast = float(np.abs(v).max())
    sides = [(np.abs(v) > _FAST_RUN_RATIO * fast) & (np.sign(v) == sign) for sign in (1, -1)]
    wander = runs.current_wander[kept]
    levels = tuple(mean_with_interval(load[is_side], error[is_side], wander=float(wander[is_side].max()), resolution=resolution)
                   if is_side.any() else none for is_side in sides)
    doubts: list[Doubt] = []
    # Friction resists motion: the load forwards is above that backwards.
    if levels[0][0] < levels[1][0]:
        doubts.append(Doubt("load", "load and speed have opposite signs (a gear that reverses, or the sign of the recording)",
                            "friction and offset are those of the load with its sign turned"))
        load = -load
    line = fit_steady_line(v, load, error, wander=wander, resolution=resolution)
    factor, name = (180 / np.pi, "deg/s") if unit == "rad" else (1e3, "mm/s")
    slow = f"{factor * float(np.abs(v).min()):.3g} {name}"
    notes = [f"no run slower than {slow}: breakaway, the fall of friction at low speed (Stribeck) and presliding are not in "
             "this record"]
    if line is None:
        doubts += _question_single_speed(v, levels)
    else:
        doubts += _line_doubts(line, factor, name)
        if line.slope_interval[1] < 0:
            return None, (levels[0], levels[1]), doubts, notes
        if abs(line.offset) > line.dry:
            notes.append("the offset is larger than the friction: weight or preload, or the sensor's zero; the record cannot "
                         "tell")
    return line, (levels[0], levels[1]), doubts, notes


def _question_single_speed(v: FloatArray, levels: tuple[Level, ...]) -> list[Doubt]:
    """Return doubts about runs of one speed or one direction."""
    if (v > 0).all() or (v < 0).all():
        return [Doubt("friction", "all runs go one way: friction is not told from weight, preload or the sensor's zero",
                      "record both directions")]
    doubts = [Doubt("friction", "all runs have one speed: dry and viscous friction are not told apart",
                    "record runs at several speeds")]
    if levels[0][0] * levels[1][0] > 0:
        doubts.append(Doubt("load", "one sign in both directions", "weight or an offset is larger than the friction"))
    return doubts


def _line_doubts(line: SteadyLine, factor: float, name: str) -> list[Doubt]:
    doubts, dry, slowest = [], max(abs(line.dry), 1e-300), f"{factor * line.slowest:.3g} {name}"
    if line.speeds < 3:
        doubts.append(Doubt("friction", "two speeds only: a line goes through them whether friction is one or not",
                            "dry and viscous part hold if it is; record three speeds or more"))
    if line.excess > 0:
        doubts.append(Doubt("friction", f"below {slowest} up to {line.excess:.3g} above the line of the faster runs (it falls "
                            f"with speed)", f"dry and viscous part hold from {slowest} on; fit a curve to slow runs",
                            figure=line.excess / dry))
    if line.dry_interval[0] <= 0:
        doubts.append(Doubt("friction", "the load does not tell a dry friction above zero", "the load of another axis, too "
                            "few or too short runs, or none there"))
    if line.slope_interval[1] < 0:
        doubts.append(Doubt("friction", "falls with speed over the whole record: dry and viscous part are not told",
                            "record faster runs too (the fall of the Stribeck curve), or it is the load of another axis"))
    if line.scatter > _MAX_SCATTER_FRACTION * abs(line.dry):
        share = line.scatter / dry
        doubts.append(Doubt("friction", f"does not fit: runs scatter about the line by {100 * share:.0f} % of the dry friction",
                            "friction depends on more than speed (place, temperature, load), or another law is needed",
                            figure=share))
    return doubts
