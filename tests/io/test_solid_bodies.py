"""Bodies of machine files from STEP and mesh files: the same as the casting that they were made from; faults by their keys."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from test_mesh_files import write_inp

from toolpoint import ToolpointError
from toolpoint.io import read_machine, write_machine
from toolpoint.machine import assemble
from toolpoint.machine.description import parameters
from toolpoint.vibration.eigen import solve_undamped

meshed = pytest.mark.skipif(importlib.util.find_spec("netgen") is None, reason="Netgen (extra 'mesh') is not installed")
MATERIAL = "materials: {body: {modulus: 120 GPa, density: 7100 kg/m^3, poisson: 0.25, loss_factor: 0.003}}"
HEAD = """\
toolpoint: 1
name: post
bodies:
  post:
"""
TAIL = """\
      interfaces:
        foot: {centre: [40 mm, 30 mm, 0], along: [1, 0, 0], across: [0, -1, 0], length: 80 mm, width: 60 mm}
        head: {centre: [40 mm, 30 mm, 400 mm], along: [1, 0, 0], across: [0, 1, 0], length: 60 mm, width: 40 mm}
      band: 1500 Hz
joints:
  foot: {parent: ground, child: post, at: [40 mm, 30 mm, 0], child_interface: foot,
         stiffness: {x: 2e8, y: 2e8, z: 3e8, rx: 2e6, ry: 2e6, rz: 1e6}}
points:
  head: {body: post, interface: head}
"""
CASTING = f"""\
    elastic:
      mesh_size: 50 mm
      {MATERIAL}
      boxes: [{{low: [0, 0, 0], high: [80 mm, 60 mm, 400 mm]}}]
"""


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("TOOLPOINT_CACHE", str(tmp_path / "cache"))


def machine(folder: Path, section: str):
    path = folder / "post.yaml"
    path.write_text(HEAD + section + TAIL)
    return read_machine(path)


def solid(file: str, more: str = "") -> str:
    material = MATERIAL if file.endswith("step") else MATERIAL.replace("body", "column")
    return f"    solid:\n      file: {file}\n      {material}\n" + (f"      {more}\n" if more else "")


def frequencies(built):
    return solve_undamped(assemble(built)).frequency[:8]


@pytest.fixture
def casting(tmp_path):
    return machine(tmp_path, CASTING)


def test_a_mesh_file_is_the_casting_that_it_was_written_from(tmp_path, casting):
    write_inp(tmp_path / "post.inp", casting.description.bodies["post"].elastic.model)
    read = machine(tmp_path, solid("post.inp", "unit: mm"))
    assert frequencies(read) == pytest.approx(frequencies(casting), rel=1e-9)
    assert read.bodies[0].structural_damping == pytest.approx(0.003 * read.bodies[0].stiffness, rel=1e-9)
    assert "bodies.post.solid.materials.column.modulus" in parameters(read.description)
    stiffer = read.with_values({"bodies.post.solid.materials.column.modulus": 140e9})
    assert frequencies(stiffer)[0] > frequencies(read)[0]
    assert any("post.inp: 13.6" in note for note in read.bodies[0].notes)  # 0.08 x 0.06 x 0.4 m x 7100 kg/m^3 = 13.632 kg


def test_a_machine_with_a_solid_is_written_and_read_back(tmp_path, casting):
    write_inp(tmp_path / "post.inp", casting.description.bodies["post"].elastic.model)
    first = machine(tmp_path, solid("post.inp", "unit: mm"))
    write_machine(first.description, tmp_path / "again.yaml")
    assert read_machine(tmp_path / "again.yaml").description == first.description


@pytest.mark.parametrize(("file", "more", "words"), [
    ("post.inp", "", "solid.unit: missing"),
    ("post.inp", "{unit: mm, mesh_size: 30 mm}", "serves a STEP file only"),
    ("post.inp", "unit: m", "size: 400 m"),
    ("none.inp", "unit: mm", "must be a file in"),
    ("none.step", "mesh_size: 30 mm", "must be a file in"),
    ("post.step", "", "solid.mesh_size: missing"),
    ("post.step", "unit: furlong", "furlong")])
def test_faults_are_named_by_their_keys(tmp_path, casting, file, more, words):
    write_inp(tmp_path / "post.inp", casting.description.bodies["post"].elastic.model)
    (tmp_path / "post.step").write_text("ISO-10303-21;")
    if more.startswith("{"):
        more = "\n      ".join(more.strip("{}").split(", "))
    with pytest.raises(ToolpointError, match=words):
        machine(tmp_path, solid(file, more))


@meshed
@pytest.mark.slow
def test_a_step_file_is_the_casting_that_it_draws(tmp_path, casting):
    from netgen.occ import Box, Pnt

    Box(Pnt(0, 0, 0), Pnt(80, 60, 400)).WriteStep(str(tmp_path / "post.step"))
    read = machine(tmp_path, solid("post.step", "mesh_size: 25 mm"))
    assert read.bodies[0].mass[0, 0] == pytest.approx(casting.bodies[0].mass[0, 0], rel=1e-9)
    # Both meshes are coarse: hexahedra of 50 mm against tetrahedra of 25 mm.
    assert frequencies(read) == pytest.approx(frequencies(casting), rel=5e-3)
    assert np.ptp(read.bodies[0].surface.nodes, axis=0) == pytest.approx([0.08, 0.06, 0.4])
    assert any("post.step in mm" in note and "Netgen" in note for note in read.bodies[0].notes)
