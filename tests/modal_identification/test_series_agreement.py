"""Law: two struck Dofs differ by one ratio a mode, so a record with another sign, gain or place departs from all others."""

import numpy as np
import pytest

from toolpoint.modal_identification import identify
from toolpoint.modal_identification.judgement.series_agreement import question_series
from toolpoint.vibration import Frf

POINTS, COUNT = 12, 4


def measured(seed: int, slip: str = "") -> Frf:
    """Accelerances of a random structure from two struck Dofs, noise 1 %, one record with a slip."""
    rng = np.random.default_rng(seed)
    frequency, ratio = 30 * np.cumprod(1 + rng.uniform(0.2, 0.5, COUNT)), rng.uniform(0.01, 0.03, COUNT)
    shape = rng.normal(size=(POINTS, 3, COUNT))
    lines = np.arange(15.0, 1.2 * frequency[-1], 0.25)
    w, w_r = 2 * np.pi * lines[:, None], 2 * np.pi * frequency
    values = np.einsum("fr,pdr,sr->fpds", -(w**2) / (w_r**2 - w**2 + 2j * ratio * w_r * w), shape, shape[[0, 5], 0])
    values += 0.01 * np.sqrt((np.abs(values) ** 2).mean(axis=0)) * (rng.normal(size=values.shape) + 1j * rng.normal(
        size=values.shape))
    if slip == "other side":
        values[:, 7, :, 1] *= -1
    elif slip == "g":
        values[:, 7, :, 1] /= 9.80665
    elif slip == "exchanged":
        values[:, [7, 3], :, 1] = values[:, [3, 7], :, 1]
    elif slip == "sensor":  # the same in both series
        values[:, 7] *= -1
    labels = [f"{point + 1}:+{way}" for point in range(POINTS) for way in "xyz"]
    return Frf(lines, values.reshape(lines.size, -1, 2), labels, ["1:+x", "6:+x"], "accelerance")


@pytest.mark.parametrize(("slip", "points", "words"), [
    ("other side", ["8"], "opposite signs"), ("g", ["8"], "g"), ("exchanged", ["4", "8"], "by no factor"), ("sensor", [], ""),
    ("", [], "")])
@pytest.mark.default_cases(2)
def test_the_record_that_departs_from_all_others_is_named(slip, points, words):
    for seed in range(2):
        frf = measured(seed, slip)
        doubts = question_series(frf, identify(frf).modes)
        assert sorted(doubt.what.split()[1] for doubt in doubts) == points
        assert all(words in doubt.why for doubt in doubts)
        if slip in ("other side", "g"):
            factor = doubts[0].figure
            assert min(abs(factor * size - 1) for size in (-1.0, 9.80665, 1 / 9.80665)) < 0.1


def test_one_series_and_few_points_are_not_judged():
    frf = measured(0, "other side")
    modes = identify(frf).modes
    assert not question_series(frf.selected(list(range(36)), [0]), modes)
    assert not question_series(frf.selected(list(range(9)), [0, 1]), modes)
