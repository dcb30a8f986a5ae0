"""Friction: the published LuGre cases, the laws' common interface, identification, plausibility."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from toolpoint import ToolpointError, ToolpointWarning
from toolpoint.drives import Coulomb, DriveAxis, LuGre, MaxwellSlip, Stribeck, TorqueMotor, TwoExponential, Viscous, build_plant
from toolpoint.drives.axis.mechanics import MassChain, Rub
from toolpoint.drives.friction.identification import (
    check_plausibility,
    constant_velocity_points,
    friction_variants,
    identify_friction,
)
from toolpoint.drives.simulation.free_motion import simulate_free_motion

# Canudas de Wit et al. 1995, Table I
TABLE = LuGre(1e5, np.sqrt(1e5), 1.0, 1.5, 1e-3, 0.4)


def block(law, stiffness=0.0, mass=1.0):
    chain = MassChain(("m",))
    chain.inertia("m", mass)
    chain.spring({"m": 1}, stiffness)
    row = {"m": 1.0}
    mechanics = chain.build(motor=row, table=row, scale=row, lead=1.0, boundaries=(), friction=(Rub(row, law),))
    return build_plant([DriveAxis("x", TorqueMotor(), mechanics)])


def test_lugre_steady_friction():
    np.testing.assert_allclose(TABLE.steady(np.array([1e-5, 5e-4, 2e-3])), [1.499954, 1.389600, 1.009958], atol=1e-6)


@pytest.mark.slow
def test_lugre_stick_slip():
    step = 5e-5
    t = (np.arange(int(15 / step)) + 0.5) * step
    result = simulate_free_motion(block(TABLE, 2.0), 0.2 * t[:, None], step)
    v, time = result.output("speed", "x"), result.time
    up = np.flatnonzero((v[:-1] < 0.01) & (v[1:] >= 0.01))
    times = time[up] + (0.01 - v[up]) / (v[up + 1] - v[up]) * step
    np.testing.assert_allclose(times, [7.4581, 13.8208], atol=1e-4)
    assert (2 * (0.1 * time - result.output("scale", "x"))).max() == pytest.approx(1.50799, abs=1e-5)
    assert v.max() == pytest.approx(0.36982, abs=1e-5)


def test_lugre_break_away():
    step = 2e-5
    t = (np.arange(int(1.6 / step)) + 0.5) * step
    result = simulate_free_motion(block(TABLE), t[:, None], step)
    assert result.forces.max() == pytest.approx(1.43241, abs=1e-5)


@pytest.mark.parametrize("law", [
    Coulomb(2.0, 0.3), Viscous(0.5), Stribeck(1.0, 1.5, 0.01, 0.2), TwoExponential(1.0, 1.4, 0.02, 0.03, 0.1), TABLE,
    MaxwellSlip((1e4, 3e3), (0.6, 0.4), Stribeck(1.0, 1.5, 0.01, 0.2), 100.0)])
def test_common_interface(law):
    v = np.array([0.003, 0.02, 0.5])
    np.testing.assert_allclose(law.steady(-v), -law.steady(v))
    slope = (law.steady(v * (1 + 1e-6)) - law.steady(v * (1 - 1e-6))) / (2e-6 * v)
    np.testing.assert_allclose(law.slope(v), slope, rtol=1e-5, atol=1e-6)
    # Far beyond every fall of the curve the slope is the viscous part alone.
    assert law.record["viscous"] == pytest.approx(float(law.slope(1e3)), rel=1e-12)


@pytest.mark.parametrize("law", [
    Coulomb(2.0, 0.3), Stribeck(1.0, 1.5, 0.01, 0.2), TwoExponential(1.0, 1.4, 0.02, 0.03, 0.1),
    LuGre(1e4, 20.0, 1.0, 1.5, 0.01, 0.2), MaxwellSlip((1e4, 3e3), (0.6, 0.4), Stribeck(1.0, 1.5, 0.01, 0.2), 100.0)])
def test_steady_sliding_reaches_the_steady_curve(law):
    """A block pushed by the steady force at 0.1 m/s and started there keeps its velocity."""
    force = float(law.steady(0.1))
    result = simulate_free_motion(block(law), np.full((20000, 1), force), 1e-4, start=np.array([0.0, 0.1]),
                         bristles=np.array([law.level(0.1) / 1e4 if isinstance(law, LuGre) else 0.0]))
    if isinstance(law, MaxwellSlip):
        assert result.forces[-1, 0] == pytest.approx(float(law.steady(result.output("speed", "x")[-1])), rel=1e-3)
    else:
        np.testing.assert_allclose(result.output("speed", "x"), 0.1, rtol=1e-6)
        np.testing.assert_allclose(result.forces[1:, 0], force, rtol=1e-6)


def test_maxwell_slip_follows_masing():
    """With equal static and Coulomb level: the virgin curve is a sum of clipped springs, the return twice as wide."""
    from toolpoint.drives.friction.kernel import maxwell_force
    from toolpoint.drives.friction.records import LAW_STATE

    law = MaxwellSlip((4e4, 1e4, 2e3), (0.5, 0.3, 0.2), Stribeck(2.0, 2.0, 0.01), 1e9)
    k, limit = np.array(law.stiffness), 2.0 * np.array(law.share)
    laws, state, step, v = law.record[None], np.zeros(1, LAW_STATE), 1e-4, 0.01
    state["velocity"] = v
    virgin = lambda x: np.minimum(k * x, limit).sum()
    x, top = 0.0, 3e-4
    for sign in (1.0, -1.0):
        for n in range(300):
            new = state.copy()
            force, _ = maxwell_force(laws[0], state[0], step, sign * v, new[0])
            state, x = new, x + step * 0.5 * (state["velocity"][0] + sign * v)
            expected = virgin(x) if sign > 0 else virgin(top) - 2 * virgin((top - x) / 2)
            # The step in which the velocity turns has no mean velocity; a slipping block then reaches its limit at once.
            if n:
                assert force == pytest.approx(expected, abs=0.03)


@pytest.mark.parametrize("push", [0.5, 0.99])
def test_static_law_holds_below_break_away(push):
    result = simulate_free_motion(block(Coulomb(1.0)), np.full((200, 1), push), 1e-3)
    assert np.abs(result.output("scale", "x")).max() == 0.0
    assert result.forces[-1, 0] == pytest.approx(push)


def test_coulomb_deceleration_has_the_closed_form():
    """v0^2/(2 mu) of travel, then rest."""
    result = simulate_free_motion(block(Coulomb(2.0)), np.zeros((2000, 1)), 1e-3, start=np.array([0.0, 1.0]))
    assert result.output("scale", "x")[-1] == pytest.approx(0.25, rel=3e-3)
    assert result.output("speed", "x")[-1] == 0.0


def test_friction_only_takes_energy():
    for law in (TABLE, MaxwellSlip((1e4, 3e3), (0.6, 0.4), Stribeck(1.0, 1.5, 0.01), 100.0)):
        result = simulate_free_motion(block(law, 500.0), np.zeros((4000, 1)), 1e-4, start=np.array([0.02, 0.0]))
        energy = 0.5 * result.output("speed", "x") ** 2 + 250 * result.output("scale", "x") ** 2
        assert energy[-1] < energy[0]
        assert energy.max() <= energy[0] * (1 + 1e-9)


@settings(max_examples=15, deadline=None)
@given(st.floats(0.5, 5.0), st.floats(1.1, 2.0), st.floats(0.2, 2.0), st.floats(0.01, 0.3))
def test_identification_returns_the_parameters(coulomb, ratio, speed, viscous):
    law = Stribeck(coulomb, ratio * coulomb, speed, viscous)
    v = speed * np.array([-20, -8, -4, -2, -1.2, -0.7, -0.3, 0.3, 0.7, 1.2, 2, 4, 8, 20.0])
    fit = identify_friction(v, law.steady(v))
    np.testing.assert_allclose([fit.law.coulomb, fit.law.static, fit.law.stribeck_velocity, fit.law.viscous],
                               [coulomb, ratio * coulomb, speed, viscous], rtol=1e-4)


def test_identification_from_records():
    rng = np.random.default_rng(0)
    law = Coulomb(1.5, 0.02)
    speeds = np.array([-50.0, -20, -5, 5, 20, 50])
    records = [(np.full(500, v), law.steady(v) + 0.05 * rng.standard_normal(500)) for v in speeds]
    fit = identify_friction(*constant_velocity_points(records), law="coulomb")
    assert abs(fit.law.coulomb - 1.5) < 4 * max(fit.deviation[0], 0.003)
    with pytest.warns(ToolpointWarning, match="not constant"):
        constant_velocity_points([(np.sin(np.arange(100.0)), np.zeros(100))])


def test_an_offset_is_not_taken_for_friction():
    """A vertical axis: weight 3 N m, friction 0.8 N m; without an offset the level would be wrong by much."""
    v = np.array([-40.0, -20, -10, -5, 5, 10, 20, 40])
    fit = identify_friction(v, Coulomb(0.8, 0.01).steady(v) + 3.0, "coulomb")
    assert (fit.offset, fit.law.coulomb, fit.law.viscous) == pytest.approx((3.0, 0.8, 0.01), rel=1e-6)
    assert fit.levels == pytest.approx((3.8, 2.2)) and fit.status == "converged" and not fit.doubts


def test_levels_by_direction_are_those_of_the_points():
    v = np.array([-40.0, -20, -10, -5, 5, 10, 20, 40])
    fit = identify_friction(v, np.where(v > 0, 1.4, -1.0), "coulomb")
    assert fit.levels == pytest.approx((1.4, -1.0), abs=1e-6)


def test_one_direction_does_not_tell_offset_from_level():
    v = np.array([5.0, 10, 20, 40])
    fit = identify_friction(v, Coulomb(0.8, 0.01).steady(v) + 3.0, "coulomb")
    assert any("one direction" in words for words in fit.inseparable) and fit.doubts


def test_the_status_is_that_of_the_residual():
    v = np.repeat([-40.0, -20, -10, -5, 5, 10, 20, 40], 3)
    rng = np.random.default_rng(3)
    noise = 0.01 * rng.standard_normal(v.size)
    good = identify_friction(v, Coulomb(0.8, 0.01).steady(v) + noise, "coulomb")
    assert good.status == "converged" and good.scatter == pytest.approx(0.01, rel=0.5)
    bent = identify_friction(v, Coulomb(0.8, 0.01).steady(v) + 1e-3 * v * np.abs(v) + noise, "coulomb")
    assert "does not fit" in bent.status and "times the scatter" in bent.status
    unknown = identify_friction(v[::3], Coulomb(0.8, 0.01).steady(v[::3]) + 1e-3 * v[::3] * np.abs(v[::3]), "coulomb")
    assert "% of the dry level" in unknown.status


def test_parameters_that_hang_together_are_named():
    """Speeds far above the Stribeck velocity say nothing about the fall."""
    v = np.array([-40.0, -30, -25, -20, 20, 25, 30, 40])
    fit = identify_friction(v, Stribeck(1.0, 1.5, 0.1, 0.02).steady(v))
    assert fit.inseparable and fit.doubts


def test_plausibility_of_published_parameters():
    """P1: F_s/F_c 411 and 194, slopes -8.0 and -2.1 against 1.157, critical about 90 mm/min in x."""
    x, y = Stribeck(0.0115, 4.7318, 0.5, 0.1), Stribeck(0.0069, 1.3374, 0.5, 0.16)
    with pytest.warns(ToolpointWarning, match="critical feed"):
        report = check_plausibility(x, 0.0766 * 15.1, 0.001591)
    assert report.ratio == pytest.approx(411, abs=1)
    assert report.steepest == pytest.approx(-8.0, abs=0.05)
    assert 60e3 * report.critical_feed == pytest.approx(90, rel=0.05)
    other = check_plausibility(y, 0.0766 * 15.1, 0.001591, warn=False)
    assert (round(other.ratio), round(other.steepest, 1)) == (194, -2.1)
    assert check_plausibility(Coulomb(1.0), 1.0, 1e-3).critical_feed == 0.0
    assert list(friction_variants(x)) == ["literal", "F_c = F_s/1.5", "Coulomb"]
    assert friction_variants(x)["F_c = F_s/1.5"].static == 4.7318


def test_bad_friction():
    with pytest.raises(ToolpointError, match="below coulomb"):
        Stribeck(2.0, 1.0, 0.1)
    with pytest.raises(ToolpointError, match="sum to one"):
        MaxwellSlip((1.0, 2.0), (0.5, 0.2), Stribeck(1.0, 1.5, 0.1), 1.0)
    with pytest.raises(ToolpointError, match="not be zero"):
        identify_friction(np.array([0.0, 1, 2, 3]), np.ones(4))
