"""Compiled kernels of drives against NumPy forms that read like the equations of their docstrings."""

import numpy as np
import pytest
import scipy

from toolpoint.drives import (
    Contact,
    Controller,
    Inverter,
    JerkLimits,
    PositionLoop,
    Stribeck,
    TorqueMotor,
    VelocityLoop,
    low_pass,
    notch,
    seven_phase,
)
from toolpoint.drives.controller.records import CONTROL_STATE, PARAMETERS, SET_POINT
from toolpoint.drives.friction.records import LAW_STATE

RNG = np.random.default_rng(3)


def record_of(array):
    """Return the one record of an array as the kernels take it."""
    return np.rec.array(np.atleast_1d(array))[0]


def test_a_segment_is_sampled_as_seven_phases():
    from toolpoint.drives.program.planner_kernel import phases, sample_motion

    limits, length, step = JerkLimits(0.4, 3.0, 80.0), 0.3, 1e-3
    profile = seven_phase(length, limits)
    times, junction, n = np.zeros((1, 7)), np.zeros(2), int(profile.duration / step)
    phases(np.array([length]), np.array([limits.speed]), junction, np.array([3.0]), np.array([80.0]), times)
    np.testing.assert_allclose(times[0], [t for t, _ in profile.phases], rtol=1e-9)
    segment, share, motion = np.zeros(n, np.int64), np.zeros(n), np.zeros((n, 3))
    assert sample_motion(times, junction, np.array([80.0]), np.array([length]), step, segment, share, motion) == n
    np.testing.assert_allclose(motion, profile.sample(np.arange(n) * step)[:, :3], atol=1e-9)
    np.testing.assert_allclose(share, motion[:, 0] / length, atol=1e-12)


def test_look_ahead_lowers_what_cannot_be_reached():
    from toolpoint.drives.program.planner_kernel import look_ahead

    limits = JerkLimits(0.5, 3.0, 80.0)
    length, speed_max, junction = np.array([0.001, 0.3]), np.full(2, 0.5), np.array([0.0, 0.5, 0.0])
    look_ahead(length, speed_max, junction, np.full(2, 3.0), np.full(2, 80.0), np.zeros(2, bool))
    from toolpoint.drives.program.jerk_profile import speed_change

    assert junction[0] == junction[2] == 0
    assert speed_change(0.0, junction[1], limits)[2] == pytest.approx(0.001, rel=1e-9)


def test_torque_filters_are_those_of_scipy():
    from toolpoint.drives.controller.kernel import filter_torque

    filters = (notch(180.0), low_pass(400.0))
    loop = VelocityLoop(1.0, filters=filters)
    p = record_of(Controller(PositionLoop(20.0), loop, 1e-3).parameters(TorqueMotor()))
    s, torque = record_of(np.zeros((), CONTROL_STATE)), RNG.normal(size=60)
    filtered = [filter_torque(p, s, value) for value in torque]
    for part in filters:
        b0, b1, b2, a1, a2 = part.coefficients(loop.sample_time)
        torque = scipy.signal.lfilter([b0, b1, b2], [1, a1, a2], torque)
    np.testing.assert_allclose(filtered, torque, atol=1e-12)


def test_position_and_velocity_samples_are_the_cascade():
    from toolpoint.drives.controller.kernel import position_sample, velocity_sample

    position, velocity, lead = PositionLoop(25.0, velocity_feedforward=0.8), VelocityLoop(0.6, 0.02), 2e-3
    p = record_of(Controller(position, velocity, lead).parameters(TorqueMotor()))
    s, point = record_of(np.zeros((), CONTROL_STATE)), record_of(np.array((0.01, 0.2, 0.0), SET_POINT))
    position_sample(p, s, point, 3.0, 0.0)
    speed_set = (25.0 * (0.01 - 3.0 * lead) + 0.8 * 0.2) / lead
    assert s.speed_set == pytest.approx(speed_set, rel=1e-12)
    for number in range(3):
        velocity_sample(p, s, 3.0, 1.5, 0.0, 0.0, 0.0)
        error = speed_set - 1.5
        assert s.torque_set == pytest.approx(0.6 * error * (1 + number * velocity.sample_time / 0.02), rel=1e-12)


def test_switched_legs_give_the_commanded_voltage_in_the_mean():
    from toolpoint.drives.controller.kernel import write_switched_voltage

    p, s = np.zeros((), PARAMETERS), np.zeros((), CONTROL_STATE)
    inverter = Inverter(320.0, "six-pulse")
    p["voltage_limit"], p["carrier"], p["pole_pairs"], p["current_sample_time"] = inverter.voltage, 1, 4, 1e-4
    s["voltage_d"], s["voltage_q"], s["held_angle"] = 40.0, -110.0, 0.3
    p, s, total, parts = record_of(p), record_of(s), np.zeros(2), 16
    for k in range(parts):
        out = np.empty(2)
        write_switched_voltage(p, s, k / parts, 1 / parts, 0.3, 0.0, out)
        total += out / parts
    np.testing.assert_allclose(total, [40.0, -110.0], rtol=1e-9)


def test_dry_friction_and_contact_are_those_of_the_laws():
    from toolpoint.drives.friction.kernel import contact_correction, dry

    law, contact = Stribeck(2.0, 3.0, 0.05, 0.0, 1.5), Contact.preloaded(2e8, 500.0)
    for speed in (1e-3, 0.03, 0.4):
        level, slope = dry(record_of(law.record), speed)
        assert (level, slope) == pytest.approx((float(law.level(speed)), float(law.slope(speed))), rel=1e-12)
    for deflection in (-1e-5, 1e-6, 2e-5):
        w, _ = contact_correction(record_of(contact.record), deflection)
        assert w == pytest.approx(contact.reference_stiffness * deflection - float(contact.force(deflection)), abs=1e-6)


def test_a_law_is_solved_in_its_surroundings():
    from toolpoint.drives.friction.kernel import solve_law

    contact, free, gain = Contact.with_backlash(1e7, 4e-6), 1e-5, 4e-8
    state, trial = record_of(np.zeros((), LAW_STATE)), record_of(np.zeros((), LAW_STATE))
    s, w, converged = solve_law(record_of(contact.record), state, 1e-4, free, gain, 0.0, trial)

    def correction(deflection):
        return contact.reference_stiffness * deflection - float(contact.force(deflection))

    root = scipy.optimize.brentq(lambda x: x - free - gain * correction(x), -1e-3, 1e-3, xtol=1e-18)
    assert converged and (s, w) == pytest.approx((root, correction(root)), rel=1e-8)


def test_products_by_columns_are_matrix_products():
    from toolpoint.drives.simulation.kernel import add_columns, add_rounded

    columns, x, start = RNG.normal(size=(7, 5)), RNG.normal(size=7), RNG.normal(size=5)
    for kernel in (add_columns, add_rounded):
        out = start.copy()
        kernel(columns, x, out)
        np.testing.assert_allclose(out, start + columns.T @ x, rtol=1e-12)
