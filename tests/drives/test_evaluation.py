"""Evaluation: contour error, circular test, positioning, loops' margins, filters, tuning, transformations."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drives import servo_cases as cases
from toolpoint import ToolpointError
from toolpoint.drives import (
    Controller,
    DriveAxis,
    PositionLoop,
    Servo,
    TorqueMotor,
    VelocityLoop,
    build_plant,
    circular_test,
    compute_loops,
    contour_error,
    low_pass,
    low_pass_1,
    notch,
    positioning,
    quadrant_peaks,
    step_figures,
    tune,
    two_mass_axis,
)
from toolpoint.drives.accuracy.contour import torque_comparison
from toolpoint.drives.accuracy.metrology import circular_hysteresis
from toolpoint.drives.controller.loops import margins
from toolpoint.drives.program.path import Path, polyline
from toolpoint.drives.simulation.loop_identification import average_response, prbs


def test_contour_error_on_an_arc_is_the_radial_error():
    path = Path([1], [[0.01, 0, 0]], [[0.01, 0, 0]], [[0, 0, 0]], [4 * np.pi], [[0, 1]], [0.1], [False])
    angle = np.linspace(0.1, 4 * np.pi - 0.1, 500)
    error = 1e-6 * np.sin(7 * angle)
    points = (0.01 + error)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    found = contour_error(path, points, 0.01 * angle + 1e-4, window=1e-3)
    np.testing.assert_allclose(found.length, np.abs(error), atol=1e-15)
    np.testing.assert_allclose(found.signed, -error, atol=1e-15)
    np.testing.assert_allclose(found.progress, 0.01 * angle, atol=1e-12)
    np.testing.assert_allclose(np.hypot(*found.enlarged(50)[:, :2].T), 0.01 + 50 * error, atol=1e-12)


def test_contour_error_at_a_corner_and_on_a_crossing_path():
    square = polyline(np.array([[0, 0], [1, 0], [1, 1], [0.5, -1.0]]), 0.1)
    s = np.array([1.0, 0.7, 2.0 + np.hypot(0.5, 2) * 0.6])
    points = np.array([[1.02, -0.02], [0.7, 0.01], square.at(s[2:])[0, :2] + [1e-4, 0]])
    found = contour_error(square, points, s, window=0.1)
    assert found.length[0] == pytest.approx(np.hypot(0.02, 0.02))
    np.testing.assert_allclose(found.foot[0, :2], [1, 0], atol=1e-12)
    assert found.length[1] == pytest.approx(0.01)
    assert found.length[2] < 1e-4


@settings(max_examples=30, deadline=None)
@given(st.floats(-3e-4, 3e-4), st.floats(-3e-4, 3e-4), st.floats(1e-7, 1e-4))
def test_circular_deviation_of_an_offset_oval(cx, cy, size):
    angle = np.linspace(0, 2 * np.pi, 721)
    r = 0.05 + size * np.cos(2 * angle)
    points = np.array([cx, cy]) + r[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    for method in ("least squares", "minimum zone"):
        assert circular_test(points, 0.05, method=method).deviation == pytest.approx(2 * size, rel=0.02)


def test_quadrant_peaks_and_hysteresis():
    angle = np.linspace(0, 2 * np.pi, 3601)
    r = 0.05 + 5e-6 * np.exp(-((np.degrees(angle) - 90) / 5) ** 2)
    points = r[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    np.testing.assert_allclose(quadrant_peaks(points, 0.05), [0, 5e-6, 0, 0], atol=2e-8)
    plain = 0.05 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    assert circular_hysteresis(points, plain) == pytest.approx(5e-6, rel=1e-3)


def test_positioning_repeatability_trap():
    """ISO 230-2: with unequal scatter the unidirectional 4 s exceeds 2 s+ + 2 s- + |B|, and R must follow it."""
    forward = np.array([[3e-6, -3e-6, 3e-6, -3e-6, 0.0]] * 2)
    backward = np.zeros((2, 5))
    result = positioning(forward, backward)
    s = forward[0].std(ddof=1)
    assert result.repeatability == pytest.approx(4 * s)
    assert result.repeatability > 2 * s
    shifted = positioning(forward + 5e-6, backward)
    assert shifted.reversal == pytest.approx(5e-6)
    assert shifted.repeatability == pytest.approx(max(4 * s, 2 * s + 5e-6))
    assert shifted.accuracy == pytest.approx(5e-6 + 2 * s + max(2 * s - 5e-6, 0.0))
    assert "R " in result.table()


def test_margins_of_a_known_loop():
    """1/(s (s + 1)^2): gain margin 2 at 1 rad/s, phase margin 21.4 deg at 0.682 rad/s."""
    w = np.geomspace(1e-3, 1e2, 20000)
    m = margins(w / (2 * np.pi), 1 / (1j * w * (1j * w + 1) ** 2))
    assert m.gain == pytest.approx(2.0, rel=1e-4)
    assert m.phase_crossover == pytest.approx(1 / (2 * np.pi), rel=1e-3)
    assert m.phase == pytest.approx(21.386, abs=0.02)


def test_prbs_is_of_maximum_length():
    for order in range(4, 16):
        s = prbs(order)
        correlation = np.fft.ifft(np.abs(np.fft.fft(s)) ** 2).real
        np.testing.assert_allclose(correlation[1:], -1.0, atol=1e-6)


def test_coherence_falls_with_noise():
    rng = np.random.default_rng(0)
    r = np.tile(prbs(9), (20, 1))
    y = 0.5 * r + 0.5 * rng.standard_normal(r.shape)
    clean = average_response(r, 0.5 * r, 1e-3)
    noisy = average_response(r, y, 1e-3)
    assert clean.coherence.min() > 1 - 1e-12
    assert np.median(noisy.coherence) == pytest.approx(0.5, abs=0.1)
    assert np.median(np.abs(noisy.closed)) == pytest.approx(0.5, rel=0.1)


def test_filters():
    n = notch(200.0, 0.3, 0.1)
    assert abs(n.response(np.array([200.0]))[0]) == pytest.approx(0.1)
    assert abs(n.response(np.array([200.0]), 2.5e-4)[0]) == pytest.approx(0.1, rel=1e-9)
    f = np.array([5.0, 50.0])
    for part in (n, low_pass(500.0), low_pass_1(1e-3)):
        np.testing.assert_allclose(part.response(f, 1e-5), part.response(f), rtol=1e-3)
    with pytest.raises(ToolpointError, match="half the sample rate"):
        notch(3000.0).coefficients(2.5e-4)


def test_tuning_keeps_margins_and_the_notch_helps():
    axis = DriveAxis("x", TorqueMotor(), two_mass_axis(0.01, 500.0, 2.5e-3, stiffness=1.5e8, damping=2e4))
    control = Controller(PositionLoop(10.0, 1e-3), VelocityLoop(0.1, 0.05, 250e-6, delay=1), 2.5e-3)
    start = Servo(build_plant([axis]), (control,))
    plain = tune(start, notches=0)
    better = tune(start, notches=1)
    for found in (plain, better):
        m = compute_loops(found.servo).velocity.margins(0)
        assert m.phase >= 45.0 - 0.2
        assert m.gain_db >= 8.0 - 0.05
        assert found.peak <= 10 ** (0.5 / 20) * 1.001
        assert compute_loops(found.servo).stable
    assert better.servo.controllers[0].velocity.gain >= plain.servo.controllers[0].velocity.gain


@pytest.mark.slow
def test_servo_table_names_loops():
    table = compute_loops(cases.benchmark_servo()).table()
    assert "velocity  x" in table


def test_torque_comparison():
    t = np.linspace(0, 1, 200)
    same = torque_comparison(np.sin(9 * t), np.sin(9 * t))
    assert same["relative"] == pytest.approx(0.0)
    assert same["correlation"] == pytest.approx(1.0)


def test_step_figures_of_a_second_order_system():
    """Overshoot exp(-pi zeta/sqrt(1 - zeta^2)) at pi/(w sqrt(1 - zeta^2))."""
    zeta, w = 0.4, 50.0
    wd, t = w * np.sqrt(1 - zeta**2), np.linspace(0, 0.6, 20001)
    y = 1 - np.exp(-zeta * w * t) * (np.cos(wd * t) + zeta * w / wd * np.sin(wd * t))
    found = step_figures(t, 2e-3 * y, 2e-3)
    assert found.overshoot == pytest.approx(np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2)), rel=1e-3)
    assert found.peak_time == pytest.approx(np.pi / wd, rel=1e-3)
    assert 3 / (zeta * w) < found.settling_time < 4.5 / (zeta * w)
    with pytest.raises(ToolpointError, match="must reach"):
        step_figures(t, 0.5 * np.minimum(t, 0.1), 1.0)
