"""Bulk data with bars, springs, masses and ties: closed forms, every kind of field, the machine of them, faults with lines."""

from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csc_array

from toolpoint import ToolpointError, ToolpointWarning, io
from toolpoint.bodies.beam import join_elements, ring
from toolpoint.io.matrices import dmig
from toolpoint.io.matrices.bulk_cards import BulkCard, bulk_cards
from toolpoint.io.matrices.bulk_sections import read_material, read_section
from toolpoint.io.matrices.labelled_matrix import LabelledMatrix
from toolpoint.io.yaml import machine_file
from toolpoint.machine import assemble
from toolpoint.spatial.rotation import skew
from toolpoint.vibration import Dof, eigen

LENGTH, COUNT = 0.4, 8
PROPERTY = {
    "PBAR": "PBAR,7,3,{area},{second},{second},{polar}\n",
    "PBARL": "PBARL,7,3,,ROD,,,,,\n+,0.025\n",
    "PBEAM": "PBEAM   7       3       1.9635-33.068-7 3.068-7         6.136-7 \n",
    "PBEAML": "PBEAML*,7,3,,ROD\n*\n*,0.025\n",
}


def bulk(tmp_path, *, kind="PBARL", more="", coupled=1, name="beam.bdf"):
    area, second = np.pi / 4 * 0.05**2, np.pi / 64 * 0.05**4
    lines = [f"PARAM,COUPMASS,{coupled}", "MAT1,3,2.1+11,,0.3,7850.",
             PROPERTY[kind].format(area=area, second=second, polar=2 * second).rstrip()]
    lines += [f"GRID    {k + 1:<8d}{'':8s}{k * LENGTH / COUNT:<8.3f}0.      0." for k in range(COUNT + 1)]
    lines += [f"{'CBEAM' if 'BEAM' in kind else 'CBAR'},{k + 1},7,{k + 1},{k + 2},0.,1.,0." for k in range(COUNT)]
    path = tmp_path / name
    path.write_text("SOL 103\nCEND\nBEGIN BULK\n" + "\n".join(lines) + "\n" + more + "\nENDDATA\n")
    return path


@pytest.mark.parametrize("kind", PROPERTY)
def test_bars_of_every_property_swing_as_the_beam(tmp_path, kind):
    matrices = io.read_matrices(bulk(tmp_path, kind=kind))
    # PBAR without K1 and K2 does not shear, PBEAM has K1 = K2 = 1; a ROD has 0.9.
    section = ring(0.05, 0, 210e9, density=7850, poisson=0.3, shear={"PBAR": 1e5, "PBEAM": 1.0}.get(kind, 0.9))
    beam = join_elements(np.linspace(0, LENGTH, 21), [section] * 20)
    exact = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(beam.mass, beam.stiffness)).real)[6:10]) / (2 * np.pi)
    # Eight bars: 0.6 % in the second bending.
    np.testing.assert_allclose(matrices.modes(10).frequency[6:10], exact, rtol=6e-3)
    assert matrices.directional_mass == pytest.approx(LENGTH * 7850 * np.pi / 4 * 0.05**2, rel=1e-5)


def test_springs_bushings_and_masses_of_any_field_swing_as_two_masses(tmp_path):
    path = tmp_path / "two.bdf"
    path.write_text("BEGIN BULK\nGRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nCONM2,1,1,,1.0,,,,,\n+,1.,,1.,,,1.\nCONM2,2,2,,3.0,,,,,\n"
                    "+,1.,,1.,,,1.\nCELAS2,3,1.0+2,1,1,2,1\nPELAS,9,2.0D2\nCELAS1,4,9,1,1,2,1\n"
                    "PBUSH,5,K,,5.,5.,5.,5.,5.\nCBUSH,6,5,1,2,,,,0\nENDDATA\n")
    frequency = io.read_matrices(path).modes(12).frequency
    assert np.isclose(frequency * 2 * np.pi, 20.0, rtol=1e-9).any()


def test_a_tie_to_a_spider_gives_the_interface_of_the_same_points(tmp_path):
    """RBE3 to a point of its own and an interface over the same points are one thing: modes equal to rounding."""
    lines = "GRID,90,,0.,0.,0.1\nRBE3,100,,90,123456,1.0,123,1,2,\n+,101,102,103\n"
    stub = "".join(f"GRID,{101 + k},,0.,{y},{z}\nRBE2,{200 + k},1,123456,{101 + k}\n" for k, (y, z) in enumerate(
        ((0.05, 0.0), (-0.05, 0.0), (0.0, 0.05))))
    bulk(tmp_path, more=lines + stub)
    frequencies = []
    for points in ("[90]", "[1, 2, 101, 102, 103]"):
        (tmp_path / "machine.yaml").write_text(f"""
toolpoint: 1
name: shaft on a spider
bodies:
  shaft:
    matrices: {{file: beam.bdf, band: 4 kHz,
               interfaces: {{foot: {{points: {points}, at: [0, 0, 0.1]}}, tip: {{points: [9]}}}}}}
joints:
  foot: {{parent: ground, child: shaft, child_interface: foot, at: [0, 0, 0.1],
          stiffness: {{x: 2e8, y: 1e8, z: 1e8, rx: 1e5, ry: 1e5, rz: 1e5}}}}
points: {{tip: {{body: shaft, interface: tip}}}}
""")
        frequencies.append(eigen.solve_undamped(assemble(machine_file.read(tmp_path / "machine.yaml"))).frequency[:6])
    np.testing.assert_allclose(*frequencies, rtol=1e-8)


def test_elements_beside_matrices_add_to_them(tmp_path):
    """The beam as DMIG with a point mass of 2 kg beside it: the same as the mass in the matrix."""
    section = ring(0.05, 0.0, 210e9, density=7850, poisson=0.3, shear=0.9).slender
    beam = join_elements(np.linspace(0, LENGTH, COUNT + 1), [section] * COUNT)
    dofs = tuple(Dof(k + 1, way) for k in range(COUNT + 1) for way in ("+x", "+y", "+z", "+rx", "+ry", "+rz"))
    path = tmp_path / "part.pch"
    dmig.write(path, [LabelledMatrix(name, csc_array(values), dofs, dofs) for name, values in
                      (("KAAX", beam.stiffness), ("MAAX", beam.mass))])
    path.write_text(path.read_text() + "GRID,9,,0.4,0.,0.\nCONM2,1,9,,2.0\n")
    heavier = beam.mass.copy()
    heavier[48:51, 48:51] += 2 * np.eye(3)
    exact = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(heavier, beam.stiffness)).real)[6:10]) / (2 * np.pi)
    matrices = io.read_matrices(path)
    np.testing.assert_allclose(matrices.modes(10).frequency[6:10], exact, rtol=1e-6)
    assert any("1 CONM2" in note for note in matrices.notes)


def test_files_within_files_and_turned_coordinates_are_followed(tmp_path):
    bulk(tmp_path)
    text = (tmp_path / "beam.bdf").read_text()
    grids = [line for line in text.splitlines() if line.startswith("GRID")]
    turned = [line[:16] + "5       " + line[24:] for line in grids]
    (tmp_path / "points.inc").write_text("\n".join(turned) + "\nCORD2R,5,0,0.,0.,0.,0.,0.,1.\n+,0.,1.,0.\n")
    whole = "\n".join(line for line in text.replace("0.,1.,0.", "0.,0.,1.").splitlines() if not line.startswith("GRID"))
    (tmp_path / "turned.bdf").write_text(whole.replace("BEGIN BULK", "BEGIN BULK\nINCLUDE 'points.inc'"))
    matrices = io.read_matrices(tmp_path / "turned.bdf")
    np.testing.assert_allclose(matrices.coordinates[9], [0, LENGTH, 0], atol=1e-12)
    straight = io.read_matrices(tmp_path / "beam.bdf")
    np.testing.assert_allclose(matrices.modes(10).frequency[6:], straight.modes(10).frequency[6:], rtol=1e-9)


def test_millimetres_and_tonnes_are_the_same_beam(tmp_path):
    (tmp_path / "mm.bdf").write_text(
        "PARAM,COUPMASS,1\nMAT1,3,2.1+5,,0.3,7.85-9\nPBARL,7,3,,ROD,,,,,\n+,25.\n"
        + "".join(f"GRID,{k + 1},,{1e3 * k * LENGTH / COUNT},0.,0.\n" for k in range(COUNT + 1))
        + "".join(f"CBAR,{k + 1},7,{k + 1},{k + 2},0.,1.,0.\n" for k in range(COUNT)))
    of_millimetres = io.read_matrices(tmp_path / "mm.bdf", units="mm-t-s")
    of_metres = io.read_matrices(bulk(tmp_path))
    np.testing.assert_allclose(of_millimetres.modes(10).frequency[6:], of_metres.modes(10).frequency[6:], rtol=1e-9)
    assert of_millimetres.coordinates[9][0] == pytest.approx(LENGTH)
    np.testing.assert_allclose(of_millimetres.directional_mass, of_metres.directional_mass, rtol=1e-9)
    np.testing.assert_allclose(of_millimetres.stiffness.diagonal(), of_metres.stiffness.diagonal(), rtol=1e-9)


@pytest.mark.parametrize(("more", "words"), [
    ("CBAR,50,7,1,77,0.,1.,0.", r"beam\.bdf:\d+: CBAR: grid point 77; must be a GRID"),
    ("CBAR,50,8,1,3,0.,1.,0.", r"CBAR: property 8; must be in this file"),
    ("CBAR,50,7,1,3,1.,0.,0.", r"CBAR: .*must point aside"),
    ("CBAR,50,7,1,3", r"CBAR: no orientation vector"),
    ("GRID,60,4,0.,0.,0.", r"GRID: coordinate system 4"),
    ("PBARL,9,3,,CHAN,,,,,\n+,1.,1.,1.,1.", r"PBARL: section CHAN; must be one of ROD, TUBE, BAR, BOX"),
    ("PBAR,9,2,1.,1.,1.,1.", r"PBAR: material 2; must be a MAT1"),
    ("RBE2,50,1,1237,2", r"RBE2: components '1237'"),
    ("RBE3,50,,9,123456,1.0,123,1,2,3", r"RBE3: point 9: .*six motions apart"),
    ("RBE2,50,1,123456,2\nRBE2,51,2,123456,1", r"circle"),
    ("INCLUDE 'nowhere.inc'", r"nowhere\.inc: no such file"),
    ("CONM2,50,1,,x", r"CONM2: 'x'; must be a number"),
])
def test_faults_are_named_with_file_line_and_card(tmp_path, more, words):
    with pytest.raises(ToolpointError, match=words):
        io.read_matrices(bulk(tmp_path, more=more))


def test_what_is_not_read_is_doubted_before_all_else(tmp_path):
    matrices = io.read_matrices(bulk(tmp_path, more="CQUAD4,70,1,1,2,3,4", coupled=-1))
    assert "1 CQUAD4" in matrices.notes[0] and matrices.notes[0].startswith("beam.bdf")
    assert any("half at each end" in note for note in matrices.notes)


@pytest.mark.parametrize(("dimensions", "area", "first", "second"), [
    ("TUBE,,,,,\n+,2.,1.", 3 * np.pi, np.pi / 4 * 15, np.pi / 4 * 15),
    ("BAR,,,,,\n+,2.,3.", 6.0, 2 * 3**3 / 12, 3 * 2**3 / 12),
    ("BOX,,,,,\n+,4.,6.,1.,.5", 24 - 12.0, (4 * 6**3 - 3 * 4**3) / 12, (6 * 4**3 - 4 * 3**3) / 12),
])
def test_sections_by_their_dimensions(tmp_path, dimensions, area, first, second):
    path = tmp_path / "section.bdf"
    path.write_text(f"MAT1,3,2.,1.,,5.\nPBARL,7,3,,{dimensions}\n")
    cards = {card.keyword: card for card in bulk_cards(path, ("MAT1", "PBARL"))}
    section = read_section(cards["PBARL"], {3: read_material(cards["MAT1"])})
    assert (section.axial, section.bending_1, section.bending_2) == pytest.approx((2 * area, 2 * first, 2 * second))
    assert section.mass == pytest.approx(5 * area)


def test_a_thin_box_twists_and_shears_as_its_walls():
    """Bredt for a thin square tube of side a and wall t: J = a^3 t; two of the four walls carry the shear."""
    card = BulkCard(Path("thin.bdf"), 1, ("PBARL", "7", "3", "", "BOX", "", "", "", "", "1.", "1.", ".001", ".001"))
    section = read_section(card, {3: read_material(BulkCard(Path("thin.bdf"), 2, ("MAT1", "3", "2.", "1.", "", "5.")))})
    assert section.torsion == pytest.approx(0.999**3 * 0.001, rel=1e-9)
    assert section.shear_1 == section.shear_2 == pytest.approx(2 * 0.998 * 0.001, rel=1e-9)
    rectangle = BulkCard(Path("flat.bdf"), 1, ("PBARL", "7", "3", "", "BAR", "", "", "", "", "1.", "1."))
    # Roark, table 10.7: a square of side a has J = 0.1406 a^4.
    material = {3: read_material(BulkCard(Path("flat.bdf"), 2, ("MAT1", "3", "2.", "1.")))}
    assert read_section(rectangle, material).torsion == pytest.approx(0.1406, rel=2e-3)


def test_masses_have_offset_inertia_and_the_factor_of_the_file(tmp_path):
    path = tmp_path / "mass.bdf"
    held = "".join(f"CELAS2,{way},1.0,1,{way}\n" for way in range(1, 7))
    path.write_text(f"PARAM,WTMASS,.5\nGRID,1,,1.,0.,0.\n{held}CONM2,9,1,-1,4.,1.,0.,2.\n+,.1,.02,.2,.03,.04,.3\n")
    matrices = io.read_matrices(path)
    arm, mass = skew(np.array([0, 0, 2.0])), 2.0
    inertia = 0.5 * np.array([[0.1, -0.02, -0.03], [-0.02, 0.2, -0.04], [-0.03, -0.04, 0.3]])
    expected = np.block([[mass * np.eye(3), -mass * arm], [mass * arm, inertia - mass * arm @ arm]])
    np.testing.assert_allclose(matrices.mass.toarray(), expected, atol=1e-12)


def test_rigid_bars_and_selected_equations_tie_their_points(tmp_path):
    path = tmp_path / "ties.bdf"
    parts = "".join(f"CELAS2,{way},1.0,1,{way}\nCELAS2,{10 + way},1.0,3,{way}\n" for way in range(1, 7))
    path.write_text(f"SOL 103\nMPC = 4\nBEGIN BULK\nGRID,1,,0.,0.,0.\nGRID,2,,0.,0.,2.\nGRID,3,,1.,0.,0.\n{parts}"
                    "CONM2,30,1,,1.\nCONM2,31,3,,1.\nRBAR,40,1,2,123456\nMPC,4,3,1,2.,2,1,-1.,\n+,,1,2,-3.\nMPC,5,3,2,1.,2,1,-1.\n")
    with pytest.warns(ToolpointWarning, match="differs by direction"):  # the equation mixes x and y
        matrices = io.read_matrices(path)
    tied = matrices.tied
    follower = dict(zip(matrices.dofs, tied.motion[[tied.dofs.index(Dof(3, "+x"))]].toarray()[0], strict=True))
    # u3x = (u2x + 3 u1y) / 2, and point 2 stands 2 above point 1: u2x = u1x + 2 r1y.
    assert {dof: value for dof, value in follower.items() if value} == {
        Dof(1, "+x"): 0.5, Dof(1, "+ry"): 1.0, Dof(1, "+y"): 1.5}
    assert Dof(3, "+y") in matrices.dofs


def test_pins_and_offsets_in_either_axes(tmp_path):
    lines = "PARAM,COUPMASS,1\nMAT1,3,2.1+11,,0.3,7850.\nPBARL,7,3,,ROD,,,,,\n+,0.025\nGRID,1,,0.,0.,0.\nGRID,2,,0.,.5,0.\n"
    spring = "CELAS2,9,1.,2,6\n"  # keeps the turn of point 2 among the coordinates

    def stiffness(bar):
        (tmp_path / "bar.bdf").write_text(lines + spring + bar)
        matrices = io.read_matrices(tmp_path / "bar.bdf")
        return dict(zip(matrices.dofs, matrices.stiffness.diagonal(), strict=True))

    hinged = stiffness("CBAR,1,7,1,2,1.,0.,0.,,\n+,,46\n")
    assert hinged[Dof(2, "+rz")] == pytest.approx(1.0)
    assert hinged[Dof(1, "+rz")] == pytest.approx(3 * 210e9 * np.pi / 64 * 0.05**4 / 0.5, rel=0.05)  # 3 E I / L, and some shear
    # The bar's x axis is the basic y, its y axis the basic x.
    of_basic, of_bar = stiffness("CBAR,1,7,1,2,1.,0.,0.,,\n+,,,.1,.2,.3,.1,.2,.3\n"), stiffness(
        "CBAR,1,7,1,2,1.,0.,0.,GOO,\n+,,,.2,.1,-.3,.2,.1,-.3\n")
    assert of_basic == pytest.approx(of_bar)
    assert of_basic[Dof(1, "+rz")] != pytest.approx(stiffness("CBAR,1,7,1,2,1.,0.,0.\n")[Dof(1, "+rz")], rel=0.01)
