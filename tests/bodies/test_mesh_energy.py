"""What a mesh errs by, estimated from strains: closed forms of polynomials, and finer meshes of castings."""

import numpy as np
import pytest

from solid_models import brick, tetrahedral_brick
from toolpoint.bodies.reduced import ElasticNumbers
from toolpoint.bodies.solid import STEEL, Casting, Cuboid, Material, Patch
from toolpoint.bodies.solid.mesh_energy import mesh_energy
from toolpoint.machine.parts.elastic_body import reduce_in_parts
from toolpoint.vibration.sparse import modes

IRON = Material(110e9, 0.26, 7200.0)


def along_x(model, power):
    shape = np.zeros((model.size, 1))
    shape[::3, 0] = model.nodes[:, 0] ** power
    return shape


@pytest.mark.parametrize("make", [brick, tetrahedral_brick])
def test_motions_that_the_elements_hold_cost_nothing(make):
    """Strains linear in place are those of the elements themselves."""
    model = make([0.2, 0.12, 0.1], [4, 3, 3])
    for power in (1, 2):
        shape = along_x(model, power)
        whole = float((shape.T @ (model.stiffness() @ shape)).item())
        assert abs(mesh_energy(model, shape)["body"].item()) < 1e-9 * whole


@pytest.mark.parametrize("parts", [12, 24])
def test_the_cubic_motion_has_its_closed_form(parts):
    """u = x^3 on nodes: strains 3 x^2 at the Gauss points, linear between them. With half a cell a the difference is
    3 t^2 - a^2 over the cell, 8/5 a^5 of square; the two cells at the ends see one cell only and may miss it."""
    model = brick([0.3, 0.1, 0.05], [parts, 4, 2])
    stiff = STEEL.lame + 2 * STEEL.shear_modulus
    half = 0.3 / parts / 2
    exact = stiff * 0.1 * 0.05 * parts * 8 / 5 * half**5
    found = mesh_energy(model, along_x(model, 3))["body"].item()
    assert (1 - 2.2 / parts) * exact < found < 1.001 * exact


def column(mesh_size):
    """A hollow column whose walls are one element thick."""
    walls = [Cuboid([-0.06, -0.04, 0], [0.06, 0.04, 0.6]), Cuboid([-0.05, -0.03, 0.01], [0.05, 0.03, 0.59], "body", True)]
    return Casting(walls, {"body": IRON}).meshed(mesh_size)


def angle(mesh_size):
    """Two bars at right angles: strains without limit in the corner between them."""
    bars = [Cuboid([0, 0, 0], [0.3, 0.1, 0.05]), Cuboid([0, 0, 0.05], [0.05, 0.1, 0.3])]
    return Casting(bars, {"body": IRON}).meshed(mesh_size)


def free_modes(model, count=6):
    shift = (2 * np.pi * 100) ** 2
    pairs = modes(model.stiffness() + shift * model.mass(), model.mass(), 6 + count, solver="SuperLU")
    return pairs.squares[6:] - shift, pairs.vectors[:, 6:]


@pytest.mark.slow  # `test_mesh_estimate` holds a column beside its finer mesh in the default tests
@pytest.mark.parametrize("make", [column, angle])
def test_frequencies_of_castings_are_as_much_too_high_as_estimated(make):
    """Mode by mode a fifth to ten times of what a finer mesh shows (modes may change places), the sum half to four times."""
    model = make(0.05)
    squares, vectors = free_modes(model)
    truth, _ = free_modes(make(0.025 if make is column else 0.0125))
    true = np.sqrt(squares / truth) - 1
    found = np.diag(sum(mesh_energy(model, vectors).values())) / (2 * squares)
    assert true.max() > 0.02
    assert (found > true / 5).all() and (found < 10 * true).all()
    assert 0.5 < found.sum() / true.sum() < 4


def test_the_energy_scales_with_the_modulus_of_its_set():
    part = Casting([Cuboid([0, 0, 0], [0.3, 0.1, 0.05]), Cuboid([0, 0, 0.05], [0.05, 0.1, 0.3], "rib")],
                   {"body": IRON, "rib": STEEL}).meshed(0.05)
    foot = {"foot": Patch([0.15, 0.05, 0.0], [1, 0, 0], [0, -1, 0], 0.2, 0.08)}
    reduced = reduce_in_parts(part, foot, band=3000.0)
    nominal = {name: part.numbers for name, part in reduced.parts.items()}
    energies = {name: part.mesh_energy for name, part in reduced.parts.items()}
    assert reduced.at(nominal).mesh_energy == pytest.approx(energies["body"] + energies["rib"], rel=1e-12)
    rib = nominal["rib"]
    stiffer = {**nominal, "rib": ElasticNumbers(3 * rib.modulus, rib.density)}
    assert reduced.at(stiffer).mesh_energy == pytest.approx(energies["body"] + 3 * energies["rib"], rel=1e-12)
