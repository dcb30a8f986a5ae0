"""Solid elements against closed forms: Lame's cube, Lamb's sphere, a cantilever, plane modes of FV52, and their rates."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import spherical_jn

from solid_models import ball, brick, tetrahedral_brick
from toolpoint.bodies.solid import STEEL, Material
from toolpoint.vibration.sparse import modes

NAFEMS = Material(200e9, 0.3, 8000.0)


def frequencies(model, number, held=()):
    free = np.setdiff1d(np.arange(model.size), held)
    k, m = model.stiffness()[free][:, free], model.mass()[free][:, free]
    pairs = modes(k, m, number, solver="SuperLU")  # it is there without compiling
    assert pairs.is_complete
    return pairs.frequency


@pytest.mark.slow
@pytest.mark.parametrize(("build", "parts"), [(brick, (2, 4)), (tetrahedral_brick, (3, 5))], ids=["hexahedra", "tetrahedra"])
def test_lame_mode_of_a_free_cube_converges_with_the_fourth_power(build, parts):
    """f = sqrt(G/rho)/(sqrt(2) a); eigenvalues of quadratic elements err with h^4 (Strang, Fix, chapter 6): near it here."""
    exact = np.sqrt(STEEL.shear_modulus / STEEL.density) / np.sqrt(2)
    errors = []
    for n in parts:
        f = frequencies(build([1.0, 1, 1], [n] * 3), 24)
        errors.append(abs(f / exact - 1).min())
    assert errors[-1] < 2e-3
    assert np.log(errors[0] / errors[1]) / np.log(parts[1] / parts[0]) > 3.1


def test_torsional_mode_of_a_free_sphere():
    """Lamb: j_2(x) = x j_3(x), five-fold; the mesh splits it by its cubic symmetry."""
    x = brentq(lambda x: spherical_jn(2, x) - x * spherical_jn(3, x), 2, 3)
    exact = x * np.sqrt(NAFEMS.shear_modulus / NAFEMS.density) / (2 * np.pi)
    f = frequencies(ball(4, NAFEMS), 11)[6:11]
    assert np.allclose(f, exact, rtol=2.5e-3)


@pytest.mark.slow
def test_cantilever_converges_to_timoshenko():
    """Square bar, nu = 0, L/h = 20: clamped-free Timoshenko beam with k = 5/6, roots of its own frequency equation."""
    material = Material(210e9, 0.0, 7850.0)
    exact = timoshenko_cantilever(1.0, 0.05, material)
    f = [frequencies(model, 2, model.coordinates_of(model.nodes_in([0, 0, 0], [0, 1, 1])))[0]
         for model in (brick([1, 0.05, 0.05], parts, material) for parts in ((6, 1, 1), (12, 2, 2), (24, 4, 4)))]
    assert f[2] == pytest.approx(exact, rel=3e-4)
    assert np.log2((f[0] - f[1]) / (f[1] - f[2])) > 3.0


def timoshenko_cantilever(length, height, material):
    """First root of the clamped-free Timoshenko beam: transfer of (w, psi, M, Q) by the matrix exponential."""
    from scipy.linalg import expm

    area, inertia, shear = height**2, height**4 / 12, 5 / 6 * material.shear_modulus * height**2

    def end(omega):
        a = np.array([[0, 1, 0, 1 / shear], [0, 0, 1 / (material.modulus * inertia), 0],
                      [0, -material.density * inertia * omega**2, 0, -1], [-material.density * area * omega**2, 0, 0, 0]])
        return np.linalg.det(expm(a * length)[2:, 2:])

    grid = 2 * np.pi * np.linspace(10, 80, 71)
    values = [end(w) for w in grid]
    at = next(i for i in range(70) if values[i] * values[i + 1] < 0)
    return brentq(end, grid[at], grid[at + 1]) / (2 * np.pi)


def test_plate_of_nafems_fv52():
    """10 x 10 x 1 m, u_z = 0 at all nodes along the lower edges.

    NAFEMS' finite-element targets are those of 4 x 4 x 1 quadratic bricks; a support along a line softens as the mesh gets
    finer (8 x 8 x 1: 44.05, 106.7 Hz), so no mesh is the limit. Finer ones hold the in-plane modes, in closed form 193.59 and
    206.19 Hz.
    """
    def supported(parts):
        model = brick([10.0, 10, 1], parts, NAFEMS)
        x, y, z = model.nodes.T
        edge = (z == 0) & ((x == 0) | (x == 10) | (y == 0) | (y == 10))
        return frequencies(model, 12, 3 * np.flatnonzero(edge) + 2)

    coarse, fine = supported([4, 4, 1]), supported([8, 8, 1])
    assert (coarse[:3] == 0).all()
    assert coarse[3:9] == pytest.approx([44.762, 110.52, 110.52, 169.08, 193.93, 206.64], rel=1e-3)
    assert (fine[3:7] < coarse[3:7]).all()
    assert abs(fine - 193.59).min() < 0.1 and np.sort(abs(fine - 206.19))[1] < 0.1
