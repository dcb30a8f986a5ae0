"""Column, housing and ram by files alone: held nodes, surfaces by name, the ram sliding in the housing; full and reduced.

    python benchmarks/machine/full_mesh.py [--mesh 0.1]

The column stands on a held node set, the housing on its front by surfaces of both meshes, the ram slides in the housing on four
blocks (rectangles that travel over the ram). Three sources of figures at three positions: the command's full mesh, SciPy's
Lanczos on one assembled sparse matrix, and the reduced bodies. The last two lines are the largest relative difference of the
full mesh from SciPy, and of the reduced bodies from the full mesh beside what they state.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from scipy.sparse import block_diag, csc_array
from scipy.sparse.linalg import eigsh

from benchmarks.frame import CommandLine
from toolpoint.bodies.solid import Casting, Cuboid, Material, NamedNodes, NamedSurface, Patch, SolidModel
from toolpoint.bodies.solid.region import SolidPlace
from toolpoint.io import read_machine, read_mesh
from toolpoint.studies import compare_full_mesh

IRON = Material(120e9, 0.25, 7100.0)
SIZES = {"column": (0.5, 0.4, 1.2), "housing": (0.4, 0.3, 0.4), "ram": (0.2, 0.2, 1.0)}  # m, boxes from their own corner
PLACES = {"column": (0.0, 0.0, 0.0), "housing": (0.05, 0.4, 0.6), "ram": (0.15, 0.7, 0.3)}  # of these corners in the machine, m
BLOCKS = {"a": (0.05, 0.35), "b": (0.15, 0.35), "c": (0.05, 0.65), "d": (0.15, 0.65)}  # x and z on the ram's rear face, m
FOOT, MOUNT = (2e9, 2e9, 3e9, 2e8, 2e8, 1e8), (3e9, 4e9, 3e9, 9e7, 9e7, 9e7)  # N/m, N m/rad
GUIDE = {"x": 5e8, "y": 6e8, "rx": 1e6, "ry": 1e6, "rz": 1e6}
SCREW, COUNT, TRAVEL = 1.5e8, 10, 0.2
MACHINE = """toolpoint: 1
name: column, housing, ram
bodies:
  column:
    solid: {file: column.inp, unit: mm, held: FIXED, band: 600 Hz, interfaces: {front: {surface: FRONT}}}
  housing:
    frame: {at: [0.05, 0.4, 0.6]}
    solid:
      file: housing.inp
      unit: mm
      band: 600 Hz
      interfaces:
        rear: {surface: REAR}
BLOCKS_OF_HOUSING
  ram:
    frame: {at: [0.15, 0.7, 0.3]}
    solid:
      file: ram.inp
      unit: mm
      band: 600 Hz
      interfaces:
        nose: {surface: BOTTOM}
WAYS_OF_RAM
joints:
  foot: {parent: ground, child: column, at: [0.25, 0.2, 0], child_interface: held, stiffness: FOOT_STIFFNESS}
  mount: {parent: column, child: housing, at: [0.25, 0.4, 0.8], parent_interface: front, child_interface: rear,
          stiffness: MOUNT_STIFFNESS}
GUIDES
axes: {Z: {joint: guide_a, direction: z, limits: [-200 mm, 200 mm]}}
points: {tool: {body: ram, interface: nose}}
tool: tool
reduction_error: 0
"""
WAYS = ("x", "y", "z", "rx", "ry", "rz")


def model_of(name: str, size: float) -> SolidModel:
    """The box of a part."""
    return Casting([Cuboid((0.0, 0.0, 0.0), SIZES[name])], {"body": IRON}).meshed(size)


def write_mesh(path: Path, model: SolidModel) -> None:
    """Write an Abaqus file with the nodes of the foot as FIXED, and the faces FRONT (+y), REAR (-y), BOTTOM (-z)."""
    x, low, high = model.nodes, model.nodes.min(axis=0), model.nodes.max(axis=0)
    lines = ["*NODE"] + [f"{i + 1}, " + ", ".join(repr(1e3 * float(c)) for c in place) for i, place in enumerate(x)]
    lines.append("*ELEMENT, TYPE=C3D20, ELSET=body")
    for e, nodes in enumerate(model.blocks[0].nodes):
        words = [str(e + 1), *(str(n + 1) for n in nodes)]
        lines += [", ".join(words[:15]) + ",", ", ".join(words[15:])]
    lines += ["*NSET, NSET=FIXED", *(f"{n + 1}," for n in np.flatnonzero(np.abs(x[:, 2] - low[2]) < 1e-9))]
    corners = {"S1": [0, 1, 2, 3], "S2": [4, 5, 6, 7], "S3": [0, 1, 5, 4], "S4": [1, 2, 6, 5], "S5": [2, 3, 7, 6],
               "S6": [3, 0, 4, 7]}
    for surface, axis, end in (("FRONT", 1, high), ("REAR", 1, low), ("BOTTOM", 2, low)):
        lines.append(f"*SURFACE, NAME={surface}")
        lines += [f"{e + 1}, {side}" for e, nodes in enumerate(model.blocks[0].nodes) for side, chosen in corners.items()
                  if np.allclose(x[nodes[chosen], axis], end[axis])]
    path.write_text("\n".join([*lines, "*MATERIAL, NAME=IRON", "*ELASTIC", "120000., 0.25", "*DENSITY", "7.1e-9",
                               "*SOLID SECTION, ELSET=body, MATERIAL=IRON", ""]))


def on_ram_place(x: float, z: float) -> np.ndarray:
    """Return a place of the ram's rear face in the machine, m."""
    return np.array(PLACES["ram"]) + np.array([x, 0.0, z])


def machine_text() -> str:
    """The machine's file: blocks are places of the housing's front, and travel over the ram's rear face."""
    housing, ram, guides = [], [], []
    stiffness = "{" + ", ".join(f"{way}: {value:g}" for way, value in GUIDE.items()) + "}"
    for name, (x, z) in BLOCKS.items():
        patch = "along: [0, 0, 1], across: [1, 0, 0], length: 60 mm, width: 40 mm"
        on_housing = on_ram_place(x, z) - PLACES["housing"]
        housing.append(f"        {name}: {{centre: {on_housing.round(6).tolist()}, {patch}}}")
        ram.append(f"        {name}: {{centre: [{x}, 0, {z}], {patch}, slide: [-{TRAVEL}, {TRAVEL}]}}")
        place = on_ram_place(x, z).round(6).tolist()
        kind = "free: [z]" if name != "a" else ""
        springs = stiffness if name != "a" else stiffness[:-1] + f", z: {SCREW:g}}}"
        loop = "closes_loop: true, " if name != "a" else ""
        guides.append(f"  guide_{name}: {{parent: housing, child: ram, at: {place}, {loop}elastic_at: parent, "
                      f"parent_interface: {name}, child_interface: {name}, stiffness: {springs}{', ' + kind if kind else ''}}}")
    text = MACHINE.replace("BLOCKS_OF_HOUSING", "\n".join(housing)).replace("WAYS_OF_RAM", "\n".join(ram))
    for key, values in (("FOOT_STIFFNESS", FOOT), ("MOUNT_STIFFNESS", MOUNT)):
        text = text.replace(key, "{" + ", ".join(f"{way}: {value:g}" for way, value in zip(WAYS, values, strict=True)) + "}")
    return text.replace("GUIDES", "\n".join(guides))


def of_scipy(models: dict[str, SolidModel], position: float) -> np.ndarray:
    """Return the lowest frequencies (Hz) of one assembled sparse matrix, by SciPy."""
    starts = dict(zip(models, np.cumsum([0, *(model.size for model in models.values())])[:-1], strict=True))
    total = sum(model.size for model in models.values())
    stiffness, mass = (block_diag(parts, format="csc") for parts in zip(*(model.assembled() for model in models.values()),
                                                                        strict=True))

    def twist(name: str, place: SolidPlace, joint: np.ndarray) -> csc_array:
        """Motion at the joint's place in the machine's axes, (total, 6)."""
        weights = place.averages(models[name])
        arm = joint - place.centre_on(models[name]) - PLACES[name]
        shift = np.eye(6)
        shift[:3, 3:] = -np.array([[0, -arm[2], arm[1]], [arm[2], 0, -arm[0]], [-arm[1], arm[0], 0]])
        part = csc_array(weights @ shift.T).tocoo()
        return csc_array((part.data, (part.row + starts[name], part.col)), shape=(total, 6))

    # Held nodes as one rigid piece.
    column = models["column"]
    held = np.unique(NamedNodes("FIXED").nodes(column))
    centre = NamedNodes("FIXED").centre_on(column)
    free = np.setdiff1d(np.arange(total), column.coordinates_of(held))
    rigid = np.zeros((total, 6))
    rigid[column.coordinates_of(held)] = column.rigid_motion(tuple(centre))[column.coordinates_of(held)]
    rows, columns = np.nonzero(rigid)
    carried = csc_array((np.concatenate([np.ones(len(free)), rigid[rows, columns]]),
                         (np.concatenate([free, rows]), np.concatenate([np.arange(len(free)), len(free) + columns]))),
                        shape=(total, len(free) + 6))
    mount = np.array([0.25, 0.4, 0.8])
    motion = csc_array(twist("housing", NamedSurface("REAR"), mount) - twist("column", NamedSurface("FRONT"), mount))
    springs = motion @ np.diag(MOUNT) @ motion.T.toarray()
    total_stiffness = csc_array(stiffness) + csc_array(springs)
    for name, (x, z) in BLOCKS.items():
        joint = on_ram_place(x, z)
        on_ram = Patch((x, 0, z - position), (0, 0, 1), (1, 0, 0), 0.06, 0.04)
        on_housing = Patch(joint - PLACES["housing"], (0, 0, 1), (1, 0, 0), 0.06, 0.04)
        motion = csc_array(_at(twist, "ram", on_ram, joint, position) - twist("housing", on_housing, joint))
        diagonal = [GUIDE.get(way, 0.0) for way in WAYS]
        diagonal[2] = SCREW if name == "a" else 0.0
        total_stiffness = total_stiffness + csc_array(motion @ np.diag(diagonal) @ motion.T.toarray())
    k, m = (csc_array(carried.T @ matrix @ carried) for matrix in (total_stiffness, csc_array(mass)))
    k = k + csc_array((FOOT, (np.arange(len(free), len(free) + 6),) * 2), shape=k.shape)
    squares = eigsh(k, COUNT, m, sigma=0.0, return_eigenvectors=False)
    return np.sort(np.sqrt(squares)) / (2 * np.pi)


def _at(twist, name: str, place: Patch, joint: np.ndarray, position: float) -> csc_array:  # type: ignore[no-untyped-def]
    """The motion of a part that has moved along z: its joint lies lower on it."""
    return twist(name, place, joint - [0.0, 0.0, position])


def main() -> None:
    """Print the differences at every position."""
    line = CommandLine(__doc__)
    line.add_argument("--mesh", type=float, default=0.1)
    size = line.parse_args().mesh
    errors: list[float] = []
    worst, stated, truth = 0.0, 0.0, 0.0
    with tempfile.TemporaryDirectory() as folder:
        path, models = Path(folder), {}
        for name in SIZES:
            write_mesh(path / f"{name}.inp", model_of(name, size))
            models[name] = read_mesh(path / f"{name}.inp", IRON, unit="mm")
        (path / "machine.yaml").write_text(machine_text())
        machine = read_machine(path / "machine.yaml")
        print(repr(machine))
        for position in (0.0, 0.13, -0.171):
            begin = time.process_time()
            result = compare_full_mesh(machine, {"Z": position}, COUNT)
            seconds = time.process_time() - begin
            error = float(np.abs(result.frequency / of_scipy(models, position) - 1).max())
            worst, truth = max(worst, error), max(truth, float(result.rise.max()))
            stated = max(stated, float(np.nanmax(result.stated)))
            errors.append(error)
            print(result.table())
            print(f"Z {1e3 * position:g} mm: full mesh within {error:.2g} of SciPy, {seconds:.1f} s")
    print(f"largest relative difference of the full mesh from SciPy: {worst:.2g}")
    print(f"reduced bodies above the full mesh by at most {truth:.2g}, stated {stated:.2g}")


if __name__ == "__main__":
    main()
