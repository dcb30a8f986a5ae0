"""Terms outside the band, reduced to what the responses share: certainty gained, and none claimed that is not there."""

from __future__ import annotations

import numpy as np
import pytest

from modal_identification.modal_case import (
    ABOVE,
    BAND,
    DAMPING,
    DAMPING_ABOVE,
    IN_BAND,
    benchmark,
    labels,
    responses,
    with_noise,
)
from toolpoint import Modes
from toolpoint.modal_identification import identify
from toolpoint.modal_identification.fit import estimate

POINTS, SEEDS = 45, 12


def alike(rng: np.random.Generator) -> Modes:
    """Return a structure whose modes above the band have the shapes of modes 1, 11 and 12 within it."""
    shape = np.linalg.qr(rng.standard_normal((3 * POINTS, IN_BAND.size)))[0]
    return Modes(np.concatenate([IN_BAND, ABOVE]), np.concatenate([DAMPING, DAMPING_ABOVE]),
                 np.column_stack([shape, shape[:, [11, 10, 0]]]), labels(POINTS))


def intervals_that_hold(make, noise: float) -> float:
    inside = []
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        found = identify(with_noise(make(rng), noise, rng), band=BAND).modes
        assert found.count == IN_BAND.size
        inside.append([np.abs(found.frequency - IN_BAND) < found.frequency_interval,
                       np.abs(found.damping_ratio - DAMPING) < found.damping_interval])
    return float(np.mean(inside))


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.01, 0.05])
def test_intervals_hold_where_the_modes_outside_look_like_those_inside(noise):
    held = intervals_that_hold(lambda rng: responses(alike(rng), 2, "accelerance"), noise)
    assert held > 0.95 - 3 * np.sqrt(0.95 * 0.05 / (2 * SEEDS * IN_BAND.size))


@pytest.mark.slow
def test_the_modes_at_the_ends_of_the_band_gain_most(monkeypatch):
    rng = np.random.default_rng(0)
    frf = with_noise(benchmark(rng, points=POINTS, placed=True).frf, 0.05, rng)
    reduced = identify(frf, band=BAND).modes.damping_interval
    monkeypatch.setattr(estimate, "reduce_outside_terms", lambda data, fit, spread: (data, fit, fit.information))
    whole = identify(frf, band=BAND).modes.damping_interval
    assert (reduced < 1.02 * whole).all()
    assert reduced[0] < 0.9 * whole[0]
    assert reduced[0] / whole[0] < (reduced[5] / whole[5])


@pytest.mark.slow
def test_few_responses_keep_all_terms(monkeypatch):
    rng = np.random.default_rng(1)
    frf = with_noise(benchmark(rng, points=5).frf, 0.01, rng).selected(range(15), [0])
    now = identify(frf, band=BAND).modes.frequency_interval
    monkeypatch.setattr(estimate, "reduce_outside_terms", lambda data, fit, spread: (data, fit, fit.information))
    assert (now == identify(frf, band=BAND).modes.frequency_interval).all()


@pytest.mark.slow
def test_modes_outside_of_many_patterns_are_all_kept():
    """Twenty modes just outside the band: fewer terms than are there would bias the mode at the edge."""
    rng = np.random.default_rng(2)
    frequency = np.concatenate([np.linspace(8, 19, 6), IN_BAND, np.linspace(500, 560, 10)])
    shape = np.linalg.qr(rng.standard_normal((3 * POINTS, frequency.size)))[0]
    modes = Modes(frequency, np.full(frequency.size, 0.015), shape, labels(POINTS))
    found = identify(with_noise(responses(modes, 2, "accelerance"), 0.002, rng), band=BAND).modes
    inner = found.between(30, 470)
    assert inner.count == IN_BAND.size
    off = np.abs(inner.frequency - IN_BAND) / inner.frequency_interval * 1.96
    assert off.max() < 4.5


@pytest.mark.slow
def test_a_mode_that_looks_like_the_rest_gains_nothing(monkeypatch):
    """The mode at 410 Hz has the shape of the only one outside, at 560 Hz."""
    rng = np.random.default_rng(0)
    modes = alike(rng).selected(range(IN_BAND.size + 1))
    frf = with_noise(responses(modes, 2, "accelerance"), 0.05, rng)
    reduced = identify(frf, band=BAND).modes.damping_interval
    monkeypatch.setattr(estimate, "reduce_outside_terms", lambda data, fit, spread: (data, fit, fit.information))
    whole = identify(frf, band=BAND).modes.damping_interval
    assert reduced[11] == pytest.approx(whole[11], rel=0.02)
    assert reduced[0] < 0.9 * whole[0]
