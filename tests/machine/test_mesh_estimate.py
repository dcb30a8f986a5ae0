"""What meshes of elastic bodies do to a machine's frequencies is told beside what reduction does, and doubted where coarse."""

from pathlib import Path

import numpy as np
import pytest

from toolpoint._doubt import Doubt
from toolpoint.io import read_machine
from toolpoint.machine.assembly.mesh_estimate import MAX_MESH_ERROR
from toolpoint.studies import check_machine, solve_modes
from toolpoint.vibration.sparse import factorisation

TEXT = """toolpoint: 1
name: column with a slide
bodies:
  column:
    elastic:
      mesh_size: {mesh} mm
      band: 600 Hz
      boxes:
        - {{low: [-60 mm, -40 mm, 0], high: [60 mm, 40 mm, 600 mm]}}
        - {{low: [-50 mm, -30 mm, 10 mm], high: [50 mm, 30 mm, 590 mm], window: true}}
      interfaces:
        foot: {{centre: [0, 0, 0], along: [1, 0, 0], across: [0, -1, 0], length: 60 mm, width: 40 mm}}
        rail: {{centre: [60 mm, 0, 300 mm], along: [0, 0, 1], across: [0, -1, 0], length: 80 mm, width: 40 mm}}
  slide: {{mass: 20 kg, centre: [0.1, 0, 0.3], inertia: {{xx: 0.1, yy: 0.1, zz: 0.1}}}}
joints:
  foot: {{parent: ground, child: column, child_interface: foot, at: [0, 0, 0],
         stiffness: {{x: 1e9, y: 1e9, z: 1e9, rx: 1e7, ry: 1e7, rz: 1e7}}}}
  way: {{parent: column, child: slide, parent_interface: rail, at: [60 mm, 0, 300 mm],
        stiffness: {{x: 3e8, y: 3e8, z: 1e8, rx: 1e6, ry: 1e6, rz: 1e6}}}}
points:
  tip: {{body: slide, at: [0.15, 0, 0.3]}}
tool: tip
"""


def machine(folder: Path, mesh: float):
    path = folder / f"column{mesh:g}.yaml"
    path.write_text(TEXT.format(mesh=mesh))
    return read_machine(path)


@pytest.mark.slow
def test_a_coarse_mesh_is_doubted_beside_a_fine_reduction(tmp_path, monkeypatch):
    """Reduction within 1e-3, the mesh a quarter off: the user reads both. The finer mesh is still some per cent too stiff."""
    monkeypatch.setattr(factorisation, "_MIN_COMPILED_ROWS", 100_000)  # SciPy's solver: it is there without compiling
    coarse = solve_modes(machine(tmp_path, 50.0), None, 6)
    truth = solve_modes(machine(tmp_path, 25.0), None, 6)
    true = coarse.frequency / truth.frequency - 1
    mesh = coarse.reduction.mesh
    assert coarse.reduction.error.max() < 1e-3 < MAX_MESH_ERROR < true.max()
    assert (mesh > true / 3).all() and (mesh < 8 * true).all()
    assert truth.reduction.mesh.max() < 0.7 * mesh.max()
    doubt, = (note for note in coarse.notes if isinstance(note, Doubt))
    assert "their meshes raise them further, by about" in doubt.why and "smaller mesh_size" in doubt.remedy
    assert doubt.figure == pytest.approx(mesh.max())
    assert coarse.to_dict()["mesh_error"] == mesh.tolist() and "mesh error %" in coarse.table()
    assert any("meshes raise them" in doubt for doubt in check_machine(machine(tmp_path, 50.0)).doubts)


def test_the_estimate_is_the_same_from_disk(tmp_path, monkeypatch):
    from toolpoint.machine.parts import body_store

    monkeypatch.setenv("TOOLPOINT_CACHE", str(tmp_path / "cache"))
    found = []
    for _ in range(2):
        body_store._load_or_reduce.cache_clear()
        found.append(solve_modes(machine(tmp_path, 50.0), None, 4).reduction.mesh)
    body_store._load_or_reduce.cache_clear()
    assert list((tmp_path / "cache").glob("body-*.npz")) and np.array_equal(*found)
