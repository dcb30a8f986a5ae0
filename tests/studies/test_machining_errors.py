"""Errors of blocks: servo under cutting force, walls of forced vibration, feed marks, and the spindle's curve of torque."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from toolpoint import ToolpointError, studies
from toolpoint.cutting import Engagement, Tool
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.surface.location import location_error
from toolpoint.drives.description import (
    DriveAxisDescription,
    DriveDescription,
    LimitsDescription,
    MechanicsDescription,
    PositionDescription,
    VelocityDescription,
)
from toolpoint.io.program.gcode import parse
from toolpoint.material_removal import Stock
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.machines.tool_point import milling_problem
from toolpoint.studies.machining.errors.servo_course import drives_of_path
from toolpoint.studies.machining.errors.wall_errors import feed_mark_height
from toolpoint.studies.machining.result import MachiningStudy
from toolpoint.vibration import Modes

MM = 1e-3
BLOCK = Stock.box(np.array([0, -30, -20]) * MM, np.array([60, 30, 0]) * MM)
CUT = {"diameter": 0.01, "teeth": 4, "tangential": 8e8, "normal": 3e8, "flute_length": 0.022}
LEAD, GAIN, VELOCITY_GAIN = 0.01 / (2 * np.pi), 60.0, 4.0
SLOT = "G0 X-10 Y0 Z5\nG0 Z-2\nS12000 G1 X70 F2400\n"
# Above the stock: the wall is to the right of the feed.
DOWN = "G0 X-10 Y31\nG0 Z-2\nS12000 G1 X70 F2400\n"


def _drives(limit: float | None = None, *, with_table: bool = False) -> DriveDescription:
    axis = DriveAxisDescription(
        mechanics=MechanicsDescription("rigid", lead=0.01, inertia=0.005), position=PositionDescription(gain=GAIN),
        velocity=VelocityDescription(gain=VELOCITY_GAIN, limit=limit))
    turning = DriveAxisDescription(
        mechanics=MechanicsDescription("reducer", inertia=3e-5, gear_ratio=100.0, load_inertia=3.2, torsion=3e4),
        position=PositionDescription(gain=GAIN), velocity=VelocityDescription(gain=0.02))
    axes = {"X": axis, "Y": axis, **({"C": turning} if with_table else {})}
    return DriveDescription("table", axes, LimitsDescription(0.5, 2.0, 50.0))


def _tip(size: float = 1.0) -> ToolDynamics:
    return studies.modal_dynamics(Modes([900.0, 1080.0], [0.02, 0.02], [[size, 0], [0, 0.9 * size]], ("tool:+x", "tool:+y")))


def _run(text: str, dynamics: ToolDynamics | None = None, **values: Any) -> MachiningStudy:
    setup = studies.describe_machining(BLOCK, CuttingDescription.of(**CUT), spacing=0.4 * MM, **values)
    return studies.run_program(parse(text, start=(0, 0, 0.2)), setup, dynamics, text=text)


def _block(result: MachiningStudy, line: int) -> int:
    return int(np.flatnonzero(result.blocks.line == line)[0])


def test_a_servo_without_integral_yields_by_its_stiffness() -> None:
    """Static law: F h^2/(K_p K_v), h the travel of a radian, K_p the velocity loop's gain, K_v the position loop's.

    A rotary axis of the drive file stands still in a program of three axes.
    """
    result = _run(SLOT, drives=_drives(with_table=True))
    assert "The program does not turn C: these axes are taken as clamped." in result.notes
    assert drives_of_path(_drives(with_table=True))[0] == _drives()
    assert result.errors is not None
    k, errors = _block(result, 3), result.errors.columns
    along, across = (abs(float(np.median(result.loads.force[result.loads.lateral > 0, axis]))) for axis in (0, 1))  # type: ignore[union-attr]
    static = LEAD**2 / (VELOCITY_GAIN * GAIN)
    assert errors["push"][k] == pytest.approx(np.hypot(along, across) * static, rel=0.05)
    assert errors["feed_force"][k] == pytest.approx(max(along, across), rel=0.02)


def test_the_contour_of_an_arc_shrinks_as_the_loop_lags() -> None:
    """Two loops on a circle: R w^2/2 (1/K_v^2 - 2 T/K_v), T = J/K_p, to second order in the angular speed w."""
    text = "G0 X10 Y0 Z5\nG0 Z-1\nS12000 G2 X10 Y0 I20 J0 F3600\n"
    result = _run(text, drives=_drives())
    assert result.errors is not None
    turn, delay = 0.06 / 0.02, 0.005 / VELOCITY_GAIN
    shrinkage = 0.02 * turn**2 / 2 * (1 / GAIN**2 - 2 * delay / GAIN)
    contour = result.errors.columns["contour"][_block(result, 3)]
    assert contour == pytest.approx(shrinkage, rel=0.05)


def test_location_error_of_a_wall_is_that_of_the_frequency_response() -> None:
    """Down-milling along x: the block's error is that of its arc by the exact series, and the total without a servo."""
    result = _run(DOWN, _tip())
    assert result.errors is not None and result.arcs is not None
    assert result.errors.walls is not None
    middle = result.arcs.place.size // 2
    assert result.arcs.exit[middle] == pytest.approx(np.pi, abs=np.radians(1)) or result.arcs.entry[middle] < np.radians(1)
    side = "exit" if result.arcs.exit[middle] > 3 else "entry"
    arc = Engagement(float(result.arcs.entry[middle]), np.pi) if side == "exit" else \
        Engagement(0.0, float(result.arcs.exit[middle]))
    problem = milling_problem(CuttingDescription.of(**CUT, immersion=0.4), _tip().response, _tip().x, y=_tip().y).changed(
        engagement=arc, feed_angle=0.0, feed_per_tooth=0.04 / (200 * 4))
    exact = location_error(problem, np.array([12000.0]), 2 * MM, side=side)[0]
    assert result.errors.walls.location[middle, 0 if side == "entry" else 1] == pytest.approx(exact, rel=0.02)
    k, errors = _block(result, 3), result.errors.columns
    assert errors["total"][k] == errors["location"][k]
    assert abs(errors["location"][k]) >= abs(exact)


def test_a_servo_that_is_pushed_off_leaves_material_on_the_side_it_leaves() -> None:
    """A stiff tool: the total is the way that the force across the feed pushes the servo from the wall to the right."""
    result = _run(DOWN, _tip(0.001), drives=_drives())
    assert result.errors is not None and result.loads is not None
    across = float(np.median(result.loads.force[result.loads.lateral > 0, 1])) * LEAD**2 / (VELOCITY_GAIN * GAIN)
    assert result.errors.columns["total"][_block(result, 3)] == pytest.approx(across, rel=0.15)


def test_feed_marks_of_equal_and_of_one_leading_tooth() -> None:
    """f^2/8R of equal teeth; with much run-out the leading tooth alone cuts the wall: (N f)^2/8R."""
    tool = Tool(teeth=4, diameter=0.01)
    assert feed_mark_height(tool, 1e-4) == pytest.approx(1e-8 / 0.04, rel=1e-3)
    assert feed_mark_height(tool.with_runout(5e-5), 1e-4) == pytest.approx(16e-8 / 0.04, rel=1e-3)


def test_a_drive_at_its_limit_is_named_with_its_line() -> None:
    result = _run(SLOT, drives=_drives(limit=0.4))
    assert any(doubt.grave and "axis X is at its limit" in doubt for doubt in result.doubts)
    calm = _run(SLOT, drives=_drives(limit=40.0))
    assert calm.errors is not None
    assert 0 < calm.errors.columns["drive_use"][_block(calm, 3)] < 0.2


def test_a_program_that_cuts_beyond_the_curve_of_the_spindle_is_named() -> None:
    """The same power is allowed at one speed and not at a lower one, where the torque is the limit."""
    limits = studies.CuttingLimits(curve=((6000.0, 1.0), (12000.0, 1.0), (24000.0, 0.5)))
    slow, fast = (_run(SLOT.replace("S12000", f"S{speed}"), limits=limits) for speed in (5000, 20000))
    assert any("spindle torque" in doubt for doubt in slow.doubts) and not any("spindle" in doubt for doubt in fast.doubts)
    assert limits.power_at(np.array([18000.0]))[0] == pytest.approx(12000 * np.pi / 30)


def test_a_curve_that_falls_back_in_speed_is_refused() -> None:
    with pytest.raises(ToolpointError, match="rising speed"):
        studies.CuttingLimits(curve=((6000.0, 1.0), (3000.0, 1.0)))
