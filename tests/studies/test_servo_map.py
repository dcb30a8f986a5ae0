"""Servo loops over the workspace of the published machine, its structure in the loop."""

from dataclasses import replace

import numpy as np
import pytest

from toolpoint.drives import (
    Controller,
    DriveAxis,
    PositionLoop,
    Servo,
    TorqueMotor,
    VelocityLoop,
    build_plant,
    compute_loops,
    four_dof_axis,
)
from toolpoint.studies.servos.servo_map import map_margins

LEAD = 0.001591
ENDS = {"x.base": "saddle:+x", "x.table": "table:+x", "y.base": "bed:+y", "y.table": "saddle:+y"}
TOOLS = {"x": "tool:+x", "y": "tool:+y"}


def chain():
    """Motor, coupling, screw and nut between the structure's base and table; values chosen."""
    return four_dof_axis(0.008, 0.002, 15.0, table_mass=None, lead_ratio=LEAD, coupling=(2e4, 1.0), bearing=(3e8, 2e4),
                         nut=(3e8, 2e4), guide_damping=500.0)


def servo_of(structure):
    control = Controller(PositionLoop(60.0, 1e-3), VelocityLoop(1.157, 0.02, 2.5e-4), LEAD)
    return Servo(build_plant([DriveAxis(name, TorqueMotor(), chain()) for name in "xy"], structure), (control, control))


@pytest.fixture(scope="module")
def free_machine(vertical_drives):
    free = vertical_drives.with_values({"joints.drive_x.stiffness.x": 1e-3, "joints.drive_y.stiffness.y": 1e-3})
    points = dict(free.description.points)
    points |= {"bed": replace(points["table"], body="base", at=(0.0, 0.75, -0.27)),
               "saddle": replace(points["table"], body="saddle", at=(0.0, 0.75, -0.15))}
    return free.rebuild(replace(free.description, points=points))


@pytest.mark.slow
def test_map_over_poses(free_machine):
    poses = [{}, {"X": 0.3, "Y": -0.2}, {"X": -0.3, "Z": 0.4}]
    found = map_margins(free_machine, poses, ends=ENDS, tools=TOOLS, build=servo_of)
    assert found.axes == ("x", "y")
    assert found.stable.all()
    assert found.gain_margin.shape == (3, 2)
    assert (found.bandwidth > 1).all()
    assert np.ptp(found.velocity_phase_margin, axis=0).max() > 0
    assert found.worst()[1] in "xy"


@pytest.mark.slow
def test_one_pose_is_that_of_the_loops(free_machine):
    from toolpoint.drives import Structure
    from toolpoint.machine import assemble
    from toolpoint.vibration import eigen

    labels = list(dict.fromkeys([*ENDS.values(), *TOOLS.values()]))
    structure = Structure.from_modes(eigen.solve_undamped(assemble(free_machine, {}, labels)), ENDS, TOOLS)
    expected = compute_loops(servo_of(structure)).velocity.margins(1, 800).phase
    found = map_margins(free_machine, [{}], ends=ENDS, tools=TOOLS, build=servo_of)
    assert found.velocity_phase_margin[0, 1] == pytest.approx(expected)


def test_failed_poses_are_kept(free_machine):
    found = map_margins(free_machine, [{}, {"X": 9.0}], ends=ENDS, tools=TOOLS, build=servo_of)
    assert "within" in found.failures[1]
    assert np.isnan(found.gain_margin[1]).all()
