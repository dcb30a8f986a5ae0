"""Programs of real controls: cycles, variables, loops, subprograms, offsets, notes; the measured set with a second reading."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.drives import JerkLimits, plan_motion
from toolpoint.io.faults import FileFaults
from toolpoint.io.program import gcode

RUN = ("fusion_grbl.nc", "linuxcnc_3dtest.ngc", "linuxcnc_arcspiral.ngc", "linuxcnc_cds.ngc", "norn_drill.gcode",
       "siemens_notch.mpf", "ws_0100.nc", "ws_SINUMERIK850.nc", "7997A.nc")


def ends(text, **options):
    return 1e3 * gcode.parse(text, **options).end


def test_words_without_motion_are_one_note():
    program = gcode.parse("G40 G49 G1 X1 F100\n" + "G40\nG43 H1\n" * 3 + "X2")
    assert [n for n in program.notes if "G40 in 4 lines" in n and "G43 in 3 lines" in n and "G49 in 1 line" in n]
    assert len(program.notes) == 1


def test_equal_faults_are_one():
    with pytest.raises(FileFaults) as caught:
        gcode.parse("G1 X1 F100\n" + "G5.2 X2\nM8\n" * 26)
    assert "1 fault" in str(caught.value) and "in 26 lines" in str(caught.value) and "a spline" in str(caught.value)


@pytest.mark.slow
def test_a_dwell_is_time():
    moves, limits = "G1 X10 F3000\n{}X20", JerkLimits(1, 5, 200)
    for words, duration in (("G4 P500\n", 0.5), ("G4 P0.25\n", 0.25), ("G4 X1.5\n", 1.5), ("G4 F2\n", 2.0)):
        waits = plan_motion(gcode.parse(moves.format(words)).path, limits)
        passes = plan_motion(gcode.parse("G9 G1 X10 F3000\nX20").path, limits)
        assert waits.duration - passes.duration == pytest.approx(duration)
        command = waits.command(1e-3)
        rest = (np.abs(command.position[:, 0] - 0.01) < 1e-12).sum() * 1e-3
        assert rest == pytest.approx(duration, abs=3e-3)
        assert np.ptp(np.diff(command.position[:, 0])) < 1e-3 and command.position[-1, 0] == pytest.approx(0.02)


def test_cycles_are_moves():
    """R 2, depth -5, begun at 10: over the hole, down to R, the hole, and back to R (G99) or to 10 (G98)."""
    hole = "G0 Z10\nG{} G81 X5 Y6 Z-5 R2 F100\nX20\nG80\nX0"
    np.testing.assert_allclose(ends(hole.format(98))[1:, :].tolist(), [
        [5, 6, 10], [5, 6, 2], [5, 6, -5], [5, 6, 10], [20, 6, 10], [20, 6, 2], [20, 6, -5], [20, 6, 10], [0, 6, 10]],
        atol=1e-12)
    np.testing.assert_allclose(ends(hole.format(99))[3:6, 2], [-5, 2, 2], atol=1e-12)
    pecks = gcode.parse("G0 Z10\nG83 X0 Y0 Z-5 R2 Q3 F100\nG80")
    depths = 1e3 * pecks.end[~pecks.rapid, 2]
    np.testing.assert_allclose(depths, [-1, -4, -5], atol=1e-12)
    assert not gcode.parse("G0 Z10\nG85 X0 Z-5 R2 F100").rapid[-2]
    with pytest.raises(FileFaults, match="depth"):
        gcode.parse("G81 X1 F100")


@pytest.mark.parametrize("block", ["G83 X0 Y0 Z-50 R2 Q0.001 F100", "G81 X0 Y0 Z-5 R2 F100 L2000"])
def test_more_pecks_or_holes_than_a_block_can_mean_are_refused(block):
    """A peck of a micrometre: before, the thousandth went the rest of the way, and load and time were wrong."""
    with pytest.raises(FileFaults, match="at most 1000"):
        gcode.parse(f"G0 Z10\n{block}\nG80")


def test_repeats_of_a_cycle_in_increments():
    program = gcode.parse("G0 X0 Y0 Z5\nG91 G81 X10 Z-3 R-4 F100 L4\nG80")
    cut = ~program.rapid
    np.testing.assert_allclose(1e3 * program.end[cut, 0], [10, 20, 30, 40], atol=1e-12)
    np.testing.assert_allclose(1e3 * program.end[cut, 2], -2, atol=1e-12)


@pytest.mark.parametrize("text", [
    "#1=0\nWHILE [#1 LT 4] DO1\n#1=#1+1\nG1 X[#1*10] F100\nEND1\nM30",
    "#1=1\nN10 G1 X[#1*10] F100\n#1=#1+1\nIF [#1 LE 4] GOTO 10\nM30",
    "o100 while [#<n> lt 4]\n#<n> = [#<n>+1]\ng1 x[10*#<n>] f100\no100 endwhile\nm2",
    "#1=0\no7 repeat [4]\n#1=[#1+1]\ng1 x[#1*10] f100\no7 endrepeat\nm2",
    "o1 sub\ng1 x[10*#1] f100\no1 endsub\no1 call [1]\no1 call [2]\no1 call [3]\no1 call [4]\nm2",
    "DEF REAL N\nFOR N=1 TO 4\nG1 X=N*10 F100\nENDFOR\nM30",
    "R1=0\nREPEAT\nR1=R1+1\nG1 X=R1*10 F100\nUNTIL R1>=4\nM30",
    "R1=1\nLOOP1:\nG1 X=R1*10 F100\nR1=R1+1\nIF R1<=4 GOTOB LOOP1\nM30",
    "R1=0\nWHILE R1<4\nR1=R1+1\nIF R1==2\nG1 X=2*SQRT(100) F100\nELSE\nG1 X=R1*10 F100\nENDIF\nENDWHILE\nM30",
    "G91\nM98 P200 L4\nM30\nO200\nG1 X10 F100\nM99", "0 BEGIN PGM A MM\n1 Q1 = 0\n2 LBL 1\n3 Q1 = Q1 + 10\n4 L X+Q1 F100\n"
    "5 CALL LBL 1 REP 3\n6 END PGM A MM"])
def test_variables_loops_and_subprograms(text):
    np.testing.assert_allclose(ends(text)[:, 0], [10, 20, 30, 40], atol=1e-12)


@pytest.mark.parametrize(("text", "value"), [
    ("2+3*4", 14), ("[2+3]*4", 20), ("2**3", 8), ("SIN[30]*2", 1), ("ATAN[1]/[1]", 45), ("7 MOD 4", 3), ("ABS[-3]", 3),
    ("-[1 EQ 1]", -1), ("FIX[2.7]+FUP[2.1]", 5), ("10-2-3", 5), ("SQRT[9]/3", 1)])
def test_expressions(text, value):
    assert ends(f"G1 X[{text}] F100")[0, 0] == pytest.approx(value)


@pytest.mark.slow
@pytest.mark.parametrize("text", ["N1 GOTO 1", "WHILE [1 EQ 1] DO1\nEND1", "o1 while [1]\no1 endwhile", "O1\nM98 P1",
                                  "0 BEGIN PGM A MM\nLBL 1\nCALL LBL 1", "#1=" + "[" * 5000, "R1=0\nLOOP\nENDLOOP"])
def test_programs_without_end_end(text):
    with pytest.raises(ToolpointError):
        gcode.parse(text)


def test_offsets_shifts_and_reference():
    np.testing.assert_allclose(ends("G10 L2 P2 X100\nG55 G1 X1 F100\nG53 G1 X5\nG92 X0\nX1\nG28 X2")[:, 0], [101, 5, 6, 7, 0],
                               atol=1e-12)
    program = gcode.parse("G54 G1 X1 F100\nG55 X1")
    assert sum("offset G5" in note and "zero" in note for note in program.notes) == 2


def test_feeds_of_every_mode():
    feeds = gcode.parse("G94 G1 X10 F600\nG95 S1200 F0.5 X20\nG93 F2 X30").feed
    np.testing.assert_allclose(feeds, [0.01, 0.01, 0.01 * 2 / 60])


def test_klartext_arcs_are_those_of_iso():
    heid = gcode.parse("0 BEGIN PGM A MM\n1 L X+10 Y+0 R0 F500 M3\n2 CC X+0 Y+0\n3 C X+0 Y+10 DR+\n4 CR X-10 Y+0 R+10 DR+\n"
                       "5 L Z+20 FMAX\n6 END PGM A MM")
    iso = gcode.parse("G1 X10 Y0 F500\nG3 X0 Y10 I-10 J0\nG3 X-10 Y0 R10\nG0 Z20")
    for name in ("end", "sweep", "feed", "rapid"):
        np.testing.assert_allclose(getattr(heid, name), getattr(iso, name), atol=1e-12)


def test_rotary_words_are_said():
    notes = " ".join(gcode.parse("G0 B90\nG1 X10 A20 F100").notes)
    assert "only position" in notes and "alone" in notes


def second_reading(text):
    """Return length and extents (m) of a plain program by another way: chords and angles, no segments kept."""
    scale, here, length, motion, points = 1e-3, np.zeros(3), 0.0, 0, []
    plane = (0, 1)
    for line in text.upper().splitlines():
        words = re.findall(r"([A-Z])\s*([-+]?\d*\.?\d+)", re.sub(r"\(.*?\)|;.*", "", line))
        codes = [float(v) for k, v in words if k == "G"]
        for code in codes:
            motion = int(code) if code in (0, 1, 2, 3) else motion
            scale = {20: 0.0254, 21: 1e-3, 710: 1e-3}.get(code, scale)
            plane = {17: (0, 1), 18: (2, 0), 19: (1, 2)}.get(code, plane)
        values = {k: float(v) * scale for k, v in words if k in "XYZIJKR"}
        if not values:
            continue
        goal = np.array([values.get(k, here[i]) for i, k in enumerate("XYZ")])
        if motion < 2:
            length += np.linalg.norm(goal - here)
        else:
            chord = np.linalg.norm((goal - here)[list(plane)])
            center = [values.get("IJK"[i], 0.0) for i in plane]
            radius = abs(values.get("R", 0.0)) or math.hypot(*center)
            angle = 2 * math.pi if chord == 0 else 2 * math.asin(min(1.0, chord / 2 / radius))
            length += radius * angle
        here = goal
        points.append(here)
    return length, np.min(points, axis=0), np.max(points, axis=0)


@pytest.mark.slow
@pytest.mark.parametrize("name", RUN)
def test_measured_programs_run(measured, name):
    program = gcode.read(measured / "gcode" / name, feed=0.1)
    path = program.path
    assert np.isfinite(path.lengths).all() and plan_motion(path, JerkLimits(0.5, 5, 200)).duration > 0
    if name in RUN[:6]:
        text = (measured / "gcode" / name).read_text(errors="replace")
        length, low, high = second_reading(text)
        assert path.lengths.sum() == pytest.approx(length, rel=1e-4)
        np.testing.assert_allclose(program.end.min(axis=0), np.minimum(low, program.end[0]), atol=1e-9)
        np.testing.assert_allclose(program.end.max(axis=0), np.maximum(high, program.end[0]), atol=1e-9)


def test_measured_drillings_and_turnings(measured):
    """Holes counted by eye in the text: 4+4+4+2+2+2+2+2+2+4+4 (Sinumerik 850); dwells 0.2 + 2 + 6 s in the turned flange."""
    drilled = gcode.read(measured / "gcode" / "ws_SINUMERIK850.nc")
    deepest = drilled.end[~drilled.rapid & (drilled.end[:, 2] < 0)]
    assert len(deepest) == 32 and 1e3 * deepest[:, 2].min() == pytest.approx(-38)
    turned = gcode.read(measured / "gcode" / "ws_0100.nc")
    assert turned.dwell.sum() == pytest.approx(8.2)
    assert 1e3 * turned.end[:, 0].max() == pytest.approx(200)  # X400 is a diameter
    assert turned.feed[~turned.rapid].max() < 0.01


def test_measured_program_with_compensation_runs_once_the_radius_is_known(measured):
    """APPR LT LEN10 RR around a square whose corners an operator touches: seven millimetres from zero here, as he does not."""
    file = measured / "gcode" / "heid_PROFILE.h"
    with pytest.raises(FileFaults, match="radius of the tool is not known"):
        gcode.read(file)
    program = gcode.read(file, cutter_radius=0.005)
    cut = ~program.rapid
    assert 1e3 * np.abs(program.end[cut][:, :2]).max() == pytest.approx(17)  # the contour's seven, and ten of LEN
    assert (program.line[program.kind == 1] > 0).all() and any("radius compensation" in note for note in program.notes)


def test_brackets_in_a_comment_belong_to_it():
    text = "G21 G90\n(hole at (61.0, 67.7) of (all))\nG1 X10 F100 (a (b)\nM30"
    assert gcode.parse(text).end[-1, 0] == pytest.approx(0.01)


def test_m17_outside_a_subprogram_is_passed_over_and_ends_one_inside():
    """A word of some machines (servos on); the end of a subprogram at Siemens."""
    plain = gcode.parse("M17\nG21 G90\nG1 X10 F100\nX20\nM30")
    assert plain.end[-1, 0] == pytest.approx(0.02) and any("M17" in note for note in plain.notes)
    assert gcode.parse("G90\nG1 X10 F100\nM17").end[-1, 0] == pytest.approx(0.01)


def test_klartext_reads_where_the_program_stands():
    """ID270: the position in the datum; a loop that goes down until a depth ends there, after four passes."""
    text = """BEGIN PGM DOWN MM
FN0 : Q1 = -10
L X+0 Y+0 Z+0 FMAX
LBL 1
L IZ-2.5 F100
L IX+5
FN 18: SYSREAD Q3 = ID270 NR1 IDX3
FN 12 : IF +Q3 LT +Q1 GOTO LBL 2
FN 9: IF +Q3 EQU +Q1 GOTO LBL 2
CALL LBL 1 REP 25/25
LBL 2
Q7 = SGN Q3
L Z+Q7 FMAX
END PGM DOWN MM
"""
    program = gcode.parse(text)
    assert program.end[-1] == pytest.approx([0.02, 0, -0.001])
    assert any("where this program brought it" in note for note in program.notes)
