"""Records of controllers: intervals hold what they were made with, wrong channels are doubted, what is not told is said."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from toolpoint.drives.accuracy.axis_record import AxisRecord, AxisSignal, PositioningRun
from toolpoint.drives.friction.steady_line import fit_steady_line
from toolpoint.drives.simulation.loop_identification import LoopResponse
from toolpoint.studies import judge_servo_data

STEP, GAIN = 2e-3, 40.0
DRY, VISCOUS, OFFSET = 1.5, 4.0, 0.3
UNITS = {"position": "m", "position_set": "m", "velocity": "m/s", "velocity_set": "m/s", "current": "A", "following_error": "m"}


def profile(speeds, hold=0.6, ways=(1, -1)):
    """Return set speeds of trapezes to and fro with pauses, m/s."""
    ramp = np.linspace(0, 1, 50)
    move = np.concatenate([np.zeros(60), ramp, np.ones(round(hold / STEP)), ramp[::-1]])
    return np.concatenate([v * way * move for v in speeds for way in ways] + [np.zeros(150)])


def channels(rng, speeds=(0.02, 0.05, 0.1, 0.2), noise=0.02, **more):
    """Return time and SI values of every channel: an axis that lags by 1/GAIN, friction and inertia in its current."""
    wish = profile(speeds, **more)
    time = STEP * np.arange(wish.size)
    decay = np.exp(-STEP * GAIN)
    speed = scipy.signal.lfilter([1 - decay], [1, -decay], wish)
    position_set, position = np.cumsum(wish) * STEP, np.cumsum(speed) * STEP
    current = DRY * np.tanh(speed / 2e-4) + VISCOUS * speed + OFFSET + 0.1 * np.gradient(speed, time)
    current = current + noise * rng.standard_normal(time.size)
    return time, {"position": position, "position_set": position_set, "velocity": speed, "velocity_set": wish,
                  "current": current, "following_error": position_set - position}


def judged(time, values, roles=("velocity", "position_set", "position", "current")):
    signals = tuple(AxisSignal(role, UNITS[role], role, "X", time, np.asarray(values[role], float)) for role in roles)
    return judge_servo_data(AxisRecord(signals)).axes[0]


def test_a_true_record_is_not_doubted_and_says_what_it_cannot_tell():
    axis = judged(*channels(np.random.default_rng(0)))
    assert axis.doubts == ()
    assert any("Stribeck" in note and "20 mm/s" in note for note in axis.notes)
    assert axis.gain_interval[0] <= axis.velocity_gain <= axis.gain_interval[1]
    assert axis.velocity_gain == pytest.approx(GAIN, rel=0.05)  # the lag of a sampled first-order axis: 1/GAIN less half a step


@pytest.mark.slow
def test_intervals_hold_what_the_record_was_made_with():
    """95 % of random records; noise that is filtered, so that samples hang together."""
    rng, inside = np.random.default_rng(3), []
    for _ in range(60):
        time, values = channels(rng, np.sort(rng.uniform(0.01, 0.3, int(rng.integers(3, 6)))), noise=0.0)
        rough = scipy.signal.lfilter([0.1], [1, -0.9], rng.standard_normal(time.size)) * rng.uniform(0.02, 0.3)
        values["current"] = values["current"] + rough
        line = judged(time, values).friction
        if line is not None:
            inside += [low <= truth <= high for truth, (low, high) in
                       ((DRY, line.dry_interval), (VISCOUS, line.slope_interval), (OFFSET, line.offset_interval))]
    assert len(inside) > 120 and 0.9 < np.mean(inside) <= 1.0


def late(values, by):
    return np.r_[np.full(by, values[0]), values[:-by]]


SLIPS = {
    "a unit of position": (lambda v, r: {"position": 1e3 * v["position"], "position_set": 1e3 * v["position_set"]},
                           "mm against m"),
    "a unit of speed": (lambda v, r: {"velocity": 60 * v["velocity"]}, "per minute against per second"),
    "the sign of the position": (lambda v, r: {"position": -v["position"]}, "opposite signs"),
    "set point and position exchanged": (lambda v, r: {"position": v["position_set"], "position_set": v["position"]},
                                         "K_v: is negative"),
    "the sign of the current": (lambda v, r: {"current": -v["current"]}, "load and speed have opposite signs"),
    "the current of another axis": (lambda v, r: {"current": r.permutation(v["current"].reshape(-1, 10)).ravel()},
                                    "explain"),
    "the position of another axis": (lambda v, r: {"position": v["position"][::-1] ** 2}, "do not go together"),
    "a late current": (lambda v, r: {"current": late(v["current"], 60)}, "ms behind the speed"),
    "a late position": (lambda v, r: {"position": late(v["position"], 60)}, "ms apart, one quantity twice"),
    "a limit of the current": (lambda v, r: {"current": np.clip(v["current"], -1.7, 1.7)}, "stand at ±1.7 A"),
    "a resonance": (lambda v, r: {"current": v["current"] + 2 * np.sin(2 * np.pi * 40 * STEP * np.arange(v["current"].size))},
                    "swings by")}


@pytest.mark.parametrize("slip", SLIPS)
def test_wrong_channels_are_doubted_with_the_reason(slip):
    rng = np.random.default_rng(1)
    time, values = channels(rng)
    n = time.size // 10 * 10
    time, values = time[:n], {key: v[:n] for key, v in values.items()}
    change, reason = SLIPS[slip]
    assert any(reason in doubt for doubt in judged(time, values | change(values, rng)).doubts)


def test_a_gap_is_said_and_no_run_reaches_into_it():
    """Held over a gap at speed, the last current would count as a second of steady motion."""
    time, values = channels(np.random.default_rng(2))
    start = float(time[np.flatnonzero(values["velocity_set"] == 0.2)[0]]) + 0.2
    keep = (time < start) | (time > start + 0.9)
    axis = judged(time[keep], {key: v[keep] for key, v in values.items()})
    assert any("gaps without samples" in doubt for doubt in axis.doubts)
    ends = axis.runs.start + axis.runs.duration
    assert not ((axis.runs.start < start + 0.85) & (ends > start + 0.05)).any()


def test_the_fall_of_the_curve_is_left_out_of_the_line_and_said():
    """F = [1.5 + 0.4 exp(-(v/4 mm/s)^2)] sgn v + ...: the dry part of a line through all runs would be wrong."""
    time, values = channels(np.random.default_rng(4), (0.003, 0.02, 0.05, 0.1, 0.2))
    v = values["velocity"]
    values["current"] = values["current"] + 0.4 * np.exp(-(v / 4e-3)**2) * np.tanh(v / 2e-4)
    axis = judged(time, values)
    assert any("falls with speed" in doubt for doubt in axis.doubts)
    assert axis.friction.slowest == pytest.approx(0.02, rel=0.01)
    assert axis.friction.dry_interval[0] <= DRY <= axis.friction.dry_interval[1]


@pytest.mark.parametrize(("speeds", "ways", "words"), [
    ((0.1,), (1, -1), "all runs have one speed"), ((0.05, 0.1, 0.2), (1,), "all runs go one way"),
    ((0.05, 0.2), (1, -1), "two speeds only")])
def test_what_a_record_cannot_tell_is_said(speeds, ways, words):
    axis = judged(*channels(np.random.default_rng(5), speeds, ways=ways))
    assert any(words in doubt for doubt in axis.doubts)
    assert (axis.friction is None) == ("two" not in words)


def test_friction_that_depends_on_the_place_widens_the_intervals():
    """A slow run stays where friction is low: the line through such runs has a slope that is no viscous friction."""
    time, values = channels(np.random.default_rng(6))
    line = judged(time, values).friction
    v, x = values["velocity"], values["position"]
    values["current"] = values["current"] + 0.05 * DRY * np.tanh(v / 2e-4) * np.sin(2 * np.pi * x / 0.15)
    placed = judged(time, values).friction
    width = lambda interval: interval[1] - interval[0]
    assert width(placed.slope_interval) > 3 * width(line.slope_interval)
    assert placed.slope_interval[0] <= VISCOUS <= placed.slope_interval[1]


def test_a_line_that_holds_exactly_has_its_numbers():
    v = np.array([0.1, 0.2, 0.4, -0.1, -0.2, -0.4])
    line = fit_steady_line(v, 2 * np.sign(v) + 3 * v - 0.5, np.full(6, 1e-3))
    assert (line.dry, line.slope, line.offset) == pytest.approx((2, 3, -0.5))
    assert fit_steady_line(v[:3], v[:3], np.ones(3)) is None
    placed = fit_steady_line(v, 2 * np.sign(v) + 3 * v - 0.5, np.full(6, 1e-3), wander=np.r_[0.1, np.zeros(5)])
    assert placed.dry_interval[1] - placed.dry_interval[0] > 2 * 0.1  # no average takes it away


def test_a_response_that_follows_nothing_is_no_closed_loop():
    f = np.linspace(1, 200, 400)
    closed = 1 / (1 + 1j * f / 50)
    loop = lambda t: judge_servo_data(LoopResponse(f, t, t / (1 - t + 1e-9), np.ones(f.size), 1e-3))
    assert not any("no closed loop" in doubt for doubt in loop(closed).doubts())
    assert any("no closed loop" in doubt for doubt in loop(1e-3 * closed).doubts())
    assert any("set point of a closed loop" in note for note in loop(closed).notes)


def test_a_positioning_run_of_few_approaches_is_doubted():
    targets, rng = np.linspace(0, 0.4, 5), np.random.default_rng(0)
    run = lambda many: judge_servo_data(PositioningRun(targets, *(targets[:, None] + 1e-6 * rng.standard_normal((2, 5, many)))))
    assert any("2 approaches" in doubt for doubt in run(2).doubts()) and not run(5).doubts()
