"""Lines of a coupled tool: noise by scatter, windows, peaks between lines, and what a gauge test betrays of itself."""

import numpy as np
import pytest

from toolpoint.studies.cuts.coupling.gauge_doubts import question_gauge, with_noise
from toolpoint.studies.cuts.coupling.line_smoothing import noise_over_stated, scatter_variance, smooth_tip
from toolpoint.studies.cuts.coupling.peaks import peaks_of, question_peaks
from toolpoint.studies.cuts.tool_coupling import bases_from_gauge, study_tool
from toolpoint.substructuring import PlaneReceptance, SegmentDescription, ShaftDescription
from toolpoint.substructuring.shaft_stiffness import station_stiffness
from toolpoint.vibration import Frf

LINES = np.arange(100.0, 2500.0, 3.0)
GAUGE = ShaftDescription({"bar": SegmentDescription(0.08, 0.04, loss_factor=1e-3)}, stations={"1": 0.078, "2": 0.03})
TOOL = ShaftDescription({"shank": SegmentDescription(0.06, 0.016, material="carbide", loss_factor=0.01)})


def mode(lines, natural=801.1, ratio=0.01):
    """One mode of 1e7 N/m: the peak is at f sqrt(1 - 2 z^2), 1 / (2 k z sqrt(1 - z^2)) high."""
    q = lines / natural
    return 1e-7 / (1 - q**2 + 2j * ratio * q)


def noise(values, size, rng):
    return size * np.abs(values) * (rng.normal(size=values.shape) + 1j * rng.normal(size=values.shape)) / np.sqrt(2)


def tip_of(values, draws=None):
    whole = np.zeros((values.size, 2, 2), complex)
    whole[:, 0, 0] = values
    drawn = None
    if draws is not None:
        drawn = np.zeros((len(draws), values.size, 2, 2), complex)
        drawn[:, :, 0, 0] = draws
    return PlaneReceptance(LINES, whole, draws=drawn)


def gauge_test(size=0.005, seed=3, stations=None, sign=1.0):
    """Responses of the gauge in a spindle of three modes, with noise of `size` times each and its variance."""
    values = np.zeros((LINES.size, 2, 2), complex) + np.diag([1e-9, 2e-6])
    for f, stiffness, slope in ((450.0, 6e7, 5.0), (1100.0, 1e8, 12.0), (1700.0, 2e8, -15.0)):
        q = LINES / f
        values += np.outer([1, slope], [1, slope]) / stiffness / (1 - q**2 + 0.06j * q)[:, None, None]
    whole = station_stiffness(GAUGE, LINES)
    matrix = whole.matrix.copy()
    matrix[:, :2, :2] += np.linalg.inv(values)
    at = [2 * s for s in whole.sections.values()]
    clean = np.linalg.inv(matrix)[:, at][:, :, at]
    rng = np.random.default_rng(seed)
    labels = [f"{name}:+x" for name in (stations or ("1", "2"))]
    return Frf(LINES, clean + noise(clean, size, rng), labels, labels, variance=np.abs(size * clean) ** 2)


def coupled(frf, **more):
    rng = np.random.default_rng(1)
    return study_tool(bases_from_gauge(frf, GAUGE, draws=60, generator=rng, **more), TOOL, generator=rng)


def test_scatter_of_neighbouring_lines_gives_the_noise():
    values = mode(LINES, ratio=0.04)
    seen = scatter_variance((values + noise(values, 0.02, np.random.default_rng(1)))[:, None])[:, 0]
    assert np.median(seen / np.abs(0.02 * values) ** 2) == pytest.approx(1, rel=0.15)
    assert noise_over_stated(values + noise(values, 0.02, np.random.default_rng(2)), np.abs(0.005 * values) ** 2) \
        == pytest.approx(4, rel=0.15)


@pytest.mark.slow
def test_lines_taken_together_are_nearer_to_the_truth_and_the_interval_still_holds_it():
    """A mode in 3 % noise over 12 seeds: the mean square error falls by more than two, 91 to 99 % of lines are held."""
    truth, before, after, held = mode(LINES, ratio=0.02), [], [], []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        values = truth + noise(truth, 0.03, rng)
        draws = values + noise(np.broadcast_to(truth, (80, truth.size)), 0.03, rng)
        tip = smooth_tip(tip_of(values, draws))
        low, high = tip.band()
        held.append(np.mean((low.real <= truth.real) & (truth.real <= high.real)))
        before.append(np.mean(np.abs(values / truth - 1) ** 2))
        after.append(np.mean(np.abs(tip.values[:, 0, 0] / truth - 1) ** 2))
    assert np.mean(after) < 0.5 * np.mean(before)
    assert 0.91 < np.mean(held) < 0.99


def test_exact_lines_are_left_as_they_are_whatever_noise_is_stated():
    truth = mode(LINES)
    draws = truth + noise(np.broadcast_to(truth, (60, truth.size)), 0.05, np.random.default_rng(1))
    assert np.abs(smooth_tip(tip_of(truth, draws)).values[:, 0, 0] / truth - 1).max() < 1e-6


def test_a_peak_between_lines_is_that_of_the_closed_form():
    peak = peaks_of(tip_of(mode(LINES, ratio=0.005)))[0]
    assert peak.frequency == pytest.approx(801.1 * np.sqrt(1 - 2 * 0.005**2), abs=0.03)
    assert peak.height == pytest.approx(1e-7 / (2 * 0.005 * np.sqrt(1 - 0.005**2)), rel=2e-3)


def test_too_few_lines_and_a_band_that_cuts_a_larger_peak_off_are_doubted():
    assert question_peaks(tip_of(mode(LINES, ratio=0.01))) == []
    assert "lines within its half-power width" in question_peaks(tip_of(mode(LINES, ratio=0.0008)))[0]
    rising = mode(LINES, 800.0, 0.05) + 20 * mode(LINES, 2520.0, 0.01)
    assert any(doubt.what == "band" for doubt in question_peaks(tip_of(rising)))


def turned(frf, factors):
    values = frf.values * np.array(factors)
    return Frf(LINES, values, frf.outputs, frf.inputs, frf.quantity, variance=frf.variance)


def test_a_good_gauge_test_is_not_doubted():
    assert question_gauge(gauge_test(), GAUGE) == []


def told(frf, factor=1.0, quantity="receptance"):
    return Frf(LINES, frf.values, frf.outputs, frf.inputs, quantity, variance=factor * frf.variance)


@pytest.mark.parametrize(("slip", "words"), [
    (lambda: turned(gauge_test(), [[1, -1], [1, 1]]), "opposite signs"),
    (lambda: turned(gauge_test(), [[0.8, 1], [1, 1]]), "give off power"),
    (lambda: told(gauge_test(), quantity="mobility"), "give off power"),
    (lambda: gauge_test(stations=("2", "1")), "may be exchanged"),
    (lambda: told(gauge_test(), 1 / 16), "times the stated noise")])
def test_slips_of_a_gauge_test_are_named(slip, words):
    assert any(words in doubt for doubt in question_gauge(slip(), GAUGE))


def test_a_gain_of_hammer_and_sensor_is_within_the_interval_of_a_stated_calibration():
    """All responses 3 % too large, calibration told to 3 %: the true peak is held; taken as exact it is not."""
    truth, off = peaks_of(coupled(gauge_test(1e-5)).tips[0])[0], turned(gauge_test(5e-4), np.full((2, 2), 1.03))
    for calibration, is_held in ((0.03, True), (0.0, False)):
        (low, high), _ = peaks_of(coupled(off, calibration=calibration).tips[0])[0].intervals
        assert (low <= truth.frequency <= high) is is_held


def test_a_share_of_each_response_is_no_less_than_the_scatter_of_lines():
    frf = gauge_test(0.05)
    bare = Frf(LINES, frf.values, frf.outputs, frf.inputs)
    assert np.median(with_noise(bare, 0.001).variance / frf.variance) == pytest.approx(1, rel=0.25)
    assert np.median(with_noise(bare, 0.2).variance / frf.variance) == pytest.approx(16, rel=0.1)
