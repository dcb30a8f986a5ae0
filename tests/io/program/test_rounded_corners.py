"""Rounded and broken corners in three dialects, polar and tangential moves and cycles of Klartext: against closed forms."""

import math

import numpy as np
import pytest

from toolpoint.io.faults import FileFaults
from toolpoint.io.program.gcode import parse

LENGTH = 35 + 5 * math.pi / 2 + 30 - 5 - 4 + 4 * math.sqrt(2) + 36


@pytest.mark.parametrize("text", [
    "BEGIN PGM A MM\nL X+0 Y+0 FMAX\nL X+40 F500\nRND R5\nL Y+30\nCHF 4\nL X+0\nEND PGM A MM",
    "G0 X0 Y0\nG1 X40 F500 RND=5\nY30 CHR=4\nX0\nM30", "G0 X0 Y0\nG1 X40 F500 ,R5\nY30 ,C4.\nX0\nM30",
    "R1=5\nG0 X0 Y0\nG1 X40 F500 RND=R1\nY30 CHF=4*SQRT(2)\nX0\nM30"])
def test_a_rounding_and_a_chamfer_in_three_dialects(text):
    program = parse(text)
    assert 1e3 * program.path.lengths.sum() == pytest.approx(LENGTH, rel=1e-12)
    assert 1e3 * program.center[program.kind == 1] == pytest.approx(np.array([[35, 5, 0]]))
    assert np.array_equal(program.start[1:], program.end[:-1])


def test_roundings_between_lines_and_arcs_are_tangent_to_both():
    """The distance of the rounding's centre is its radius from the line, and the sum or difference of radii from the circle."""
    program = parse("G0 X0 Y0\nG1 X40 F500 RND=3\nG3 X60 Y20 I20 J0 RND=2\nG1 X60 Y60\nM30")
    arcs = 1e3 * program.center[program.kind == 1, :2]
    assert abs(arcs[0, 1]) == pytest.approx(3)
    assert abs(np.hypot(*(arcs[0] - [60, 0])) - 20) == pytest.approx(3)


def test_a_rounding_belongs_to_the_contour_that_is_compensated():
    """Outside a corner rounded with 5 mm the centre of a tool of 3 mm goes on 8 mm."""
    program = parse("G0 X-20 Y0\nG42 G1 X0 F500\nX40 RND=5\nY30\nX0\nG40 X-20\nM30", cutter_radius=3e-3)
    k = int(np.flatnonzero(program.kind == 1)[0])
    assert 1e3 * np.hypot(*(program.start[k] - program.center[k])[:2]) == pytest.approx(8)
    assert 1e3 * program.center[k, :2] == pytest.approx([35, 5])


@pytest.mark.parametrize(("block", "words"), [
    ("G1 X4 F100 RND=5\nY30", "too short for it"), ("G0 X4 RND=5\nG1 Y30 F3", "beside a rapid"),
    ("G1 X40 F100 RND=5\nZ3", "do not both lie in the plane"), ("G1 X40 F9 CHR=3\nG2 X60 Y20 I20 J0", "beside an arc"),
    ("G1 X40 F9 RND=3", "no block follows")])
def test_roundings_that_do_not_fit_are_named(block, words):
    with pytest.raises(FileFaults, match=words):
        parse("G0 X0 Y0\n" + block)


def test_polar_and_tangential_moves_of_klartext():
    """CT: a quarter of a circle; LP and CP about the pole; CP by IPA is a helix of two turns."""
    program = parse("BEGIN PGM A MM\nL X+0 Y+0 Z+5 FMAX\nL X+40 F500\nCT X+60 Y+20\nCC X+60 Y+40\nLP PR+20 PA+0\n"
                    "CP IPA+720 IZ-5 DR+\nCP PA+90 DR-\nLP IPR+3\nLP IPA+90\nEND PGM A MM")
    assert 1e3 * program.end[2:] == pytest.approx(np.array(
        [[60, 20, 5], [80, 40, 5], [80, 40, 0], [60, 60, 0], [60, 63, 0], [37, 40, 0]]))
    assert program.sweep[[2, 4, 5]] == pytest.approx([math.pi / 2, 4 * math.pi, -1.5 * math.pi])
    assert 1e3 * program.path.lengths[4] == pytest.approx(math.hypot(80 * math.pi, 5))


def test_drilling_cycles_of_klartext_drill_and_others_are_grave():
    head = "BEGIN PGM A MM\nL X+0 Y+0 Z+50 FMAX\n"
    cycle = "CYCL DEF 200 DRILLING ~\nQ200=2 ;CLEARANCE ~\nQ201=-12\nQ202=5\nQ203=+1\nQ204=20\nQ206=200\nQ211=0.1\n"
    program = parse(head + cycle + "L X+10 FMAX M99\nL X+20 FMAX\nCYCL CALL\nEND PGM A MM")
    cuts = ~program.rapid
    assert 1e3 * program.end[cuts, 2] == pytest.approx([-4, -9, -11] * 2) and 60e3 * program.feed[cuts] == pytest.approx(200)
    pocket = parse(head + "CYCL DEF 251 POCKET\nL X+10 F500 M99\nEND PGM A MM")
    assert any(note.grave and "CYCL DEF 251 is called in line 4" in note for note in pocket.notes if hasattr(note, "grave"))
    with pytest.raises(FileFaults, match="rotation is not computed"):
        parse(head + "CYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 ROT+35\nL X+10 F9\nEND PGM A MM")
