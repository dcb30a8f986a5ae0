"""Frames of programs (Siemens, Fanuc) and Siemens drilling cycles: against the same path written out, and by their laws."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from toolpoint._check import ToolpointError
from toolpoint.io.program import gcode
from toolpoint.io.program.iso.siemens_cycles import peck_depths

SHAPE = "G0 X10 Y5 Z2\nG1 Z-1 F600\nG1 X40 Y5\nG3 X50 Y15 I0 J10\nG2 X40 Y25 CR=10\nG1 G91 X-20 Y3\nG90 X10 Y5\nG0 Z2\n"


def corners(text):
    """Ends of all segments, m, without those before the first that moves in the plane."""
    program = gcode.parse(text)
    return program.end, program


def turned(degrees, points):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


@settings(max_examples=40, deadline=None)
@given(st.floats(-720, 720), st.floats(-200, 200), st.floats(-200, 200))
def test_a_turned_and_shifted_program_makes_the_turned_and_shifted_path(angle, x, y):
    plain, first = corners(SHAPE)
    moved, second = corners(f"TRANS X{x:.6f} Y{y:.6f}\nAROT RPL={angle:.6f}\n{SHAPE}")
    expected = turned(angle, plain) + np.array([1e-3 * x, 1e-3 * y, 0])
    assert moved == pytest.approx(expected, abs=2e-9)
    assert second.sweep == pytest.approx(first.sweep, abs=1e-6)
    arc = first.kind == 1
    assert second.center[arc] == pytest.approx(turned(angle, first.center[arc]) + np.array([1e-3 * x, 1e-3 * y, 0]), abs=1e-7)


def test_fanuc_turns_about_a_point_and_ends():
    plain, _ = corners(SHAPE)
    centre = np.array([0.02, -0.01, 0])
    moved, _ = corners(f"G68 X20 Y-10 R30\n{SHAPE}G69\n{SHAPE}")
    assert moved[:len(plain)] == pytest.approx(turned(30, plain - centre) + centre, abs=1e-9)
    assert moved[-len(plain) + 1:] == pytest.approx(plain[1:], abs=1e-9)


@pytest.mark.parametrize("mirror", ["MIRROR X0", "G51.1 X0"])
def test_a_mirror_turns_arcs_round(mirror):
    plain, first = corners(SHAPE)
    moved, second = corners(f"{mirror}\n{SHAPE}")
    assert moved == pytest.approx(plain * [-1, 1, 1], abs=1e-12)
    assert second.sweep == pytest.approx(-first.sweep)


def test_a_scale_stretches_radii_and_arcs_alike():
    plain, first = corners(SHAPE)
    moved, second = corners(f"SCALE X2 Y2\n{SHAPE}")
    assert moved == pytest.approx(plain * [2, 2, 1], abs=1e-12)
    assert second.sweep == pytest.approx(first.sweep)
    with pytest.raises(ToolpointError, match="ellipse"):
        gcode.parse(f"SCALE X2\n{SHAPE}")


def test_verbs_without_a_replace_and_with_a_add():
    once, _ = corners("TRANS X10\nG0 X1 Y0\n")
    twice, _ = corners("TRANS X10\nATRANS X10\nG0 X1 Y0\n")
    anew, _ = corners("TRANS X10\nTRANS Y10\nG0 X1 Y0\n")
    gone, _ = corners("TRANS X10\nAROT RPL=90\nTRANS\nG0 X1 Y0\n")
    square, _ = corners("ROT RPL=90\nATRANS X10\nG0 X1 Y0\n")
    assert [once[-1, 0], twice[-1, 0], *anew[-1, :2]] == pytest.approx([0.011, 0.021, 0.001, 0.010])
    assert gone[-1] == pytest.approx([0.001, 0, 0]) and square[-1] == pytest.approx([0, 0.011, 0])


def test_lines_may_be_tilted_arcs_may_not():
    tilted, _ = corners("ROT Y90\nG0 X10 Y5 Z2\n")
    assert tilted[-1] == pytest.approx([0.002, 0.005, -0.010])
    for text, word in ((f"ROT Y30\n{SHAPE}", "tilts"), ("ROT X20\nCYCLE81(5,0,1,-10)", "axis of the tool"),
                       ("ROT RPL=20 Z3\nG0 X1", "one of them"), ("SCALE X0\nG0 X1", "above zero"),
                       ("TRANS Q3\nG0 X1", "not a word of TRANS"), ("ROT RPL=10\nG92 X0\nG0 X1", "G92")):
        with pytest.raises(ToolpointError, match=word):
            gcode.parse(text)


def test_machine_coordinates_know_no_frame():
    ends, _ = corners("G54\nTRANS X100\nAROT RPL=45\nG0 X10\nG53 G0 X0 Y0\n")
    assert ends[-1] == pytest.approx([0, 0, 0], abs=1e-12)


HOLE = "G17 G90 F120 S1000\nG0 X10 Y20 Z50\n"


def test_a_drilling_cycle_is_its_moves_written_out():
    cycle, _ = corners(HOLE + "CYCLE82(30,2,3,-15,,0.5)\n")
    moves, _ = corners(HOLE + "G0 Z5\nG1 Z-15\nG4 F0.5\nG0 Z30\n")
    assert cycle == pytest.approx(moves)
    program = gcode.parse(HOLE + "CYCLE82(30,2,3,,17,0.5)\n")
    assert program.end == pytest.approx(moves) and program.dwell[2] == 0.5
    assert list(program.rapid) == [True, True, False, True] and program.feed[2] == pytest.approx(0.002)


def test_a_modal_cycle_drills_after_every_move_until_it_ends():
    modal, _ = corners(HOLE + "MCALL CYCLE81(30,2,3,-15)\nX10 Y20\nX30\nX50 Y40\nMCALL\nX0 Y0\n")
    single = "CYCLE81(30,2,3,-15)\n"
    written, _ = corners(HOLE + f"{single}X30\n{single}X50 Y40\n{single}X0 Y0\n")
    assert np.unique(modal, axis=0) == pytest.approx(np.unique(written, axis=0))


def test_patterns_put_holes_where_they_say():
    def holes(pattern):
        program = gcode.parse(f"{HOLE}MCALL CYCLE81(30,2,3,-15)\n{pattern}\nMCALL\n")
        return 1e3 * program.end[~program.rapid][:, :2]

    row = holes("HOLES1(5,10,30,20,15,3)")
    assert row == pytest.approx(np.array([[5 + a * math.cos(math.pi / 6), 10 + a / 2] for a in (20, 35, 50)]))
    circle = holes("HOLES2(5,10,40,45,0,4)")
    assert np.hypot(*(circle - [5, 10]).T) == pytest.approx(40) and len(circle) == 4
    assert np.diff(np.unwrap(np.arctan2(*(circle - [5, 10]).T[::-1]))) == pytest.approx(math.pi / 2)
    grid = holes("CYCLE801(0,0,90,10,20,3,2)")
    assert sorted(map(tuple, grid.round(9))) == sorted((-20.0 * j, 10.0 * i) for i in range(3) for j in range(2))
    with pytest.raises(ToolpointError, match="without a modal cycle"):
        gcode.parse(HOLE + "HOLES1(5,10,30,20,15,3)\n")


@given(st.floats(0.5, 30), st.floats(-1, 20), st.floats(1, 300))
def test_pecks_grow_to_the_depth_and_never_take_more_than_the_first(first, degression, total):
    depths = peck_depths(first, degression, total, least_stroke=0.1)
    strokes = np.diff([0.0, *depths])
    assert depths[-1] == pytest.approx(total) and (strokes > 0).all() and strokes.max() <= min(first, total) * (1 + 1e-12)
    if degression > 0 and len(strokes) > 3:
        assert (strokes[:-2] >= min(degression, first) * (1 - 1e-12)).all()
        assert strokes[-2:] == pytest.approx([strokes[-1]] * 2) or strokes[-1] <= strokes[-2] * (1 + 1e-9)


def test_deep_holes_are_drilled_in_the_strokes_of_the_cycle():
    """First to -10, then strokes of 8 and 6 mm, the last two sharing what is left; out to the clearance between them."""
    program = gcode.parse(HOLE + "CYCLE83(30,0,2,-40,,-10,,2,0,0,1,1)\n")
    cuts = 1e3 * program.end[~program.rapid][:, 2]
    assert cuts[:3] == pytest.approx([-10, -18, -24]) and cuts[-1] == pytest.approx(-40)
    between = program.rapid[2:-1].sum()
    assert between == 2 * (len(cuts) - 1)
    chips = gcode.parse(HOLE + "CYCLE83(30,0,2,-40,,-10,,2,0,0,1,0)\n")
    assert 1e3 * chips.end[~chips.rapid][:, 2] == pytest.approx(cuts)
    assert 1e3 * chips.end[3:5, 2] == pytest.approx([-9, -18])


def test_tapping_and_boring_come_out_as_they_say():
    tap = gcode.parse(HOLE + "CYCLE84(30,2,3,-15,,,3,10,,0,500,600)\n")
    assert tap.feed[~tap.rapid] == pytest.approx([1.5 * 500 / 60e3, 1.5 * 600 / 60e3])
    bore = gcode.parse(HOLE + "CYCLE85(30,2,3,-15,,0,100,300)\nG1 X0\n")
    assert bore.feed[~bore.rapid] == pytest.approx([100 / 60e3, 300 / 60e3, 0.002])
    lift = gcode.parse(HOLE + "CYCLE86(30,2,3,-15,,0,3,-1,-1,1,0)\n")
    assert lift.end[-3] == pytest.approx([9e-3, 19e-3, -14e-3]) and lift.end[-1] == pytest.approx([10e-3, 20e-3, 30e-3])


@pytest.mark.parametrize(("call", "word"), [
    ("CYCLE81(30)", "RFP, a depth|RFP"), ("CYCLE81(30,2,3)", "depth"), ("CYCLE81(0,2,3,-5)", "retraction level"),
    ("CYCLE81(30,2,3,5)", "above the reference"), ("POCKET3(5,0,1,-10)", "POCKET3|subset"), ("CYCLE72(1,2)", "CYCLE72"),
    ("CYCLE81(30,2,3,-)", "number|expression|end"), ("CYCLE84(30,2,3,-15,,,3,,2)", None)])
def test_cycles_that_cannot_be_run_say_why(call, word):
    text = f"G17 G90 F120\nG0 X10 Y20 Z50\n{call}\n"
    if word is None:
        word = "speed"
    with pytest.raises(ToolpointError, match=word):
        gcode.parse(text)


def test_cycles_take_variables_and_lie_in_their_plane():
    ends, _ = corners("R1=30 R2=-15\nG18 G90 F120\nG0 X10 Y50 Z20\nCYCLE81(R1,2,3,R2+1)\n")
    assert 1e3 * ends[-2:, 1] == pytest.approx([-14, 30])
