"""A body of a machine file by matrices of another program: the same as by beam elements, in any units, faults named."""

import numpy as np
import pytest
from scipy.sparse import csc_array

from toolpoint import ToolpointError
from toolpoint._check import FileDoubt
from toolpoint._doubt import doubts_among
from toolpoint.bodies.beam import join_elements, ring
from toolpoint.io.matrices import dmig
from toolpoint.io.matrices.labelled_matrix import LabelledMatrix
from toolpoint.io.yaml import machine_file
from toolpoint.machine import assemble
from toolpoint.vibration import Dof, eigen

LENGTH, NODES = 0.4, 9
STEEL = {"density": 7850.0, "poisson": 0.3, "shear": 0.886}
MACHINE = """
toolpoint: 1
name: shaft of another program
bodies:
  shaft:
    matrices: {{file: shaft.pch, geometry: {geometry}, band: 2 kHz, units: {units},
               interfaces: {{foot: {{points: [{foot}]}}, tip: {{points: [9]}}}}}}{more}
joints:
  foot: {{parent: ground, child: shaft, child_interface: foot, at: [0, 0, 0],
          stiffness: {{x: 2e8, y: 1e8, z: 1e8, rx: 1e5, ry: 1e5, rz: 1e5}}}}
points:
  tip: {{body: shaft, interface: tip}}
"""


def written(folder, *, units="m-kg-s", scale=1.0, geometry="points.csv", foot="1", more=""):
    """Write a beam of Hermite elements along x as DMIG cards, in SI or in millimetres and tonnes, and a machine of it."""
    section = ring(0.05, 0.0, 210e9, **STEEL).slender
    beam = join_elements(np.linspace(0, LENGTH, NODES), [section] * (NODES - 1))
    ways = ("+x", "+y", "+z", "+rx", "+ry", "+rz")
    dofs = tuple(Dof(node + 1, way) for node in range(NODES) for way in ways)
    # One millimetre-tonne unit of force per shift is 1000 N/m, of moment per turn 0.001 N m.
    root = np.sqrt([1e3 if way in "+x+y+z" else 1e-3 for _ in range(NODES) for way in ways]) if units == "mm-t-s" else 1.0
    matrices = [LabelledMatrix(name, csc_array(values / np.outer(root, root) if units == "mm-t-s" else values), dofs, dofs)
                for name, values in (("KAAX", beam.stiffness), ("MAAX", beam.mass))]
    dmig.write(folder / "shaft.pch", matrices)
    size = 1e3 if units == "mm-t-s" else 1.0
    lines = [f"{node + 1},{size * at!r},0,0" for node, at in enumerate(beam.places.tolist())]
    (folder / "points.csv").write_text("\n".join(lines))
    path = folder / "machine.yaml"
    path.write_text(MACHINE.format(units=units, geometry=geometry, foot=foot, more=more))
    return path, beam


@pytest.mark.parametrize("units", ["m-kg-s", "mm-t-s"])
def test_matrices_in_either_units_give_the_machine_of_the_beam(tmp_path, units):
    path, beam = written(tmp_path, units=units)
    machine = machine_file.read(path)
    held = beam.stiffness.copy()
    held[:6, :6] += np.diag([2e8, 1e8, 1e8, 1e5, 1e5, 1e5])
    exact = np.sqrt(np.linalg.eigvals(np.linalg.solve(beam.mass, held)).real.clip(0))
    exact = np.sort(exact)[:5] / (2 * np.pi)
    frequency = eigen.solve_undamped(assemble(machine)).frequency[:5]
    np.testing.assert_allclose(frequency, exact, rtol=2e-5)
    assert machine.bodies[0].mass[0, 0] == pytest.approx(LENGTH * 7850 * np.pi / 4 * 0.05**2, rel=1e-8)


def test_the_machine_is_written_and_read_back(tmp_path):
    path, _ = written(tmp_path)
    described = machine_file.read(path).description
    machine_file.write(described, tmp_path / "again.yaml")
    assert machine_file.read(tmp_path / "again.yaml").description == described


@pytest.mark.parametrize(("changed", "words"), [
    ({"geometry": "nowhere.csv"}, "nowhere.csv"),
    ({"foot": "77"}, "must be points of the matrices"),
    ({"more": "\n    mass: 3 kg"}, "mass.*beside matrices"),
    ({"units": "inch"}, "units"),
])
def test_faults_are_named(tmp_path, changed, words):
    path, _ = written(tmp_path, **changed)
    with pytest.raises(ToolpointError, match=words):
        machine_file.read(path)


def test_cards_beside_the_matrices_are_doubted_with_their_lines_down_to_the_modes(tmp_path):
    path, _ = written(tmp_path)
    file = tmp_path / "shaft.pch"
    count = len(file.read_text().splitlines())
    file.write_text(file.read_text() + "RBE3,100,,90,123456,1.0,123,1,2\nCBAR    7       1       1       2\nCBAR,8,1,2,3\n")
    with pytest.warns(FileDoubt, match=r"shaft: shaft\.pch: 1 RBE3"):  # before all else in every command
        machine = machine_file.read(path)
    doubts = doubts_among(assemble(machine).notes)
    assert any(f"1 RBE3 (the first in line {count + 1}), 2 CBAR (the first in line {count + 2})" in doubt and
               doubt.startswith("shaft: shaft.pch: ") for doubt in doubts)
