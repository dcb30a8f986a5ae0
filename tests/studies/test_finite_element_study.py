"""The study of a machine of finite elements: grams, a part alone, layers' damping, options and the page; the example mill."""

import dataclasses

import numpy as np
import pytest
import scipy.linalg

from solid_models import brick
from toolpoint.bodies.solid import Casting, Cuboid, Material, Patch
from toolpoint.pages.machines.finite_elements import finite_element_page
from toolpoint.studies.finite_elements.example_mill import DAMPING, MINERAL_CAST, example_mill
from toolpoint.studies.finite_elements.machine_study import study_finite_elements
from toolpoint.studies.finite_elements.material_losses import bound_left_out, question_losses, solve_losses
from toolpoint.studies.finite_elements.whole_machine import GROUND, FiniteElementMachine, PatchJoint
from toolpoint.vibration import Dof, frequency_response

X, Y, Z = np.eye(3)
IRON = Material(5e9, 0.3, 7000.0, 0.01)


def small_mill(loss_factor=0.01, lower=IRON):
    """A column of two sets beside a work table on a bed."""
    bed = brick([0.9, 0.5, 0.2], [4, 3, 1], IRON)
    column = Casting([Cuboid([0.55, 0.2, 0.2], [0.8, 0.4, 0.5], "low"), Cuboid([0.55, 0.2, 0.5], [0.8, 0.4, 0.9], "high")],
                     {"low": dataclasses.replace(lower, loss_factor=loss_factor), "high": IRON}).meshed(0.2)
    foot, at = Patch([0.45, 0.25, 0.0], X, -Y, 0.9, 0.5), [0.675, 0.3, 0.2]
    joints = (PatchJoint("floor", GROUND, "bed", np.array([4e7, 5e7, 9e7, 4e6, 7e6, 6e6]), foot),
              PatchJoint("flange", "bed", "column", np.array([1e8, 1.2e8, 2e8, 5e5, 7e5, 4e5]), Patch(at, X, -Y, 0.25, 0.2),
                         Patch(at, X, Y, 0.25, 0.2)))
    points = {"tool": ("column", Patch([0.675, 0.3, 0.9], X, Y, 0.1, 0.1), (0.0, 0.0, 0.1)),
              "work": ("bed", Patch([0.25, 0.25, 0.2], X, Y, 0.1, 0.1), (0.0, 0.0, 0.0))}
    return FiniteElementMachine({"bed": bed, "column": column}, joints, points)


@pytest.fixture(scope="module")
def study():
    mill = small_mill()
    return study_finite_elements(mill, {"denser low part": mill.scaled(density={"column.low": 1.1})},
                                 tested=mill.scaled(joints={"flange": 0.8}), finer_machine=mill, damper_mass=3.0)


@pytest.mark.slow
def test_grams_are_what_thicker_walls_give(study):
    """E and density of a set times 1 + e adds e times its mass: Hz/kg of its elements, weighted by their mass."""
    mill, e = study.machine, 1e-4
    gains = study.whole_sensitivity.hertz_a_kilogram("column")[:3]
    names = np.array(study.sensitivities["column"].set_names)
    masses = np.array([0.25 * 0.2 * 0.3, 0.25 * 0.2 * 0.4]) * 7000
    for name, mass in zip(("low", "high"), masses, strict=True):
        f = [mill.scaled(modulus={f"column.{name}": 1 + s}, density={f"column.{name}": 1 + s}).solve(16).frequency[:3]
             for s in (e, -e)]
        share = np.full((names == name).sum(), mass / (names == name).sum())
        assert np.allclose(gains[:, names == name] @ share, (f[0] - f[1]) / (2 * e), rtol=1e-5, atol=1e-6)


def test_material_damping_is_the_share_of_strain_energy():
    """All of one loss factor: half of it times the materials' share; the joints' share has none."""
    mill = small_mill()
    pairs = mill.solve(4)
    materials = 1 - sum(mill.joint_shares(pairs).values())
    assert np.allclose(mill.material_damping(pairs), 0.005 * materials, rtol=1e-7)
    lossy = small_mill(0.3)
    assert (lossy.material_damping(pairs) > mill.material_damping(pairs)).all()


@pytest.mark.slow
@pytest.mark.parametrize("loss_factor", [0.05, 0.5])
def test_losses_are_solved_as_they_couple_the_modes(loss_factor):
    """Against all coordinates of K + i D: frequencies within the stated bound, responses closer than by strain energy alone."""
    mill, joints = small_mill(loss_factor), 0.02
    pairs = mill.solve(12)
    stiffness, mass = (matrix.toarray() for matrix in mill.matrices)
    losses = np.zeros_like(stiffness)
    for part, model in mill.parts.items():
        at = slice(mill.starts[part], mill.starts[part] + model.size)
        losses[at, at] += sum(model.materials[name].loss_factor * k.toarray() for name, k in model.stiffness_parts.items())
    losses = losses + 2 * joints * stiffness
    exact = np.sort_complex(scipy.linalg.eigvals(np.linalg.solve(mass, stiffness + 1j * losses)))[:8]
    modes = solve_losses(mill, pairs, joints)
    order = np.argsort(modes.frequency)[:8]
    bound = bound_left_out(mill, pairs)[:, :8]
    assert (np.abs(modes.omega[order] / np.sqrt(exact.real) - 1) <= bound[0] + 1e-8).all()
    assert (np.abs(modes.damping_ratio[order] / (exact.imag / exact.real / 2) - 1) <= bound[1] + 1e-8).all()
    tool, work = (mill.spread(*mill.points[name][:2]).toarray() for name in ("tool", "work"))
    way = tool[:, 0] + 0.1 * tool[:, 4] - work[:, 0]
    lines = np.linspace(0.9, 1.1, 41) * np.sqrt(exact[0].real) / (2 * np.pi)
    direct = np.array([way @ np.linalg.solve(stiffness + 1j * losses - (2 * np.pi * f) ** 2 * mass, way) for f in lines])
    static = way @ np.linalg.solve(stiffness, way)
    label = [Dof("tool-work", "+x")]
    taken, by_energy = (frequency_response.modal(m, lines, outputs=label, inputs=label).values[:, 0, 0]
                        for m in (modes, mill.point_modes(pairs, joints + mill.material_damping(pairs))))
    remainder = static - sum((way @ pairs.vectors) ** 2 / pairs.squares)  # of modes beyond those solved
    error = [np.abs(values + remainder - direct).max() / np.abs(direct).max() for values in (taken, by_energy)]
    assert error[0] <= bound[1][0] and error[0] < 0.3 * error[1], error


def test_modes_left_out_of_the_losses_are_doubted():
    stiff, lossy = (small_mill(loss) for loss in (0.01, 0.8))
    assert question_losses(bound_left_out(stiff, stiff.solve(12))[:, :6]) == []
    doubts = question_losses(bound_left_out(lossy, lossy.solve(6))[:, :5])
    assert len(doubts) == 1 and "left out" in doubts[0]


@pytest.mark.slow
def test_options_are_judged_by_the_same_cut(study):
    names = [option.name for option in study.every_option]
    assert names == ["denser low part", "tuned damper, 3 kg at tool:+x", "active damper, 3 kg moving at tool:+x"]
    base = study.base.limit
    for option in study.every_option:
        assert option.limit.chart.depth_max == base.chart.depth_max
        assert option.limit.depth <= option.limit.chart.limit.min() * (1 + 1e-3)
    assert study.dampers.tuned.depths[0] == pytest.approx(base.depth, rel=1e-9)
    assert study.dampers.active.depths[0] == pytest.approx(base.depth, rel=1e-3)
    assert all(option.limit.depth > base.depth for option in study.dampers.options)
    assert study.options[0].frequency[0] < study.base.frequency[0]


@pytest.mark.slow
def test_a_part_alone_and_its_slopes(study):
    alone = study.part_sensitivity
    assert alone.pairs.frequency[0] > study.pairs.frequency[0], "its foot stands on the ground"
    assert np.allclose(alone.frequency["column"].density.sum(axis=1), -0.5, atol=1e-9)
    e, rho = alone.motion.by_part()["column"]
    assert np.allclose(rho, -alone.motion.values / 2, atol=1e-9 * np.abs(alone.motion.values).max())
    assert np.allclose(e + sum(alone.motion.joints.values()), 0, atol=1e-8 * np.abs(alone.motion.values).max())
    assert alone.mac is not None and (alone.mac.values > 0.5).all()


@pytest.mark.slow
def test_what_is_said(study):
    assert study.correlation is not None and study.doubts
    assert "a finer mesh moves frequencies by up to +0.0 %" in study.doubts[-1]
    text = study.table()
    for word in ("Test beside model", "The whole machine", "The column alone", "What helps the cut", "tuned damper of 3 kg",
                 "gain margin"):
        assert word in text
    html = finite_element_page(study).html()
    assert len(html) < 1.6e6 and "A hammer test beside the model" in html and "What helps the cut" in html


def test_the_example_mill_with_layers_and_a_filling():
    """Mass of what is put on and in: three plates with closed corners, the hollow between the plates."""
    bare, size = example_mill(mesh_size=0.5), {"mesh_size": 0.5}
    layered = example_mill(layers=DAMPING, **size)
    sides = [2 * 0.003 * 0.5 * 1.35 + 0.606 * 0.003 * 1.35, 2 * 0.010 * 0.503 * 1.35 + 0.626 * 0.010 * 1.35]
    assert layered.part_mass["column"] - bare.part_mass["column"] == pytest.approx(sides[0] * 1200 + sides[1] * 7850, rel=1e-9)
    hollow = 0.6 * 0.5 * 1.35 - bare.part_mass["column"] / 7200
    filled = example_mill(filling=MINERAL_CAST, **size)
    assert filled.part_mass["column"] - bare.part_mass["column"] == pytest.approx(hollow * 2350, rel=1e-9)
