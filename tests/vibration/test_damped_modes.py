"""Modes with the whole damping of a system: their response is that of the direct solution, for every kind of damping."""

import numpy as np
import pytest

from toolpoint.vibration import Dof, SecondOrderSystem, damping, frequency_response
from toolpoint.vibration.damped_modes import is_coupled, solve_as_damped

LINES = np.linspace(2.0, 120.0, 700)
SIZE = 5


def a_system(kind: str, seed: int = 0, poses: int = 0) -> SecondOrderSystem:
    """Springs and dampers of rank one between random coordinates; each spring has a loss factor or a damper of its own."""
    rng = np.random.default_rng(seed)
    shape = (poses,) if poses else ()
    springs = rng.standard_normal((*shape, SIZE + 3, SIZE))
    stiffness = 1e5 * np.einsum("...ki,...kj->...ij", springs, springs)
    root = rng.standard_normal((*shape, SIZE, SIZE)) + 3 * np.eye(SIZE)
    mass = root @ np.swapaxes(root, -1, -2)
    share = rng.uniform(0.01, 0.15, SIZE + 3)
    hysteretic = np.where(np.arange(SIZE + 3) % 2, share, 0.0) if kind == "both" else share
    d = 1e5 * np.einsum("k,...ki,...kj->...ij", hysteretic, springs, springs) if kind in ("structural", "both") else None
    c = 1e5 / 200 * np.einsum("k,...ki,...kj->...ij", share, springs, springs) if kind in ("viscous", "both") else None
    if kind == "proportional":
        c = 2e-4 * stiffness
    seen = np.broadcast_to(np.eye(2, SIZE), (*shape, 2, SIZE))
    dofs = (Dof("tool", "+x"), Dof("tool", "+y"))
    return SecondOrderSystem(mass, stiffness, c, d, seen, np.swapaxes(seen, -1, -2), dofs, dofs)


@pytest.mark.parametrize("poses", [0, 3])
@pytest.mark.parametrize("kind", ["proportional", "structural", "viscous"])
@pytest.mark.parametrize("seed", range(4))
def test_the_modes_of_one_kind_of_damping_answer_as_the_direct_solution(kind, seed, poses):
    system = a_system(kind, seed, poses)
    modes = solve_as_damped(system)
    whole = frequency_response.direct(system, LINES).values
    assert np.allclose(frequency_response.modal(modes, LINES).values, whole, rtol=1e-8, atol=1e-10 * np.abs(whole).max())
    assert np.isrealobj(modes.shape) == (kind == "proportional") and modes.direct is None


@pytest.mark.parametrize("seed", range(6))
def test_both_kinds_are_exact_at_the_resonances_and_carry_the_response_between_them(seed):
    """Of the difference the resonant part must be gone: beside a pole it grows as the response would."""
    system = a_system("both", seed)
    modes = solve_as_damped(system)
    away = np.abs(frequency_response.modal(modes, LINES).values - frequency_response.direct(system, LINES).values)
    static = np.abs(frequency_response.direct(system, np.array([1e-3])).values).max()
    assert away.max() < 2 * modes.damping_ratio.max() * static
    assert modes.direct is not None
    assert np.allclose(modes.direct.values, frequency_response.direct(system, modes.direct.frequency).values, rtol=1e-12)


def test_a_damper_so_strong_that_a_pole_is_real_still_has_modes_and_its_response():
    system = a_system("both")
    heavy = system.with_damping(40 * np.asarray(system.damping))
    modes = solve_as_damped(heavy)
    assert modes.direct is not None and np.isfinite(frequency_response.modal(modes, LINES).values).all()


def test_one_ratio_for_all_modes_takes_the_place_of_all_damping():
    system = damping.modal(a_system("both"), 0.03)
    assert system.structural_damping is None and not is_coupled(system)
    assert np.allclose(solve_as_damped(system).damping_ratio, 0.03)


def test_what_goes_along_with_modes_follows_their_selection():
    modes = solve_as_damped(a_system("both", poses=2)).at_pose(1).at_dofs(["tool:+y"])
    assert modes.direct.values.shape[1:] == (1, 1)
    assert np.allclose(modes.direct.values[:, 0, 0], frequency_response.direct(
        a_system("both", poses=2).at_pose(1), modes.direct.frequency).values[:, 1, 1])
