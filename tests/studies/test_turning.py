"""Turning on a structure of several directions: the orient response, the width that is always stable, its lobes' tips."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from toolpoint import ToolpointError, ToolpointWarning
from toolpoint.cutting import stability
from toolpoint.cutting.cut.problem import TurningProblem
from toolpoint.cutting.stability.methods.turning import least_width, lobe_tips
from toolpoint.studies.cuts.tool_dynamics import response_dynamics
from toolpoint.studies.cuts.turning.direction import orient, unconditional_limit, width_range
from toolpoint.studies.cuts.turning.study import TurningCut, chart_turning
from toolpoint.vibration import Frf, Modes, frequency_response

LABELS = {"x": "t:+x", "y": "t:+y", "z": "t:+z"}
TOOL = Modes([120.0, 180.0, 310.0], [0.03, 0.02, 0.04], np.array([[1.0, 0.3, 0.2], [0.1, 0.8, 0.3], [0.2, 0.1, 1.1]]) / 5,
             tuple(LABELS.values()))
KF = 1e9
F = np.linspace(20, 900, 300)


def test_the_response_of_the_chip_thickness_is_the_quadratic_form_of_the_receptance():
    """n^T G f from the whole receptance, by modes and by measured lines."""
    n, c = np.array([1.0, 0, 1.0]) / np.sqrt(2), np.array([0, 1.0, 0])
    f = n + 2.2 * c
    whole = frequency_response.modal(TOOL, F)
    expected = np.einsum("i,kij,j->k", n, whole.values, f)
    for response in (TOOL, whole):
        found = orient(response, LABELS, n, force=f).response(F)
        np.testing.assert_allclose(found[:, 0, 0], expected, rtol=1e-9)
        assert np.abs(found.reshape(-1, 4)[:, 1:]).max() == 0
    along = orient(whole.selected(["t:+z"], ["t:+z"]), {"z": "t:+z"}, (0, 0, 1), force=(0, 0, 1))
    np.testing.assert_allclose(along.response(F)[:, 0, 0], whole.values[:, 2, 2], rtol=1e-9)


@settings(max_examples=30, deadline=None)
@given(st.floats(30, 900), st.floats(0.005, 0.15), st.floats(0.2, 40))
def test_one_mode_has_the_limit_and_the_tips_of_the_closed_form(frequency, ratio, mass):
    """b = 2 k z (1 + z)/K_f at w sqrt(1 + 2 z), tips at 60 f/(k + e/2 pi) (Tlusty)."""
    modes = Modes([frequency], ratio, np.array([[1 / np.sqrt(mass)]]), ("t:+x",))
    found = unconditional_limit(TurningProblem(KF, modes))
    k = mass * (2 * np.pi * frequency) ** 2
    assert found.width == pytest.approx(least_width(k, ratio, KF), rel=1e-9)
    assert found.frequency == pytest.approx(frequency * np.sqrt(1 + 2 * ratio), rel=1e-5)
    np.testing.assert_allclose(found.tips[:5], lobe_tips(frequency, ratio, 5), rtol=1e-5)


def test_the_chart_meets_the_limit_at_the_tips_and_nowhere_falls_below():
    """With several modes and a tangential force too; b_lim = -1/(2 K_f min Re G)."""
    n = np.array([1.0, 0, 1.0]) / np.sqrt(2)
    problem = TurningProblem(KF, orient(TOOL, LABELS, n, force=n + 1.5 * np.array([0, 1.0, 0])))
    found = unconditional_limit(problem)
    dense = np.linspace(20, 900, 400_001)
    least = problem.plane.response(dense)[:, 0, 0].real.min()
    assert found.width == pytest.approx(-1 / (2 * KF * least), rel=1e-6)
    chart = stability.chart(problem, np.sort(found.tips), None, depth_max=width_range(problem))
    np.testing.assert_allclose(chart.limit, found.width, rtol=1e-5)
    everywhere = stability.chart(problem, np.linspace(500, 9000, 200), None, depth_max=width_range(problem))
    assert everywhere.limit.min() >= found.width * (1 - 1e-6)


def test_a_response_without_negative_real_part_is_stable_at_every_width():
    """The force has no part that moves the chip's thickness."""
    still = Modes([100.0], 0.02, np.array([[1.0], [1.0]]), ("t:+x", "t:+y"))
    turned = orient(still, {"x": "t:+x", "y": "t:+y"}, (1, 0, 0), force=(1, -1, 0))
    found = unconditional_limit(TurningProblem(KF, turned))
    assert np.isinf(found.width) and found.tips.size == 0


def test_wrong_input():
    with pytest.raises(ToolpointError, match="along z is not known"):
        orient(TOOL, {"x": "t:+x"}, (0, 0, 1), force=(0, 0, 1))
    with pytest.raises(ToolpointError, match="zero length"):
        orient(TOOL, LABELS, (0, 0, 0), force=(0, 0, 1))
    damped = TurningProblem(KF, orient(TOOL, LABELS, (1, 0, 0), force=(1, 0, 0)), None, 1e3, 2.0)
    with pytest.raises(ToolpointError, match="depends on the speed"):
        unconditional_limit(damped)


def measured_study(frequency, noise=0.0, modes=TOOL):
    """Return the study of measured lines with noise, as a share of the least real part."""
    frf = frequency_response.modal(modes, frequency, ["t:+x"], inputs=["t:+x"])
    rng, least = np.random.default_rng(0), -frf.values.real.min()
    values = frf.values + noise * least * (rng.standard_normal(frf.values.shape) + 1j * rng.standard_normal(frf.values.shape))
    dynamics = response_dynamics(Frf(frf.frequency, values, frf.outputs, frf.inputs))
    return chart_turning(dynamics, TurningCut(KF), np.array([900.0]))


@pytest.mark.filterwarnings("ignore::toolpoint.ToolpointWarning")
@pytest.mark.parametrize(("frequency", "noise", "words"), [
    (np.arange(20, 121, 0.25), 0.0, "least at the edge"), (np.arange(20, 118, 0.25), 0.0, "least at the edge"),
    (np.arange(20, 900, 0.25), 0.4, "noise, or lines too far apart"),
    (np.arange(20, 900, 8.0), 0.0, "noise, or lines too far apart"),
    (np.arange(20, 100, 0.25), 0.0, "no line has a negative real part")])
def test_lines_that_cannot_carry_the_limit_are_doubted(frequency, noise, words):
    study = measured_study(frequency, noise)
    assert any(words in doubt for doubt in study.doubts) and study.to_dict()["doubts"]
    assert "(doubtful)" in study.rows()[0][-1]


@pytest.mark.filterwarnings("ignore::toolpoint.ToolpointWarning")
def test_good_lines_are_not_doubted_and_say_their_band():
    study = measured_study(np.arange(5, 1500, 0.25), 1e-3)
    assert not study.doubts and any("measured from" in note for note in study.chart.notes)
    assert study.limit.width == pytest.approx(unconditional_limit(TurningProblem(KF, orient(
        TOOL, {"x": "t:+x"}, (1, 0, 0), force=(1, 0, 0)))).width, rel=0.01)


def test_a_band_that_ends_too_early_is_a_doubt_of_the_limits():
    """The mode at 310 Hz decides; the lines end before it."""
    with pytest.warns(ToolpointWarning, match="missing is the band"):
        study = measured_study(np.arange(5, 150, 0.25))
    assert any(doubt.what == "limits" and "missing is the band" in doubt for doubt in study.doubts)


def test_noise_of_responses_is_that_of_their_sum():
    """var(n^T G f) = sum n_i^2 f_j^2 var_ij of independent noise."""
    frf = frequency_response.modal(TOOL, F)
    variance = np.random.default_rng(0).uniform(1e-20, 1e-18, frf.values.shape)
    n, f = np.array([0.6, 0.8, 0.0]), np.array([0.6, 0.8, 1.5])
    lines = Frf(F, frf.values, frf.outputs, frf.inputs, variance=variance)
    found = orient(lines, LABELS, n, force=f).variance
    np.testing.assert_allclose(found[:, 0, 0], np.einsum("i,kij,j->k", n**2, variance, f**2))
