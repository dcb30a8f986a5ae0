"""Reducers: pieces of torsion, lost motion and hysteresis against closed forms, the joint, and catalogues."""

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.joints import Reducer, choose_reducer, next_ratio, reflect_inertia

PIECES = {"ratio": 100, "torsion": (2.0e4, 3.0e4, 4.0e4), "torques": (10.0, 40.0), "bending": 4e5}


def test_twist_adds_up_the_pieces_and_is_odd():
    gear = Reducer(**PIECES)
    # By hand: 10/2e4 + 30/3e4 + 20/4e4.
    assert gear.twist(60.0) == pytest.approx(5e-4 + 1e-3 + 5e-4, rel=1e-14)
    assert gear.twist(-60.0) == pytest.approx(-2e-3, rel=1e-14)


def test_torque_is_the_inverse_of_twist():
    gear = Reducer(**PIECES, lost_motion=2e-4, lost_motion_torque=1.0)
    torque = np.linspace(-90, 90, 181)
    np.testing.assert_allclose(gear.torque(gear.twist(torque)), torque, atol=1e-10)
    # What defines lost motion: the twist between plus and minus that torque.
    assert gear.twist(1.0) - gear.twist(-1.0) == pytest.approx(2e-4, rel=1e-12)


@pytest.mark.parametrize(("load", "slope"), [(0.0, 2e4), (25.0, 3e4), (-25.0, 3e4), (60.0, 4e4)])
def test_small_vibration_sees_the_slope_at_the_load(load, slope):
    assert Reducer(**PIECES).linearise(load).stiffness == slope


def test_the_loop_is_as_wide_at_no_torque_as_the_hysteresis():
    gear = Reducer(ratio=100, torsion=(2e4,), bending=4e5, hysteresis=3e-4)
    twist = 5e-3 * np.sin(np.linspace(0, 4 * np.pi, 200001))
    torque = gear.history(twist)
    last = slice(100000, None)
    crossing = np.flatnonzero(np.diff(np.sign(torque[last])))
    assert np.ptp(twist[last][crossing]) == pytest.approx(3e-4, rel=1e-3)


def test_first_harmonic_of_a_sliding_loop_against_its_closed_form():
    # Coulomb limit: a slider that turns over at once loses 4 T_f a a cycle, so the loss modulus is 4 T_f/(pi a).
    gear = Reducer(ratio=100, torsion=(2e4,), bending=4e5, hysteresis=3e-4, settling=1e-9)
    amplitude = 5e-3
    seen = gear.linearise(0.0, amplitude)
    assert seen.loss == pytest.approx(4 * gear.friction / (np.pi * amplitude), rel=0.01)
    assert seen.stiffness == pytest.approx(2e4, rel=0.01)


def test_joint_has_torsion_two_bending_springs_and_dampers():
    joint = Reducer(ratio=80, torsion=(2.5e4,), bending=39.2e4, damping=14.0).joint()
    assert joint.states == ("locked", "locked", "locked", "elastic", "elastic", "elastic")
    np.testing.assert_allclose(np.diag(joint.stiffness)[3:], [39.2e4, 39.2e4, 2.5e4])
    np.testing.assert_allclose(np.diag(joint.damping)[3:], [0, 0, 14.0])


def test_catalogue_gives_the_nearest_ratio_of_the_size_and_the_next_of_a_series():
    rows = {f"a-{r}": Reducer(ratio=r, torsion=(1e4,), bending=1e5, diameter=0.08, series="a") for r in (50, 80, 100)}
    rows["b-70"] = Reducer(ratio=70, torsion=(1e4,), bending=1e5, diameter=0.11)
    assert choose_reducer(rows, 69) == "b-70"
    assert choose_reducer(rows, 69, largest_diameter=0.09) == "a-80"
    assert next_ratio(rows, "a-80") == "a-100"
    assert next_ratio(rows, "a-100") is None
    with pytest.raises(ToolpointError, match="did you mean 'a-80'"):
        next_ratio(rows, "a80")


def test_rotor_through_the_ratio():
    assert reflect_inertia(3e-5, 100) == pytest.approx(0.3)


@pytest.mark.parametrize(("change", "words"), [
    ({"torsion": ()}, "torsion: missing"), ({"bending": None}, "bending: missing"), ({"ratio": 0.5}, "at least 1"),
    ({"torques": (10.0,)}, "one fewer"), ({"lost_motion": 1e-4}, "both or neither"), ({"damping": -1.0}, "damping"),
])
def test_rows_that_are_no_reducer_are_refused(change, words):
    with pytest.raises(ToolpointError, match=words):
        Reducer(**{**PIECES, **change})
