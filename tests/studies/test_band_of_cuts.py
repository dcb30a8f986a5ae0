"""Lines of a measured response that a chart is made of: low ones go only where they hold drift or noise."""

import numpy as np
import pytest

from toolpoint.studies.cuts.tool_dynamics import take_band
from toolpoint.vibration import Dof, Frf, Modes, frequency_response

LINES = np.arange(1.0, 1200.0, 0.25)
TIP = Dof("tool", "+x")


def response(frequencies=(16.0, 300.0), masses=(400.0, 20.0)):
    """The receptance of a machine on its feet below a spindle."""
    modes = Modes(list(frequencies), [0.02, 0.03], [1 / np.sqrt(masses)], [TIP])
    return frequency_response.modal(modes, LINES)


def test_a_low_mode_without_noise_stays_whatever_part_of_the_range_it_is_in():
    frf = take_band(response(), None)
    assert frf.frequency[0] == 1.0 and not frf.notes
    assert np.abs(frf.values - response().values).max() == 0


def test_a_sharp_low_mode_is_no_noise():
    modes = Modes([20.0, 60.0], [0.002, 0.03], [[0.1, 0.03]], [TIP])
    frf = frequency_response.modal(modes, LINES)
    assert take_band(frf, None).frequency[0] == 1.0


@pytest.mark.parametrize("seed", range(3))
def test_low_lines_that_hold_nothing_but_noise_of_the_accelerometer_go_with_a_note(seed):
    accelerance = response((250.0, 300.0)).converted_to("accelerance")
    rng = np.random.default_rng(seed)
    noise = 2e-4 * np.abs(accelerance.values).max() * (rng.standard_normal((LINES.size, 2)) @ [1, 1j])[:, None, None]
    frf = take_band(Frf(LINES, accelerance.values + noise, (TIP,), (TIP,), "accelerance"), None)
    assert 1.0 < frf.frequency[0] <= 0.021 * LINES[-1] and any("left out" in note for note in frf.notes)
