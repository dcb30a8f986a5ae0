"""A body that `joints` calls bent is replaced by an elastic one in its machine file; the truth is all its finite elements."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csc_array

from toolpoint import ToolpointWarning
from toolpoint.io import read_machine
from toolpoint.machine import assemble
from toolpoint.machine.components import Components
from toolpoint.studies import study_joints
from toolpoint.vibration import Dof, Modes
from toolpoint.vibration.eigen import solve_undamped
from toolpoint.vibration.geometry import Geometry
from toolpoint.vibration.sparse import modes

FOOT = {"x": 1.5e8, "y": 1.5e8, "z": 4e8, "rx": 1.5e7, "ry": 2e7, "rz": 1e7}
JOINT = """
joints:
  foot: {parent: ground, child: column, at: [0.2, 0.15, 0], child_interface: foot,
         stiffness: {x: 1.5e8, y: 1.5e8, z: 4e8, rx: 1.5e7, ry: 2e7, rz: 1e7}}
points: {foot: {body: column, at: [0.2, 0.15, 0]INTERFACE}}
"""
ELASTIC = """toolpoint: 1
name: column by finite elements
bodies:
  column:
    elastic:
      mesh_size: 250 mm
      band: 700 Hz
      materials: {body: {modulus: 110 GPa, density: 7200 kg/m^3, poisson: 0.26}}
      boxes:
        - {low: [0, 0, 0], high: [0.4, 0.3, 2.0]}
        - {low: [0.08, 0.08, 0.1], high: [0.32, 0.22, 1.9], window: true}
      interfaces: {foot: {centre: [0.2, 0.15, 0], along: [1, 0, 0], across: [0, -1, 0], length: 0.3, width: 0.2}}
""" + JOINT.replace("INTERFACE", ", interface: foot")


def rigid(mass):
    """The same machine with a rigid column."""
    i, c = mass.inertia, mass.centre
    words = ", ".join(f"{name}: {value!r}" for name, value in zip(
        ("xx", "yy", "zz", "xy", "xz", "yz"), map(float, (i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2])), strict=True))
    return (f"toolpoint: 1\nname: rigid column\nbodies:\n  column: {{mass: {mass.mass!r}, centre: {c.tolist()}, "
            f"inertia: {{{words}}}}}\n" + JOINT.replace(" child_interface: foot,", "").replace("INTERFACE", ""))


def test_a_column_that_bends_is_replaced_by_an_elastic_one(tmp_path):
    (tmp_path / "elastic.yaml").write_text(ELASTIC)
    elastic = read_machine(tmp_path / "elastic.yaml")
    described = elastic.description.bodies["column"].elastic
    model = described.model
    weights = described.interfaces["foot"].place.averages(model)
    stiffness = csc_array(model.stiffness() + weights @ csc_array(np.diag(list(FOOT.values()))) @ weights.T)
    truth = modes(stiffness, model.mass(), 8)

    # A test of it: points on its outside, shapes with a small error.
    rng = np.random.default_rng(4)
    x, _, z = model.nodes.T
    nodes = rng.choice(np.flatnonzero((x == 0) | (x == 0.4) | (z == 2.0)), 30, False)
    shape = truth.vectors[model.coordinates_of(nodes)]
    shape = shape + 2e-3 * np.abs(shape).max(axis=0) * rng.standard_normal(shape.shape)
    dofs = tuple(Dof(int(n) + 1, way) for n in nodes for way in ("+x", "+y", "+z"))
    measured = Modes(truth.frequency[:6], np.full(6, 0.01), shape[:, :6], dofs)
    geometry = Geometry({int(n) + 1: model.nodes[n] for n in nodes}, [])
    mass = model.mass_properties
    components = Components("its test", ("ground", "column"), {"column": [int(n) + 1 for n in nodes]})
    with pytest.warns(ToolpointWarning, match="doubtful at column"):
        result = study_joints(measured, geometry, components)
    assert "column: bends in mode" in result.table() and "elastic in the machine file" in result.table()
    assert "do not move with" not in result.table()
    with pytest.warns(ToolpointWarning, match="doubtful at column"):
        turned = study_joints(replace(measured, shape=measured.shape * np.where(np.arange(len(dofs)) == 21, -1, 1)[:, None]),
                              geometry, components)
    assert f"points [{dofs[21].point}]: do not move with column (left out of the fit)" in turned.table()

    (tmp_path / "rigid.yaml").write_text(rigid(mass))
    stiff = solve_undamped(assemble(read_machine(tmp_path / "rigid.yaml"))).frequency[:6]
    # The rigid column cannot follow: every mode is too high, by up to 9 %; the elastic one has all eight.
    assert np.abs(stiff / truth.frequency[:6] - 1).max() > 0.05
    assert solve_undamped(assemble(elastic)).frequency[:8] == pytest.approx(truth.frequency[:8], rel=2e-3)
