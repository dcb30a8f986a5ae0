"""Tilted planes of three controls: places in the work by rotations written out, and what is refused by name and line."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint._check import FloatArray
from toolpoint.io.program.gcode import parse

KLARTEXT = "BEGIN PGM A MM\nTOOL CALL 1 Z S9000\n{}\nL X+1 Y+2 Z+3 F100\nPLANE RESET STAY\nL X+0 Y+0 Z+5\nEND PGM A MM"


def _turn(axis: int, degrees: float) -> FloatArray:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    a, b = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[a, a], matrix[a, b], matrix[b, a], matrix[b, b] = c, -s, s, c
    return matrix


@pytest.mark.parametrize(("text", "rotation", "origin"), [
    ("G68.2 X10 Y20 Z-5 I30 J40 K-20\nG53.1\nG1 X1 Y2 Z3 F100\nG69", _turn(2, 30) @ _turn(0, 40) @ _turn(2, -20), (10, 20, -5)),
    ('CYCLE800(0,"T",0,57,10,20,-5,30,40,-20,0,0,0,-1)\nG1 X1 Y2 Z3 F100\nCYCLE800()',
     _turn(0, 30) @ _turn(1, 40) @ _turn(2, -20), (10, 20, -5)),
    ('CYCLE800(0,"T",0,27,0,0,0,30,40,-20,0,0,0,-1)\nG1 X1 Y2 Z3 F100\nCYCLE800()',
     _turn(2, 30) @ _turn(1, 40) @ _turn(0, -20), (0, 0, 0)),
    (KLARTEXT.format("PLANE SPATIAL SPA+30 SPB+40 SPC-20 TURN FMAX"), _turn(2, -20) @ _turn(1, 40) @ _turn(0, 30), (0, 0, 0))])
def test_places_in_a_tilted_plane(text: str, rotation: FloatArray, origin: tuple[float, ...]) -> None:
    program = parse(text, start=(0, 0, 0.1))
    matrix, stage = program.stages()[0]
    assert np.allclose(matrix, rotation, atol=1e-12)
    assert np.allclose(matrix @ stage.end[-1], 1e-3 * (np.array(origin) + rotation @ np.array([1, 2, 3])), atol=1e-12)


def test_arcs_in_a_tilted_plane_are_arcs_and_the_path_goes_on_upright() -> None:
    program = parse("G68.2 X5 J90\nG53.1\nG1 X0 Y0 Z0 F600\nG2 X4 Y0 I2 J0\nG69\nG1 X9 Y9 Z9", start=(0, 0, 0.05))
    (rotation, tilted), (upright, last) = program.stages()
    assert tilted.kind.tolist() == [0, 1] and np.allclose(upright, np.eye(3))
    assert np.allclose(rotation @ tilted.end[-1], last.start[0]) and np.allclose(last.end[0], [9e-3] * 3)


@pytest.mark.parametrize(("text", "message"), [
    ("G68.2 J30\nG1 X5 F100", "before G53.1"),
    ('CYCLE800(0,"T",0,192,0,0,0,30,0,0,0,0,0,-1)\nG1 X5 F100', "machine angles is not computed"),
    ('CYCLE800(0,"T",1,57,0,0,0,30,0,0,0,0,0,-1)\nG1 X5 F100', "added to the one before"),
    ("G68.2 J30\nG53.1\nG92 X0\nG1 X5 F100", "G92 in a tilted plane"),
    (KLARTEXT.format("PLANE VECTOR BX0.8 BY-0.4 BZ-0.4 NX0.2 NY0.2 NZ0.9"), "PLANE VECTOR: this way to tilt is not computed"),
])
def test_other_ways_to_tilt_are_refused_by_name(text: str, message: str) -> None:
    with pytest.raises(ToolpointError, match=message):
        parse(text, start=(0, 0, 0.1))


def test_a_tool_called_by_its_name_may_have_words_behind_it() -> None:
    program = parse('T="MILL8" D1\nM6\nS6000 M3\nG1 X1 F100', start=(0, 0, 0.1))
    assert program.kind.size == 1 and program.speed.tolist() == [6000.0]
