"""Responses of an axis that shakes itself, in closed loop: free of the controller and of loads, with honest intervals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from toolpoint._check import ToolpointError
from toolpoint.signals import driven_axis_test
from toolpoint.vibration import Record

RATE, MASS, FREQUENCY, DAMPING = 1000.0, 200.0, 42.0, 0.02


def closed_loop(load: float, seconds: float = 120.0, seed: int = 0, drift: float = 0.0) -> tuple[np.ndarray, Record]:
    """Return the set point and the record of a table on one spring and damper, held by a velocity controller, under loads."""
    rng, count = np.random.default_rng(seed), round(seconds * RATE)
    w = 2 * np.pi * FREQUENCY
    a, b, *_ = signal.cont2discrete((np.array([[0.0, 1.0], [-w**2, -2 * DAMPING * w]]), np.array([[0.0], [1 / MASS]]),
                                     np.eye(2), np.zeros((2, 1))), 1 / RATE)
    r, d = rng.standard_normal(count), load * 2000.0 * rng.standard_normal(count)
    state, force, velocity = np.zeros(2), np.empty(count), np.empty(count)
    for n in range(count):
        velocity[n] = state[1]
        force[n] = 4000.0 * (0.01 * r[n] - state[1]) + 20.0 * r[n]
        state = a @ state + b[:, 0] * (force[n] + d[n])
    samples = np.column_stack([force, velocity + drift * np.arange(count) / RATE])
    return r, Record(samples, RATE, ["motor:+y", "table:+y"], ["force", "velocity"])


def truth(frequency: np.ndarray) -> np.ndarray:
    """Return the mobility of the sampled system, force held between samples."""
    w = 2 * np.pi * FREQUENCY
    system = signal.cont2discrete((np.array([[0.0, 1.0], [-w**2, -2 * DAMPING * w]]), np.array([[0.0], [1 / MASS]]),
                                   np.array([[0.0, 1.0]]), np.zeros((1, 1))), 1 / RATE)
    return signal.dfreqresp((*system[:4], 1 / RATE), 2 * np.pi * frequency / RATE)[1]


def test_loads_bias_the_plain_estimate_and_not_this_one():
    r, record = closed_loop(load=0.1, seconds=200.0)
    test = driven_axis_test(r, record, 0.5, band=(10.0, 100.0))
    exact = truth(test.frf.frequency)
    error = np.abs(test.frf.values[:, 0, 0] - exact)
    plain = np.abs(test.direct_values[:, 0] - exact)
    assert np.median(error / np.abs(exact)) < 0.3 and np.median(plain) > 2 * np.median(error)
    # A complex error within 2.45 deviations in 95 % (two components).
    assert 0.85 < np.mean(error < 2.45 * np.sqrt(test.frf.variance[:, 0, 0])) <= 1.0


def test_the_ramp_of_a_moving_axis_does_not_count():
    r, record = closed_loop(load=0.0, seconds=60.0)
    _, moving = closed_loop(load=0.0, seconds=60.0, drift=0.5)
    still, ramp = (driven_axis_test(r, each, 1.0, band=(10.0, 100.0)).frf.values for each in (record, moving))
    assert np.allclose(still, ramp, rtol=1e-6)


def test_a_set_point_that_shakes_nothing_is_refused():
    rng, (_, record) = np.random.default_rng(9), closed_loop(load=0.5, seconds=60.0)
    with pytest.raises(ToolpointError, match="louder set point"):
        driven_axis_test(rng.standard_normal(record.samples.shape[0]), record, 1.0)
    with pytest.raises(ToolpointError, match="8 at least"):
        driven_axis_test(np.ones(record.samples.shape[0]), record, 0.02)
