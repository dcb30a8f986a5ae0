"""Surface: scallops, filters, roughness of analytic profiles, separation by lifting."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cutting.cutting_cases import benchmark
from toolpoint import ToolpointError, ToolpointWarning
from toolpoint.cutting import Engagement, Tool
from toolpoint.cutting.simulation.milling import ExactSteps, simulate
from toolpoint.cutting.surface.filters import Lifting, gaussian, separate
from toolpoint.cutting.surface.location import location_error, wall_side
from toolpoint.cutting.surface.roughness import areal_parameters, profile_parameters, spectrum
from toolpoint.cutting.surface.topography import dynamic_wall, static_wall
from toolpoint.vibration import frequency_response


def test_sine_profile() -> None:
    """A sine of amplitude A: Ra 2A/pi, Rq A/sqrt 2, Rz 2A, Rsk 0, Rku 1.5, RSm its wavelength."""
    x = np.arange(8000) * 1e-6
    found = profile_parameters(1e-6 * np.sin(2 * np.pi * x / 0.8e-3), 1e-6, 0.8e-3)
    assert found["Ra"] == pytest.approx(2e-6 / np.pi, rel=1e-3)
    assert found["Rq"] == pytest.approx(1e-6 / np.sqrt(2), rel=1e-3)
    assert found["Rz"] == pytest.approx(2e-6, rel=1e-3) and found["Rt"] == pytest.approx(2e-6, rel=1e-3)
    assert found["Rsk"] == pytest.approx(0, abs=1e-9) and found["Rku"] == pytest.approx(1.5, rel=1e-3)
    assert found["RSm"] == pytest.approx(0.8e-3, rel=1e-3)
    area = areal_parameters(1e-6 * np.sin(2 * np.pi * x / 0.8e-3)[None, :] * np.ones((5, 1)), (1e-6, 1e-6))
    assert area["Sa"] == pytest.approx(2e-6 / np.pi, rel=1e-3) and area["Sku"] == pytest.approx(1.5, rel=1e-3)


def test_scallop_height_is_feed_squared_over_eight_radii() -> None:
    """A rigid tool with equal edges leaves marks f_z apart, f_z^2/8R high (0.1 %), parabolic: Ra = h/(2.25 sqrt 3)."""
    problem = benchmark(Engagement.down(0.1), feed_per_tooth=0.2e-3)
    wall = static_wall(problem, 4e-3, 8001)
    # Down-milling trochoid: the edge moves back over the wall with R - f N/2 pi a radian (Martellotti).
    height = 0.2e-3**2 / (8 * 0.01) / (1 - 0.4e-3 / (2 * np.pi * 0.01)) ** 2
    assert np.ptp(wall.profile) == pytest.approx(height, rel=1e-3)
    slow = static_wall(benchmark(Engagement.down(0.1), feed_per_tooth=0.01e-3), 0.2e-3, 8001)
    assert np.ptp(slow.profile) == pytest.approx(0.01e-3**2 / (8 * 0.01), rel=1e-3)
    found = profile_parameters(wall.profile, 0.5e-6)
    assert found["Ra"] == pytest.approx(2 / (9 * np.sqrt(3)) * np.ptp(wall.profile) * 2, rel=1e-2)
    wavelength, amplitude = spectrum(wall.profile[:-1], 0.5e-6)
    assert wavelength[np.argmax(amplitude)] == pytest.approx(0.2e-3, rel=1e-6)


def test_runout_makes_marks_one_turn_apart() -> None:
    """With run-out one edge leaves the surface: marks a whole revolution's feed apart."""
    problem = benchmark(Engagement.down(0.1), feed_per_tooth=0.2e-3, tool=Tool(0.02, 2, runout=20e-6))
    wavelength, amplitude = spectrum(static_wall(problem, 4e-3, 8001).profile[:-1], 0.5e-6)
    assert wavelength[np.argmax(amplitude)] == pytest.approx(0.4e-3, rel=1e-6)


def test_the_simulated_wall_stands_off_by_the_location_error() -> None:
    """Least height of the simulated wall equals the location error of the response."""
    problem = benchmark(Engagement.down(0.05), 2, feed_per_tooth=1e-4)
    run = simulate(problem, 13830.0, 0.5e-3, revolutions=100, method=ExactSteps(800))
    wall = dynamic_wall(run, 1e-3, 2001)
    error = location_error(problem, [13830.0], 0.5e-3)[0]  # type: ignore[arg-type]
    assert wall.location_error == pytest.approx(error, rel=0.02)


@pytest.mark.slow
def test_a_measured_response_keeps_its_static_deflection() -> None:
    """A FRF that begins at 20 Hz gives the published location error of its modes (36.70644, 3.73467, -2.07386 um)."""
    problem = benchmark(Engagement.down(0.05), 2, feed_per_tooth=1e-4)
    measured = frequency_response.modal(problem.dynamics, np.arange(20.0, 6001.0, 1.0))  # type: ignore[arg-type]
    speeds = [13830.0, 12500.0, 5000.0]
    with pytest.warns(ToolpointWarning, match="static deflection included"):
        error = location_error(problem.changed(dynamics=measured), speeds, 0.5e-3)  # type: ignore[arg-type]
    assert error == pytest.approx([36.70644e-6, 3.73467e-6, -2.07386e-6], abs=0.02e-6)


def test_up_milling_finishes_the_wall_at_the_entry() -> None:
    cuts = (Engagement.down(0.1), Engagement.slot(), Engagement.up(0.1), Engagement.centred(0.5))
    assert [wall_side(cut) for cut in cuts] == ["exit", "exit", "entry", None]
    problem = benchmark(Engagement.up(0.05), 2, feed_per_tooth=1e-4)
    run = simulate(problem, 5000.0, 0.5e-3, revolutions=100, method=ExactSteps(800))
    error = location_error(problem, [5000.0], 0.5e-3, side="entry")[0]  # type: ignore[arg-type]
    assert dynamic_wall(run, 1e-3, 2001, side="entry").location_error == pytest.approx(error, rel=0.02)


def test_gaussian_filter_passes_half_at_its_cutoff() -> None:
    """ISO 16610-21: 50 % at the cutoff, exp(-pi (alpha lc/l)^2) elsewhere; a constant stays."""
    x = np.arange(20000) * 1e-6
    for wave, share in ((0.8e-3, 0.5), (1.6e-3, np.exp(-np.log(2) / 4)), (0.4e-3, np.exp(-np.log(2) * 4))):
        z = np.cos(2 * np.pi * x / wave)
        passed = gaussian(z, 1e-6, 0.8e-3)[5000:15000]
        assert passed @ z[5000:15000] / np.sum(z[5000:15000] ** 2) == pytest.approx(share, abs=2e-3)
    assert gaussian(np.ones(4000), 1e-6, 0.8e-3) == pytest.approx(1, rel=1e-12)
    with pytest.raises(ToolpointError, match="cutoff"):
        gaussian(np.ones(400), 1e-6, 0.8e-3)


@settings(max_examples=25, deadline=None)
@given(st.integers(64, 700), st.sampled_from(["9/7", "5/3"]), st.integers(0, 1000))
def test_lifting_reconstructs(n: int, wavelet: str, seed: int) -> None:
    """Any length, any profile: the inverse returns the profile to 1e-12, and the bands add up to it."""
    z = np.random.default_rng(seed).standard_normal(n)
    lifting = Lifting(4, wavelet)
    assert lifting.inverse(lifting.forward(z)) == pytest.approx(z, abs=1e-12)
    assert lifting.bands(z).sum(0) == pytest.approx(z, abs=1e-12)


def test_three_wavelengths_go_to_three_bands() -> None:
    """Roughness 30 um, waviness 0.8 mm and form 16.4 mm are separate with at least 95 % of their energy in place."""
    x = np.arange(2**14) * 2e-6
    parts = [1e-6 * np.sin(2 * np.pi * x / 30e-6), 2e-6 * np.sin(2 * np.pi * x / 0.8e-3),
             5e-6 * np.cos(2 * np.pi * x / 16.384e-3)]
    found = separate(sum(parts), 2e-6, 0.15e-3, form_above=4e-3)  # type: ignore[arg-type]
    for got, want in zip((found.roughness, found.waviness, found.form), parts):
        assert np.sum((got - want) ** 2) < 0.05 * np.sum(want**2)
    assert found.roughness + found.waviness + found.form == pytest.approx(sum(parts), abs=1e-17)
