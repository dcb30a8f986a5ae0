"""What mesh files name and state: surfaces, sets, materials; elements of 4 and 8 nodes; elements that are no solids."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse.linalg import eigsh
from test_mesh_files import WRITERS, write_cdb, write_inp, write_nastran

from solid_models import brick, tetrahedral_brick
from toolpoint import ToolpointError
from toolpoint.bodies.solid import STEEL, Material, NamedNodes, NamedSurface, Patch
from toolpoint.io import read_machine, read_mesh
from toolpoint.io.meshes.mesh_files import read_content
from toolpoint.io.meshes.mesh_material import material_of_file
from toolpoint.machine import assemble
from toolpoint.machine.assembly.reduction_error import reduction_error
from toolpoint.vibration.eigen import solve_undamped

SIZE, PARTS = [0.3, 0.2, 0.5], [2, 1, 2]
TOP = Patch((0.15, 0.1, 0.5), (1, 0, 0), (0, 1, 0), 0.3, 0.2)
ELASTIC = "*MATERIAL, NAME=IRON\n*ELASTIC\n120000., 0.25\n*DENSITY\n7.1e-9\n*SOLID SECTION, ELSET=column, MATERIAL=IRON\n"


def append(path, text: str) -> None:
    path.write_text(path.read_text() + text)


def sides_on_top(model) -> list[tuple[int, int]]:
    """Element and side number, both from 1, of the faces on top; sides of Abaqus, by their corners."""
    corners = {8: ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
               4: ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))}[model.blocks[0].kind.corner_count]
    return [(e + 1, s + 1) for e, nodes in enumerate(model.blocks[0].nodes) for s, side in enumerate(corners)
            if np.all(np.abs(model.nodes[nodes[list(side)], 2] - 0.5) < 1e-9)]


@pytest.mark.parametrize("build", [brick, tetrahedral_brick])
def test_a_surface_of_sides_is_the_rectangle_over_it(tmp_path, build):
    model, path = build(SIZE, PARTS), tmp_path / "a.inp"
    write_inp(path, model)
    append(path, "*ELSET, ELSET=ALL_OF_IT\n1\ncolumn\n*SURFACE, NAME=RAM_REAR\n"
           + "".join(f"{e}, S{s}\n" for e, s in sides_on_top(model)) + "*SURFACE, NAME=SKIN, TYPE=ELEMENT\ncolumn\n")
    back = read_mesh(path, STEEL, unit="mm")
    assert abs(NamedSurface("ram_rear").averages(back) - TOP.averages(back)).max() < 1e-10
    assert NamedSurface("SKIN").note(back) == "6200 cm^2 of faces"  # 2 (0.3 0.2 + 0.3 0.5 + 0.2 0.5) m^2


def test_node_sets_of_every_format(tmp_path):
    model = brick(SIZE, PARTS)
    top = np.flatnonzero(np.abs(model.nodes[:, 2] - 0.5) < 1e-9) + 11
    for write, suffix in ((write_inp, ".inp"), (write_cdb, ".cdb"), (write_nastran, ".bdf")):
        write(tmp_path / f"a{suffix}", model)
    append(tmp_path / "a.inp", "*NSET, NSET=TOP\n" + ",\n".join(map(str, top)) + "\n*SURFACE, TYPE=NODE, NAME=AGAIN\nTOP, 1.\n")
    append(tmp_path / "a.cdb", f"CMBLOCK,TOP,NODE,{len(top)}\n(8i10)\n" + "".join(f"{n:10d}\n" for n in top))
    words = [str(n) for n in top]
    rows = [words[:7], *(words[k:k + 8] for k in range(7, len(words), 8))]
    card = "\n".join(",".join(["SET1" if k == 0 else "", *(["7"] if k == 0 else []), *row]) for k, row in enumerate(rows))
    append(tmp_path / "a.bdf", card + "\n")
    for name, place in (("a.inp", "TOP"), ("a.inp", "AGAIN"), ("a.cdb", "TOP"), ("a.bdf", "SET1 7")):
        back = read_mesh(tmp_path / name, STEEL, unit="mm")
        assert abs(NamedNodes(place).averages(back) - TOP.averages(back)).max() < 1e-10, name


@pytest.mark.parametrize(("width", "build"), [(4, tetrahedral_brick), (8, brick)])
def test_linear_elements_become_those_with_middles(tmp_path, width, build):
    model, path = build(SIZE, PARTS), tmp_path / "a.inp"
    corners = model.blocks[0].nodes[:, :width]
    lines = ["*NODE"] + [f"{i + 1}, " + ", ".join(f"{1e3 * x!r}" for x in map(float, p)) for i, p in enumerate(model.nodes)]
    lines += [f"*ELEMENT, TYPE=C3D{width}R, ELSET=column"]
    lines += [f"{e + 1}, " + ", ".join(str(n + 1) for n in nodes) for e, nodes in enumerate(corners)]
    top = np.intersect1d(np.flatnonzero(np.abs(model.nodes[:, 2] - 0.5) < 1e-9), corners) + 1
    path.write_text("\n".join([*lines, "*NSET, NSET=TOP", ",\n".join(map(str, top)), ""]))
    back = read_mesh(path, STEEL, unit="mm")
    order = np.lexsort(np.round(back.nodes, 9).T), np.lexsort(np.round(model.nodes, 9).T)
    assert np.allclose(back.nodes[order[0]], model.nodes[order[1]], atol=1e-9)
    assert back.stiffness().trace() == pytest.approx(model.stiffness().trace(), rel=1e-9)
    assert abs(NamedNodes("TOP").averages(back) - TOP.averages(back)).max() < 1e-10
    is_top = np.abs(back.nodes[:, 2] - 0.5) < 1e-9
    assert sorted(back.node_sets["TOP"].tolist()) == np.flatnonzero(is_top).tolist()
    assert "were given mid-side nodes" in read_content(path).notes[0]


@pytest.mark.parametrize(("suffix", "name", "cards"), [
    (".inp", "column", ELASTIC),
    (".cdb", "material 1", "MPDATA,R5.0, 1,EX  ,     1, 1,  120000.\nMP,NUXY,1,0.25\nMP,DENS,1,7.1e-9\n"),
    (".bdf", "property 1", "PSOLID,1,3\nMAT1,3,120000.,,0.25,7.1-9\n")])
def test_materials_of_the_file_are_taken_in_its_units(tmp_path, suffix, name, cards):
    path = tmp_path / f"a{suffix}"
    WRITERS[suffix](path, brick(SIZE, PARTS))
    append(path, cards)
    material, note = material_of_file(path, read_content(path), name, unit="mm")
    assert (material.modulus, material.density, material.poisson) == pytest.approx((120e9, 7100.0, 0.25))
    assert "in N, mm, t: 120 GPa, 7100 kg/m^3" in note
    with pytest.raises(ToolpointError, match="must be a solid's modulus and density in m"):
        material_of_file(path, read_content(path), name, unit="m")


def test_what_is_no_solid_is_named(tmp_path):
    path = tmp_path / "a.inp"
    path.write_text("*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n*ELEMENT,TYPE=S3\n1,1,2,3\n")
    with pytest.raises(ToolpointError, match=r"3 nodes and no solid elements; its elements are S3 \(line 5\)"):
        read_mesh(path, STEEL, unit="mm")
    write_inp(path, brick(SIZE, PARTS))
    append(path, "*ELEMENT, TYPE=S3\n900,11,12,13\n")
    assert read_content(path).notes == ("left out: elements that are no solids, S3",)


@pytest.mark.parametrize(("text", "words"), [
    ("*SURFACE, NAME=A\n1, S9\n", "surface A names element 1 S9"), ("*SURFACE, NAME=A\n7777, S1\n", "element 7777"),
    ("*SURFACE, NAME=A\n1, TOP\n", "the side 'TOP'; must be S1"), ("*NSET, NSET=B\nMISSING\n", "set 'MISSING', which")])
def test_sets_that_are_not_there_are_told_with_their_line(tmp_path, text, words):
    path = tmp_path / "a.inp"
    write_inp(path, brick(SIZE, PARTS))
    append(path, text)
    with pytest.raises(ToolpointError, match=rf"a\.inp:\d+: .*{words}"):
        read_mesh(path, STEEL, unit="mm")


MACHINE = """\
toolpoint: 1
name: ram
bodies:
  ram:
    solid:
      file: a.inp
      unit: mm
      interfaces:
        foot: {FOOT}
        head: {HEAD}
      band: 2500 Hz
joints:
  foot: {parent: ground, child: ram, at: [150 mm, 100 mm, 0], child_interface: foot,
         stiffness: {x: 2e8, y: 2e8, z: 3e8, rx: 2e6, ry: 2e6, rz: 1e6}}
points:
  head: {body: ram, interface: head}
"""


def test_a_machine_by_names_alone_is_the_one_by_rectangles(tmp_path):
    model = brick(SIZE, PARTS)
    write_inp(tmp_path / "a.inp", model)
    foot = np.flatnonzero(np.abs(model.nodes[:, 2]) < 1e-9) + 11
    append(tmp_path / "a.inp", ELASTIC + "*NSET, NSET=FIXED\n" + ",\n".join(map(str, foot)) + "\n*SURFACE, NAME=RAM_REAR\n"
           + "".join(f"{e}, S{s}\n" for e, s in sides_on_top(model)))
    by_rectangles = ("centre: [150 mm, 100 mm, 0], along: [1, 0, 0], across: [0, -1, 0], length: 300 mm, width: 200 mm",
                     "centre: [150 mm, 100 mm, 500 mm], along: [1, 0, 0], across: [0, 1, 0], length: 300 mm, width: 200 mm")
    half = ("centre: [75 mm, 100 mm, 0], along: [1, 0, 0], across: [0, -1, 0], length: 150 mm, width: 200 mm",
            "centre: [225 mm, 100 mm, 0], along: [1, 0, 0], across: [0, -1, 0], length: 150 mm, width: 200 mm")
    frequencies = []
    drawn = f"together: [{{{half[0]}}}, {{{half[1]}}}]", "plane: {at: [0, 0, 500 mm], normal: [0, 0, 1]}"
    for foot_text, head_text in (by_rectangles, ("nodes: fixed", "surface: RAM_REAR"), drawn):
        (tmp_path / "m.yaml").write_text(MACHINE.replace("FOOT", foot_text).replace("HEAD", head_text))
        machine = read_machine(tmp_path / "m.yaml")
        frequencies.append(solve_undamped(assemble(machine)).frequency[:8])
    assert frequencies[1:] == pytest.approx(np.array([frequencies[0]] * 2), rel=1e-9)
    assert any("material of column from a.inp, IRON in N, mm, t" in note for note in machine.bodies[0].notes)
    assert "interface foot: 600 cm^2 of faces" in machine.bodies[0].notes


@pytest.mark.parametrize(("foot", "words"), [
    ("nodes: FIXD", "interfaces.foot.nodes: 'FIXD'; must be of those that the mesh names"),
    ("nodes: FOOT, surface: A", "surface and nodes"),
    ("along: [1, 0, 0]", "centre: missing; must be given: a rectangle has"), ("", "no place"),
    ("nodes: FOOT, slide: [0, 100 mm]", "slide: on a place that is no rectangle")])
def test_faults_of_a_place_are_told_by_their_keys(tmp_path, foot, words):
    write_inp(tmp_path / "a.inp", brick(SIZE, PARTS))
    append(tmp_path / "a.inp", ELASTIC)
    (tmp_path / "m.yaml").write_text(MACHINE.replace("FOOT", foot).replace("HEAD", "nodes: FOOT"))
    with pytest.raises(ToolpointError, match=words):
        assemble(read_machine(tmp_path / "m.yaml"))


def test_held_nodes_hold_as_in_the_full_mesh(tmp_path):
    """The body on the ground by its held nodes: all frequencies of the band as by the unreduced matrices without their rows."""
    model = brick(SIZE, [3, 2, 5])
    write_inp(tmp_path / "a.inp", model)
    held = np.flatnonzero(np.abs(model.nodes[:, 2]) < 1e-9)
    append(tmp_path / "a.inp", ELASTIC + "*NSET, NSET=FIXED\n" + ",\n".join(map(str, held + 11)) + "\n")
    text = MACHINE.replace("foot: {FOOT}", "").replace("{HEAD}", "{plane: {at: [0, 0, 500 mm], normal: [0, 0, 1]}}")
    text = text.replace("band: 2500 Hz", "band: 2500 Hz\n      held: FIXED").replace(
        text[text.index("  foot: {parent"):text.index("points:")],
        "  foot: {parent: ground, child: ram, at: [150 mm, 100 mm, 0], child_interface: held}\n")
    (tmp_path / "m.yaml").write_text(text)
    machine = read_machine(tmp_path / "m.yaml")
    full = read_mesh(tmp_path / "a.inp", Material(120e9, 0.25, 7100.0), unit="mm")
    free = full.free_coordinates(np.unique(full.node_sets["FIXED"]))
    stiffness, mass = (matrix[free][:, free] for matrix in full.assembled())
    squares = eigsh(stiffness, 6, mass, sigma=0.0, return_eigenvectors=False)
    expected = np.sqrt(np.sort(squares)) / (2 * np.pi)
    frequency = solve_undamped(assemble(machine)).frequency
    assert frequency[:3] == pytest.approx(expected[:3], rel=1e-6)  # below 2500 Hz: shapes of the held body itself
    assert frequency[:6] == pytest.approx(expected, rel=2e-2)
    assert reduction_error(machine, modes=3) == pytest.approx(np.zeros(3), abs=1e-6)
    assert f"{len(held)} nodes of FIXED are held as one rigid piece" in machine.bodies[0].notes


def test_a_rigid_foot_on_springs_is_that_of_the_full_mesh(tmp_path):
    """All finite elements with the held nodes as one rigid piece on a spring for each motion: the foot's inertia counts."""
    model = brick(SIZE, [3, 2, 5])
    write_inp(tmp_path / "a.inp", model)
    held = np.flatnonzero(np.abs(model.nodes[:, 2]) < 1e-9)
    append(tmp_path / "a.inp", ELASTIC + "*NSET, NSET=FIXED\n" + ",\n".join(map(str, held + 11)) + "\n")
    text = MACHINE.replace("foot: {FOOT}", "").replace("{HEAD}", "{plane: {at: [0, 0, 500 mm], normal: [0, 0, 1]}}")
    text = text.replace("band: 2500 Hz", "band: 900 Hz\n      held: FIXED").replace("interface: foot", "interface: held")
    springs = [2e8, 2e8, 3e8, 2e6, 2e6, 1e6]
    (tmp_path / "m.yaml").write_text(text)
    frequency = solve_undamped(assemble(read_machine(tmp_path / "m.yaml"))).frequency
    full = read_mesh(tmp_path / "a.inp", Material(120e9, 0.25, 7100.0), unit="mm")
    free, size = full.free_coordinates(held), full.size
    carried = np.zeros((size, len(free) + 6))
    carried[free, np.arange(len(free))] = 1.0
    fixed = np.setdiff1d(np.arange(size), free)
    carried[fixed, -6:] = full.rigid_motion((0.15, 0.1, 0.0))[fixed]
    stiffness, mass = (carried.T @ (matrix @ carried) for matrix in full.assembled())
    stiffness[-6:, -6:] += np.diag(springs)
    expected = np.sqrt(eigh(stiffness, mass, eigvals_only=True, subset_by_index=[0, 5])) / (2 * np.pi)
    assert frequency[:6] == pytest.approx(expected, rel=1e-4)
