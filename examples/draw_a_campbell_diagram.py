"""All that `toolpoint campbell` does: a spindle's frequencies over its speed, whirl and critical speeds, as a page."""

import tempfile
from pathlib import Path

import numpy as np

from toolpoint.io import read_machine
from toolpoint.pages.machines.campbell import campbell_page
from toolpoint.studies import map_speeds

SPINDLE = """toolpoint: 1
name: rigid spindle on two bearings
bodies:
  rotor: {mass: 4 kg, inertia: {xx: 0.03, yy: 0.03, zz: 0.02}, spin: {speed: 20000 rpm, axis: z}}
joints:
  bearings: {parent: ground, child: rotor, at: [0, 0, 0], stiffness: {x: 4e7, y: 4e7, z: 5e7, rx: 4e5, ry: 4e5, rz: 1e5}}
points: {nose: {body: rotor, at: [0, 0, -0.15]}}
tool: nose
"""


def main() -> float:
    """Return how far forward and backward whirl part at 30000 rev/min, Hz: I_p W/(I_d 2 pi) by hand."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "spindle.yaml").write_text(SPINDLE)
        result = map_speeds(read_machine(Path(folder) / "spindle.yaml"), np.linspace(0, 30000, 13), 6)
        print(campbell_page(result).save(Path(folder) / "campbell.html").name)
    print(result.table())
    forward, backward = (result.frequency[-1][result.whirl[-1] == way] for way in (1, -1))
    return float(forward.max() - backward.min())


if __name__ == "__main__":
    main()
