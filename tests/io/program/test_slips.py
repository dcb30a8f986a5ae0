"""Slips of programs: comments that are numbered, arcs whose start is not programmed, files that are no program."""

from pathlib import Path

import numpy as np
import pytest

from toolpoint import studies
from toolpoint.io import read_drives
from toolpoint.io.faults import FileFaults
from toolpoint.io.program.gcode import parse

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize("comment", ["12 ; comment", "12;comment", "12   ", "12 ; L X+99", "; comment"])
def test_numbered_comments_of_klartext_are_comments(comment):
    program = parse(f"0 BEGIN PGM A MM\n1 L X+0 Y+0 F500\n{comment}\n13 L X+10\n14 END PGM A MM\n")
    assert program.end[-1].tolist() == [0.01, 0.0, 0.0] and program.kind.size == 2


@pytest.mark.parametrize(("text", "axis"), [
    ("G1 X5 F100\nG2 X10 Y10 I0 J5\n", "Y"), ("G1 Y5 F100\nG3 X10 Y10 I0 J5\n", "X"),
    ("G0 X10\nG2 X0 Y10 CR=3 F100\n", "Y"), ("G18 G0 Z4\nG2 X9 Z9 I0 K5 F100\n", "X"),
    ("0 BEGIN PGM A MM\n1 L X+10 F500\n2 CC X+0 Y+5\n3 C X+0 Y+10 DR+\n4 END PGM A MM\n", "Y")])
def test_an_arc_without_a_programmed_start_names_the_axis(text, axis):
    with pytest.raises(FileFaults, match=f"no block before this arc programs {axis}, so that its start is taken at 0 mm"):
        parse(text)


def test_an_arc_that_fits_from_zero_is_noted_and_a_programmed_one_is_not():
    assert "no block before this arc programs X and Y" in parse("G2 X10 Y0 I5 J0 F100").notes[0]
    assert not parse("G0 X0 Y0\nG2 X10 Y0 I5 J0 F100").notes
    # A wrong centre behind a programmed start is what it was.
    with pytest.raises(FileFaults, match="correct I, J, K or the end point"):
        parse("G0 X0 Y0\nG2 X10 Y0 I7 J0 F100")


@pytest.mark.parametrize("file", ["README.md", "pyproject.toml", "src/toolpoint/_check.py",
                                  "src/toolpoint/app/machines/gantry.yaml"])
def test_what_is_no_program_is_called_so_once(file):
    with pytest.raises(FileFaults, match="no NC program") as error:
        parse((ROOT / file).read_text(encoding="utf-8"))
    assert len(error.value.faults) == 1


def test_a_binary_file_is_called_no_program_once():
    binary = np.random.default_rng(1).integers(0, 256, 3000).astype(np.uint8).tobytes().decode("utf-8", "replace")
    with pytest.raises(FileFaults, match="none of a text") as error:
        parse(binary)
    assert len(error.value.faults) == 1


def test_a_program_with_some_wrong_blocks_names_them_all():
    lines = [f"G1 X{k} F500" for k in range(20)]
    lines[3], lines[7] = "G1 X?", "G6000 X1"
    with pytest.raises(FileFaults) as error:
        parse("\n".join(lines))
    assert [fault.line for fault in error.value.faults] == [4, 8]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:friction curve")
def test_a_long_motion_says_how_long_its_simulation_takes():
    drives, said = read_drives(ROOT / "src/toolpoint/app/machines/three_axis_vertical_servo.yaml"), []
    program = parse("G0 X0 Y0\nG1 X10 F8\n")
    studies.run_drives(drives, path=program.path, progress=said.append)
    assert any("s of motion, about" in name for name in said)
