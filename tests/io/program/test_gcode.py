"""G-code: geometry of every word of the subset, faults with their lines, a long program."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint.drives import JerkLimits, plan_motion
from toolpoint.io.faults import FileFaults
from toolpoint.io.program import gcode

PROGRAM = """N10 G17 G90 G71 ; comment
N20 G0 X0 Y0 (start)
N30 G64 G1 X10 F1200 M3 S5000
N40 G3 X20 Y10 I0 J10
N50 G2 X=AC(30) Y=IC(10) CR=10
N60 G91 G1 X-5 Y5
N70 G2 I5 J0
N80 G9 G1 X1
M30
this is not read
"""


def test_words_and_geometry():
    program = gcode.parse(PROGRAM)
    np.testing.assert_allclose(1e3 * program.end[:, :2], [[0, 0], [10, 0], [20, 10], [30, 20], [25, 25], [25, 25], [26, 25]],
                               atol=1e-12)
    np.testing.assert_allclose(np.degrees(program.sweep), [0, 0, 90, -90, 0, -360, 0], atol=1e-9)
    np.testing.assert_allclose(program.feed[1:], 0.02)
    assert program.stop.tolist() == [True, False, False, False, False, False, True]
    assert program.line.tolist() == [2, 3, 4, 5, 6, 7, 8]
    assert (3, "M", 3.0) in program.words
    path = program.path
    assert path.lengths[2] == pytest.approx(0.01 * np.pi / 2)
    assert path.turns()[1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("plane", "end", "center"), [("G18", "Z10 X10", "I0 K10"), ("G19", "Y10 Z10", "J0 K10")])
def test_other_planes(plane, end, center):
    program = gcode.parse(f"{plane} G1 X0 F100\nG3 {end} {center}")
    path = program.path
    points = path.points(np.full(20, 1), np.linspace(0, 1, 20))
    radius = np.linalg.norm(points - program.center[1], axis=1)
    np.testing.assert_allclose(radius, radius[0], rtol=1e-12)
    np.testing.assert_allclose(points[-1], program.end[1], atol=1e-15)


def test_inches_and_absolute_centre():
    program = gcode.parse("G70 G1 X1 F10\nG3 X0 Y1 I=AC(0) J=AC(0)")
    assert program.end[0, 0] == pytest.approx(0.0254)
    assert np.degrees(program.sweep[1]) == pytest.approx(90)
    assert program.feed[0] == pytest.approx(0.010 / 60)
    assert gcode.parse("G700 G1 X1 F10").feed[0] == pytest.approx(10 * 0.0254 / 60)


def test_negative_radius_is_the_longer_arc():
    program = gcode.parse("G1 X0 F100\nG2 X10 Y0 CR=-7")
    assert abs(np.degrees(program.sweep[1])) > 180


@pytest.mark.parametrize(("line", "message"), [
    ("G2 X5 Y5 I1 J0", "radius 1 mm at its start and 6.40312 mm"), ("G2 X5 Y5 CR=1", "below half the chord"),
    ("G2 X5 Y5", "needs I, J, K"), ("G1 G3 X1", "in one block"), ("G77 X1", "not in the subset"), ("Q5 X1", "unknown word"),
    ("X1 Y?", "not a word"), ("F0 X1", "above zero"), ("X1 X2", "twice"), ("G2 X0 Y0 CR=5", "full circle"),
    ("G1 X3 I2", "straight line"), ("G2 X1 K3", "not in the plane")])
def test_faults_name_their_line(line, message):
    if "CR=5" in line:
        line = "G2 CR=5 X0 Y0"
    with pytest.raises(FileFaults, match=message.replace("?", r"\?")) as error:
        gcode.parse(f"G1 X0 Y0 F100\n; nothing\n{line}\n", name="part.mpf")
    assert error.value.faults[0].line == 3
    assert "part.mpf:3" in str(error.value)


def test_all_faults_at_once():
    with pytest.raises(FileFaults) as error:
        gcode.parse("G1 X1\nG77\nQ1\n")
    assert [fault.line for fault in error.value.faults] == [1, 2, 3]


@pytest.mark.slow
def test_a_program_is_planned():
    rng = np.random.default_rng(0)
    points = np.cumsum(rng.normal(0, 0.2, (3000, 2)), axis=0)
    text = "G64 G1 F3000\n" + "\n".join(f"N{i} X{x:.3f} Y{y:.3f}" for i, (x, y) in enumerate(points))
    plan = plan_motion(gcode.parse(text).path, JerkLimits(1, 5, 200), corner_tolerance=5e-6)
    np.testing.assert_allclose(plan.command(1e-3, 2).position[-1], 1e-3 * points[-1].round(3), atol=1e-9)


def test_iso_units_and_program_number():
    """G20 and G21 set lengths and feeds; an O word heads a program."""
    inch = gcode.parse("O1000\nG20 G90\nG1 X1 F10")
    np.testing.assert_allclose([inch.end[0, 0], inch.feed[0]], [0.0254, 10 * 0.0254 / 60])
    assert gcode.parse("G21\nG1 X1 F600").feed[0] == pytest.approx(0.01)


def test_a_fault_is_said_once_and_makes_no_others():
    """After a faulty block the program goes on where it was meant to end; a missing feed is one fault."""
    text = "G1 X10 Y0 F100\nG81 X20 Y0\nG2 X30 Y0 CR=5\nM30"
    with pytest.raises(FileFaults) as caught:
        gcode.parse(text)
    assert "1 fault" in str(caught.value) and "G81" in str(caught.value)
    with pytest.raises(FileFaults) as caught:
        gcode.parse("G1 X1\nX2\nX3")
    assert str(caught.value).count("no feed yet") == 1


@pytest.mark.parametrize(("block", "words"), [
    ("G33.1 Z-5 K1", "rigid tapping is not computed"), ("G5.2 X1 Y1 P2", "a spline is not computed"),
    ("G38.2 Z-5", "probing is not computed")])
def test_what_is_not_computed_is_named_with_what_to_post(block, words):
    with pytest.raises(FileFaults) as error:
        gcode.parse(f"G21 G90 F100 S500\nG0 X0 Y0 Z5\n{block}\nM2\n")
    assert words in str(error.value) and "post the program" in str(error.value)


def test_an_offset_of_the_tool_is_no_place():
    plain = gcode.parse("G21 G90\nG0 X0 Y0 Z5\nG1 X10 F100\nM2\n")
    offset = gcode.parse("G21 G90\nG0 X0 Y0 Z5\nG43.1 Z7 K3\nG1 X10 F100\nM2\n")
    assert offset.end[-1] == pytest.approx(plain.end[-1])
    assert any("G43.1" in note for note in offset.notes)
