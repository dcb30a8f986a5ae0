"""Tap tests of random tips from their files of volts: limits against the true ones, and what is said of slips."""

from dataclasses import replace

import numpy as np
import pytest

from tapped_tools import GRAVITY, SLIPS, Tip, channels_of, random_tap, spoiled, strike, write
from toolpoint import ToolpointError, io, studies
from toolpoint._doubt import doubts_among
from toolpoint.cutting import PanelArnoldi, ZeroOrder, stability
from toolpoint.cutting.stability.panels.between import refine_levels
from toolpoint.cutting.stability.panels.bumps import Level
from toolpoint.signals.hammer import hammer_test, locate_hits
from toolpoint.signals.usable_band import find_compliant_band, usable_band
from toolpoint.signals.windows import doubt_window
from toolpoint.studies.cuts.described_cut import build_problem
from toolpoint.studies.cuts.tool_dynamics import modal_dynamics, response_dynamics
from toolpoint.studies.cuts.uncertain_cut import Uncertainty, sample_charts
from toolpoint.studies.testing import tap_limits
from toolpoint.studies.testing.tap_dynamics import TappedModes, join_directions
from toolpoint.vibration import Frf, Record
from toolpoint.vibration.frequency_response import modal

CUT = {"diameter": 0.012, "teeth": 4, "direction": "slot", "tangential": 8e8, "normal": 2.4e8}
SPEEDS = (6000.0, 16000.0)


def a_tap(tip: Tip):
    """A tap of this tip as it should be: four blows in x and in y, lines of 2 Hz."""
    usual = random_tap(1)
    blows = replace(usual.blows, rate=12800.0, length=0.5, count=4, contact=2e-4, pulse="half sine", noise=(1e-4, 1e-4),
                    place=0.003, tilt=0.005, apart=True, kind="npz")
    return replace(usual, tip=tip, blows=blows, cut=CUT, speeds=SPEEDS, true_coefficients=(8e8, 2.4e8))


# A soft mode of 420 Hz far below a stiff fast one, whose accelerance is forty times as large; one mode along y.
SOFT_AND_FAST = Tip(np.array([420.0, 3600.0, 900.0]), np.array([0.03, 0.015, 0.03]), np.array([1.5e7, 1.5e7, 2e7]),
                    np.array([[1.0, 0], [1, 0], [0, 1]]))


def studied(tap, folder):
    rng, sets = np.random.default_rng(1), []
    for axis in (0, 1):
        files = strike(tap, axis, rng)
        sets.append(studies.study_hammer_records(io.read_records(write(files, folder, "xy"[axis], tap.blows),
                                                                 channels_of(tap, axis, files))))
    if tap.spoil.get("sets changed over"):
        sets = sets[::-1]
    return studies.study_tap(*sets, tap.cut, speeds=tap.speeds, rng=np.random.default_rng(0))


def true_limits(tip, speeds, depth):
    problem = build_problem(modal_dynamics(tip.modes), CUT)[0]
    return stability.chart(problem, speeds, PanelArnoldi(first_only=True), depth_max=depth).limit


@pytest.mark.slow
def test_limits_of_a_tap_are_those_of_the_tip(tmp_path):
    result = studied(a_tap(SOFT_AND_FAST), tmp_path)
    chart = result.limits.chart
    true = true_limits(SOFT_AND_FAST, chart.speeds, chart.depth_max)
    np.testing.assert_allclose(np.minimum(chart.limit, chart.depth_max), np.minimum(true, chart.depth_max), rtol=0.08)
    assert result.colour == "green", result.light_rows()
    assert result.limits.speeds
    for use in result.limits.speeds:
        assert use.depth < true_limits(SOFT_AND_FAST, np.array([use.speed]), 0.1)[0]


@pytest.mark.slow
@pytest.mark.parametrize(("slip", "words"), [
    ("analyser's window not said", "exponential window"), ("x and y exchanged", "exchanged"), ("V/N said for mV/N", "no blow"),
    ("sign of the response turned", "sign of one channel"), ("sensor at another point", "driving point"),
    ("one channel 0.1 ms late", "only with a delay")])
def test_slips_that_spoil_limits_are_red_and_named(tmp_path, slip, words):
    result = studied(SLIPS[slip](a_tap(SOFT_AND_FAST)), tmp_path)
    assert result.colour == "red" and words in result.status and not result.speed_rows()
    assert result.again


@pytest.mark.slow
@pytest.mark.parametrize("slip", ["all blows bounce", "response clipped", "channels exchanged",
                                  "sensor's cable broken (noise)"])
def test_slips_that_leave_no_good_blow_are_refused_by_name(tmp_path, slip):
    with pytest.raises(ToolpointError, match=r"double hit|overload|swapped|ring-down"):
        studied(SLIPS[slip](a_tap(SOFT_AND_FAST)), tmp_path)


@pytest.mark.slow
def test_a_wrong_unit_shows_in_the_static_stiffness(tmp_path):
    stiff = Tip(SOFT_AND_FAST.frequency, SOFT_AND_FAST.damping, 4 * SOFT_AND_FAST.stiffness, SOFT_AND_FAST.way)
    tap = a_tap(stiff)
    result = studied(spoiled(tap, said_sensor=f"{1e3 * tap.blows.sensor * GRAVITY:.6g}mV/(m/s^2)"), tmp_path)
    assert any("static stiffness" in light.words and light.colour == "red" for light in result.lights)
    right = 1 / (1 / stiff.stiffness[0] + 1 / stiff.stiffness[1])
    said = next(light.words for light in studied(tap, tmp_path).lights if light.step == "modes along x")
    assert float(said.split("static stiffness ")[1].split()[0]) * 1e6 == pytest.approx(right, rel=0.1)


def test_a_soft_mode_below_a_fast_one_belongs_to_the_band_of_compliance():
    """420 Hz: a fortieth of the loudest accelerance, and the softest of all; noise of 1 % of its peak there."""
    line = np.arange(0.0, 5000.0, 1.0)[1:]
    frf = modal(SOFT_AND_FAST.modes, line, outputs=["tip:+x"], inputs=["tip:+x"], quantity="accelerance")
    at = int(np.argmin(np.abs(line - 420)))
    noise = 0.01 * abs(frf.values[at, 0, 0])
    rng = np.random.default_rng(0)
    rough = noise / np.sqrt(2) * (rng.standard_normal(frf.values.shape) + 1j * rng.standard_normal(frf.values.shape))
    noisy = Frf(line, frf.values + rough, frf.outputs, frf.inputs, "accelerance",
                variance=np.full(frf.values.shape, noise**2))
    band = find_compliant_band(noisy, usable_band(noisy, 5000.0))
    assert 50 < band.low < 350 and band.high > 4000
    # Where noise of the receptance reaches the peak's height nothing is known: the band ends above.
    assert (noise / (2 * np.pi * band.low) ** 2) < 0.1 * np.abs(frf.converted_to("receptance").values).max()


def parts_of(tip, axis, deviation=1e-3):
    """The modes of a direction as a perfect identification has them."""
    at = tip.seen(axis, 1e9)
    w, zeta = 2 * np.pi * tip.frequency[at], tip.damping[at]
    residue = tip.way[at, axis] ** 2 * w**2 / tip.stiffness[at] / (2j * w * np.sqrt(1 - zeta**2))
    covariance = np.array([np.diag([(deviation * f) ** 2, (deviation * z) ** 2]) for f, z in zip(tip.frequency[at], zeta,
                                                                                               strict=True)])
    return TappedModes(tip.frequency[at], zeta, residue, np.full(len(at), deviation), covariance, 0.0, 0.0, True,
                       np.ones(len(at), bool))


def test_modes_that_x_and_y_share_are_drawn_with_either_sign_of_their_cross_response():
    turn = np.array([np.cos(0.5), np.sin(0.5)])
    tip = Tip(np.array([500.0, 900.0]), np.array([0.03, 0.03]), np.array([1e7, 1e7]), np.array([turn, turn]))
    struck = join_directions(parts_of(tip, 0), parts_of(tip, 1))
    assert struck.shared == ((0, 0), (1, 1)) and len(struck.turned) == 2
    line = np.array([300.0, 500.0, 880.0])
    true = tip.receptance(line)
    for sign in (1, -1):
        response = struck.dynamics({(0, 0): sign, (1, 1): sign}).response
        seen = modal(response, line).values
        np.testing.assert_allclose(seen[:, 0, 0], true[:, 0, 0], rtol=1e-9)
        np.testing.assert_allclose(seen[:, 1, 1], true[:, 1, 1], rtol=1e-9)
        np.testing.assert_allclose(seen[:, 0, 1], sign * true[:, 0, 1], rtol=1e-9)
    apart = modal(struck.dynamics().response, line).values
    np.testing.assert_allclose(np.diagonal(apart, axis1=1, axis2=2), np.diagonal(true, axis1=1, axis2=2), rtol=1e-9)
    assert np.abs(apart[:, 0, 1]).max() == 0


def test_static_stiffness_and_peaks_of_tapped_modes_are_those_of_the_tip():
    part = parts_of(SOFT_AND_FAST, 0)
    assert part.stiffness == pytest.approx(1 / (1 / 1.5e7 + 1 / 1.5e7), rel=1e-9)
    np.testing.assert_allclose(part.compliance, 1 / (2 * SOFT_AND_FAST.damping[:2] * 1.5e7), rtol=2e-3)


def test_drawn_modes_scatter_as_stated():
    part, rng = parts_of(SOFT_AND_FAST, 0, 0.01), np.random.default_rng(0)
    drawn = [part.drawn(rng) for _ in range(2000)]
    for name in ("frequency", "damping"):
        shares = np.array([getattr(draw, name) / getattr(part, name) for draw in drawn])
        np.testing.assert_allclose(shares.std(axis=0), 0.01, rtol=0.1)
    np.testing.assert_allclose(np.std([np.abs(draw.residue / part.residue) for draw in drawn], axis=0), 0.01, rtol=0.1)


def test_least_limits_of_drawn_tips_lie_in_the_interval_of_the_least_limit(monkeypatch):
    """They lie at other speeds than the middle one's, and lower than what draws have at its speed."""
    monkeypatch.setattr(tap_limits, "LIMIT_DRAWS", 40)
    tip, rng = join_directions(parts_of(SOFT_AND_FAST, 0, 0.05), parts_of(SOFT_AND_FAST, 1, 0.05)), np.random.default_rng(2)
    problem = build_problem(tip.dynamics(), CUT)[0]
    rough = tap_limits._chart_roughly(problem, np.linspace(*SPEEDS, 100), 0.05)
    ratios, least_ratios = tap_limits._draw_limit_ratios(tip, problem, rough, 0.05, rng)
    lower, upper = np.quantile(least_ratios, tap_limits.INTERVAL_LEVELS, method="weibull")
    share = tap_limits._draw_limit_ratios(tip, problem, rough, 0.05, rng)[1]  # of other tips
    assert 0.5 < lower < 1 < upper < 1.5
    assert (share < lower).mean() <= 0.075 and (share > upper).mean() <= 0.075
    assert (share < np.quantile(ratios[:, int(np.argmin(rough.limit))], 0.025)).mean() > 0.1


@pytest.mark.parametrize("windowed", [False, True])
def test_noise_that_dies_away_betrays_a_window_of_the_analyser(windowed):
    tap = a_tap(SOFT_AND_FAST)
    tap = SLIPS["analyser's window not said"](tap) if windowed else tap
    volts = strike(tap, 0, np.random.default_rng(2))
    records = [Record(part, tap.blows.rate, ["tip:+x", "tip:+x"], ("force", "acceleration")) for part in volts]
    hits = locate_hits(records, 0.45)
    doubts = doubt_window(hits, records, round(0.45 * tap.blows.rate))
    assert [doubt.what for doubt in doubts] == ["window"] * windowed


def test_a_force_stored_in_steps_coarser_than_its_noise_keeps_no_offset():
    """Steps of 0.42 N, an offset of 0.62 N between two of them: the impulse is that of the pulse down to 0 Hz."""
    rng, rate = np.random.default_rng(0), 20000.0
    force = np.zeros(32000)
    force[600:604] = [60.0, 150.0, 150.0, 60.0]
    stored = 0.42 * np.round((force + 0.62 + 0.06 * rng.standard_normal(force.size)) / 0.42)
    ringing = np.where(np.arange(force.size) >= 600, np.exp(-0.002 * (np.arange(force.size) - 600.0)), 0.0)
    answer = 50 * ringing * np.sin(0.3 * np.arange(force.size)) + 1e-3 * rng.standard_normal(force.size)
    record = Record(np.stack([stored, answer], axis=1), rate, ["tip:+x", "tip:+x"], ("force", "acceleration"))
    with pytest.warns(match="one hit only"):
        test = hammer_test(record, 1.5)
    np.testing.assert_allclose(test.force_spectrum[:20], force.sum() / rate, rtol=0.02)


def test_a_depth_that_is_looked_at_twice_is_no_stretch():
    """The growth of a cut falls towards the circle from both sides of one depth, at which two levels stand."""
    def look(depth: float) -> Level:
        return Level.of(depth, np.array([np.exp(-0.2 - abs(depth - 1.0))]))

    levels = [look(depth) for depth in (0.5, 1.0, 1.0, 1.5)]
    assert {level.depth for level in refine_levels(levels, look)} >= {0.5, 1.0, 1.5}


def test_certainty_on_measured_lines_is_doubted():
    """The samples of a probability chart vary no measured line: its 95 % leaves their noise out."""
    line = np.arange(50.0, 5000.0, 2.0)
    problem = build_problem(response_dynamics(modal(SOFT_AND_FAST.modes, line)), CUT)[0]
    chart = stability.chart(problem, np.array([9000.0, 10000.0]), ZeroOrder(), depth_max=0.01)
    notes = sample_charts(problem, chart, Uncertainty(samples=2), method=ZeroOrder())[1]
    assert [note.what for note in doubts_among(notes)] == ["probability"]


@pytest.mark.parametrize("windowed", [False, True])
def test_a_window_shows_by_what_a_record_holds_before_the_pretrigger_of_its_block(windowed):
    """At 800 Hz the block of a blow begins 64 samples before it, of which filters ring in 40: too few for their noise."""
    rng, rate = np.random.default_rng(3), 800.0
    time = np.arange(3360) / rate - 0.2
    force = np.where((time > 0) & (time < 0.005), np.sin(np.pi * time / 0.005), 0.0)
    motion = np.where(time > 0, np.exp(-5 * time) * np.sin(2 * np.pi * 30 * time), 0.0)
    records = []
    for _ in range(3):
        samples = np.column_stack([force, motion]) + 1e-3 * rng.standard_normal((time.size, 2))
        samples = samples * np.exp(-np.maximum(time, 0))[:, None] if windowed else samples
        records.append(Record(samples, rate, ["bed:+x", "bed:+x"], ("force", "acceleration")))
    doubts = doubt_window(locate_hits(records, 3.2), records, round(3.2 * rate))
    assert [doubt.what for doubt in doubts] == ["window"] * windowed
