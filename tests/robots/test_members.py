"""Members of a robot: rigid, a beam, or finite elements, chosen for each in one file."""

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_mesh_files import write_inp

from toolpoint import ToolpointError
from toolpoint.io.yaml import robot_file
from toolpoint.machine import build
from toolpoint.machine import description as d
from toolpoint.machine.description.elastic import CastingBox, ElasticDescription
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.machine.robot.datasheet import RobotMember
from toolpoint.machine.robot.model import bending_members, rigid_members, robot_machine
from toolpoint.machine.robot.solid_member import solid_member
from toolpoint.studies.robots.datasheet_study import study_datasheet

SHEET = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines/milling_robot_datasheet.yaml"


@pytest.fixture(scope="module")
def sheet():
    return robot_file.read(SHEET)


def bar(wall=None):
    return RobotMember(1, "box", (0.4, 0.0, 0.0), (0.8, 0.04, 0.04), along="x", wall=wall, modulus=70e9,
                       elastic="finite elements")


@pytest.mark.parametrize(("wall", "share"), [(None, 0.01), (0.006, 0.02)])
def test_a_slender_member_is_a_cantilever(wall, share):
    """3.516 / (2 pi) sqrt(EI / (m L^3)), Euler-Bernoulli; the far end of a hollow one is thicker: heavier at the tip."""
    mass = 3.0
    body = solid_member("bar", bar(wall), mass, sense=1.0)
    foot = d.JointDescription("ground", "bar", child_interface="near")
    tip = d.PointDescription("bar", interface="far")
    machine = build(d.MachineDescription("bar", {"bar": body}, {"foot": foot}, {}, {"tip": tip}))
    inner = 0.0 if wall is None else 0.04 - 2 * wall
    bending = 70e9 * (0.04**4 - inner**4) / 12
    found = natural_frequencies(machine, {}, 2)[0]
    expected = 3.516 / (2 * np.pi) * np.sqrt(bending / (mass * 0.8**3))
    assert found[0] == pytest.approx(expected, rel=share) and found[1] == pytest.approx(found[0], rel=1e-6)
    assert sum(b.mass[0, 0] for b in machine.bodies) == pytest.approx(mass, rel=1e-9)


@pytest.mark.slow
def test_one_file_may_hold_all_three(sheet, tmp_path):
    text = SHEET.read_text(encoding="utf-8")
    old = "size: [120 mm, 110 mm, 360 mm], elastic: true"
    assert old in text
    text = text.replace(old, old.replace("true", "finite elements")).replace(
        "size: [230 mm, 180 mm, 160 mm], elastic: true", "size: [230 mm, 180 mm, 160 mm], elastic: rigid")
    path = tmp_path / "robot.yaml"
    path.write_text(text, encoding="utf-8")
    mixed = robot_file.read(path)
    assert [mixed.members[name].bending for name in ("base", "turret", "upper_arm")] == ["beam", "rigid", "finite elements"]
    machine = build(robot_file.read_robot_machine(path))
    assert machine.description.bodies["link2"].elastic is not None and "link1_end" not in machine.description.bodies
    assert machine.description.joints["joint_q2"].child_interface == "near"
    assert machine.description.joints["joint_q3"].parent_interface == "far"
    assert sum(b.mass[0, 0] for b in machine.bodies) == pytest.approx(32.0, rel=1e-9)
    study = study_datasheet(mixed, machine.description, finite_elements=False)
    assert study.rest_load.vertical_force == pytest.approx(313.6, abs=1e-9)
    lowest = natural_frequencies(machine, {}, 1)[0, 0]
    assert lowest < natural_frequencies(build(robot_machine(rigid_members(mixed))), {}, 1)[0, 0]


def test_only_the_first_member_of_a_link_bends_and_stiff_material_is_rigid(sheet):
    stiff = replace(sheet, members={name: replace(part, modulus=70e11) for name, part in sheet.members.items()})
    one = replace(stiff, members=stiff.members | {"upper_arm": replace(stiff.members["upper_arm"], elastic="finite elements")})
    found = natural_frequencies(build(robot_machine(bending_members(one, "beam"))), {}, 4)[0]
    solid = natural_frequencies(build(robot_machine(one)), {}, 4)[0]
    # The walls hold the mass, so the inertia differs a little from that of the even block.
    assert np.allclose(solid, found, rtol=8e-3)


@pytest.mark.slow
def test_the_error_of_rigid_members_and_of_beams_is_told(sheet):
    result = study_datasheet(sheet, robot_file.read_robot_machine(SHEET))
    rigid, beams, elements = result.ways.values()
    assert (elements < beams).all() and (beams < rigid).all()
    assert "members by finite elements" in result.table()
    assert set(result.to_dict()["frequency_by_members_hz"]) == set(result.ways)


def tube(wall=None, along="x"):
    at = 0.4 * np.eye(3)["xyz".index(along)]
    return RobotMember(1, "cylinder", tuple(at.tolist()), diameter=0.04, length=0.8, along=along, wall=wall, modulus=70e9,
                       elastic="finite elements")


@pytest.mark.parametrize(("wall", "along", "share"), [
    (None, "z", 0.01), *(pytest.param(*case, marks=pytest.mark.slow) for case in ((0.006, "x", 0.02), (0.003, "y", 0.03)))])
def test_a_slender_tube_is_a_cantilever_and_a_shaft(wall, along, share):
    """1 / (2 pi) sqrt(3 EI / L^3 / (0.2427 m + m_tip)), Rayleigh, the far end's thickness at the tip (thin ends bend); a solid
    one twists at sqrt(G / rho) / (4 L)."""
    mass = 3.0
    body = solid_member("tube", tube(wall, along), mass, sense=1.0)
    foot = d.JointDescription("ground", "tube", child_interface="near")
    tip = d.PointDescription("tube", interface="far")
    machine = build(d.MachineDescription("tube", {"tube": body}, {"foot": foot}, {}, {"tip": tip}))
    inner = 0.0 if wall is None else 0.04 - 2 * wall
    bending = 70e9 * np.pi / 64 * (0.04**4 - inner**4)
    found = natural_frequencies(machine, {}, 8)[0]
    walls, ends = 0.8 * (0.04**2 - inner**2), 3 * (wall or 0.0) * inner**2
    still = mass / (walls + 2 * ends) * (0.2427 * walls + ends)
    assert found[0] == pytest.approx(np.sqrt(3 * bending / 0.8**3 / still) / (2 * np.pi), rel=share)
    assert found[1] == pytest.approx(found[0], rel=1e-6)
    assert sum(b.mass[0, 0] for b in machine.bodies) == pytest.approx(mass, rel=1e-9)
    if wall is None:
        twist = np.sqrt(70e9 / 2 / 1.33 / (mass / (np.pi * 0.02**2 * 0.8))) / (4 * 0.8)
        assert np.abs(found / twist - 1).min() < 0.01


def test_a_bore_through_both_ends_is_refused(sheet):
    wrong = replace(sheet, members=sheet.members | {"forearm": replace(sheet.members["forearm"], elastic="finite elements",
                                                                       bore=0.05)})
    with pytest.raises(ToolpointError, match=r"members.forearm.bore: a bore through both ends; .* give the tube a wall"):
        robot_machine(wrong)


FACES = """near: {centre: [150 mm, 0, -55 mm], along: [1, 0, 0], across: [0, -1, 0], length: 108 mm, width: 99 mm},
    far: {centre: [150 mm, 0, 305 mm], along: [1, 0, 0], across: [0, 1, 0], length: 108 mm, width: 99 mm}"""


def mesh_sheet(tmp_path, file="arm.inp"):
    text = SHEET.read_text(encoding="utf-8")
    start = text.index("  upper_arm: {")
    row = f"""  upper_arm: {{link: 2, kind: mesh, mesh: {file}, mesh_unit: 1 mm, along: z, elastic: finite elements,
    {FACES}, source: chosen}}"""
    path = tmp_path / "robot.yaml"
    path.write_text(text[:start] + row + text[text.index("\n", start):], encoding="utf-8")
    return path


@pytest.mark.slow
def test_a_member_of_another_program_s_mesh_is_the_same_box(sheet, tmp_path):
    bent = replace(sheet, members=sheet.members | {"upper_arm": replace(sheet.members["upper_arm"],
                                                                        elastic="finite elements", wall=None)})
    box = robot_machine(bent)
    write_inp(tmp_path / "arm.inp", box.bodies["link2"].elastic.model)
    path = mesh_sheet(tmp_path)
    machine = robot_file.read_robot_machine(path)
    assert machine.bodies["link2"].solid is not None and machine.joints["joint_q3"].parent_interface == "far"
    mine, other = build(machine), build(box)
    assert sum(b.mass[0, 0] for b in mine.bodies) == pytest.approx(32.0, rel=1e-9)
    assert np.allclose(natural_frequencies(mine, {}, 4), natural_frequencies(other, {}, 4), rtol=1e-6)
    study = study_datasheet(robot_file.read(path), machine, finite_elements=False)
    assert study.rest_load.vertical_force == pytest.approx(313.6, abs=1e-9)


def test_a_surface_alone_is_no_finite_elements(tmp_path):
    with pytest.raises(ToolpointError, match=r"arm.stl is a surface alone; finite elements need a STEP solid"):
        robot_file.read(mesh_sheet(tmp_path, "arm.stl"))


def box_corners(low, high):
    """The twelve triangles of a box, counter-clockwise seen from outside."""
    ends = np.array([low, high], float)
    corner = np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4),
             (1, 5, 7), (1, 7, 3)]
    return corner[np.array(faces)]


def write_stl(path, corners):
    lines = ["solid part", *("facet normal 0 0 0\nouter loop\n" + "\n".join(
        f"vertex {x:.9g} {y:.9g} {z:.9g}" for x, y, z in face) + "\nendloop\nendfacet" for face in corners), "endsolid part"]
    path.write_text("\n".join(lines), encoding="utf-8")


def rigid_mesh_sheet(tmp_path, unit="1 mm", file="arm.stl"):
    path = mesh_sheet(tmp_path, file)
    text = path.read_text(encoding="utf-8").replace("elastic: finite elements,", "elastic: rigid,", 1).replace(
        "mesh_unit: 1 mm", f"mesh_unit: {unit}")
    path.write_text(text, encoding="utf-8")
    return path


ARM = box_corners([90, -55, -55], [210, 55, 305])  # mm, the upper arm's box


def test_a_rigid_member_of_a_surface_is_the_box_that_it_bounds(sheet, tmp_path):
    """Volume, centre and inertia by the divergence theorem."""
    write_stl(tmp_path / "arm.stl", ARM)
    mine = robot_file.read_robot_machine(rigid_mesh_sheet(tmp_path))
    rigid = replace(sheet, members=sheet.members | {"upper_arm": replace(sheet.members["upper_arm"], elastic="rigid")})
    other = robot_machine(rigid)
    assert mine.bodies["link2"].mesh is not None
    assert np.allclose(natural_frequencies(build(mine), {}, 4), natural_frequencies(build(other), {}, 4), rtol=1e-9)


@pytest.mark.parametrize(("corners", "unit", "words"), [
    (ARM[1:], "1 mm", r"members.upper_arm.mesh: arm.stl: .*3 open edges, the first \d+-\d+ at x 90, y -?\d+, z -?\d+ mm"),
    (ARM[:, ::-1], "1 mm", r"members.upper_arm.mesh: arm.stl: .*inside out"),
    (np.concatenate([ARM[:1, ::-1], ARM[1:]]), "1 mm", r"edge \d+-\d+ at x 90.* mm is run through twice"),
    (ARM, "1 m", r"members.upper_arm.mesh: arm.stl: mesh_unit: 1 m makes it 360 m long.*most STL files are in mm"),
    (ARM + 9000, "1 mm", r"9\.\d+ m from the base at most")])
def test_surfaces_that_bound_no_member_are_refused_with_the_place(tmp_path, corners, unit, words):
    write_stl(tmp_path / "arm.stl", corners)
    with pytest.raises(ToolpointError, match=words):
        robot_file.read_robot_machine(rigid_mesh_sheet(tmp_path, unit))


def test_a_solid_s_file_as_a_rigid_surface_is_refused(tmp_path):
    (tmp_path / "arm.step").write_text("ISO-10303-21;", encoding="utf-8")
    with pytest.raises(ToolpointError, match=r"members.upper_arm.mesh: arm.step; a rigid member's mesh must be an STL surface"):
        robot_file.read_robot_machine(rigid_mesh_sheet(tmp_path, file="arm.step"))


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("netgen") is None, reason="Netgen (extra 'mesh') is not installed")
def test_a_member_of_a_step_solid_is_the_same_box(sheet, tmp_path, monkeypatch):
    """Tetrahedra against the hexahedra of the box itself; both are fine enough for a hundredth."""
    from netgen.occ import Box, Pnt

    monkeypatch.setenv("TOOLPOINT_CACHE", str(tmp_path / "cache"))
    Box(Pnt(90, -55, -55), Pnt(210, 55, 305)).WriteStep(str(tmp_path / "arm.step"))
    path = mesh_sheet(tmp_path, "arm.step")
    path.write_text(path.read_text(encoding="utf-8").replace("mesh_unit: 1 mm", "mesh_unit: 1 mm, mesh_size: 40 mm"),
                    encoding="utf-8")
    machine = robot_file.read_robot_machine(path)
    bent = replace(sheet, members=sheet.members | {"upper_arm": replace(sheet.members["upper_arm"],
                                                                        elastic="finite elements", wall=None)})
    mine, other = build(machine), build(robot_machine(bent))
    assert sum(b.mass[0, 0] for b in mine.bodies) == pytest.approx(32.0, rel=1e-9)
    assert np.allclose(natural_frequencies(mine, {}, 4), natural_frequencies(other, {}, 4), rtol=1e-2)


def test_round_parts_of_another_axis_or_place_are_refused():
    parts = (CastingBox((0, 0, 0), (0.1, 0.1, 0.3), round="z"), CastingBox((0, 0, 0), (0.1, 0.1, 0.1), round="x"))
    for boxes, words in ((parts, r"boxes\[1\].round: 'x'; must be 'z'"),
                         ((parts[0], CastingBox((0.01, 0, 0), (0.11, 0.1, 0.1), round="z")), r"boxes\[1\]: centre"),
                         ((CastingBox((0, 0, 0), (0.1, 0.2, 0.1), round="z"),), r"must be square, a cylinder fits in it")):
        with pytest.raises(ToolpointError, match=words):
            ElasticDescription(boxes, {}, 1000.0, 0.05).model  # noqa: B018


def test_a_wall_that_leaves_no_hollow():
    with pytest.raises(ToolpointError, match=r"members.bar.wall: 20 mm; must leave it hollow"):
        solid_member("bar", bar(0.02), 1.0, sense=1.0)
