"""Chart of posterior samples: what is drawn is what the samples hold."""

import numpy as np
import pytest

from toolpoint._check import ToolpointError
from toolpoint.plot.figures.measured.posterior import posterior_corner


def test_histograms_are_densities_and_pairs_lie_below_the_diagonal():
    rng = np.random.default_rng(1)
    values = rng.normal(size=(4000, 3)) * [1.0, 2.0, 0.5]
    made = posterior_corner(values, ["a <b>", "b", "c"], (np.zeros(3), np.array([1.0, 2.0, 0.5])))
    bars = [t for t in made.data if t.type == "bar"]
    assert len(bars) == 3 and sum(t.type == "heatmap" for t in made.data) == 3
    for bar in bars:
        assert np.sum(bar.y) * (bar.x[1] - bar.x[0]) == pytest.approx(1.0)
    assert "a &lt;b&gt;" in made.to_json()


def test_at_most_six_parameters_are_drawn_and_no_samples_are_refused():
    made = posterior_corner(np.random.default_rng(2).normal(size=(50, 9)), list("abcdefghi"))
    assert sum(t.type == "bar" for t in made.data) == 6
    with pytest.raises(ToolpointError, match="no samples"):
        posterior_corner(np.zeros((0, 2)), ["a", "b"])
