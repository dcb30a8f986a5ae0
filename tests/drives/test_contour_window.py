"""Contour error of simulated axes: no window of fixed size, rapids apart, axes that the servo lacks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path as FilePath

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.drives.accuracy.lag import estimate_lag
from toolpoint.drives.program.path import Path, polyline
from toolpoint.io.program import gcode
from toolpoint.io.yaml import drive_file
from toolpoint.studies import run_drives

SERVO = FilePath(__file__).resolve().parents[2] / "src/toolpoint/app/machines/three_axis_vertical_servo.yaml"
SQUARE = "G90 G0 Z5\nG0 X0 Y0\nG1 Z{depth} F600\nG1 X20 F3000\nY20\nX0\nY0\nG0 Z5\nM30"

pytestmark = pytest.mark.filterwarnings("ignore::toolpoint.ToolpointWarning")


@pytest.fixture(scope="module")
def drives():
    return drive_file.read(SERVO)


def largest(result, place="tool"):
    return result.to_dict()["contour_error_m"][place]


@pytest.mark.parametrize("feed", [3000, pytest.param(12000, marks=pytest.mark.slow), 30000])
def test_a_straight_line_of_one_axis_has_no_contour_error(drives, feed):
    """The following error v/Kv is 0.8 mm, 3.3 mm and 8.3 mm; whatever it is, every point lies on the line."""
    result = run_drives(drives, path=gcode.parse(f"G1 X400 F{feed}").path)
    follow = np.abs(result.result.signal("following_error", "X")).max()
    assert follow == pytest.approx(feed / 6e4 / 60, rel=0.1)
    # At its end the axis settles on the last point from either side: that alone may be beyond the line.
    beyond = max(0.0, float(result.result.output("scale", "X").max()) - 0.4)
    assert largest(result, "scale") <= beyond + 1e-12
    assert largest(result, "scale") < 5e-6


def test_matched_axes_have_no_contour_error_on_a_slanted_line(drives):
    """Equal axes without friction: the actual point is on the line at any feed."""
    axis = replace(drives.axes["X"], friction=replace(drives.axes["X"].friction, law="none"))
    matched = replace(drives, axes={"X": axis, "Y": axis})
    line = polyline(np.array([[0, 0], [0.3, 0.2]]), 0.5)
    assert largest(run_drives(matched, path=line)) < 2e-6


def test_a_rapid_is_judged_apart(drives):
    cut = "G1 X{x} Y20 F1500\nX{x}5 Y40"
    near = run_drives(drives, path=gcode.parse("G0 X1 Y20\n" + cut.format(x=2)).path)
    far = run_drives(drives, path=gcode.parse("G0 X301 Y20\n" + cut.format(x=30)).path)
    assert far.to_dict()["contour_error_rapid_m"]["tool"] < 1e-2
    assert "rapids" in far.table()
    for result in (near, far):
        assert largest(result) < 3e-4


def test_only_rapids_are_said_to_be_no_cut(drives):
    result = run_drives(drives, path=gcode.parse("G0 X100").path)
    assert result.to_dict()["contour_error_m"]["tool"] is None
    assert "no cutting move" in result.table()


def test_axes_that_only_position_do_not_enter(drives):
    """A square at Z-2 and the same in the plane: the servo has no Z, which only goes up and down; said first."""
    flat = run_drives(drives, path=gcode.parse(SQUARE.format(depth=5)).path)
    deep = run_drives(drives, path=gcode.parse(SQUARE.format(depth=-2)).path)
    assert largest(deep) == pytest.approx(largest(flat), rel=0.02)
    assert 1e-5 < largest(deep) < 1e-4
    assert deep.table().startswith("note: axis Z")


def test_an_axis_that_takes_part_in_the_contour_is_refused_unless_called_ideal(drives):
    ramp = gcode.parse("G1 X20 Z-1 F2000\nX40 Y20 Z-2").path
    with pytest.raises(ToolpointError, match=r"Z.*lacks.*ideal"):
        run_drives(drives, path=ramp)
    result = run_drives(drives, path=ramp, ideal=("Z",))
    assert largest(result) < 2e-4 and "ideal" in result.table().splitlines()[0]


def test_where_a_rounded_program_is_along_the_programmed_one(drives):
    """A thousand rounded corners shorten the way; the place along the program does not drift off."""
    x = np.repeat(np.arange(251) * 2e-3, 2)[1:]
    y = np.tile([0, 0, 2e-3, 2e-3], 200)[: len(x)]
    stairs = polyline(np.column_stack([x, y]), 0.05)
    rounded = replace(drives, corner_tolerance=2e-4)
    assert largest(run_drives(rounded, path=stairs)) < 1e-3


def test_the_lag_of_a_delayed_motion_is_its_delay():
    time = np.arange(0, 2, 1e-3)
    motion = lambda t: np.column_stack([np.sin(5 * t), np.cos(3 * t), 0.2 * t**2])
    assert estimate_lag(time, motion(time), motion(time - 0.0167)) == pytest.approx(0.0167, rel=1e-3)
    assert estimate_lag(time, motion(time), motion(time)) == pytest.approx(0.0, abs=1e-6)


def test_a_path_knows_its_rapids():
    program = gcode.parse("G0 X1\nG1 X2 F100")
    assert program.path.rapid.tolist() == [True, False]
    assert not Path([0], [[0, 0, 0]], [[1, 0, 0]], [[0, 0, 0]], [0], [[0, 1]], [1], [False]).rapid.any()
