"""Tip and direction of the tool against the work, and the pose that brings it there, of a trunnion machine from its file."""

import numpy as np
import pytest

from toolpoint.io import read_machine
from toolpoint.machine.pose.tool_pose import pose_for, poses_for, tool_place
from toolpoint.spatial import rotation

TRUNNION = """toolpoint: 1
name: trunnion
bodies:
  column: {mass: 500 kg, centre: [0, 0.6, 0.8], shape: {kind: box, size: [0.4, 0.4, 1.6]}}
  head: {mass: 100 kg, centre: [0, 0.2, 0.7], shape: {kind: box, size: [0.2, 0.3, 0.4]}}
  cross: {mass: 200 kg, centre: [0, 0, 0.1], shape: {kind: box, size: [0.6, 0.4, 0.2]}}
  cradle: {mass: 80 kg, centre: [0, 0, 0.25], shape: {kind: box, size: [0.5, 0.2, 0.1]}}
  plate: {mass: 40 kg, centre: [0, 0, 0.3], shape: {kind: cylinder, diameter: 0.3, length: 0.04}}
joints:
  x: {parent: ground, child: column, at: [0, 0.6, 0], stiffness: {x: 1e8, y: 1e8, z: 1e8, rx: 1e7, ry: 1e7, rz: 1e7}}
  z: {parent: column, child: head, at: [0, 0.4, 0.7], stiffness: {z: 1e8}}
  y: {parent: ground, child: cross, at: [0, 0, 0], stiffness: {y: 1e8}}
  a: {parent: cross, child: cradle, at: [0, 0, 0.3], stiffness: {rx: 1e6}}
  c: {parent: cradle, child: plate, at: [0, 0, 0.3], stiffness: {rz: 1e6}}
axes:  # the table turns the other way than the tool against it (ISO 841)
  X: {joint: x, direction: x, limits: "-400, 400 mm"}
  Y: {joint: y, direction: -y, limits: "-300, 300 mm"}
  Z: {joint: z, direction: z, limits: "-200, 400 mm"}
  A: {joint: a, direction: -rx, limits: "-110, 110 deg"}
  C: {joint: c, direction: -rz, limits: "-180, 180 deg"}
points:
  tip: {body: head, at: [0, 0, 0.5]}
  work: {body: plate, at: [0, 0, 0.32]}
tool: tip
table: work
"""


@pytest.fixture(scope="module")
def trunnion(tmp_path_factory):
    path = tmp_path_factory.mktemp("trunnion") / "m.yaml"
    path.write_text(TRUNNION)
    return read_machine(path)


def test_tool_against_the_turned_table_in_closed_form(trunnion):
    x, y, z, a, c = 0.05, -0.03, 0.1, 0.4, -0.9
    tip, direction = (v[0] for v in tool_place(trunnion, {"X": x, "Y": y, "Z": z, "A": a, "C": c}))
    turn = rotation.about("z", c) @ rotation.about("x", a)  # of the tool in the plate's axes: the plate turns by the inverse
    np.testing.assert_allclose(direction, turn @ [0, 0, 1], atol=1e-12)
    # From the point where A and C meet, 0.3 m up, to the tip; the work's point lies 0.02 m above it on the plate.
    np.testing.assert_allclose(tip, turn @ [x, y, 0.2 + z] - [0, 0, 0.02], atol=1e-12)


def test_inverse_finds_both_ways_within_travel(trunnion):
    tip, direction = np.array([0.02, 0.01, 0.03]), np.array([np.sin(0.5), 0.0, np.cos(0.5)])
    solutions = poses_for(trunnion, tip, direction)
    assert sorted(round(float(np.degrees(s.pose["A"])), 6) for s in solutions) == [
        round(-float(np.degrees(0.5)), 6), round(float(np.degrees(0.5)), 6)]
    for solution in solutions:
        place, way = (v[0] for v in tool_place(trunnion, solution.pose))
        np.testing.assert_allclose(place, tip, atol=1e-9)
        np.testing.assert_allclose(way, direction, atol=1e-9)


@pytest.mark.slow
def test_targets_beyond_travel_say_what_is_left_and_which_axis_ends(trunnion):
    far = pose_for(trunnion, [0.9, 0.0, 0.1], [0.0, 0.0, 1.0])
    assert not far.is_reached
    assert "mm" in far.status and "at the end of travel" in far.status
