"""Values as a person types them in one line: SI by their units, and refused where they cannot be."""

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.io.machine_poses import check_pose, lay_grid
from toolpoint.io.quantities import written
from toolpoint.io.yaml import machine_file
from toolpoint.studies.accuracy.tool_paths import along_points, lay_path, line, square

MACHINE = "src/toolpoint/app/machines/three_axis_vertical.yaml"


def test_units_are_taken_to_si():
    assert written.read_pose("X=200mm,Y=-0.1,A=90deg") == pytest.approx({"X": 0.2, "Y": -0.1, "A": np.pi / 2})
    assert written.read_lengths("600mm,0,30cm") == pytest.approx((0.6, 0.0, 0.3))
    assert written.read_angle("180deg") == pytest.approx(np.pi) and written.read_length("250 um") == pytest.approx(2.5e-4)
    axis = written.read_axis_points("X=-20mm:20mm:5")
    assert axis.name == "X" and axis.positions == pytest.approx([-0.02, -0.01, 0, 0.01, 0.02])
    assert written.read_angles("0:135:4") == pytest.approx(np.radians([0, 45, 90, 135]))


def test_directions_are_axes_angles_or_vectors():
    assert written.read_direction("-y") == (0, -1, 0) and written.read_direction("1,0,0.5") == (1, 0, 0.5)
    assert written.read_direction("30deg") == pytest.approx((np.sqrt(3) / 2, 0.5, 0))
    assert written.read_plane("y,-z") == ((0, 1, 0), (0, 0, -1))


def test_values_of_tests_and_cuts_come_in_si():
    assert written.read_block("0,-10mm,0.2,30mm") == ((0, pytest.approx(-0.01)), (pytest.approx(0.2), pytest.approx(0.03)))
    assert written.read_circle("50,4000") == pytest.approx((0.05, 4 / 60))
    assert written.read_pole("34.2,1.5") == pytest.approx((34.2, 0.015))
    assert written.read_tried_cut("12000:1.5:chatter") == (12000, pytest.approx(1.5e-3), False)
    assert written.read_tried_cut("9000:2:stable")[2] is True
    assert written.read_shares("1,-,5,", "abcd") == pytest.approx({"a": 0.01, "c": 0.05})
    assert written.read_two_names("KAA, MAA") == ("KAA", "MAA") and written.read_picture_shape("720x1280") == (720, 1280)


@pytest.mark.parametrize(("read", "text"), [
    (written.read_circle, "0,4000"), (written.read_circle, "50"), (written.read_pole, "34,51"), (written.read_pole, "0,1"),
    (written.read_tried_cut, "9000:2:good"), (written.read_tried_cut, "9000:2"), (written.read_two_names, "KAA,"),
    (written.read_two_names, "KAA"), (written.read_picture_shape, "720"), (written.read_block, "0,0,1"),
    (lambda text: written.read_shares(text, "ab"), "1,-2"), (lambda text: written.read_shares(text, "ab"), "1")])
def test_values_that_cannot_be_are_refused(read, text):
    with pytest.raises((ToolpointError, ValueError, KeyError)):
        read(text)


@pytest.mark.parametrize("text", ["nan:900:3", "1:2", "1:2:x"])
def test_a_wrong_form_is_a_bare_value_error(text):
    """Who asks says how to write it, so no words come from here."""
    with pytest.raises(ValueError) as refused:
        written.read_speeds(text)
    assert not isinstance(refused.value, ToolpointError)


@pytest.mark.parametrize(("read", "text", "words"), [
    (written.read_band, "5:3", "lower end must be below"), (written.read_lines, "5:400:1", "2 to 100000 lines"),
    (written.read_speeds, "0:900:3", "above zero"), (written.read_speeds, "900:900:2", "or one speed"),
    (written.read_pose, "X=1,X=2", "there twice"), (written.read_pose, "X=1,5", "AXIS=VALUE"),
    (written.read_axis_points, "X=1:0:3", "must be above the first"), (written.read_axis_points, "X=10mm:100:3", "one end has"),
    (written.read_length_points, "x=0deg:30deg:3", "must be lengths"), (written.read_length, "nan", "does not begin"),
    (written.read_lengths, "1,2", "must be 3 numbers"), (written.read_length, "3deg", "not one of length")])
def test_numbers_that_cannot_be_are_refused(read, text, words):
    with pytest.raises(ToolpointError, match=words):
        read(text)


def test_a_standstill_is_a_speed_only_where_it_may_be():
    assert written.read_speeds("0:100:3", from_rest=True) == pytest.approx([0, 50, 100])
    with pytest.raises(ToolpointError, match="not be negative"):
        written.read_speeds("-1:100:3", from_rest=True)


def test_poses_are_checked_against_the_axes():
    machine = machine_file.read(MACHINE)
    grid = lay_grid(machine, [written.read_axis_points("X=0:100mm:3")])
    assert grid["X"] == pytest.approx([0, 0.05, 0.1])
    for text, words in (("X=30deg", "given as an angle"), ("Q=1", "Q"), ("X=30", "must be within")):
        with pytest.raises(ToolpointError, match=words):
            check_pose(machine, written.read_pose(text))
    with pytest.raises(ToolpointError, match="there twice"):
        lay_grid(machine, [written.read_axis_points("X=0:0.1:3")] * 2)


def test_a_path_is_exactly_one():
    """Whatever is given, the sides are those of the verb that lays this kind of path."""
    corners = [[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0]]
    for ours, theirs in ((lay_path(square_side=0.2), square(0.2)), (lay_path(ends=corners[:2]), line(*corners[:2])),
                         (lay_path(points=corners), along_points(corners))):
        assert [side.length for side in ours] == pytest.approx([side.length for side in theirs])
    for given in ({}, {"square_side": 0.2, "points": corners}):
        with pytest.raises(ToolpointError, match="exactly one"):
            lay_path(**given)
    with pytest.raises(ToolpointError, match="twice"):
        lay_path(ends=corners[:1])
