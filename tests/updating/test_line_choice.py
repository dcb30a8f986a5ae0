"""Lines that carry a measurement, and the noise that lines show by their scatter."""

import numpy as np
import pytest

from toolpoint.updating import Targets
from toolpoint.updating.measured.line_choice import choose_lines, on_chosen_lines
from toolpoint.vibration import Frf
from toolpoint.vibration.line_noise import line_noise


def responses(noise, rng, lines=2000):
    """Two resonances of 1 % at 40 and 130 Hz at three points."""
    f = np.linspace(0.2, 200, lines)
    g = np.stack([1 / (f0**2 - f**2 + 0.02j * f0 * f) for f0 in (40.0, 130.0)], axis=1) @ np.array([[1, 2, -1], [1.0, -1, 3]])
    size = noise * np.sqrt((np.abs(g) ** 2).mean() / 2)
    values = g + size * (rng.normal(size=g.shape) + 1j * rng.normal(size=g.shape))
    return Frf(f, values[:, :, None], ["1:+x", "2:+x", "3:+x"], ["1:+x"], variance=np.full((*g.shape, 1), 2 * size**2))


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.2])
def test_lines_stand_where_responses_turn_and_over_the_band(noise):
    frf = responses(noise, np.random.default_rng(0))
    at = choose_lines(Targets(frf=frf), 120)
    f = frf.frequency[at]
    assert at.size <= 120 and at[0] == 0 and at[-1] == frf.frequency.size - 1
    near = sum((np.abs(f / f0 - 1) < 0.03).sum() for f0 in (40.0, 130.0)) / f.size
    assert near > 0.15  # they are 5 % of the band
    assert np.diff(f).max() < 8.0


def test_few_lines_stay_as_they_are():
    frf = responses(0.0, np.random.default_rng(0), lines=60)
    targets = Targets(frf=frf)
    assert on_chosen_lines(targets) is targets
    np.testing.assert_array_equal(choose_lines(targets, 60), np.arange(60))


def test_chosen_lines_keep_their_variance_and_correlation():
    frf = responses(0.1, np.random.default_rng(1), lines=400)
    correlation = 0.3 ** np.abs(np.subtract.outer(np.arange(400), np.arange(400)))
    few = on_chosen_lines(Targets(frf=frf, line_correlation=correlation), 50)
    at = np.searchsorted(frf.frequency, few.frf.frequency)
    np.testing.assert_array_equal(few.frf.values, frf.values[at])
    np.testing.assert_array_equal(few.frf.variance, frf.variance[at])
    np.testing.assert_array_equal(few.line_correlation, correlation[np.ix_(at, at)])


def test_scatter_of_lines_is_their_noise():
    for noise in (0.01, 0.1):
        frf = responses(noise, np.random.default_rng(2))
        np.testing.assert_allclose(line_noise(frf.values), np.sqrt(frf.variance[0]), rtol=0.1)
    assert line_noise(responses(0.0, np.random.default_rng(2)).values).max() < 1e-3 * np.abs(frf.values).max()
    assert not line_noise(frf.values[:11]).any()  # too few to tell
