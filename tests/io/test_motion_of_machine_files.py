"""Machine files that move: arms by their table, several drives, tasks, assembly modes, and faults of all of them."""

import numpy as np
import pytest

import elastic_robot
from serial_arms import arm_forward
from toolpoint.app.main import main
from toolpoint.io import read_machine, write_machine
from toolpoint.io.faults import FileFaults
from toolpoint.kinematics.arms.denavit_hartenberg import ArmRow
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.machine.pose.placement import place_machine

MACHINES = ("three_rps_head", "hexapod_6_ups", "three_prs_head", "gantry")


def arm_file(coupled="", second="250 mm", theta="-90 deg"):
    """The robot of B2 by its table."""
    bodies, rows = [], []
    for i, (_, d, a, alpha) in enumerate(elastic_robot.LINKS):
        x, y, z = elastic_robot.CENTRES[i]
        xx, yy, zz = elastic_robot.INERTIAS[i]
        k, kz = elastic_robot.SPRINGS[i]
        bodies.append(f"  link{i + 1}: {{mass: {elastic_robot.MASSES[i]} kg, centre: [{x}, {y}, {z}], "
                      f"inertia: {{xx: {xx}, yy: {yy}, zz: {zz}}}}}")
        length = second if i == 1 else f"{1e3 * a} mm"
        more = coupled if i == 2 else ""
        angle = theta if i == 1 else "0 deg"
        rows.append(f"    - {{body: link{i + 1}, axis: q{i + 1}, theta: {angle}, d: {1e3 * d} mm, a: {length}, "
                    f"alpha: {alpha} deg, stiffness: {{rx: {k}, ry: {k}, rz: {kz}}}, limits: [-200 deg, 200 deg]{more}}}")
    return "\n".join(["toolpoint: 1", "name: robot", "bodies:", *bodies, "arm:", "  rows:", *rows,
                      "points: {flange: {body: link6}}", ""])


def read(tmp_path, text):
    (tmp_path / "m.yaml").write_text(text)
    return read_machine(tmp_path / "m.yaml")


def test_arm_of_a_table_is_the_published_robot(tmp_path):
    """B2: the first four frequencies at zero to the printed digits, from a file."""
    machine = read(tmp_path, arm_file())
    np.testing.assert_allclose(natural_frequencies(machine, {}, 4)[0], elastic_robot.REFERENCE, rtol=1e-10)
    write_machine(machine.description, tmp_path / "again.yaml")
    again = read_machine(tmp_path / "again.yaml")
    both = [natural_frequencies(each, {"q2": 0.3}, 4) for each in (again, machine)]
    np.testing.assert_allclose(both[0], both[1], rtol=1e-9)


def test_coupled_axis_turns_the_third_joint_too(tmp_path):
    machine = read(tmp_path, arm_file(", coupled: {q2: 1}"))
    q = np.random.default_rng(0).uniform(-1, 1, (20, 6))
    rows = [ArmRow(f"q{i + 1}", np.radians(t), d, a, np.radians(alpha), coupled={"q2": 1.0} if i == 2 else {})
            for i, (t, d, a, alpha) in enumerate(elastic_robot.LINKS)]
    place = place_machine(machine, {f"q{i + 1}": q[:, i] for i in range(6)})
    np.testing.assert_allclose(place.position(machine.description.points["flange"]), arm_forward(rows, q)[:, :3, 3], atol=1e-12)


@pytest.mark.parametrize(("text", "message"), [
    (arm_file(second="0.25"), "without a unit in a table whose other values carry one"),
    (arm_file(theta="-90"), "without a unit in a table whose other values carry one"),
    (arm_file(", coupled: {q9: 1}"), "no row has the axis 'q9'"),
    (arm_file().replace("body: link3", "body: link9"), "no body 'link9'")])
def test_faults_of_a_table(tmp_path, text, message):
    with pytest.raises(FileFaults, match=message):
        read(tmp_path, text)


GANTRY = """toolpoint: 1
name: gantry
bodies:
  left: {mass: 300 kg, centre: [-1, 0, 1], shape: {kind: box, size: [0.2, 0.5, 1]}}
  right: {mass: 300 kg, centre: [1, 0, 1], shape: {kind: box, size: [0.2, 0.5, 1]}}
  bridge: {mass: 700 kg, centre: [0, 0, 1.6], shape: {kind: box, size: [2.2, 0.4, 0.4]}}
joints:
  guide_l: {parent: ground, child: left, at: [-1, 0, 0.5], stiffness: {y: 1.2e8, rx: 6e7, rz: 6e7}}
  guide_r: {parent: ground, child: right, at: [1, 0, 0.5], stiffness: {y: 1.2e8, rx: 6e7, rz: 6e7}}
  left_bridge: {parent: left, child: bridge, at: [-1, 0, 1.5], stiffness: {x: 9e8, y: 9e8, z: 9e8, rx: 8e7, ry: 8e7, rz: 8e7}}
  right_bridge: {parent: right, child: bridge, closes_loop: true, at: [1, 0, 1.5]}
axes:
  Y: {drives: [{joint: guide_l, direction: y}, {joint: guide_r, direction: y}], limits: "-1, 1 m"}
"""


def test_axis_of_a_gantry_drives_both_sides(tmp_path):
    machine = read(tmp_path, GANTRY)
    moved = machine.chain.displacements({"Y": 0.5})[0]
    np.testing.assert_allclose(moved[:, :3, 3], [[0, 0.5, 0]] * 3, atol=1e-12)
    # Sides, bridge and guides move alike: nothing but the place changes.
    frequency = natural_frequencies(machine, {"Y": [0.0, 0.5, -0.7]}, 6)
    np.testing.assert_allclose(frequency, frequency[[0, 0, 0]], rtol=1e-9)


@pytest.mark.parametrize(("old", "new", "message"), [
    ("axes:\n", "axes:\n  Y2: {joint: guide_r, direction: -y}\n  Y3: {joint: guide_r, direction: y}\n",
     "drive direction y of joint"),
    ("{joint: guide_r, direction: y}]", "{joint: right_bridge, direction: y}]", "right_bridge closes a loop"),
    ("{joint: guide_r, direction: y}]", "{joint: guide, direction: y}]", "no joint 'guide'"),
    ("drives: [{joint: guide_l, direction: y}, {joint: guide_r, direction: y}], ", "", "joint: 'joint' is missing"),
    ('limits: "-1, 1 m"', 'limits: "1, -1 m"', "reversed"),
    ("at: [-1, 0, 1.5], ", "", "'at' is missing"),
    ("name: gantry", "name: gantry\npoints: {tip: {body: bridge}}\n"
     "task: {point: tip, axes: [Y], coordinates: {Z: {coordinate: z}, X: {coordinate: x}}}",
     "2 coordinates for 1 axes"),
    ("name: gantry", "name: gantry\ntool_axis: up", "tool_axis: 'up'")])
def test_faults_of_axes_places_and_tasks(tmp_path, old, new, message):
    assert old in GANTRY
    with pytest.raises(FileFaults, match=message):
        read(tmp_path, GANTRY.replace(old, new, 1))


def test_elastic_loop_that_a_pose_strains_says_its_force(tmp_path):
    text = GANTRY.replace("closes_loop: true, at: [1, 0, 1.5]}",
                          "closes_loop: true, at: [1, 0, 1.5], stiffness: {x: 9e8, y: 1e7, z: 9e8, rx: 8e7, ry: 8e7, rz: 8e7}}")
    text = text.replace("{joint: guide_r, direction: y}]", "{joint: guide_r, direction: y, factor: 1.001}]")
    machine = read(tmp_path, text)
    with pytest.warns(UserWarning, match=r"right_bridge is strained by 0\.5 mm .* takes 5000 N"):
        natural_frequencies(machine, {"Y": 0.5})


def test_rotary_axes_speak_degrees(tmp_path, capsys):
    head = "src/toolpoint/app/machines/three_rps_head.yaml"
    with pytest.raises(SystemExit):
        main(["modes", head, "--pose", "tilt=30"])
    shown = " ".join(capsys.readouterr().err.split())
    assert "must be within -45 .. 45 deg" in shown and "did you mean tilt=30deg?" in shown


@pytest.mark.parametrize("name", MACHINES)
def test_machines_of_the_package_read_write_and_move(tmp_path, name):
    machine = read_machine(f"src/toolpoint/app/machines/{name}.yaml")
    write_machine(machine.description, tmp_path / "copy.yaml")
    assert read_machine(tmp_path / "copy.yaml").description == machine.description
    for pose in machine.description.poses:
        assert (natural_frequencies(machine, pose, 3) > 10).all()


@pytest.mark.parametrize("name", ["three_rps_head", "hexapod_6_ups"])
def test_tasks_of_the_package_undo_their_inverse(name):
    machine = read_machine(f"src/toolpoint/app/machines/{name}.yaml")
    pose = {"tilt": 0.3, "azimuth": 0.8}
    legs = dict(zip([axis.name for axis in machine.chain.driven_axes], machine.chain.positions(pose)[0], strict=True))
    there, back = machine.chain.coordinates(pose), machine.chain.coordinates(legs)
    for axis in there:
        np.testing.assert_allclose(back[axis], there[axis], atol=1e-10)
