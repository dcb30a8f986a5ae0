"""Quadrature picking: closed form, noise, measured data."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from modal_identification.modal_case import responses, structure, with_noise
from toolpoint import Dof, Frf, ToolpointError
from toolpoint.modal_identification import quadrature
from toolpoint.vibration.correlation import mac

DATA = Path(__file__).parents[2] / ".." / "shared" / "data"
FREQUENCY = np.array([35.0, 52, 88, 141, 210, 305])
RATIO = np.array([2.5, 2, 1.6, 1.8, 2.2, 1]) / 100


@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
def test_one_mode_is_exact_in_every_quantity(quantity):
    modes = structure(np.random.default_rng(1), 4, np.array([100.0]), np.array([0.02]))
    found = quadrature(responses(modes, 1, quantity, np.arange(400.0)))
    assert found.scaling == "unit modal mass"
    assert found.frequency == pytest.approx([100.0], rel=1e-9)
    assert found.damping_ratio == pytest.approx([0.02], rel=1e-7)
    sign = np.sign(found.shape[0, 0] * modes.shape[0, 0])
    assert np.allclose(sign * found.shape, modes.shape, atol=1e-7 * np.abs(modes.shape).max())


@settings(deadline=None, max_examples=25)
@given(st.floats(40.0, 340.0), st.floats(0.006, 0.08), st.integers(0, 1000))
def test_any_single_mode_is_recovered_from_noisy_data(frequency, ratio, seed):
    rng = np.random.default_rng(seed)
    modes = structure(rng, 10, np.array([frequency]), np.array([ratio]))
    found = quadrature(with_noise(responses(modes, 1, "accelerance", np.arange(0.0, 400, 0.5)), 0.02, rng))
    at = int(np.argmin(np.abs(found.frequency - frequency)))
    assert abs(found.frequency[at] / frequency - 1) < 2e-3
    assert abs(found.damping_ratio[at] / ratio - 1) < 0.1


@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
@pytest.mark.parametrize("noise", [0.0, 0.01, 0.03])
@pytest.mark.default_cases(4)
def test_six_separate_modes_are_found_and_no_more(quantity, noise):
    rng = np.random.default_rng(3)
    modes = structure(rng, 20, FREQUENCY, RATIO)
    found = quadrature(with_noise(responses(modes, 2, quantity), noise, rng))
    assert found.count == 6
    assert np.abs(found.frequency / FREQUENCY - 1).max() < 1e-3
    assert np.abs(found.damping_ratio / RATIO - 1).max() < 0.05
    assert np.diag(mac(found.shape, modes.shape)).min() > 0.99


def test_coarse_lines_without_noise():
    modes = structure(np.random.default_rng(3), 20, FREQUENCY, RATIO)
    found = quadrature(responses(modes, 1, "receptance", np.arange(1.0, 400.0, 1.0)))
    assert np.abs(found.frequency / FREQUENCY - 1).max() < 1e-3
    assert any("finer line spacing" in note for note in found.notes)


def test_pure_noise_has_no_modes():
    rng = np.random.default_rng(0)
    values = rng.standard_normal((500, 10, 1)) + 1j * rng.standard_normal((500, 10, 1))
    frf = Frf(np.arange(1.0, 501), values, [Dof(i + 1, "x") for i in range(10)], ["1:x"], "accelerance")
    with pytest.raises(ToolpointError, match="no peak"):
        quadrature(frf)


def test_the_exponential_window_is_taken_out():
    modes = structure(np.random.default_rng(1), 4, np.array([100.0]), np.array([0.004]))
    windowed = modes.poles[0] - 5.0
    ratio = -windowed.real / abs(windowed)
    heavier = structure(np.random.default_rng(1), 4, np.array([abs(windowed) / 2 / np.pi]), np.array([ratio]))
    frf = responses(heavier, 1, "receptance", np.arange(1.0, 300, 0.25))
    found = quadrature(Frf(frf.frequency, frf.values, frf.outputs, frf.inputs, frf.quantity, decay=5.0))
    assert found.damping_ratio == pytest.approx([0.004], rel=1e-4)
    assert found.frequency == pytest.approx([100.0], rel=1e-6)


def test_without_a_driving_point_shapes_stay_unscaled():
    modes = structure(np.random.default_rng(1), 4, np.array([100.0]), np.array([0.02]))
    frf = responses(modes, 1, "receptance", np.arange(1.0, 300))
    found = quadrature(frf.selected(outputs=frf.outputs[1:]))
    assert found.scaling == "unscaled"
    assert any("no scale" in note for note in found.notes)


def test_a_wrong_sign_at_the_driving_point_gives_no_scale():
    modes = structure(np.random.default_rng(1), 4, np.array([100.0]), np.array([0.02]))
    frf = responses(modes, 1, "receptance", np.arange(1.0, 300))
    found = quadrature(Frf(frf.frequency, -frf.values, frf.outputs, frf.inputs))
    assert found.scaling == "unscaled"


def test_measured_tool_holder():
    folder = DATA / "tool_holder_frf"
    if not folder.exists():
        pytest.skip("the measured data are not beside this project")
    tables = [np.loadtxt(folder / f"Point_{i}_Channel_1_CH1.txt") for i in range(1, 6)]
    values = np.stack([table[:, 1] + 1j * table[:, 2] for table in tables], axis=1)[:, None, :]
    frf = Frf(tables[0][:, 0], values, ["1:x"], [Dof(i, "x") for i in range(1, 6)])
    found = quadrature(frf, (500, 3000))
    for picked in (1074.0, 1961.0, 2617.0):  # by hand by the author of the data
        assert np.abs(found.frequency / picked - 1).min() < 0.015
    assert found.scaling == "unit modal mass"
