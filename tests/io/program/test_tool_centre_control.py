"""Tool centre control in three dialects: what is read of the tool's direction, and what is refused with its line."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.io.program.gcode import parse
from toolpoint.io.program.path.segments import Program

FANUC = """S9000 M3
G0 X-20 Y10 Z50 B0 C0
G43.4 H1
G0 X0 Y0 Z20 B20 C30
G1 Z-2 F1000
X40 B30 C45
B10 F500
G0 Z50
G49
G0 Z200
B0 C0
X0
"""
SIEMENS = """N10 S9000 M3
N20 G0 X-20 Y10 Z50 B=0 C=0
N30 TRAORI(1)
N40 G0 X0 Y0 Z20 B=20 C=30
N50 G1 Z-2 F1000
N60 X40 B30 C=AC(45)
N70 B10 F500
N80 G0 Z50
N90 TRAFOOF
N100 G0 Z200
N110 B0 C0
N120 X0
"""
KLARTEXT = """0 BEGIN PGM PART MM
1 TOOL CALL 1 Z S9000
2 L X-20 Y+10 Z+50 B+0 C+0 R0 FMAX
3 {on}
4 L X+0 Y+0 Z+20 B+20 C+30 FMAX
5 L Z-2 F1000
6 L X+40 IB+10 C+45
7 L B+10 F500
8 L Z+50 FMAX
9 {off}
10 L Z+200 FMAX
11 L B+0 C+0 FMAX
12 L X+0 FMAX
13 END PGM PART MM
"""


def _read(text: str) -> Program:
    return parse(text, start=(0, 0, 0.1))


@pytest.mark.parametrize("text", [FANUC, SIEMENS, KLARTEXT.format(on="M128", off="M129"),
                                  KLARTEXT.format(on="FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS", off="FUNCTION RESET TCPM")])
def test_three_dialects_give_the_same_tips_and_angles(text: str) -> None:
    """Angles at both ends of every segment under control; a turn alone stands still; the last rapids are not seen."""
    program = _read(text)
    assert program.is_five_axis and program.rotary == ()
    b, c = np.degrees(program.directions[:, [7, 8]]).T
    assert b[1:6] == pytest.approx([20, 20, 30, 10, 10]) and c[1:6] == pytest.approx([30, 30, 45, 45, 45])
    assert np.degrees(program.directions[3, 1]) == pytest.approx(20) and program.directions[1, 1] == 0
    assert program.is_controlled.tolist() == [False] + 5 * [True] + 2 * [False]
    assert program.unseen.tolist() == 6 * [False] + [True, False]
    assert np.allclose(program.end[4], program.start[4]) and program.feed[4] == pytest.approx(np.radians(500) / 60)
    assert np.allclose(1e3 * program.end[3], [40, 0, -2])


@pytest.mark.parametrize(("begin", "block", "end"), [
    ("G43.5 H1", "G1 X10 Y0 Z0 I0.6 K0.8 F900", "G49"), ("TRAORI", "G1 X10 Y0 Z0 A3=3 B3=0 C3=4 F900", "TRAFOOF")])
def test_vectors_are_of_unit_length(begin: str, block: str, end: str) -> None:
    program = _read(f"S9000\nG0 X0 Y0 Z50\n{begin}\n{block}\nX20\n{end}\nG0 Z90")
    assert program.directions[1, 9:] == pytest.approx([0.6, 0, 0.8])
    assert program.directions[2] == pytest.approx([0, 0, 0, 0.6, 0, 0.8, 0, 0, 0, 0.6, 0, 0.8])


def test_klartext_takes_the_tool_of_a_block_with_vectors_and_not_its_normal() -> None:
    program = _read("0 BEGIN PGM P MM\n1 TOOL CALL 1 Z S9000\n2 L X+0 Y+0 Z+50 FMAX\n3 M128\n"
                    "4 LN X+10 Y+5 Z+0 NX0.1 NY0 NZ0.99 TX0 TY-0.6 TZ0.8 F900\n5 M129\n6 END PGM P MM")
    assert 1e3 * program.end[1] == pytest.approx([10, 5, 0]) and program.directions[1, 9:] == pytest.approx([0, -0.6, 0.8])


@pytest.mark.parametrize(("text", "line", "words"), [
    ("TRAORI\nG1 A10 F900\nG2 X10 Y0 I5 J0 A3=0.1 C3=1", 3, "a vector and angles"),
    ("TRAORI\nG1 X10 A2=10 F900", 2, "A2=: Euler"),
    ("TRAORI\nG1 X10 A5=0 C5=1 F900", 2, "A5=: a normal"), ("G1 X10 A3=1 F900", 1, "without TRAORI"),
    ("G43.5\nG1 X10 I0 J0 K0 F900", 2, "of no length"), ("G68.2 J45\nG53.1\nG43.4 H1\nG1 X5 F900", 3, "tilted is not computed"),
    ("G43.4 H1\nG81 X5 Z-3 R2 F100", 2, "drilling cycle under G43.4"), ("G43.4\nG53 G1 Z0 F9", 2, "machine coordinates")])
def test_what_is_not_computed_is_refused_with_its_line(text: str, line: int, words: str) -> None:
    with pytest.raises(ToolpointError, match=words) as caught:
        _read("S9000\nG0 X0 Y0 Z5\n" + text)
    assert f":{line + 2}:" in str(caught.value) or f"line {line + 2}" in str(caught.value)


def test_cuts_with_turned_axes_and_without_control_are_named() -> None:
    assert _read("S9000\nG0 X0 Y0 Z5\nG0 B30\nG1 X10 F900").rotary == (4,)
    assert _read("S9000\nG0 X0 Y0 Z5\nG1 A90 F900").rotary == (3,)
    assert _read("S9000\nG0 X0 Y0 Z5\nG0 B30\nG0 B0\nG1 X10 F900").rotary == ()


def test_an_arc_is_followed_by_chords_along_which_the_tool_turns_evenly() -> None:
    program = _read("S9000\nG0 X0 Y0 Z5\nG43.4 H1\nG1 X0 Y0 Z0 F900\nG2 X10 Y0 I5 J0 B20\nG49")
    rows = np.flatnonzero(program.line == 5)
    middle = program.end[rows[rows.size // 2 - 1]]
    assert np.hypot(*(1e3 * program.end[rows, :2] - [5, 0]).T) == pytest.approx(5) and middle[1] > 4.9e-3
    assert np.degrees(program.directions[rows, 7]) == pytest.approx(20 * np.arange(1, rows.size + 1) / rows.size)
    sagitta = 5 * (1 - np.cos(np.pi / rows.size / 2))
    assert sagitta < 1e-3 and np.allclose(1e3 * program.end[rows[-1]], [10, 0, 0])


def test_inverse_time_is_that_of_the_block_also_where_the_tool_only_turns() -> None:
    program = _read("S9000\nG0 X0 Y0 Z5 B0\nG43.4 H1\nG93\nG1 X10 B10 F60\nB40 F30\nG94\nG49")
    assert program.feed[1] == pytest.approx(0.01) and np.radians(30) / program.feed[2] == pytest.approx(2.0)


def test_a_five_axis_program_has_no_path_of_three_axes() -> None:
    with pytest.raises(ToolpointError, match="line 4 moves under tool centre control"):
        _ = _read(FANUC).path
