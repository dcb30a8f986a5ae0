"""Noise that the responses of a point share and that is smooth along the lines, as a windowed hammer force makes it."""

from __future__ import annotations

import numpy as np
import pytest

from modal_identification.modal_case import BAND, DAMPING, IN_BAND, benchmark, with_noise
from toolpoint.modal_identification import identify
from toolpoint.modal_identification.fit import estimate
from toolpoint.vibration import Frf

POINTS, SEEDS = 20, 4


def shared_noise(frf: Frf, part: float, rng: np.random.Generator, over: int = 20) -> Frf:
    """Return the responses times 1 + eta, one eta for the three directions of a point, smooth over about `over` lines."""
    kernel = np.hanning(over + 2)[1:-1]
    lines, points = frf.frequency.size, len(frf.outputs) // 3
    raw = rng.standard_normal((lines + over - 1, points, 2)) @ np.array([1, 1j]) / np.sqrt(2)
    eta = np.stack([np.convolve(column, kernel / np.linalg.norm(kernel), "valid") for column in raw.T], axis=1)
    return Frf(frf.frequency, frf.values * (1 + part * np.repeat(eta, 3, axis=1))[:, :, None], frf.outputs, frf.inputs,
               frf.quantity)


def standardised_errors(seeds: int) -> float:
    """Root mean square of the errors of frequency and damping over their stated deviation."""
    found = []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        frf = shared_noise(with_noise(benchmark(rng, points=POINTS, placed=True).frf, 1e-3, rng), 0.02, rng)
        modes = identify(frf, band=BAND).modes
        assert modes.count == IN_BAND.size
        found.append([(modes.frequency - IN_BAND) / modes.frequency_interval,
                      (modes.damping_ratio - DAMPING) / modes.damping_interval])
    return float(1.96 * np.sqrt(np.mean(np.square(found))))


@pytest.mark.slow
def test_shared_smooth_noise_widens_the_intervals_to_what_the_errors_are(monkeypatch):
    assert standardised_errors(SEEDS) == pytest.approx(1.0, abs=0.35)
    monkeypatch.setattr(estimate, "widening", lambda fit, outputs: np.ones(fit.poles.size))
    assert standardised_errors(2) > 1.6  # a fault of this size shows in two of the five


@pytest.mark.slow
def test_independent_noise_widens_nothing(monkeypatch):
    seen = []
    monkeypatch.setattr(estimate, "widening", lambda fit, outputs: seen.append(original(fit, outputs)) or seen[-1])
    for seed in range(2):
        rng = np.random.default_rng(seed)
        identify(with_noise(benchmark(rng, points=POINTS, placed=True).frf, 0.02, rng), band=BAND)
    assert np.mean(np.array(seen) > 1) < 0.06


original = estimate.widening
