"""What records of a controller say of its axes: friction, K_v, following error, loop margins, positioning."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.ndimage import find_objects, label, maximum_filter1d, minimum_filter1d

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.drives.accuracy.axis_record import AxisRecord, AxisSignal, PositioningRun, names_of
from toolpoint.drives.accuracy.metrology import Positioning, positioning
from toolpoint.drives.friction.identification import FrictionFit, identify_friction
from toolpoint.drives.simulation.loop_identification import LoopResponse
from toolpoint.studies.text_table import text_table

# A run of constant speed: at least this long (s), speed within this share of the largest, first part left out while it settles.
_SHORTEST, _CONSTANT, _SETTLES = 0.1, 0.005, 0.3
_MOST_SAMPLES = 4_000_000


@dataclass(frozen=True, eq=False)
class ConstantRuns:
    """Runs of constant speed of an axis: velocity (m/s or rad/s), duration (s), means of current (A; or torque) and following
    error (m or rad) and the standard deviation of the current; (n_runs,) each, not-a-number where there is no such signal."""

    velocity: FloatArray
    duration: FloatArray
    current: FloatArray
    scatter: FloatArray
    following_error: FloatArray


@dataclass(frozen=True, eq=False)
class AxisFindings:
    """One axis: its runs of constant speed, K_v (1/s) with its scatter, largest following error, friction, doubts."""

    axis: str
    unit: str
    runs: ConstantRuns
    velocity_gain: float
    gain_scatter: float
    largest_following_error: float
    friction: FrictionFit | None
    levels: tuple[float, float]
    force_unit: str
    doubts: tuple[Doubt, ...]


@dataclass(frozen=True, eq=False)
class ServoData(NotebookText):
    """Findings of a file: axes of a record, or the positioning of a run, or the margins of a measured loop."""

    source: str
    axes: tuple[AxisFindings, ...] = ()
    positioning: Positioning | None = None
    loop: LoopResponse | None = None
    notes: tuple[str, ...] = ()
    signals: tuple[str, ...] = field(default=())

    @property
    def status(self) -> str:
        """What to doubt first."""
        return "; ".join(self.doubts()) or "no doubt"

    def doubts(self) -> list[Doubt]:
        """Return what may be wrong, axis by axis."""
        loop = [self.loop.margins.doubt] if self.loop is not None and self.loop.margins.doubt else []
        return [doubt.within(f"axis {a.axis}") for a in self.axes for doubt in a.doubts] + loop

    def rows(self) -> list[list[str]]:
        """Return axis, quantity and value as words."""
        rows = [row for axis in self.axes for row in _axis_rows(axis)]
        if self.positioning is not None:
            rows += [["", line[:8].strip(), line[8:].strip()] for line in self.positioning.table().splitlines()]
        if self.loop is not None:
            m = self.loop.margins
            rows += [["", "gain margin", f"{m.gain_db:.1f} dB at {m.phase_crossover:.4g} Hz"],
                     ["", "phase margin", f"{m.phase:.1f} deg at {m.gain_crossover:.4g} Hz"],
                     ["", "bandwidth (-3 dB)", f"{self.loop.bandwidth:.4g} Hz"]]
        return rows

    def table(self) -> str:
        """Return doubts and notes, then the quantities."""
        first = mark_notes(self.doubts()) + [f"note: {words}" for words in self.notes]
        return "\n".join([*first, text_table(self.source, ["axis", "quantity", "value"], self.rows())])

    def to_dict(self) -> dict[str, Any]:
        """Return the findings as plain values, SI."""
        axes = {a.axis: {"unit": a.unit, "velocity_gain_1_s": a.velocity_gain, "friction_levels": list(a.levels),
                         "friction_unit": a.force_unit, "friction_status": None if a.friction is None else a.friction.status,
                         "friction_trusted": a.friction is not None and a.friction.is_trusted,
                         "largest_following_error": a.largest_following_error, "doubts": list(a.doubts)} for a in self.axes}
        p, m = self.positioning, None if self.loop is None else self.loop.margins
        return {"axes": axes, "notes": list(self.notes), "status": self.status,
                "positioning_m": None if p is None else {"A": p.accuracy, "E": p.systematic, "R": p.repeatability,
                                                        "B": p.reversal},
                "margins": None if m is None else {"gain_db": m.gain_db, "gain_hz": m.phase_crossover, "phase_deg": m.phase,
                                                   "phase_hz": m.gain_crossover}}


def judge_servo_data(data: AxisRecord | PositioningRun | LoopResponse, *, source: str = "") -> ServoData:
    """Return what a record of a controller, a positioning run or a measured loop says of the axes.

    Raises
    ------
    ToolpointError
        For a record in which no signal of an axis is known, with the signals that it holds.
    """
    if isinstance(data, PositioningRun):
        targets = data.targets[:, None]
        return ServoData(source or data.source, positioning=positioning(data.forward - targets, data.backward - targets))
    if isinstance(data, LoopResponse):
        return ServoData(source, loop=data)
    axes = [_judge_axis(data, axis) for axis in data.axes]
    axes = [axis for axis in axes if axis is not None]
    if not axes:
        names = "; ".join(names_of(data.signals))
        raise ToolpointError(f"record: no axis with a velocity or a position; its signals are {names}; "
                             "name columns like 'v set', 'pos', 'current' and give their units")
    return ServoData(source or data.source, tuple(a for a in axes if a is not None), notes=data.notes,
                     signals=tuple(names_of(data.signals)))


def _judge_axis(record: AxisRecord, axis: str) -> AxisFindings | None:
    signals = {role: record.signal(role, axis) for role in
               ("position_set", "position", "velocity_set", "velocity", "following_error", "current", "torque")}
    known = [s for s in signals.values() if s is not None]
    step = max(min(float(np.median(np.diff(s.time))) for s in known),
               max(float(s.time[-1]) for s in known) / _MOST_SAMPLES)
    time = np.arange(max(float(s.time[0]) for s in known), min(float(s.time[-1]) for s in known) + step / 2, step)
    speed = _speed(signals, time)
    if speed is None or time.size < 10:
        return None
    error = _following_error(signals, time)
    force = signals["current"] or signals["torque"]
    load = np.full(time.size, np.nan) if force is None else force.at(time)
    runs = _constant_runs(time, speed, load, error=error)
    gains = runs.velocity / np.where(np.abs(runs.following_error) > 0, runs.following_error, np.nan)
    gains = gains[np.isfinite(gains)]
    friction, levels, doubts = _friction(runs)
    gain, spread = (float(np.median(gains)), float(np.std(gains))) if gains.size else (np.nan, np.nan)
    if gains.size and spread > 0.05 * abs(gain):
        doubts.append(Doubt("K_v", f"differs by {100 * spread / abs(gain):.0f} % between runs",
                            "feed-forward, or other settings", figure=spread / abs(gain)))
    if not runs.velocity.size:
        doubts.append(Doubt("record", "no run of constant speed in it: no friction and no K_v"))
    unit = next((s.unit.split("/")[0] for s in known if s.unit.split("/")[0] in ("m", "rad")), "m")
    largest = float(np.nanmax(np.abs(error))) if np.isfinite(error).any() else float("nan")
    return AxisFindings(axis, unit, runs, gain, spread, largest, friction, levels, "" if force is None else force.unit,
                        tuple(doubts))


def _speed(signals: Mapping[str, AxisSignal | None], time: FloatArray) -> FloatArray | None:
    for role in ("velocity_set", "velocity"):
        signal = signals[role]
        if signal is not None:
            return signal.at(time)
    position = signals["position_set"] or signals["position"]
    return None if position is None else np.gradient(np.interp(time, position.time, position.values), time)


def _following_error(signals: Mapping[str, AxisSignal | None], time: FloatArray) -> FloatArray:
    """Return set point less actual, as recorded or from the two positions; a turn of difference is none."""
    recorded, wish, actual = signals["following_error"], signals["position_set"], signals["position"]
    if recorded is not None:
        return recorded.at(time)
    if wish is None or actual is None:
        return np.full(time.size, np.nan)
    error = wish.at(time) - actual.at(time)
    return (error + np.pi) % (2 * np.pi) - np.pi if wish.unit == "rad" else error


def _constant_runs(time: FloatArray, speed: FloatArray, load: FloatArray, *, error: FloatArray) -> ConstantRuns:
    """Return the means over every stretch in which the speed stays the same and is not zero."""
    step, top = float(time[1] - time[0]), float(np.abs(speed).max())
    width = max(3, round(_SHORTEST / step / 2) * 2 + 1)
    same = maximum_filter1d(speed, width) - minimum_filter1d(speed, width) <= 2 * _CONSTANT * top
    stretch, number = label(same & (np.abs(speed) > 0.02 * top))
    rows = []
    places = [place[0] for place in find_objects(stretch)]
    for k in range(1, number + 1):
        at = np.arange(places[k - 1].start, places[k - 1].stop)
        at = at[round(_SETTLES * at.size):]
        if at.size * step < _SHORTEST / 2 or at.size < 3:
            continue
        rows.append((speed[at].mean(), at.size * step, load[at].mean(), load[at].std(), error[at].mean()))
    table = np.array(rows, float).reshape(-1, 5)
    return ConstantRuns(*table.T)


def _friction(runs: ConstantRuns) -> tuple[FrictionFit | None, tuple[float, float], list[Doubt]]:
    """Return the fit where speeds differ, the mean levels forward and backward, and doubts."""
    v, load = runs.velocity, runs.current
    usable = np.isfinite(load)
    v, load = v[usable], load[usable]
    if not v.size:
        return None, (float("nan"), float("nan")), []
    fast = float(np.abs(v).max())
    top = np.abs(v) > 0.9 * fast
    levels = tuple(float(load[top & (np.sign(v) == sign)].mean()) if (top & (np.sign(v) == sign)).any() else float("nan")
                   for sign in (1, -1))
    doubts: list[Doubt] = []
    if np.isfinite(levels).all() and levels[0] < levels[1]:
        doubts.append(Doubt("load", "load and speed have opposite signs (a gear that reverses, or the sign of the recording)",
                            "friction is that of the load with its sign turned"))
        load = -load
    speeds = np.unique(np.round(np.abs(v) / fast, 2))
    if speeds.size < 2:
        doubts.append(Doubt("friction", "all runs have one speed: dry and viscous friction are not told apart",
                            "record runs at several speeds"))
        if np.isfinite(levels).all() and levels[0] * levels[1] > 0:
            doubts.append(Doubt("load", "one sign in both directions", "weight or an offset is larger than the friction"))
        return None, (levels[0], levels[1]), doubts
    fit = identify_friction(v, load, "coulomb")
    doubts += fit.doubts
    if abs(fit.offset) > fit.law.coulomb:
        doubts.append(Doubt("load", "the offset is larger than the friction", "weight, or the sensor's zero"))
    return fit, (levels[0], levels[1]), doubts


def _axis_rows(a: AxisFindings) -> list[list[str]]:
    factor, unit = (180 / np.pi, "deg") if a.unit == "rad" else (1e3, "mm")
    forward, backward = a.levels
    middle = (forward + backward) / 2
    fastest = factor * np.abs(a.runs.velocity).max(initial=0)
    rows = [[a.axis, "runs of constant speed", f"{a.runs.velocity.size}, to {fastest:.5g} {unit}/s"]]
    if np.isfinite(a.velocity_gain):
        rows.append([a.axis, "gain of the position loop K_v", f"{a.velocity_gain:.1f} 1/s (scatter {a.gain_scatter:.2g})"])
    if np.isfinite(a.largest_following_error):
        rows.append([a.axis, "largest following error", f"{factor * a.largest_following_error:.6g} {unit}"])
    if np.isfinite(forward) or np.isfinite(backward):
        rows.append([a.axis, "mean load forward, backward", f"{forward:+.4g}, {backward:+.4g} {a.force_unit}"])
        rows.append([a.axis, "half their difference, and offset",
                     f"{abs(forward - backward) / 2:.4g}, {middle:+.3g} {a.force_unit}"])
    if a.friction is not None:
        law = a.friction.law
        rows.append([a.axis, "friction: dry, offset, residual", f"{law.coulomb:.4g}, {a.friction.offset:+.4g}, "
                     f"{a.friction.residual:.2g} {a.force_unit} ({a.friction.status.split(':')[0]})"])
    return rows
