"""Servo on the published eighteen-freedom machine: structure from the machine's modes, line-and-arc path at 4000 mm/min."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from toolpoint.drives import (
    Controller,
    DriveAxis,
    JerkLimits,
    LuGre,
    Path,
    PositionLoop,
    Servo,
    Structure,
    TorqueMotor,
    VelocityLoop,
    build_plant,
    compute_loops,
    contour_error,
    four_dof_axis,
    simulate,
)
from toolpoint.drives.friction.identification import friction_variants
from toolpoint.drives.program.planner import plan_motion, smooth_command
from toolpoint.machine import assemble
from toolpoint.vibration import eigen

R_L, GAIN = 0.001591, 0.0766 * 15.1


def chain(law):
    """Four-DOF chain whose ends are the structure's: motor, screw, axial screw; base and table belong to the machine.

    K_C 2e4 N m/rad, K_S 3e8 and K_T 3e8 N/m, motor 0.008, screw 0.002 kg m2, 15 kg are chosen: the paper gives none.
    """
    return four_dof_axis(0.008, 0.002, 15.0, table_mass=None, lead_ratio=R_L, coupling=(2e4, 1.0), bearing=(3e8, 2e4),
                         nut=(3e8, 2e4), guide_damping=500.0,
                         shaft_friction=law)


def structure(machine):
    """Modes of the machine with its x and y drives free; base, saddle and table are the ends of the drives."""
    free = machine.with_values({"joints.drive_x.stiffness.x": 1e-3, "joints.drive_y.stiffness.y": 1e-3})
    points = dict(free.description.points)
    point = points["table"]
    points |= {"bed": replace(point, body="base", at=(0.0, 0.75, -0.27)),
               "saddle": replace(point, body="saddle", at=(0.0, 0.75, -0.15))}
    free = free.rebuild(replace(free.description, points=points))
    labels = ["saddle:+x", "table:+x", "bed:+y", "saddle:+y", "tool:+x", "tool:+y", "table:+y"]
    modes = eigen.solve_undamped(assemble(free, outputs=labels))
    return Structure.from_modes(modes, {"x.base": "saddle:+x", "x.table": "table:+x", "y.base": "bed:+y",
                                        "y.table": "saddle:+y"}, {"x": "tool:+x", "y": "tool:+y"})


@pytest.fixture(scope="module")
def servos(vertical_drives):
    from toolpoint.drives import Stribeck

    laws = (Stribeck(0.0115, 4.7318, 0.5, 0.1), Stribeck(0.0069, 1.3374, 0.5, 0.16))
    frame = structure(vertical_drives)
    made = {}
    for name in ("literal", "F_c = F_s/1.5", "Coulomb"):
        axes = []
        for axis, law in zip("xy", laws, strict=True):
            v = friction_variants(law)[name]
            axes.append(DriveAxis(axis, TorqueMotor(), chain(LuGre(
                4000.0, 5.0, v.coulomb, getattr(v, "static", v.coulomb), getattr(v, "stribeck_velocity", 0.5), v.viscous))))
        c = Controller(PositionLoop(60.0, 1e-3), VelocityLoop(GAIN, 0.0766 / 3.8282, 2.5e-4), R_L)
        made[name] = Servo(build_plant(axes, frame), (c, c))
    return made


def line_and_arc():
    """20 mm line, half circle of 15 mm radius, line back, at 4000 mm/min."""
    kind, feed = [0, 1, 0], [4 / 60] * 3
    return Path(kind, [[0, 0, 0], [0.02, 0, 0], [0.02, 0.03, 0]], [[0.02, 0, 0], [0.02, 0.03, 0], [0, 0.03, 0]],
                [[0, 0, 0], [0.02, 0.015, 0], [0, 0, 0]], [0, np.pi, 0], [[0, 1]] * 3, feed, [False] * 3)


def test_structure_has_eighteen_freedoms_and_the_loops_are_stable(servos):
    servo = servos["Coulomb"]
    assert servo.plant.a.shape[0] == 36 + 2 * 6
    assert compute_loops(servo).stable


def test_line_and_arc_path_gives_torque_and_contour_error(servos):
    path = line_and_arc()
    plan = plan_motion(path, JerkLimits(0.1, 2.0, 50.0))
    command = smooth_command(plan.command(1e-3, 2), 0.02).extended(0.3)
    worst = {}
    for name, servo in servos.items():
        result = simulate(servo, command, record_interval=4)
        progress = np.interp(result.time, command.time, np.concatenate(
            [[0], np.cumsum(np.linalg.norm(np.diff(command.position, axis=0), axis=1))]))
        found = {k: contour_error(path, result.output(k), np.minimum(progress, path.lengths.sum()), window=3e-3)
                 for k in ("scale", "table", "tool")}
        worst[name] = 1e6 * found["tool"].length.max()
        torque = np.abs(result.signal("torque_set")).max(axis=0)
        assert 0.5 < torque[0] < 20
        assert result.unconverged == 0
        np.testing.assert_allclose(result.output("scale")[-1], command.position[-1], atol=5e-5)
        enlarged = found["tool"].enlarged(50.0)
        assert np.linalg.norm(enlarged - found["tool"].foot, axis=1).max() == pytest.approx(50e-6 * worst[name])
    assert worst["Coulomb"] > worst["literal"]
    assert 10 < worst["literal"] < worst["Coulomb"] < 500
