"""Chain of eight masses on nine springs: reference cases A1 and A2 (closed form, and 9-digit values)."""

import numpy as np
import pytest

from toolpoint.vibration import SecondOrderSystem, eigen
from toolpoint.vibration import frequency_response as fr

N, MASS, STIFFNESS = 8, 10.0, 1e5
LAPLACE = 2 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1)


def chain(damped: bool = False) -> SecondOrderSystem:
    damping = None
    if damped:
        # 50 N s/m between the masses, 250 and 25 N s/m from the ends to the ground.
        damping = 50 * LAPLACE
        damping[0, 0] += 250 - 50
        damping[-1, -1] += 25 - 50
    return SecondOrderSystem(MASS * np.eye(N), STIFFNESS * LAPLACE, damping)


def test_undamped_frequencies_are_the_closed_form():
    closed = np.sqrt(STIFFNESS / MASS) / np.pi * np.sin(np.arange(1, N + 1) * np.pi / (2 * (N + 1)))
    np.testing.assert_allclose(eigen.solve_undamped(chain()).frequency, closed, rtol=1e-12)
    assert closed[[0, -1]] == pytest.approx([5.52739317, 31.34740438], abs=5e-9)


def test_damped_frequencies_and_ratios():
    modes = eigen.solve_damped(chain(damped=True))
    damped = modes.frequency * np.sqrt(1 - modes.damping_ratio**2)
    # Reference case A2, damped frequencies in Hz and damping ratios in %.
    np.testing.assert_allclose(damped, [5.52914724, 10.8959268, 15.9269697, 20.4523036, 24.3354905, 27.4871217, 29.8351249,
                                        31.2948324], rtol=5e-9)
    np.testing.assert_allclose(100 * modes.damping_ratio, [1.520896, 2.875752, 3.956446, 4.703382, 5.091678, 5.176464,
                                                           5.108439, 5.029643], atol=6e-7)


def test_modal_sum_is_the_direct_solution():
    system, frequency = chain(damped=True), np.linspace(0.5, 40, 60)
    direct = fr.direct(system, frequency).values
    summed = fr.modal(eigen.solve_damped(system), frequency).values
    np.testing.assert_allclose(summed, direct, atol=1e-12 * np.abs(direct).max())


def test_repeated_roots_give_a_response():
    # Two equal, uncoupled chains: every root is double.
    one = chain(damped=True)
    zero = np.zeros((N, N))
    double = SecondOrderSystem(*(np.block([[a, zero], [zero, a]]) for a in (one.mass, one.stiffness, one.damping)))
    frequency = np.linspace(1, 35, 20)
    direct = fr.direct(double, frequency).values
    summed = fr.modal(eigen.solve_damped(double), frequency).values
    np.testing.assert_allclose(summed, direct, atol=1e-10 * np.abs(direct).max())


def test_rigid_body_and_overdamped_modes_give_the_direct_response():
    # Free-free chain of three, one damper to the ground on the middle mass, and heavy damping between two others.
    k = 1e4 * np.array([[1, -1, 0], [-1, 2, -1], [0, -1, 1.0]])
    mass = np.diag([1.0, 2.0, 3.0])
    frequency = np.linspace(0.5, 60, 40)
    for damping in (np.zeros((3, 3)), 3000 * np.array([[1, -1, 0], [-1, 1, 0], [0, 0, 0.0]]), np.diag([0, 40.0, 0])):
        system = SecondOrderSystem(mass, k, damping if damping.any() else None)
        modes = eigen.solve_damped(system)
        direct = fr.direct(system, frequency).values
        np.testing.assert_allclose(fr.modal(modes, frequency).values, direct, atol=1e-9 * np.abs(direct).max())
    assert eigen.solve_undamped(SecondOrderSystem(mass, k)).is_rigid.tolist() == [True, False, False]


def test_structural_damping_modes_give_the_direct_response():
    base = chain()
    system = SecondOrderSystem(base.mass, base.stiffness, structural_damping=0.05 * np.diag(np.diag(base.stiffness)))
    frequency = np.linspace(1, 35, 30)
    direct = fr.direct(system, frequency).values
    np.testing.assert_allclose(fr.modal(eigen.solve_damped(system), frequency).values, direct,
                               atol=1e-12 * np.abs(direct).max())
