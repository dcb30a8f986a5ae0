"""Laws of joints: closed forms, symmetry, differences of the force for tangents, catalogue-like sizes; and in machine files."""

from dataclasses import replace

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.io.yaml import machine_file
from toolpoint.joints import LawDescription, join_parallel, join_series
from toolpoint.joints.angular_contact import BearingDescription
from toolpoint.joints.ball_screw import BallScrewDescription
from toolpoint.joints.contact_patch import ContactPatch, PatchContactDescription
from toolpoint.joints.guideway import GuidewayCarriage, GuidewayDescription
from toolpoint.joints.rolling_contact import compliance_constant, contact_stiffness

CARRIAGE = GuidewayCarriage(35e3, 0.08, 12, 0.006, 0.06, 0.03, 0.02)
BEARING = BearingDescription(((0.0, 0.0, 0.0),), (1,), 20, 0.0087, 0.05, 500.0, np.deg2rad(15))
SCREW = BallScrewDescription(6e8, 8e8, 0.035, 0.9, 0.4)


@pytest.mark.parametrize(("kind", "size"), [("ball", {"diameter": 0.01}), ("roller", {"diameter": 0.0, "length": 0.008})])
def test_tangent_of_a_rolling_contact_is_that_of_its_law(kind, size):
    constant, load, step = compliance_constant(kind, **size), 120.0, 1e-3
    exponent = 2 / 3 if kind == "ball" else 0.9
    difference = 2 * step / (constant * ((load + step) ** exponent - (load - step) ** exponent))
    assert contact_stiffness(kind, load, constant) == pytest.approx(difference, rel=1e-7)


def test_ball_compliance_is_palmgrens():
    # Harris, section 8.6: 4.36e-4 mm N^-2/3 mm^1/3; a ball of 8 mm under 1000 N: 0.0218 mm.
    assert compliance_constant("ball", 0.008) * 1000 ** (2 / 3) == pytest.approx(4.36e-4 * 100 / 2 * 1e-3, rel=1e-12)


def test_carriage_by_hand():
    """Four rows at 45 degrees: half of all contact stiffness up and half across; turning about the rail by the arms."""
    k = contact_stiffness("ball", 0.08 * 35e3 / 12, compliance_constant("ball", 0.006))
    stiffness = CARRIAGE.stiffness
    assert np.diag(stiffness)[:3] == pytest.approx([0, 24 * k, 24 * k], rel=1e-12)
    places = np.linspace(-0.5, 0.5, 12) * 0.06
    assert stiffness[4, 4] == pytest.approx(2 * k * (places**2).sum(), rel=1e-12)
    # Lines of force of an O arrangement meet farther out than those of an X: arm (b +- h)/2 /sqrt 2.
    arm = (0.015 - 0.01) / np.sqrt(2), (0.015 + 0.01) / np.sqrt(2)
    both = sorted([stiffness[3, 3], replace(CARRIAGE, arrangement="X").stiffness[3, 3]])
    assert both == pytest.approx([48 * k * a**2 for a in arm], rel=1e-9)


def test_preload_stiffens_as_its_cube_root_and_catalogue_numbers_pass():
    ratio = replace(CARRIAGE, preload=0.04).stiffness[1, 1] / CARRIAGE.stiffness[1, 1]
    assert ratio == pytest.approx(0.5 ** (1 / 3), rel=1e-12)
    pair = GuidewayDescription(((0.0, 0.1, 0.0), (0.0, -0.1, 0.0)), radial=4e8, lateral=3e8)
    assert np.diag(pair.stiffness) == pytest.approx([0, 6e8, 8e8, 8e8 * 0.01, 0, 0])
    turned = GuidewayDescription(((0.0, 0.0, 0.0),), along="z", up="x", carriage=CARRIAGE)
    assert np.diag(turned.stiffness)[:3] == pytest.approx(np.diag(CARRIAGE.stiffness)[[2, 1, 0]])


def test_screw_in_series_by_position():
    area = np.pi / 4 * 0.035**2
    assert 1 / SCREW.axial() == pytest.approx(1 / 6e8 + 1 / 8e8 + 0.4 / (206e9 * area))
    both = replace(SCREW, held="both ends", nut_at=0.45)
    half = 0.45 / (206e9 * area) + 1 / 8e8
    assert 1 / both.axial() == pytest.approx(1 / 6e8 + half / 2)
    assert both.axial(0.3) == pytest.approx(both.axial(0.6)) and both.axial(0.3) > both.axial()
    assert replace(SCREW, lead=0.02).axial() < SCREW.axial()
    with pytest.raises(ToolpointError, match="within the shaft"):
        SCREW.axial(1.0)


@pytest.mark.parametrize("speed", [0.0, 15000.0, 30000.0])
def test_axial_stiffness_of_a_bearing_is_the_slope_of_its_preload(speed):
    bearing = replace(BEARING, speed=speed)

    def shift(load):
        changed = replace(bearing, preload=load)
        angles, forces = changed.race_state()
        constant = (2 / compliance_constant("ball", bearing.ball_diameter)) ** 1.5
        lengths = 0.02 * bearing.ball_diameter + (forces / constant) ** (2 / 3)
        return float((lengths * np.sin(angles)).sum())

    assert bearing.single[2, 2] == pytest.approx(2 / (shift(501.0) - shift(499.0)), rel=1e-4)


def test_bearing_at_speed_keeps_its_forces_in_balance():
    (inner, outer), (force_in, force_out) = replace(BEARING, speed=20000.0).race_state()
    assert force_in * np.sin(inner) == pytest.approx(25.0) and force_out * np.sin(outer) == pytest.approx(25.0)
    assert outer < np.deg2rad(15) < inner and BEARING.race_state()[0][0] == pytest.approx(BEARING.race_state()[0][1])
    stiff = [replace(BEARING, speed=s).single[0, 0] for s in (0.0, 10000.0, 20000.0)]
    assert stiff[0] > stiff[1] > stiff[2]  # centrifugal force softens a spring-preloaded bearing
    assert abs(BEARING.single[5, 5]) < 1e-9 * BEARING.single[3, 3]


def test_rings_at_a_fixed_distance_press_their_balls_harder_as_the_speed_grows():
    """Distance of the rings: both races' lengths along the axis, by hand; force and stiffness at speed; alike at rest."""
    rigid = replace(BEARING, preload_by="distance")
    assert rigid.axial_force() == BEARING.preload and np.array_equal(rigid.single, BEARING.single)

    def apart(bearing):
        angles, forces = bearing.race_state()
        constant = (2 / compliance_constant("ball", bearing.ball_diameter)) ** 1.5
        return float(((0.02 * bearing.ball_diameter + (forces / constant) ** (2 / 3)) * np.sin(angles)).sum())

    forces = []
    for speed in (0.0, 10000.0, 20000.0):
        at_speed = replace(rigid, speed=speed)
        assert apart(at_speed) == pytest.approx(apart(rigid), rel=1e-9)
        (inner, outer), (force_in, force_out) = at_speed.race_state()
        assert force_in * np.sin(inner) == pytest.approx(force_out * np.sin(outer), rel=1e-12)
        forces.append(at_speed.axial_force())
    assert forces[0] < forces[1] < forces[2]
    assert apart(replace(BEARING, speed=20000.0)) < 0.999 * apart(rigid)  # under a spring the rings give way
    assert replace(rigid, speed=20000.0).single[0, 0] > replace(BEARING, speed=20000.0).single[0, 0]
    with pytest.raises(ToolpointError, match="as many"):
        _ = BearingDescription(((0, 0, 0),), (1,), 20, 0.0087, 0.05, 500.0, preload_by="distance").stiffness


def test_back_to_back_pair_resists_tilting_more_than_face_to_face():
    places = ((0.0, 0.0, -0.02), (0.0, 0.0, 0.02))
    back, face = (BearingDescription(places, ways, 20, 0.0087, 0.05, 500.0).stiffness for ways in ((1, -1), (-1, 1)))
    assert back[2, 2] == pytest.approx(face[2, 2]) and (back[3, 3] > 1.5 * face[3, 3] or face[3, 3] > 1.5 * back[3, 3])


def test_patches_are_integrals_of_their_stiffness_per_area():
    patch = PatchContactDescription((ContactPatch((0.1, 0.2, 0.0), (0.06, 0.04)),), per_area=1e12, shear_ratio=0.8)
    single = PatchContactDescription((ContactPatch((0.0, 0.0, 0.0), (0.06, 0.04)),), per_area=1e12, shear_ratio=0.8).stiffness
    area = 0.0024
    assert np.diag(single) == pytest.approx([0.8e12 * area] * 2 + [1e12 * area, 1e12 * 0.06 * 0.04**3 / 12,
                                            1e12 * 0.06**3 * 0.04 / 12, 0.8e12 * area * (0.06**2 + 0.04**2) / 12])
    assert patch.stiffness[3, 3] == pytest.approx(single[3, 3] + 0.2**2 * single[2, 2])
    power = PatchContactDescription(patch.patches, approach=1e-9, exponent=0.5, pressure=4e6)
    assert power.normal_per_area == pytest.approx(2 * 4e6**0.5 / 1e-9)
    with pytest.raises(ToolpointError, match="approach"):
        _ = PatchContactDescription(patch.patches).stiffness


def test_series_and_parallel():
    generator = np.random.default_rng(5)
    parts = [m @ m.T * 1e6 for m in generator.normal(size=(3, 6, 6))]
    whole = join_series(parts)
    assert np.linalg.inv(whole) == pytest.approx(sum(np.linalg.inv(p) for p in parts), rel=1e-6, abs=1e-14)
    assert np.array_equal(join_parallel(parts), sum(parts))
    slack = np.diag([1e8, 0, 1e8, 1e5, 1e5, 0.0])
    assert np.diag(join_series([slack, slack])) == pytest.approx(np.diag(slack) / 2, abs=1e-6)


FILE = """toolpoint: 1
name: slide
bodies:
  table: {mass: 100 kg, shape: {kind: box, size: [0.4, 0.4, 0.1]}}
joints:
  slide:
    parent: ground
    child: table
    at: [0, 0, 0]
    law:
      loss_factor: 2 %
      guideway:
        at: [[0.1, 0.15, 0], [0.1, -0.15, 0], [-0.1, 0.15, 0], [-0.1, -0.15, 0]]
        carriage: {dynamic_load: 35 kN, preload: 8 %, elements: 12, element_diameter: 6 mm, row_length: 60 mm,
                   rows_across: 30 mm, rows_above: 20 mm, contact_angle: 45 deg}
      ball_screw: {nut: 600 N/um, bearing: 800 N/um, diameter: 35 mm, length: 900 mm, nut_at: 400 mm}
axes:
  X: {joint: slide, direction: x, limits: [-0.3, 0.3]}
points:
  middle: {body: table}
"""


def test_law_in_a_machine_file_and_back(tmp_path):
    (tmp_path / "slide.yaml").write_text(FILE)
    machine = machine_file.read(tmp_path / "slide.yaml")
    law = machine.joints[0]
    assert law.stiffness[0, 0] == pytest.approx(SCREW.axial())
    assert law.stiffness[1, 1] == pytest.approx(4 * CARRIAGE.stiffness[1, 1])
    assert law.structural_damping == pytest.approx(0.02 * law.stiffness)
    machine_file.write(machine.description, tmp_path / "again.yaml")
    assert machine_file.read(tmp_path / "again.yaml").description == machine.description
    softer = machine.with_values({"joints.slide.law.ball_screw.nut": 3e8})
    assert softer.joints[0].stiffness[0, 0] == pytest.approx(replace(SCREW, nut=3e8).axial())


@pytest.mark.parametrize(("old", "new", "words"), [
    ("      ball_screw: {nut", "      spare: {nut", "unknown key 'spare'"),
    ("preload: 8 %", "preload: 80 %", "less than or equal to 0.5"),
    ("      ball_screw: {nut: 600 N/um, bearing: 800 N/um, diameter: 35 mm, length: 900 mm, nut_at: 400 mm}\n", "",
     "no stiffness along x")])
def test_faults_of_a_law_in_a_file(tmp_path, old, new, words):
    assert old in FILE
    (tmp_path / "slide.yaml").write_text(FILE.replace(old, new))
    with pytest.raises(ToolpointError, match=words):
        machine_file.read(tmp_path / "slide.yaml")


def test_an_empty_law_is_refused():
    with pytest.raises(ToolpointError, match="law: empty"):
        _ = LawDescription().stiffness
