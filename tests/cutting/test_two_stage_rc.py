"""The 2RC filter: transmission and phase in closed form, rest at a level, cut-offs that cannot be."""

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.cutting.surface.filters import two_stage_rc

SPACING, CUTOFF = 5e-6, 0.8e-3
PLACE = np.arange(0, 60e-3, SPACING)


@pytest.mark.parametrize("ratio", [0.1, 0.5, 1.0, 2.0, 5.0])
def test_transmission_and_phase_are_those_of_two_stages(ratio):
    """(j w / (j w + w0))^2 with w0 = 2 pi / (sqrt(3) cutoff), after the run-up; whole periods are judged."""
    wavelength = ratio * CUTOFF
    omega, corner = 2 * np.pi / wavelength, 2 * np.pi / CUTOFF / np.sqrt(3)
    wave = np.sin(omega * PLACE)
    passed = wave - two_stage_rc(wave, SPACING, CUTOFF)
    judged = int(np.floor(20e-3 / wavelength) * wavelength / SPACING)
    tail = slice(PLACE.size - judged, None)
    amplitude = 2 * np.mean(passed[tail] * np.exp(-1j * omega * PLACE[tail])) * 1j
    expected = (1j * omega / (1j * omega + corner)) ** 2
    assert abs(expected) == pytest.approx(1 / (1 + ratio**2 / 3), rel=1e-12)
    assert amplitude == pytest.approx(expected, abs=3e-3)


def test_a_level_profile_has_no_roughness():
    level = np.full((3, 500), 2e-6)
    assert two_stage_rc(level, SPACING, CUTOFF) == pytest.approx(level, abs=1e-18)
    assert two_stage_rc(level.T, SPACING, CUTOFF, axis=0) == pytest.approx(level.T, abs=1e-18)


def test_the_filter_looks_backwards_only():
    step = (PLACE > 10e-3).astype(float)
    waviness = two_stage_rc(step, SPACING, CUTOFF)
    assert np.all(waviness[PLACE <= 10e-3] == 0) and waviness[-1] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(("spacing", "cutoff"), [(0.0, 1e-3), (1e-3, 1e-3)])
def test_cutoffs_that_cannot_be_are_refused(spacing, cutoff):
    with pytest.raises(ToolpointError):
        two_stage_rc(np.zeros(10), spacing, cutoff)
