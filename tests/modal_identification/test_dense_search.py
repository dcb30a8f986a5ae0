"""Search for a missing mode on dense lines: averaged lines about each trial find the pole that all lines find, as plainly."""

import numpy as np
import pytest

from toolpoint.modal_identification.fit import completion
from toolpoint.modal_identification.fit.estimate import residual, starting_weight
from toolpoint.modal_identification.fit.refinement import Data, evaluate
from toolpoint.vibration import Frf, Modes, frequency_response

LINES, MISSING = 2500, 1310.0


@pytest.fixture(scope="module")
def fitted():
    """Data of three modes of which the fit has two."""
    modes = Modes([420.0, 1270.0, MISSING], [0.01, 0.008, 0.006], [[1.0, 0.8, 0.1], [0.7, -0.5, 0.2]], ["1:+x", "2:+x"])
    exact = frequency_response.modal(modes, np.linspace(100, 2000, LINES)).selected(range(2), [0])
    pair = np.random.default_rng(3).standard_normal((2, *exact.values.shape))
    noise = 1e-3 * np.sqrt((np.abs(exact.values) ** 2).mean()) * (pair[0] + 1j * pair[1])
    data = Data.of(Frf(exact.frequency, exact.values + noise, exact.outputs, exact.inputs, "receptance"))
    poles = -modes.damping_ratio * modes.omega + 1j * modes.omega * np.sqrt(1 - modes.damping_ratio**2)
    return data, evaluate(data, poles[:2] / data.scale, np.ones((1, 2), complex), weight=starting_weight(data.frf)), poles[2]


@pytest.mark.parametrize("most_lines", [LINES + 1, 1])
def test_the_missing_mode_is_the_best_candidate(fitted, monkeypatch, most_lines):
    data, fit, pole = fitted
    monkeypatch.setattr(completion, "MAX_SEARCHED_LINES", most_lines)
    candidate = completion.search(data, fit, residual(data, fit))
    # Trial poles lie a half width apart, at the damping that the others have.
    assert abs(candidate.pole.imag * data.scale - pole.imag) < 2 * abs(pole.real)
    assert candidate.gain > 100


def test_both_ways_explain_the_residual_alike(fitted, monkeypatch):
    data, fit, _ = fitted
    gains = []
    for most_lines in (LINES + 1, 1):
        monkeypatch.setattr(completion, "MAX_SEARCHED_LINES", most_lines)
        gains.append(completion.search(data, fit, residual(data, fit)).gain)
    assert gains[1] == pytest.approx(gains[0], rel=0.1)
