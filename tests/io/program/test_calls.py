"""Subprograms, macros and their variables, files beside the program, polar words, splines, ends of programs."""

import math

import numpy as np
import pytest

from toolpoint import io
from toolpoint.io.faults import FileFaults
from toolpoint.io.program.gcode import parse


def ends(text, **options):
    return 1e3 * parse(text, **options).end


def test_a_macro_has_variables_of_its_own_and_a_subprogram_shares_them():
    """Fanuc: G65 sets #24 by X and opens a level, M98 does not."""
    macro = ends("G0 X0 Y0\nF100\n#1=7\nG65 P100 X5 Y2\nG1 X#1\nM30\nO100\nG1 X#24 Y#25\n#1=99\nM99\n")
    assert macro[1:, :2].tolist() == [[5, 2], [7, 2]]
    assert ends("F100\n#1=7\nM98 P100\nG1 X#1\nM30\nO100\n#1=#1+1\nM99\n")[-1, 0] == 8


def test_names_of_linuxcnc_are_local_and_underscores_make_them_global():
    text = "o1 sub\n#<a>=[#1+1]\n#<_g>=3\no1 endsub\nF100\n#<a>=5\no1 call [8]\nG1 X#<a> Y#<_g> Z#1"
    assert ends(text)[-1].tolist() == [5, 3, 0]


def test_a_recursion_takes_as_many_lines_as_its_law_says():
    """A curve whose every line becomes four thirds: 4^n lines of a length 3^-n, with locals of every call."""
    text = ("o9 sub\no8 if [#1 EQ 0]\nG91 G1 F100 X[#2*COS[#3]] Y[#2*SIN[#3]]\no8 else\n#<n>=[#1-1]\n#<s>=[#2/3]\n#<w>=#3\n"
            "o9 call [#<n>] [#<s>] [#<w>]\no9 call [#<n>] [#<s>] [#<w>+60]\no9 call [#<n>] [#<s>] [#<w>-60]\n"
            "o9 call [#<n>] [#<s>] [#<w>]\no8 endif\no9 endsub\no9 call [3] [81] [0]\nM2")
    program = parse(text)
    assert program.kind.size == 4**3 and program.path.lengths == pytest.approx(3e-3)
    assert 1e3 * program.end[-1] == pytest.approx([81, 0, 0], abs=1e-9)


def test_files_beside_the_program_are_run_and_what_is_absent_is_grave(tmp_path):
    main = tmp_path / "main.ngc"
    (tmp_path / "pocket.ngc").write_text("o<pocket> sub\nG1 X#1 F200\no<pocket> endsub\n")
    (tmp_path / "O9010.NC").write_text("O9010\nG1 Y#24\nM99\n")
    main.write_text("G0 X0 Y0\nF300\no<pocket> call [12]\nG65 P9010 X7\nM98 P4711\nG0 Z9\nM30\n")
    program = io.read_program(main)
    assert (1e3 * program.end[1:3, :2]).tolist() == [[12, 0], [12, 7]] and program.line.tolist() == [1, 3, 4, 6]
    grave = [note for note in program.notes if getattr(note, "grave", False)]
    assert len(grave) == 1 and "4711 (line 5)" in grave[0]
    (tmp_path / "pocket.ngc").write_text("o<pocket> sub\nG1 X1.2.3\no<pocket> endsub\n")
    with pytest.raises(FileFaults, match=r"in line 2 of pocket\.ngc"):
        io.read_program(main)


@pytest.mark.parametrize(("tail", "is_grave"), [("", True), ("G0 Z9\n", False), ("M30\n", None), ("G0 Z9\nM02\n%\n\n", None)])
def test_a_program_without_an_end_is_doubted(tmp_path, tail, is_grave):
    file = tmp_path / "part.nc"
    file.write_text("G0 X0\nG1 X9 F100\n" + tail)
    doubts = [note for note in io.read_program(file).notes if "end of the program" in note]
    assert [doubt.grave for doubt in doubts] == ([] if is_grave is None else [is_grave])


def test_polar_words_go_round_the_zero():
    """LinuxCNC: six holes 60 degrees apart on a circle of 1.5 inches; steps of a spiral."""
    holes = parse("G20 G17 G90\nG0 X1.5 Y0 Z0\nG91 G81 R.1 Z-.5 ^60 L6 F10\nM2")
    places = holes.end[~holes.rapid][:, :2] / 0.0254
    assert np.hypot(*places.T) == pytest.approx(1.5)
    assert np.degrees(np.arctan2(*places.T[::-1])) % 360 == pytest.approx([60, 120, 180, 240, 300, 360], abs=1e-9)
    spiral = ends("G0 X2 Y0\nG91 G1 F10" + " @0.5 ^90\n" * 3)
    assert spiral[1:, :2] == pytest.approx(np.array([[0, 2.5], [-3, 0], [0, -3.5]]), abs=1e-12)


@pytest.mark.parametrize(("block", "words"), [
    ("G18 G1 F9 ^60", "program them in G17"), ("G1 F9 @3 X2", "without X, Y"), ("G91 G1 F9 X-1 Y-1\n@1", "has no angle"),
    ("G1 F24O0 X3", "a letter O in place of a zero"), ("G1 F9 F8 X1", "F twice"), ("G1 X4 N7 F5", "two blocks in one line")])
def test_slips_of_a_block_are_named(block, words):
    with pytest.raises(FileFaults, match=words):
        parse(f"G0 X1 Y1 Z5\n{block}\nM2\n")


def test_splines_of_linuxcnc_are_the_curves_of_their_control_points():
    """A parabola's arc length in closed form; a cubic behind another continues its tangent; modes of Fanuc are no splines."""
    program = parse("G0 X0 Y0\nG5.1 F500 X20 Y0 I10 J20\nM30")
    x = 1e3 * program.end[1:, 0]
    assert 1e3 * program.end[1:, 1] == pytest.approx(2 * x * (1 - x / 20), abs=1e-9)
    root = math.sqrt(5)  # y' from 2 to -2: integral of sqrt(1 + y'^2) dx
    # Chords within a micrometre.
    assert 1e3 * program.path.lengths.sum() == pytest.approx(5 * (2 * root + math.asinh(2)), rel=3e-5)
    pair = parse("G0 X0 Y0\nG5 X20 Y0 I0 J10 P0 Q10 F500\nG5 X40 Y0 P0 Q-10\nM30")
    k = int(np.flatnonzero(np.isclose(pair.end[:, 0], 0.02))[0])
    ways = pair.end - pair.start
    assert ways[k, 0] / ways[k, 1] == pytest.approx(0, abs=0.02) and ways[k + 1, 1] * ways[k, 1] > 0
    assert "G5 in 1 line" in str(parse("G05 P10000\nG1 F5 X3").notes)
