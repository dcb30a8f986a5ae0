"""Laws of linear vibration: reciprocity, symmetry, invariance, consistency of all solution ways."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from random_systems import random_system
from toolpoint.vibration import Record, SecondOrderSystem, correlation, damping, eigen, state_space
from toolpoint.vibration import frequency_response as fr
from toolpoint.vibration.simulation import time_response

FREQUENCY = np.linspace(5, 300, 25)
seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=20, deadline=None)
@given(seeds, st.integers(1, 8))
def test_receptance_is_reciprocal_and_equal_by_every_way(seed, n):
    system = random_system(np.random.default_rng(seed), n)
    direct = fr.direct(system, FREQUENCY).values
    scale = np.abs(direct).max()
    np.testing.assert_allclose(direct, np.swapaxes(direct, 1, 2), atol=1e-12 * scale)
    np.testing.assert_allclose(fr.modal(eigen.solve_damped(system), FREQUENCY).values, direct, atol=1e-9 * scale)
    np.testing.assert_allclose(state_space.physical(system).response(FREQUENCY), direct, atol=1e-9 * scale)


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_driving_points_lose_energy(seed):
    direct = fr.direct(random_system(np.random.default_rng(seed)), FREQUENCY).values
    assert (np.diagonal(direct, axis1=1, axis2=2).imag < 0).all()


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_modes_are_orthogonal_and_do_not_depend_on_coordinates(seed):
    rng = np.random.default_rng(seed)
    system = random_system(rng, damped=False)
    modes = eigen.solve_undamped(system)
    np.testing.assert_allclose(modes.shape.T @ system.mass @ modes.shape, np.eye(6), atol=1e-9)
    np.testing.assert_allclose(modes.shape.T @ system.stiffness @ modes.shape, np.diag(modes.omega**2),
                               atol=1e-8 * modes.omega[-1] ** 2)
    # Coordinates that are stretched up to fourfold: nearly dependent ones would lose the digits that are compared.
    first, second = (np.linalg.qr(rng.normal(size=(6, 6)))[0] for _ in range(2))
    turn = first @ np.diag(rng.uniform(0.5, 2.0, 6)) @ second
    other = SecondOrderSystem(turn.T @ system.mass @ turn, turn.T @ system.stiffness @ turn)
    np.testing.assert_allclose(eigen.solve_undamped(other).frequency, modes.frequency, rtol=1e-7)


def test_batched_poses_equal_single_ones():
    system = random_system(np.random.default_rng(3), 5, (4,))
    batch_u, batch_c = eigen.solve_undamped(system), eigen.solve_damped(system)
    batch_f, batch_m = fr.direct(system, FREQUENCY), fr.modal(batch_c, FREQUENCY)
    for i in range(4):
        one = system.at_pose(i)
        np.testing.assert_allclose(batch_u.frequency[i], eigen.solve_undamped(one).frequency, rtol=1e-10)
        np.testing.assert_allclose(batch_c.poles[i], eigen.solve_damped(one).poles, rtol=1e-8)
        np.testing.assert_allclose(batch_f.values[i], fr.direct(one, FREQUENCY).values, rtol=1e-10)
        np.testing.assert_allclose(batch_m.values[i], batch_f.values[i], atol=1e-9 * np.abs(batch_f.values).max())
        assert batch_f.at_pose(i).values.shape == (25, 5, 5)


def test_quantities_are_powers_of_i_omega_and_come_back():
    frf = fr.direct(random_system(np.random.default_rng(4)), FREQUENCY)
    mobility = frf.converted_to("mobility")
    np.testing.assert_allclose(mobility.values, 2j * np.pi * FREQUENCY[:, None, None] * frf.values)
    np.testing.assert_allclose(mobility.converted_to("accelerance").converted_to("receptance").values, frf.values)
    with pytest.raises(ValueError, match="0 Hz"):
        fr.direct(random_system(np.random.default_rng(4)), [0, 1, 2], "accelerance").converted_to("receptance")


def test_static_residual_makes_the_sum_exact_at_zero_and_truncation_is_stated():
    system = damping.modal(random_system(np.random.default_rng(5), 10, damped=False), 0.02)
    few = eigen.solve_undamped(system, 4)
    band = np.linspace(0, few.frequency[-1] * 1.02, 200)
    direct = fr.direct(system, band).values
    corrected = fr.with_static_residual(few, system)
    plain_error = np.abs(fr.modal(few, band).values - direct).max() / np.abs(direct).max()
    better_error = np.abs(fr.modal(corrected, band).values - direct).max() / np.abs(direct).max()
    stated = fr.truncation(system, few, band)
    assert better_error < plain_error
    np.testing.assert_allclose(fr.modal(corrected, [0.0]).values, fr.direct(system, [0.0]).values, rtol=1e-9)
    assert stated.error == pytest.approx(plain_error, rel=0.05)
    assert stated.corrected_error == pytest.approx(better_error, rel=0.1)
    assert "left out" in str(stated)


def test_modal_damping_matrix_has_the_ratios_asked_for():
    ratios = np.linspace(0.01, 0.06, 6)
    system = damping.modal(random_system(np.random.default_rng(6), damped=False), ratios)
    np.testing.assert_allclose(eigen.solve_damped(system).damping_ratio, ratios, rtol=1e-8)
    np.testing.assert_allclose(eigen.solve_undamped(system).damping_ratio, ratios, rtol=1e-8)


def test_equivalent_viscous_damping_is_exact_at_resonance():
    base = random_system(np.random.default_rng(7), damped=False)
    structural = SecondOrderSystem(base.mass, base.stiffness, structural_damping=0.04 * base.stiffness)
    viscous = damping.equivalent_viscous(structural)
    one, two = eigen.solve_undamped(structural), eigen.solve_undamped(viscous)
    assert one.damping == "structural"
    assert two.damping == "viscous"
    np.testing.assert_allclose(one.damping_ratio, 0.02, rtol=1e-9)
    np.testing.assert_allclose(two.damping_ratio, 0.02, rtol=1e-9)
    for i, resonance in enumerate(one.frequency):
        first, second = (fr.modal(m.selected([i]), [resonance]).values for m in (one, two))
        np.testing.assert_allclose(first, second, rtol=1e-9)
    assert any("equal loss" in note for note in viscous.notes)


def test_non_proportional_damping_is_noted_where_it_is_dropped():
    modes = eigen.solve_undamped(random_system(np.random.default_rng(8)))
    assert any("left out" in note for note in modes.notes)


@pytest.mark.parametrize("hold", ["zero", "first"])
def test_exact_step_follows_the_differential_equation(hold):
    system = state_space.physical(random_system(np.random.default_rng(9), 3))
    rate, count = 2000.0, 40
    u = np.random.default_rng(10).normal(size=(count, 3)) * 100
    y = time_response.exact(system, u, rate, hold=hold)
    time = np.arange(count) / rate

    def force(t):
        k = min(int(t * rate + 1e-9), count - 2)
        part = t * rate - k
        return u[k] if hold == "zero" else u[k] * (1 - part) + u[k + 1] * part
    state = np.zeros(6)
    for k in range(count - 1):
        state = solve_ivp(lambda t, x: system.a @ x + system.b @ force(t), (time[k], time[k + 1] - 1e-12), state,
                          rtol=1e-11, atol=1e-16).y[:, -1]
        np.testing.assert_allclose(y[k + 1], system.c @ state, atol=1e-7 * np.abs(y).max())


@pytest.mark.parametrize("hold", ["zero", "first"])
def test_discretised_system_reproduces_the_exact_step(hold):
    system = state_space.physical(random_system(np.random.default_rng(11), 3))
    step = 1 / 1500.0
    discrete = system.discretised(step, hold)
    u = np.random.default_rng(12).normal(size=(60, 3))
    u[0] = 0
    expected = time_response.exact(system, u, 1 / step, hold=hold)
    x, found = np.zeros(6), []
    for k in range(60):
        found.append(discrete.c @ x + discrete.d @ u[k])
        x = discrete.a @ x + discrete.b @ u[k]
    np.testing.assert_allclose(found, expected, atol=1e-10 * np.abs(expected).max())
    np.testing.assert_allclose(np.sort(np.abs(discrete.poles)), np.sort(np.abs(np.exp(system.poles * step))), rtol=1e-8)


def test_modal_and_physical_state_spaces_respond_alike():
    system = damping.modal(random_system(np.random.default_rng(13), damped=False), 0.03)
    modal = state_space.modal(eigen.solve_undamped(system))
    np.testing.assert_allclose(modal.response(FREQUENCY), state_space.physical(system).response(FREQUENCY), rtol=1e-7)
    force = Record(np.random.default_rng(14).normal(size=(50, 1)), 1000.0, (system.inputs[0],), ("force",))
    out = time_response.modal_superposition(eigen.solve_undamped(system), force, (system.outputs[2],))
    direct = time_response.exact(state_space.physical(system), np.pad(force.samples, ((0, 0), (0, 5))), 1000.0)
    np.testing.assert_allclose(out.samples[:, 0], direct[:, 2], atol=1e-10 * np.abs(direct).max())


def test_free_vibration_keeps_its_energy():
    base = random_system(np.random.default_rng(15), 4, damped=False)
    ss = state_space.physical(base, "displacement and velocity")
    start = np.random.default_rng(16).normal(size=8)
    y = time_response.exact(ss, np.zeros((400, 4)), 3000.0, start=start)
    q, v = y[:, :4], y[:, 4:]
    energy = (np.einsum("ti,ij,tj->t", q, base.stiffness, q) + np.einsum("ti,ij,tj->t", v, base.mass, v)) / 2
    np.testing.assert_allclose(energy, energy[0], rtol=1e-8)


@settings(max_examples=25, deadline=None)
@given(seeds, st.booleans())
def test_mac_family_ignores_scale_and_phase(seed, is_complex):
    rng = np.random.default_rng(seed)
    shapes = rng.normal(size=(12, 4)) + (1j * rng.normal(size=(12, 4)) if is_complex else 0)
    factor = rng.normal(size=4) + (1j * rng.normal(size=4) if is_complex else 0)
    scaled = shapes * factor
    mac = correlation.mac(shapes, scaled)
    np.testing.assert_allclose(np.diag(mac), 1, rtol=1e-10)
    assert (mac <= 1 + 1e-12).all()
    np.testing.assert_allclose(correlation.auto_mac(shapes), correlation.mac(scaled), atol=1e-10)
    np.testing.assert_allclose(np.diag(correlation.modal_scale_factor(shapes, scaled)), factor, rtol=1e-9)
    np.testing.assert_allclose(correlation.ecomac(shapes, scaled), 0, atol=1e-10)


def test_comac_points_at_the_coordinate_that_differs():
    rng = np.random.default_rng(2)
    shapes = rng.normal(size=(10, 5))
    other = shapes.copy()
    other[7] = rng.normal(size=5)
    assert np.argmin(correlation.comac(shapes, other)) == 7
    assert np.argmax(correlation.ecomac(shapes, other)) == 7
    np.testing.assert_allclose(correlation.comac(shapes, shapes), 1)


def test_pairing_finds_the_permutation_and_leaves_strangers_single():
    system = random_system(np.random.default_rng(17), 6, damped=False)
    modes = eigen.solve_undamped(system)
    pairing = correlation.pair_modes(modes, modes.selected([3, 0, 5, 1]), lowest_mac=0.99)
    assert pairing.pairs.tolist() == [[0, 1], [1, 3], [3, 0], [5, 2]]
    assert pairing.single_first == (2, 4)


def test_frac_is_one_for_scaled_and_below_for_shifted_responses():
    system = damping.modal(random_system(np.random.default_rng(18), damped=False), 0.02)
    frf = fr.direct(system, FREQUENCY)
    stiffer = fr.direct(damping.modal(SecondOrderSystem(system.mass, 1.3 * system.stiffness), 0.02), FREQUENCY)
    np.testing.assert_allclose(correlation.frac(frf, frf), 1)
    assert correlation.frac(frf, stiffer).min() < 0.9


@pytest.mark.parametrize("hold", ["first", "zero"])
@pytest.mark.parametrize("every", [1, 2, 6, 50])
def test_outputs_at_every_nth_sample_are_those_of_all_samples(hold, every):
    rng = np.random.default_rng(3)
    system = state_space.physical(SecondOrderSystem(np.diag([1.0, 2.0, 0.5]), 1e4 * np.array(
        [[2.0, -1, 0], [-1, 2, -1], [0, -1, 1.5]]), 3.0 * np.eye(3)))
    u, start = rng.normal(size=(200, len(system.inputs))), rng.normal(size=system.size)
    whole = time_response.exact(system, u, 300.0, hold=hold, start=start)
    np.testing.assert_allclose(time_response.exact(system, u, 300.0, hold=hold, start=start, stride=every), whole[::every],
                               rtol=1e-9, atol=1e-12 * np.abs(whole).max())
