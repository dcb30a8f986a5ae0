"""Noise of measured lines in the stated error of limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from toolpoint import Modes
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool, stability
from toolpoint.cutting.cut.problem import plane_dynamics
from toolpoint.cutting.stability.hill.method import HillDeterminant
from toolpoint.cutting.stability.hill.noise import line_variance
from toolpoint.vibration import Frf, frequency_response

MODES = Modes([400.0, 650.0], [0.04, 0.03], np.array([[0.7, 0.2], [0.1, 0.8]]), ("tool:+x", "tool:+y"))
CLEAN = frequency_response.modal(MODES, np.arange(20.0, 1500.0, 2.0))
LEVEL = 0.01 * float(np.sqrt((np.abs(CLEAN.values) ** 2).mean()))


def measured(seed: int, *, stated: bool = False) -> Frf:
    rng = np.random.default_rng(seed)
    pair = rng.standard_normal(CLEAN.values.shape) + 1j * rng.standard_normal(CLEAN.values.shape)
    return replace(CLEAN, values=CLEAN.values + LEVEL * pair / np.sqrt(2),
                   variance=np.full(CLEAN.values.shape, LEVEL**2) if stated else None)


def limit(frf: Frf) -> tuple[float, float]:
    problem = MillingProblem(Tool(0.016, 3), Engagement.down(0.3), CuttingCoefficients(7e8, 2.5e8), frf)
    chart = stability.chart(problem, [6000.0], HillDeterminant(), depth_max=0.02)
    return float(chart.limit[0]), float(chart.error[chart.limit_points()[0]])


def test_the_scatter_of_neighbouring_lines_is_the_noise_that_was_added() -> None:
    estimate = line_variance(plane_dynamics(measured(0)))
    assert estimate.mean() == pytest.approx(LEVEL**2, rel=0.1)
    clean = line_variance(plane_dynamics(CLEAN))
    assert clean.mean() < 1e-3 * LEVEL**2  # resonances of this width are not taken for noise
    stated = plane_dynamics(measured(0, stated=True))
    assert np.allclose(line_variance(stated)[:, :2, :2], LEVEL**2)


def test_a_stated_variance_turns_with_the_feed() -> None:
    plane = plane_dynamics(measured(0, stated=True))
    assert plane.variance is not None
    turned = plane.rotated(0.6).variance
    assert turned is not None and np.allclose(turned, LEVEL**2)  # equal noise in all entries is equal in all axes


@pytest.mark.slow
@pytest.mark.parametrize("stated", [False, True])
def test_the_stated_error_is_the_scatter_of_limits_over_measurements(stated) -> None:
    exact = MillingProblem(Tool(0.016, 3), Engagement.down(0.3), CuttingCoefficients(7e8, 2.5e8), MODES)
    truth = float(stability.chart(exact, [6000.0], depth_max=0.02).limit[0])
    limits, errors = np.array([limit(measured(seed, stated=stated)) for seed in range(40)]).T
    assert np.mean(np.abs(limits - truth) <= errors) >= 0.88  # 95 % of 40, three deviations
    assert 0.7 < np.median(errors) / (1.96 * limits.std()) < 1.8
