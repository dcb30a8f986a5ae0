"""Weighted correlation coefficients: equal sets, scale, and a closed form."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint._check import ToolpointError
from toolpoint.updating.measured.correlation_coefficients import coefficients
from toolpoint.vibration import Modes

DOFS = ("1:x", "2:x", "3:x")


def test_equal_sets_give_one_whatever_the_scale_and_sign():
    shape = np.random.default_rng(0).normal(size=(3, 2))
    a, b = Modes([10, 20], 0.01, shape, DOFS), Modes([10, 20], 0.02, shape * [-3.0, 0.2], DOFS)
    found = coefficients(a, b, [3.0, 1.0])
    assert [found.mean, found.mass, found.total] == pytest.approx([1.0, 1.0, 1.0])


def test_closed_form_of_frequency_and_weight():
    a = Modes([10, 20], 0.01, np.eye(3)[:, :2], DOFS)
    b = Modes([8, 20], 0.01, np.eye(3)[:, :2], DOFS)
    found = coefficients(a, b, [3.0, 1.0])
    assert found.frequency == pytest.approx([0.8, 1.0])
    assert found.mean == pytest.approx(0.9) and found.mass == pytest.approx(0.85) and found.total == pytest.approx(0.85)


def test_unpaired_sets_are_refused():
    a = Modes([10, 20], 0.01, np.eye(3)[:, :2], DOFS)
    with pytest.raises(ToolpointError, match="paired"):
        coefficients(a, a.selected([0]))
