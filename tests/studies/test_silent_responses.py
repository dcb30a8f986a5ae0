"""Responses that the model makes exactly zero: an update goes on without them and says so; FRAC is a number."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from four_part_mill import four_part_mill, sixteen_parameters

from toolpoint._check import ToolpointWarning
from toolpoint.machine import assemble
from toolpoint.studies.measured.machine_update import update
from toolpoint.vibration import Frf, frequency_response
from toolpoint.vibration.correlation import frac

NOSE = ["nose:+x", "nose:+y"]


def responses(mill):
    return frequency_response.direct(assemble(mill, outputs=NOSE, inputs=NOSE[:1]), np.arange(5.0, 90.0, 1.0))


def test_frac_of_silent_responses_is_zero_and_of_two_of_them_one():
    rng = np.random.default_rng(2)
    values = rng.normal(size=(20, 2, 2)) + 1j * rng.normal(size=(20, 2, 2))
    values[:, 1] = 0
    first = Frf(np.arange(1.0, 21.0), values, NOSE, NOSE)
    other = values.copy()
    other[:, 1, 1] = 1.0
    np.testing.assert_allclose(frac(first, replace(first, values=other)), [[1, 1], [1, 0]], atol=1e-12)


def test_an_update_leaves_out_what_the_model_cannot_move():
    """The plane across does not move in the model at all; measured noise there must neither end nor turn the fit."""
    truth = four_part_mill()
    frf = responses(truth)
    assert np.abs(frf.values[:, 1]).max() <= 1e-12 * np.abs(frf.values).max()
    rng = np.random.default_rng(1)
    noise = 0.01 * np.abs(frf.values[:, 0]).mean() * (rng.normal(size=(85,)) + 1j * rng.normal(size=(85,)))
    values = frf.values.copy()
    values[:, 1, 0] = noise
    path = "joints.floor_base.stiffness.ry"
    paths = [p if isinstance(p, str) else p.name for p in sixteen_parameters(truth)]
    path = next(p for p in paths if "floor_base" in p and ("stiffness.ry" in p or "stiffness.x" in p))
    start = truth.with_values({path: 1.3 * truth.value(path)})
    with warnings.catch_warnings():
        warnings.simplefilter("error", ToolpointWarning)  # the scatter of its lines says that it is noise: nothing is missing
        result = update(start, [path], frf=replace(frf, values=values), limit=None)
    assert result.fit.values[path] == pytest.approx(truth.value(path), rel=1e-3)
    assert np.isnan(result.after.frac[1, 0]) and result.after.silent == 1  # noise beside rounding: nothing to compare
    assert float(result.after.frac_words[0]) == pytest.approx(result.after.frac[0, 0], abs=1e-4)
    assert "1 of 2 responses hold no more than noise" in result.table()
    moving = values.copy()
    moving[:, 1, 0] += 0.1 * frf.values[:, 0, 0]
    with pytest.warns(ToolpointWarning, match=r"nose:\+y.*does not move"):
        result = update(start, [path], frf=replace(frf, values=moving), limit=None)
    assert result.fit.values[path] == pytest.approx(truth.value(path), rel=1e-3)
    assert 0 <= result.after.frac[1, 0] < 0.2  # measured beside rounding
