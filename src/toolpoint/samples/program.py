"""Sample of an NC program: a small pocket with rounded corners, the servo of its axes, and a machine that mills it."""

from __future__ import annotations

from pathlib import Path

from toolpoint import io

PART = """; pocket of 40 x 30 mm with corners of 6 mm, one pass
N10 G21 G90 G17
N20 T1 M6
N30 S9000 M3
N40 G0 X6 Y0 Z2
N50 G1 Z-2 F300
N60 G1 X34 F2400
N70 G3 X40 Y6 I0 J6
N80 G1 Y24
N90 G3 X34 Y30 I-6 J0
N100 G1 X6
N110 G3 X0 Y24 I0 J-6
N120 G1 Y6
N130 G3 X6 Y0 I6 J0
N140 G0 Z2
N150 M30
"""
PROJECT = """# The same program as a part of a project: toolpoint run .
toolpoint: 1
name: Pocket mill
machine: mill.yaml
cuts:
  slot: {diameter: 10 mm, teeth: 4, direction: slot, material: al7075, coefficient_deviation: 10 %, speeds: 6000 14000 rpm}
programs:
  pocket: {program: part.nc, stock: "box=-10,-10,-10,50,40,0", zero: {Z: -100 mm}}
"""


def write(folder: Path) -> tuple[list[str], list[str]]:
    """Write program, servo and machine; return what was put in, and the commands."""
    (folder / "part.nc").write_text(PART, encoding="utf-8")
    io.write_template(folder / "servo.yaml", "servo")
    io.write_template(folder / "mill.yaml", "machine", "three-axis-vertical")
    (folder / "project.yaml").write_text(PROJECT, encoding="utf-8")
    return ["The contour is 40 x 30 mm with corners of 6 mm, at 2400 mm/min.",
            "The servo has X and Y with friction; Z follows without error (--ideal Z).",
            "project.yaml asks how sure it is that every block is stable, with 10 % on the coefficients."], [
        "toolpoint drive servo.yaml --program part.nc --ideal Z", "toolpoint drive servo.yaml --circle 50,4000",
        "toolpoint machining part.nc --machine mill.yaml --zero Z=-100mm --stock box=-10,-10,-10,50,40,0 --diameter 10 "
        "--teeth 4 --material al7075", "toolpoint run ."]
