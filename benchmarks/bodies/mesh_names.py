"""Solids by the names of their mesh files: a held node set, a rigid foot on springs, and surfaces, against all finite elements.

    python benchmarks/bodies/mesh_names.py

The full meshes are solved by SciPy from the assembled matrices. The last line is the largest relative difference of frequencies
within the band.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from scipy.linalg import eigh

from benchmarks.frame import CommandLine
from toolpoint.bodies.solid import Casting, Cuboid, Material, SolidModel
from toolpoint.io import read_machine, read_mesh
from toolpoint.machine import assemble
from toolpoint.vibration.eigen import solve_undamped

IRON = Material(120e9, 0.25, 7100.0)
SPRINGS = {"x": 2e8, "y": 2e8, "z": 3e8, "rx": 2e6, "ry": 2e6, "rz": 1e6}
BODIES = {"column": ((0.0, 0.0, 0.0), (0.3, 0.2, 0.8)), "ram": ((0.0, 0.0, 0.0), (0.2, 0.2, 1.0)),
          "housing": ((0.0, 0.0, 0.0), (0.4, 0.4, 0.3))}
MACHINE = """toolpoint: 1
name: body
bodies:
  body:
    solid:
      file: body.inp
      unit: mm
      held: FIXED
      interfaces: {head: {surface: TOP}}
      band: BAND Hz
joints:
  foot: {parent: ground, child: body, at: [FOOT], child_interface: held SPRINGS}
points: {head: {body: body, interface: head}}
"""


def write_mesh(path: Path, model: SolidModel) -> np.ndarray:
    """Write an Abaqus file with the nodes of the foot as FIXED and the faces on top as TOP; return the foot's nodes."""
    held = np.flatnonzero(np.abs(model.nodes[:, 2]) < 1e-9)
    lines = ["*NODE"] + [f"{i + 1}, " + ", ".join(repr(1e3 * float(x)) for x in place) for i, place in enumerate(model.nodes)]
    lines.append("*ELEMENT, TYPE=C3D20, ELSET=body")
    for e, nodes in enumerate(model.blocks[0].nodes):
        words = [str(e + 1), *(str(n + 1) for n in nodes)]
        lines += [", ".join(words[:15]) + ",", ", ".join(words[15:])]
    top = model.nodes[:, 2].max()
    lines += ["*NSET, NSET=FIXED", *(f"{n + 1}," for n in held), "*SURFACE, NAME=TOP"]
    lines += [f"{e + 1}, S2" for e, nodes in enumerate(model.blocks[0].nodes) if np.allclose(model.nodes[nodes[4:8], 2], top)]
    path.write_text("\n".join([*lines, "*MATERIAL, NAME=IRON", "*ELASTIC", "120000., 0.25", "*DENSITY", "7.1e-9",
                               "*SOLID SECTION, ELSET=body, MATERIAL=IRON", ""]))
    return held


def of_full_mesh(model: SolidModel, held: np.ndarray, foot: np.ndarray, *, springs: bool) -> np.ndarray:
    """Return the lowest frequencies (Hz) of all finite elements, the held nodes fixed or one rigid piece on springs."""
    stiffness, mass = (matrix.toarray() for matrix in model.assembled())
    free = model.free_coordinates(held)
    carried = np.zeros((model.size, len(free) + (6 if springs else 0)))
    carried[free, np.arange(len(free))] = 1.0
    if springs:
        fixed = np.setdiff1d(np.arange(model.size), free)
        carried[fixed, -6:] = model.rigid_motion(tuple(foot))[fixed]
    stiffness, mass = (carried.T @ matrix @ carried for matrix in (stiffness, mass))
    if springs:
        stiffness[-6:, -6:] += np.diag(list(SPRINGS.values()))
    return np.sqrt(eigh(stiffness, mass, eigvals_only=True, subset_by_index=[0, 11])) / (2 * np.pi)


def main() -> None:
    """Print the largest relative difference of each case, and of all."""
    CommandLine(__doc__).parse_args()
    worst = 0.0
    for name, (low, high) in BODIES.items():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder)
            held = write_mesh(path / "body.inp", Casting([Cuboid(low, high)], {"body": IRON}).meshed(0.1))
            model = read_mesh(path / "body.inp", IRON, unit="mm")
            foot = np.array([high[0] / 2, high[1] / 2, 0.0])
            for springs in (False, True):
                full = of_full_mesh(model, held, foot, springs=springs)
                words = ", stiffness: {" + ", ".join(f"{k}: {v}" for k, v in SPRINGS.items()) + "}" if springs else ""
                (path / "body.yaml").write_text(MACHINE.replace("BAND", f"{full[5]:.6g}").replace("SPRINGS", words).replace(
                    "FOOT", ", ".join(map(str, foot))))
                reduced = solve_undamped(assemble(read_machine(path / "body.yaml"))).frequency[:6]
                error = float(np.abs(reduced / full[:6] - 1).max())
                worst = max(worst, error)
                words = "on springs" if springs else "fixed"
                print(f"{name}, held nodes {words}: six modes to {full[5]:.4g} Hz within {error:.2g}")
    print(f"largest relative difference: {worst:.2g}")


if __name__ == "__main__":
    main()
