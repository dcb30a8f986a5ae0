"""Radius compensation of programs (G41, G42, RL, RR): against parallels in closed form, and by laws of distance and length."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from toolpoint._doubt import Doubt
from toolpoint.io import CutterRadii, read_program
from toolpoint.io.faults import FileFaults
from toolpoint.io.program import gcode

R = 0.005
SQUARE = "S1000\nG0 X-20 Y0 Z5\nG1 Z-2 F100\n{} G1 X0 Y0 F500\nX0 Y40\nX60\nY0\nX0\nG40 X-20\nG0 Z5\n"


def contour(program, first=3, last=-2):
    """Rows from the contour's first to its last, without the ways there and back."""
    return np.arange(program.kind.size)[first:last]


def points(program, rows, count=25):
    """Points of rows of a path in the plane, m."""
    path = program.path
    out = []
    for k in rows:
        share = np.linspace(0, 1, count)[:, None]
        if program.kind[k] == 0:
            out.append(path.start[k] + share * (path.end[k] - path.start[k]))
            continue
        ray, turn = path.start[k] - path.center[k], share[:, 0] * path.sweep[k]
        turned = np.stack([np.cos(turn) * ray[0] - np.sin(turn) * ray[1], np.sin(turn) * ray[0] + np.cos(turn) * ray[1],
                           np.zeros(count)], axis=1)
        out.append(path.center[k] + turned)
    return np.concatenate(out)[:, :2]


def distances(samples, corners):
    """Distance of samples (n, 2) to a closed polygon (m, 2)."""
    start, side = corners, np.roll(corners, -1, axis=0) - corners
    share = np.clip(np.einsum("nmi,mi->nm", samples[:, None] - start, side) / (side**2).sum(axis=1), 0, 1)
    return np.linalg.norm(samples[:, None] - start - share[..., None] * side, axis=2).min(axis=1)


@pytest.mark.parametrize("word", ["G41", "G42"])
def test_around_a_rectangle_the_centre_goes_its_perimeter_and_one_circle_or_eight_radii_less(word):
    """Steiner: a convex contour of length L has the outer parallel L + 2 pi r; inside a rectangle it is L - 8 r."""
    program = gcode.parse(SQUARE.format(word), cutter_radius=R)
    rows = contour(program)
    length = program.path.lengths[rows].sum()
    if word == "G41":  # clockwise with the tool on the left is outside; the corner where it begins and ends has no arc
        assert length == pytest.approx(0.2 + 1.5 * math.pi * R, rel=1e-12)
        assert program.sweep[program.kind == 1] == pytest.approx([-math.pi / 2] * 3)
    else:  # at start and end the tool stands square to the contour, not in the corner: two of the eight radii stay
        assert length == pytest.approx(0.2 - 6 * R, rel=1e-12) and not program.kind.any()
        assert program.end[rows][:3, :2] == pytest.approx(np.array([[R, 0.04 - R], [0.06 - R, 0.04 - R], [0.06 - R, R]]))
    assert np.array_equal(program.start[1:], program.end[:-1]) and program.end[-1] == pytest.approx([-0.02, 0, 0.005])


def test_start_and_end_are_square_to_the_contour():
    program = gcode.parse(SQUARE.format("G41 D1"), cutter_radius=R)
    assert program.end[2] == pytest.approx([-R, 0, -0.002]) and program.end[-3] == pytest.approx([0, -R, -0.002])


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(0.01, 0.06), min_size=4, max_size=9), st.floats(1e-4, 0.004), st.booleans(), st.booleans())
def test_the_centre_never_comes_nearer_than_the_radius_and_outer_corners_keep_it(radii, radius, is_left, is_mitred):
    """Any star-shaped polygon, either side: every row keeps the radius from its own side."""
    angles = np.linspace(0, -2 * np.pi, len(radii), endpoint=False)
    corners = np.stack([np.cos(angles), np.sin(angles)], axis=1) * np.array(radii)[:, None]
    words = [f"X{1e3 * x:.9f} Y{1e3 * y:.9f}" for x, y in [*corners, corners[0]]]
    text = "\n".join([f"G1 F500 X{2e3 * corners[0, 0]:.9f} Y30", "G451" if is_mitred else "G450",
                      f"{'G41' if is_left else 'G42'} {words[0]}", *words[1:], "G40 X90"])
    try:
        program = gcode.parse(text, cutter_radius=radius)
    except FileFaults:  # a corner or a side is too narrow for the tool
        assume(False)
    rows = contour(program, 2, -1)
    samples = points(program, rows)
    lines = [np.concatenate([corners, corners[:1]])[k:k + 2] for k in range(len(corners))]
    row_distance = np.array([distances(points(program, [k]), lines[int(program.line[k]) - 4]) for k in rows])
    assert row_distance.min() == pytest.approx(radius, abs=2e-9)
    if not is_mitred:
        assert row_distance.max() == pytest.approx(radius, abs=2e-9)
    assert np.abs(samples - program.start[rows[0]][:2]).max() < 0.3
    assert np.array_equal(program.start[1:], program.end[:-1])


@pytest.mark.parametrize(("word", "turn", "radius"), [("G41", 2, 0.02 + R), ("G42", 2, 0.02 - R), ("G41", 3, 0.02 - R),
                                                     ("G42", 3, 0.02 + R)])
def test_a_circle_has_a_circle_beside_it(word, turn, radius):
    """A full circle of 20 mm with tangential lines before and behind it."""
    way = 10 if turn == 2 else -10  # clockwise from its left end a circle goes up
    text = f"G1 X0 Y50 F500\n{word} X-20 Y{-way}\nY0\nG{turn} X-20 Y0 I20 J0 Z-1\nG1 Y{way}\nG40 X-50\n"
    program = gcode.parse(text, cutter_radius=R)
    circle = int(np.flatnonzero(program.kind == 1)[0])
    assert np.linalg.norm(program.start[circle, :2]) == pytest.approx(radius, abs=1e-12)
    assert abs(program.sweep[circle]) == pytest.approx(2 * math.pi) and program.end[circle, 2] == pytest.approx(-0.001)


def test_a_line_meets_an_arc_inside_a_corner_where_their_parallels_meet():
    """Along y = 0 into a half circle of 20 mm about (20, 0) that turns left: y = r and the circle of 15 mm meet."""
    program = gcode.parse("G1 X-30 Y-20 F500\nG41 X-30 Y0\nX0\nG2 X40 Y0 I20 J0\nG1 X70\nG40 Y-20\n", cutter_radius=R)
    meet = 0.02 - math.sqrt(0.025**2 - R**2)
    assert program.end[2, :2] == pytest.approx([meet, R], abs=1e-12)
    assert program.end[3, :2] == pytest.approx([0.04 - meet, R], abs=1e-12)
    assert program.sweep[3] == pytest.approx(-(math.pi - 2 * math.asin(R / 0.025)), abs=1e-12)


def test_two_arcs_meet_inside_a_corner_where_their_parallels_meet():
    """Half circles of 20 and 10 mm side by side, tool above: circles of 25 and 15 mm about centres 30 mm apart."""
    program = gcode.parse("G1 X0 Y-30 F500\nG41 X0 Y-5\nY0\nG2 X40 Y0 I20 J0\nG2 X60 Y0 I10 J0\nG1 Y-5\nG40 Y-30\n",
                          cutter_radius=R)
    along = (0.03**2 + 0.025**2 - 0.015**2) / 0.06
    first = int(np.flatnonzero(program.kind == 1)[0])
    assert program.end[first, :2] == pytest.approx([0.02 + along, math.sqrt(0.025**2 - along**2)], abs=1e-12)


def test_a_square_corner_with_intersections_is_a_square_corner():
    program = gcode.parse("G451\n" + SQUARE.format("G41"), cutter_radius=R)
    rows = contour(program)
    assert not program.kind.any()
    assert program.end[rows][:3, :2] == pytest.approx(np.array([[-R, 0.04 + R], [0.06 + R, 0.04 + R], [0.06 + R, -R]]))


def test_a_mirrored_program_makes_the_mirrored_path():
    plain = gcode.parse(SQUARE.format("G41"), cutter_radius=R)
    mirrored = gcode.parse("G51.1 X0\n" + SQUARE.format("G41"), cutter_radius=R)
    assert mirrored.end == pytest.approx(plain.end * [-1, 1, 1], abs=1e-12)
    assert mirrored.sweep == pytest.approx(-plain.sweep)


def test_a_stretched_program_keeps_the_radius_of_its_tool():
    """G51: a rectangle of 60 x 40 mm by 2 is one of 120 x 80; the tool stays as it is."""
    program = gcode.parse("G51 X0 Y0 Z0 P2000\n" + SQUARE.format("G41"), cutter_radius=R)
    rows = contour(program)
    assert program.path.lengths[rows].sum() == pytest.approx(0.4 + 1.5 * math.pi * R, rel=1e-12)


@pytest.mark.parametrize(("text", "radius"), [
    ("G10 L12 P3 R4.0\nG10 L13 P3 R-0.5\n" + SQUARE.format("G41 D3"), 0.0035),
    (SQUARE.format("G41.1 D7"), 0.0035), (SQUARE.format("G41 D0"), 0.0), (SQUARE.format("G41 D3"), 0.002)])
def test_the_radius_is_what_the_program_sets_else_that_of_the_tool(text, radius):
    program = gcode.parse("T2 M6\n" + text, cutter_radius=CutterRadii(0.009, {2: 0.002}))
    cut = program.end[~program.rapid]
    assert cut[:, 1].max() == pytest.approx(0.04 + radius)
    assert any(isinstance(note, Doubt) for note in program.notes) == (radius > 0)


def test_with_wear_alone_the_path_is_that_of_the_text():
    plain = gcode.parse(SQUARE.format(""))
    wear = gcode.parse(SQUARE.format("G41 D1"), cutter_radius=0.0)
    assert np.array_equal(wear.end, plain.end) and np.array_equal(wear.kind, plain.kind)


def test_other_planes_are_seen_along_their_axis():
    """G18: Z is the first axis, X the second; left of +Z is +X."""
    program = gcode.parse("G18\nG1 X-20 Z-20 F500\nG41 X0 Z0\nZ30\nG40 X20\n", cutter_radius=R)
    assert program.end[2] == pytest.approx([R, 0, 0.03])


def test_heights_dwells_and_lines_stay_with_their_blocks():
    text = "G1 X-20 Y0 F500\nG41 X0 Y0\nY40 Z-1\nG4 P500\nX60\nG1 Z-3\nY0\nG40 X90\n"
    program = gcode.parse(text, cutter_radius=R)
    assert program.dwell[program.line == 3] == pytest.approx([0.5])
    down = int(np.flatnonzero(program.line == 6)[0])
    assert program.end[down] == pytest.approx([0.06, 0.045, -0.003])  # before it goes about the corner
    assert program.line.tolist() == [1, 2, 3, 5, 5, 6, 7, 7, 8]


def test_klartext_makes_the_path_of_iso():
    iso = gcode.parse("G1 X-20 Y0 F500\nG41 X0 Y0\nY40\nG2 X20 Y60 CR=20\nG1 X60\nG40 Y90", cutter_radius=R)
    klartext = gcode.parse("BEGIN PGM A MM\nTOOL DEF 4 L+0 R+5\nTOOL CALL 4 Z S1000\nL X-20 Y+0 R0 F500\nL X+0 Y+0 RL\n"
                           "L Y+40\nCR X+20 Y+60 R+20 DR-\nL X+60\nL Y+90 R0\nEND PGM A MM")
    assert klartext.end == pytest.approx(iso.end, abs=1e-12) and klartext.sweep == pytest.approx(iso.sweep)


@pytest.mark.parametrize(("kind", "before"), [("LT", (-R, -0.01)), ("LN", (-R - 0.01, 0.0))])
def test_klartext_goes_to_a_contour_along_it_or_square_to_it(kind, before):
    text = (f"BEGIN PGM A MM\nTOOL CALL 1 Z S1000\nL X-30 Y-20 Z-1 R0 F500\nAPPR {kind} X+0 Y+0 LEN10 RL F300\nL Y+40\n"
            f"DEP {kind} LEN10\nL X-30 FMAX\nEND PGM A MM")
    program = gcode.parse(text, cutter_radius=R)
    after = (-R, 0.05) if kind == "LT" else (-R - 0.01, 0.04)
    assert program.end[1:5, :2] == pytest.approx(np.array([before, (-R, 0.0), (-R, 0.04), after]))


@pytest.mark.parametrize(("text", "words"), [
    ("G1 X0 Y-20 F500\nG41 X0 Y-5\nY0\nG3 X8 Y0 I4 J0\nG1 Y-5\nG40 Y-20", "arc of 4 mm"),
    ("G1 X-20 Y0 F500\nG42 X0 Y0\nY40\nX8\nY0\nG40 X40", "leave nothing of it"),
    ("G1 X-8 Y0 F500\nG41 G3 X0 Y0 I4 J0\nG1 Y20\nG40 X40", "no arc leads the tool"),
    ("G1 X-20 Y0 F500\nG41 X0 Y0\nY40\nG40 G3 X0 Y60 I0 J10", "end of radius compensation on an arc"),
    ("BEGIN PGM A MM\nL X-20 Y0 F500\nL X0 RL\nL Y40\nL X40 RR\nEND PGM A MM", "without a block R0 between"),
    ("G1 X-20 Y0 F500\nG41 X0 Y0\nY40\nG81 X40 Z-5 R1\nG40 X90", "drilling cycle under radius compensation"),
    ("G1 X-20 Y0 F500\nG41.1 X0 Y0\nY40", "without D")])
def test_what_no_control_does_is_refused_by_name(text, words):
    with pytest.raises(FileFaults, match=words):
        gcode.parse(text, cutter_radius=R)


@pytest.mark.parametrize("word", ["CDON", "M120", ""])
def test_a_bottleneck_is_refused_with_the_word_that_would_pass_it(word, tmp_path):
    """A groove of 1 mm under a tool of 10 mm."""
    if word == "M120":
        path = tmp_path / "groove.h"
        path.write_text("BEGIN PGM A MM\nTOOL CALL 1 Z S5000\nL X+0 Y+0 Z+5 R0 FMAX\nL X+10 RL F500 M120 LA10\nL X+50\nL Y-1\n"
                        "L X+51\nL Y+0\nL X+90\nL Y-40 R0\nEND PGM A MM\n")
    else:
        path = tmp_path / "groove.mpf"
        path.write_text(f"N10 G90 G71 {word}\nT1 D1\nG0 X0 Y0 Z5\nG41 G1 X10 Y0 F500\nX50\nY-1\nX51\nY0\nX90\nG40 Y-20\nM30\n")
    with pytest.raises(FileFaults) as faults:
        read_program(path, start=(0, 0, 0.1), cutter_radius=CutterRadii(5e-3))
    assert "does not reach this segment" in str(faults.value)
    assert (f"look ahead ({word})" in str(faults.value)) == bool(word)


def test_blocks_without_motion_in_the_plane_are_remarked():
    text = "G1 X-20 Y0 F500\nG41 X0 Y0\nY40\nZ5\nZ-5\nX40\nG40 X90"
    assert any("looks no further" in note for note in gcode.parse(text, cutter_radius=R).notes)
    assert not any("looks no further" in note for note in gcode.parse(text.replace("Z5\n", ""), cutter_radius=R).notes)
    # The reference point of Z between: the compensation goes on behind it.
    assert gcode.parse(text.replace("Z5\n", "G91 G28 Z0\nG90\n"), cutter_radius=R).end[-1, 0] == pytest.approx(0.09)


def test_polar_places_are_on_a_circle():
    """G16: a bolt circle of 50 mm about the program's zero, six holes; increments of the angle make the same."""
    turns = "".join(f"Y{60 * k}\n" for k in range(1, 6))
    absolute = gcode.parse(f"G16\nG81 X50 Y0 Z-10 R2 F100\n{turns}G15 G80\nG0 X0 Y0")
    angles = np.arctan2(*absolute.end[~absolute.rapid][:, 1::-1].T)
    assert np.degrees(angles) % 360 == pytest.approx([0, 60, 120, 180, 240, 300], abs=1e-9)
    assert np.hypot(*absolute.end[~absolute.rapid][:, :2].T) == pytest.approx([0.05] * 6)
    turned = gcode.parse("G16\nG81 X50 Y0 Z-10 R2 F100\nX50 Y=IC(60)\n")
    assert turned.end[~turned.rapid][1] == pytest.approx(absolute.end[~absolute.rapid][1])
    assert absolute.end[-1, :2] == pytest.approx([0, 0])


def test_the_side_changes_in_one_move_square_to_both_ends():
    """Siemens: the block before ends square to its end on the old side, the one that changes ends square on the new side."""
    program = gcode.parse("G1 X0 Y0 F500\nG41 X10\nX20\nG42 X40\nX50\nG40 X60", cutter_radius=R)
    assert 1e3 * program.end[1:, 1] == pytest.approx([5, 5, -5, -5, 0])
    assert any("changes in one move" in note for note in program.notes)


def test_compensation_that_begins_on_an_arc_ends_square_and_tangent():
    """One arc from where the tool stands to the compensated end: both as far from its centre, on the contour's normal there."""
    program = gcode.parse("G0 X0 Y0\nG41 G3 X10 Y10 I0 J10 F100\nG1 Y30\nG40 X-9\nM30", cutter_radius=R)
    k = int(np.flatnonzero(program.kind == 1)[0])
    centre, start, end = (1e3 * column[k, :2] for column in (program.center, program.start, program.end))
    assert end == pytest.approx([5, 10]) and start == pytest.approx([0, 0]) and centre[1] == pytest.approx(10)
    assert np.hypot(*(start - centre)) == pytest.approx(np.hypot(*(end - centre)), rel=1e-12)


def way(program, k, *, is_end):
    """Unit direction of motion at an end of a row, in the plane."""
    if program.kind[k] == 0:
        direction = (program.end[k] - program.start[k])[:2]
    else:
        ray = ((program.end if is_end else program.start)[k] - program.center[k])[:2]
        direction = np.sign(program.sweep[k]) * np.array([-ray[1], ray[0]])
    return direction / np.linalg.norm(direction)


@pytest.mark.parametrize(("come", "go", "arcs"), [
    ("CT X+0 Y+0 CCA90 R+10", "CT CCA90 R+10", [math.pi / 2, math.pi / 2]),
    ("CT X+0 Y+0 CCA60 R-10", "CT CCA180 R-10", [-math.pi / 3, -math.pi]),
    ("LCT X+0 Y+0 R10", "LCT X-30 Y+60 R10", None), ("PLCT PR+0 PA+0 R10", "PLCT PR+70 PA+90 R10", None)])
def test_ways_on_circles_are_tangent_to_the_contour_and_have_their_radius(come, go, arcs):
    """Klartext: the contour stands at x = 0, the tool on its left; LCT is tangent to its straight line, too."""
    text = (f"BEGIN PGM A MM\nTOOL CALL 1 Z S1000\nL X-40 Y-30 Z-1 R0 F500\nCC X+0 Y+0\nAPPR {come} RL\nL Y+40\nDEP {go}\n"
            "L X-60 Y+80 F900\nEND PGM A MM")
    program = gcode.parse(text, cutter_radius=R)
    first, last = np.flatnonzero(program.kind == 1)
    assert np.hypot(*(program.start[[first, last]] - program.center[[first, last]])[:, :2].T) == pytest.approx(0.01)
    assert program.end[first, :2] == pytest.approx([-R, 0]) and program.start[last, :2] == pytest.approx([-R, 0.04])
    assert way(program, first, is_end=True) == pytest.approx([0, 1], abs=1e-9)
    assert way(program, last, is_end=False) == pytest.approx([0, 1], abs=1e-9)
    if arcs is not None:
        assert program.sweep[[first, last]] == pytest.approx(arcs)
    else:
        assert way(program, first - 1, is_end=True) == pytest.approx(way(program, first, is_end=False), abs=1e-9)
        assert way(program, last + 1, is_end=False) == pytest.approx(way(program, last, is_end=True), abs=1e-9)
        assert 1e3 * program.end[last + 1, :2] == pytest.approx([-30, 60] if "X-30" in go else [0, 70], abs=1e-9)
    assert np.array_equal(program.start[1:], program.end[:-1])


def test_a_place_inside_the_circle_of_a_way_is_refused():
    text = "BEGIN PGM A MM\nL X-12 Y-1 R0 F500\nAPPR LCT X+0 Y+0 R10 RL\nL Y+40\nDEP LT LEN9\nEND PGM A MM"
    with pytest.raises(FileFaults, match="inside the circle of 10 mm"):
        gcode.parse(text, cutter_radius=R)
    with pytest.raises(FileFaults, match="without CCA"):
        gcode.parse(text.replace("LCT X+0 Y+0 R10", "CT X+0 Y+0 R10"), cutter_radius=R)
