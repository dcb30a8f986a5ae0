"""The other methods on one structure, indicators, complexity, residues, relative motion."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from modal_identification.modal_case import labels, responses, structure, with_noise
from toolpoint import Dof, Frf, Modes, ToolpointError
from toolpoint.modal_identification import (
    METHODS,
    RationalFraction,
    cmif,
    complexity_factor,
    identify,
    mean_phase_deviation,
    mvmif,
    phase_collinearity,
    real_modes,
    residues,
    significance,
)
from toolpoint.modal_identification.judgement.indicators import peaks
from toolpoint.modal_identification.poles.circle_fit import circle
from toolpoint.modal_identification.scaling import factor_rank_one, scale_shapes
from toolpoint.vibration.correlation import mac
from toolpoint.vibration.driving_point import driving_points
from toolpoint.vibration.frequency_response import modal

FREQUENCY = np.array([35.0, 52, 88, 141, 210, 305])
RATIO = np.array([2.5, 2, 1.6, 1.8, 2.2, 1]) / 100


@pytest.fixture(scope="module")
def truth() -> Modes:
    return structure(np.random.default_rng(0), 20, FREQUENCY, RATIO)


@pytest.mark.slow
@pytest.mark.parametrize("method", sorted(METHODS))
@pytest.mark.parametrize(("noise", "limits"), [(0.0, (1e-6, 1e-4, 1e-3)), (0.005, (1e-4, 5e-3, 3e-3))])
def test_every_method_finds_six_separate_modes_alone(truth, method, noise, limits):
    frf = with_noise(responses(truth, 2), noise, np.random.default_rng(1))
    found = identify(frf, method, (20, 400))
    assert found.modes.count == 6
    assert np.abs(found.modes.frequency / FREQUENCY - 1).max() < limits[0]
    assert np.abs(found.modes.damping_ratio / RATIO - 1).max() < limits[1]
    assert 1 - np.diag(mac(found.modes.shape, truth.shape)).min() < limits[2]
    assert found.modes.scaling == "modal A"
    assert found.method in found.status


@pytest.mark.parametrize("method", ["lsce", "era", "plscf"])
@pytest.mark.default_cases(1)
def test_poly_reference_methods_keep_a_repeated_root(method):
    modes = structure(np.random.default_rng(4), 12, np.array([80.0, 80.0, 150.0]), np.array([0.02, 0.02, 0.02]))
    frf = responses(modes, 3, "accelerance", np.arange(0, 300, 0.25))
    found = identify(frf, method, (20, 290)).modes
    assert found.count == 3
    assert np.abs(found.frequency / modes.frequency - 1).max() < 1e-4
    plane = np.linalg.svd(np.linalg.qr(modes.shape[:, :2])[0].T @ np.linalg.qr(found.shape[:, :2])[0],
                          compute_uv=False)
    assert plane.min() > 0.99


def test_rational_fractions_of_single_responses(truth):
    frf = responses(truth, 1).selected([0, 1, 2])
    found = identify(frf, RationalFraction(local=True, modes=2), (25, 65))
    assert found.modes.frequency == pytest.approx([35, 52], rel=1e-3)
    assert found.modes.damping_ratio == pytest.approx([0.025, 0.02], rel=0.08)  # the modes outside the band bias it
    with pytest.raises(ToolpointError, match="modes"):
        identify(frf, RationalFraction(local=True), (25, 65))


def test_uneven_lines_are_refused_where_a_transform_is_needed(truth):
    frf = responses(truth, 1, lines=np.sort(np.random.default_rng(0).uniform(10, 400, 900)))
    with pytest.raises(ToolpointError, match="evenly spaced"):
        identify(frf, "lsce")
    assert identify(frf).modes.count == 6


@given(st.complex_numbers(max_magnitude=5), st.floats(0.1, 10), st.floats(0.5, 6))
def test_a_circle_is_fitted_exactly(centre, radius, arc):
    points = centre + radius * np.exp(1j * np.linspace(0, arc, 9))
    found = circle(points)
    assert abs(found[0] - centre) < 1e-4 * (radius + abs(centre))
    assert found[1] == pytest.approx(radius, rel=1e-3)


def test_cmif_and_mvmif_show_modes_and_repeated_roots():
    modes = structure(np.random.default_rng(4), 12, np.array([80.0, 80.0, 150.0]), np.array([0.02, 0.02, 0.02]))
    frf = responses(modes, 3, "receptance", np.arange(1, 300, 0.5))
    curves = cmif(frf)
    assert peaks(curves) == pytest.approx([80, 150], abs=1)
    at, other = int(np.argmin(abs(curves.frequency - 80))), int(np.argmin(abs(curves.frequency - 150)))
    dips = mvmif(frf)
    assert dips.values[at, 0] < 0.05 and dips.values[at, 1] < 0.05 and dips.values[at, 2] > 0.5
    assert dips.values[other, 0] < 0.05 and dips.values[other, 1] > 0.5
    assert mac(curves.shape[other][:, :1], modes.shape[:, 2:])[0, 0] > 0.99
    mobility = mvmif(frf.converted_to("mobility"))
    assert np.allclose(mobility.values, dips.values, atol=1e-9)


@settings(deadline=None)
@given(st.integers(0, 10_000), st.floats(0, 2 * np.pi))
def test_complexity_of_real_and_travelling_shapes(seed, angle):
    real = np.random.default_rng(seed).standard_normal((12, 1))
    turned = real * np.exp(1j * angle)
    assert phase_collinearity(turned) == pytest.approx([1.0])
    assert mean_phase_deviation(turned) == pytest.approx([0.0], abs=1e-5)
    assert complexity_factor(turned) == pytest.approx([0.0], abs=1e-9)
    wave = np.exp(2j * np.pi * np.arange(12) / 12)[:, None]
    assert phase_collinearity(wave) == pytest.approx([0.0], abs=1e-9)
    assert complexity_factor(wave) == pytest.approx([1.0])


def test_real_modes_of_modal_a_are_those_of_unit_modal_mass(truth):
    shape = truth.shape / np.sqrt(2j * truth.poles.imag)
    complex_ones = Modes(truth.frequency, truth.damping_ratio, shape, truth.dofs, "modal A")
    frequency = np.arange(1.0, 300)
    first = modal(truth, frequency, [0, 1], inputs=[0]).values
    assert np.allclose(modal(complex_ones, frequency, [0, 1], inputs=[0]).values, first)
    found = real_modes(complex_ones)
    assert found.scaling == "unit modal mass"
    assert np.allclose(np.abs(found.shape), np.abs(truth.shape))


def test_residues_with_lower_and_upper_residuals_are_exact():
    rng = np.random.default_rng(0)
    modes = structure(rng, 4, np.array([50.0, 80.0]), np.array([0.02, 0.01]))
    inputs = list(modes.dofs[:2])
    lower, upper = rng.standard_normal((2, 12, 12)) * [[[1.0]], [[1e-4]]]
    full = Modes(modes.frequency, modes.damping_ratio, modes.shape, modes.dofs, lower_residual=lower + 0j,
                 upper_residual=upper + 0j)
    found = residues(modal(full, np.arange(20.0, 120, 0.25), None, inputs=inputs), modes.poles)
    expected = modes.shape[:, None, :] * modes.shape[None, :2, :] / (2j * modes.poles.imag)
    assert np.allclose(found.values, expected, rtol=1e-6, atol=1e-12)
    assert np.allclose(found.lower, lower[:, :2], rtol=1e-6)
    assert np.allclose(found.upper, upper[:, :2], rtol=1e-6)
    assert found.quality.min() > 1 - 1e-9
    with pytest.raises(ToolpointError, match="coincide"):
        residues(modal(full, np.arange(20.0, 120), None, inputs=inputs), np.repeat(modes.poles[:1], 2))


def test_several_driving_points_are_used_together_and_signs_count():
    rng = np.random.default_rng(0)
    truth = rng.standard_normal(6) + 1j * rng.standard_normal(6)
    outputs, inputs = labels(2), [Dof(1, "-x"), Dof(2, "+z")]
    points = driving_points(outputs, inputs)
    assert [(p.row, p.column, p.sign) for p in points] == [(0, 0, -1.0), (5, 1, 1.0)]
    residue = np.outer(truth, [-truth[0], truth[5]])
    shape, participation, share = factor_rank_one(residue)
    assert share < 1e-12
    shape, participation, usable = scale_shapes(shape, participation, points)
    assert usable
    assert np.allclose(shape * np.sign((shape / truth).real), truth)
    assert np.allclose(np.outer(shape, participation), residue)


def test_modes_that_move_tool_against_table_are_selected():
    dofs = [Dof(name, way) for name in ("tool", "table") for way in "xyz"]
    shape = np.array([[1.0, 0, 0, 1, 0, 0], [1, 0, 0, -1, 0, 0], [0, 0.02, 0, 0, 0, 0], [0, 1.0, 0, 0, 0, 0]]).T
    modes = Modes(np.array([10.0, 20, 30, 40]), np.full(4, 0.02), shape, dofs)
    found = significance(modes, "tool", "table")
    assert found.share == pytest.approx([0, 1, 16 / 9 * 0.02**2, 1], abs=1e-9)
    assert found.selected(0.1).frequency.tolist() == [20, 40]
    w = modes.omega[1]
    assert found.peak[1, 0] == pytest.approx(4 / (2 * 0.02 * w**2))
    assert set(found.ranking[:2].tolist()) == {1, 3}
    assert found.status == ("The modes at 20, 40 Hz move tool against table by at least a tenth of the largest along x or y or "
                            "z; the other 2 move both nearly alike, or neither, and hardly matter to the cut.")


def test_tool_against_table_with_a_sensor_that_points_the_other_way_and_one_direction_in_common():
    """The sign of a sensor at the table changes nothing; z was measured at the tool alone and is left out."""
    shape = np.array([[1.0, 1.0, 0.3], [0.2, -0.5, 0.1], [0.0, 0.7, 0.0]]).T
    modes = Modes([10.0, 20.0, 30.0], [0.02] * 3, shape, ["tool:+x", "table:+x", "tool:+z"])
    turned = Modes([10.0, 20.0, 30.0], [0.02] * 3, shape * [[1], [-1], [1]], ["tool:+x", "table:-x", "tool:+z"])
    found, other = significance(modes, "tool", "table"), significance(turned, "tool", "table")
    assert found.directions == other.directions == ("x",)
    np.testing.assert_allclose(found.peak, other.peak)
    with pytest.raises(ToolpointError, match=r"between: bed; must be a point that was measured: tool, table"):
        significance(modes, "tool", "bed")
    with pytest.raises(ToolpointError, match="must share a direction"):
        significance(Modes([10.0], [0.02], [[1.0], [1.0]], ["tool:+x", "table:+y"]), "tool", "table")


def test_two_modes_that_one_reference_cannot_part_are_remarked():
    rng = np.random.default_rng(0)
    modes = structure(rng, 6, np.array([80.0, 150.0]), np.array([0.02, 0.02]))
    shape = modes.shape.copy()
    shape[1, 1] = 1e-6  # the second reference does not see the second mode
    found = identify(responses(Modes(modes.frequency, modes.damping_ratio, shape, modes.dofs), 2), band=(40, 300))
    assert any("hardly sees mode 2" in line for line in found.advice)


def test_nothing_in_the_band_is_said_so():
    rng = np.random.default_rng(0)
    values = np.ones((300, 4, 1)) * (1 + 0.01 * rng.standard_normal((300, 4, 1)))
    frf = Frf(np.arange(1.0, 301), values, labels(2)[:4], ["1:+x"])
    try:
        found = identify(frf)
    except ToolpointError as error:
        message = str(error)
        assert "no mode found" in message
    else:
        assert found.advice
