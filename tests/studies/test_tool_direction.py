"""The tool points anywhere: a swivelled head equals the same machine turned as a whole; which way a tool points, in words."""

import contextlib
import json

import numpy as np
import pytest

from toolpoint.app.main import main
from toolpoint.cutting import ZeroOrder
from toolpoint.cutting.surface.location import location_error
from toolpoint.io import read_machine
from toolpoint.kinematics.tool_frame import smallest_turn
from toolpoint.machine import build
from toolpoint.machine.description import (
    AxisDescription,
    BodyDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
    ShapeDescription,
)
from toolpoint.machine.description.frames import describe_frame
from toolpoint.spatial import rotation
from toolpoint.spatial import transform as tf
from toolpoint.studies.cuts.simulated_cut import simulate_cut
from toolpoint.studies.cuts.tool_dynamics import machine_dynamics
from toolpoint.studies.machines.check.machine_words import describe_motion
from toolpoint.studies.machines.tool_point import lobes, pose_problem, tool_axes, tool_point

SIX = {"x": 2e7, "y": 3e7, "z": 6e7, "rx": 5e5, "ry": 8e5, "rz": 7e5}
ANGLE = np.radians(35.0)


def swivel_head(angle=0.0, move=None, cut=None):
    """A column with a head that swivels about y, described with the head at an angle, the whole carried by `move`."""
    whole = np.eye(4) if move is None else move
    pivot = tf.transform(None, [0.4, 0.0, 1.2])
    swivel = pivot @ tf.transform(rotation.about("y", angle)) @ tf.inverse(pivot)

    def body(mass, frame, size):
        return BodyDescription(mass=mass, shape=ShapeDescription("box", size=size), frame=describe_frame(whole @ frame))

    bodies = {"column": body(700.0, tf.transform(None, [0, 0, 0.7]), (0.5, 0.6, 1.4)),
              "head": body(150.0, swivel @ tf.transform(None, [0.5, 0.03, 1.1]), (0.3, 0.25, 0.5))}
    joints = {"foot": JointDescription("ground", "column", describe_frame(whole), SIX),
              # The springs keep the orientation of the column, so the joint's frame does not swivel.
              "swivel": JointDescription("column", "head", describe_frame(whole @ pivot), {k: v / 2 for k, v in SIX.items()})}
    points = {"tip": PointDescription("head", (0.05, -0.03, -0.45)), "work": PointDescription("ground")}
    axis = (whole @ swivel)[:3, 2]
    return build(MachineDescription("swivel", bodies, joints, {"B": AxisDescription("swivel", "ry")}, points, tool="tip",
                                    table="work", damping_ratio=0.03, cutting=cut, tool_axis=tuple(map(float, axis))))


@pytest.fixture(scope="module")
def cut(vertical):
    return vertical.description.cutting.with_values({"speeds": (1000.0, 4000.0)})


def test_head_turned_by_its_axis_equals_the_whole_machine_turned_back(cut):
    back = tf.transform(rotation.about("y", -ANGLE))
    turned, described = swivel_head(cut=cut), swivel_head(ANGLE, back, cut)
    studies = [tool_point(turned, [{"B": ANGLE}]), tool_point(described)]
    np.testing.assert_allclose(studies[0].axes[0][:, 2], [np.sin(ANGLE), 0, np.cos(ANGLE)], atol=1e-12)
    np.testing.assert_allclose(studies[1].axes[0], np.eye(3), atol=1e-12)
    limits = [lobes(study, method=ZeroOrder(), speeds=np.linspace(1000, 4000, 20))[0].limit for study in studies]
    np.testing.assert_allclose(limits[0], limits[1], rtol=1e-9)


@pytest.mark.slow
def test_exact_lobes_and_simulated_cuts_follow_the_tool(cut):
    back = tf.transform(rotation.about("y", -ANGLE))
    turned, described = swivel_head(cut=cut), swivel_head(ANGLE, back, cut)
    pairs = [(turned, {"B": ANGLE}), (described, {})]
    speeds = np.linspace(1500, 3500, 6)
    limits = [lobes(tool_point(machine, [pose]), speeds=speeds)[0].limit for machine, pose in pairs]
    np.testing.assert_allclose(limits[0], limits[1], rtol=1e-9)
    runs = [simulate_cut(machine_dynamics(machine, pose), speed=2500.0, depth=0.0005, revolutions=20).run
            for machine, pose in pairs]
    np.testing.assert_allclose(runs[0].force, runs[1].force, rtol=1e-7, atol=1e-7 * np.abs(runs[0].force).max())


@pytest.mark.slow
def test_the_surface_error_follows_the_tool(cut):
    """The wall that is cut lies in the tool's plane: the head turned by its axis equals the machine turned back."""
    back = tf.transform(rotation.about("y", -ANGLE))
    turned, described = swivel_head(cut=cut), swivel_head(ANGLE, back, cut)
    speeds = np.linspace(1200, 3800, 9)
    errors = []
    for study in (tool_point(turned, [{"B": ANGLE}]), tool_point(described), tool_point(turned)):
        errors.append(location_error(pose_problem(study, cut, 0).changed(feed_per_tooth=1e-4), speeds, 0.0005))
    np.testing.assert_allclose(errors[0], errors[1], rtol=1e-7)
    assert np.abs(errors[0] / errors[2] - 1).max() > 0.01  # the same head upright is another structure to the cut


def test_turning_the_machine_with_its_tool_changes_nothing_about_the_cut(cut):
    """A horizontal mill is the upright one lying down: the plane that is cut follows the tool."""
    down = tf.transform(rotation.about("x", np.pi / 2), [0.3, 0.1, -0.2])
    upright, lying = tool_point(swivel_head(cut=cut)), tool_point(swivel_head(0.0, down, cut))
    np.testing.assert_allclose(lying.axes[0][:, 2], [0, -1, 0], atol=1e-12)
    f = upright.frf.frequency
    again = tool_point(swivel_head(0.0, down, cut), frequency=f)
    np.testing.assert_allclose(again.frf.values, upright.frf.values, atol=1e-9 * np.abs(upright.frf.values).max())


@pytest.mark.parametrize("direction", [(0, 0, 1), (1, 0, 0), (0, -1, 0), (0.6, 0, 0.8), (0.36, 0.48, -0.8), (0, 0, -1)])
def test_smallest_turn_brings_z_onto_the_tool(direction):
    turn = smallest_turn(direction)
    np.testing.assert_allclose(turn[:, 2], direction, atol=1e-12)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1)
    assert np.trace(turn) == pytest.approx(1 + 2 * direction[2], abs=1e-12)  # the angle is that between z and the tool


def test_an_upright_tool_changes_no_bit(vertical):
    assert np.array_equal(tool_axes(vertical), np.eye(3)[None])


def test_check_says_which_way_the_tool_points(tmp_path, capsys, cut):
    machine = swivel_head(ANGLE, cut=cut)
    assert any("axis along (0.5736, 0, 0.8192)" in line for line in describe_motion(machine))
    (tmp_path / "m.yaml").write_text("""toolpoint: 1
name: horizontal
bodies:
  head: {mass: 100 kg, shape: {kind: box, size: [1, 1, 1]}}
joints:
  foot: {parent: ground, child: head, at: [0, 0, -0.5], stiffness: {x: 1e8, y: 1e8, z: 1e8, rx: 1e7, ry: 1e7, rz: 1e7}}
points: {tip: {body: head, at: [0, 0.6, 0]}}
tool: tip
tool_axis: -y
""")
    assert read_machine(tmp_path / "m.yaml").description.tool_axis == (0.0, -1.0, 0.0)
    main_lines = run(["check", str(tmp_path / "m.yaml")], capsys)
    assert "tool: tip with its axis along -y (away from the work); cut is the plane of +x and +z" in main_lines
    motion = json.loads(run(["check", str(tmp_path / "m.yaml"), "--json"], capsys))["motion"]
    assert motion[0].startswith("tool: tip")


def run(arguments, capsys):
    with contextlib.suppress(SystemExit):
        main(arguments)
    return capsys.readouterr().out
