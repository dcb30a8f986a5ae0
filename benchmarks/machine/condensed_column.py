"""A carriage on six blocks of three rails of a ribbed column, condensed: worst frequency, static flexibility, ripple.

    python benchmarks/machine/condensed_column.py [--error 0.002] [--mesh 0.1]

The column is that of `sliding_column.py` with a third rail in the middle, locked to the ground by its foot; 41 stations a
block, ten modes to about 700 Hz, a carriage of 320 kg. Errors are against all shapes of the reduction (their own bound is
printed), at 40 positions off the stations. Ripple: of the error of a frequency over 60 mm, less its straight line.
The last line is the size
with the three figures.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from benchmarks.machine.sliding_column import BLOCK, CARRIAGE, HIGH, LOW, RAIL, SCREW, WALL, X, Y, Z
from toolpoint.machine import Machine, assemble, build
from toolpoint.machine.assembly.condense import condense_bodies
from toolpoint.machine.assembly.reduction_estimate import estimate_reduction
from toolpoint.machine.description import (
    AxisDescription,
    BodyDescription,
    FrameDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.machine.description.elastic import (
    CAST_IRON,
    CastingBox,
    ElasticDescription,
    ElasticMaterial,
    PatchDescription,
    PlaneDescription,
)
from toolpoint.machine.frequencies import natural_frequencies

COUNT, MIDDLE = 10, 0.66  # modes; z of the carriage's centre where the axis stands at zero, m
RAILS = (0.03, X / 2 - RAIL / 2, X - 0.03 - RAIL)  # left sides, m
BLOCKS = {f"{side}{row}": (x + RAIL / 2, MIDDLE + above) for side, x in zip("abc", RAILS, strict=True)
          for row, above in ((1, -0.13), (2, 0.13))}
GUIDE = {"x": 6e8, "y": 5e8, "rx": 2e6, "ry": 2e6, "rz": 1e6}


def column(mesh: float) -> ElasticDescription:
    """The column with ribs and three rails on its front."""
    ribs = (0.33, 0.64, 0.95)
    boxes = [CastingBox((0, 0, 0), (X, Y, Z)), CastingBox((WALL,) * 3, (X - WALL, Y - WALL, Z - WALL), window=True)]
    boxes += [CastingBox((WALL, WALL, z), (X - WALL, Y - WALL, z + WALL)) for z in ribs]
    boxes += [CastingBox((0.1, 0.1, z), (X - 0.1, Y - 0.1, z + WALL), window=True) for z in ribs]
    boxes += [CastingBox((x, Y, 0.02), (x + RAIL, Y + RAIL, Z - 0.02), material="rail") for x in RAILS]
    places = {name: PatchDescription((x, Y + RAIL, z), (0, 0, 1), (1, 0, 0), BLOCK, RAIL, slide=(LOW - MIDDLE, HIGH - MIDDLE),
                                     stations=(HIGH - LOW) / 40) for name, (x, z) in BLOCKS.items()}
    places["foot"] = PatchDescription(plane=PlaneDescription((0, 0, 0), (0, 0, -1)))
    return ElasticDescription(tuple(boxes), places, band=700.0, mesh_size=mesh,
                              materials={"body": CAST_IRON, "rail": ElasticMaterial(210e9, 7850.0)})


def machine(mesh: float) -> Machine:
    """The column on the ground with its carriage."""
    bodies = {"column": BodyDescription(elastic=column(mesh)),
              "carriage": BodyDescription(CARRIAGE, (X / 2, Y + RAIL + 0.09, MIDDLE), InertiaDescription(9.0, 12.0, 8.0))}
    joints = {"foot": JointDescription("ground", "column", FrameDescription((X / 2, Y / 2, 0)), child_interface="foot")}
    for k, (name, (x, z)) in enumerate(BLOCKS.items()):
        springs = GUIDE | ({"z": SCREW} if k == 0 else {})
        joints[name] = JointDescription("column", "carriage", FrameDescription((x, Y + RAIL, z)), springs,
                                        free=() if k == 0 else ("z",), closes_loop=k > 0, parent_interface=name)
    axes = {"Z": AxisDescription("a1", "z", (LOW - MIDDLE + 0.001, HIGH - MIDDLE - 0.001))}
    points = {"tool": PointDescription("carriage", (X / 2, 0.9, MIDDLE))}
    return build(MachineDescription("column", bodies, joints, axes, points))


def main() -> None:
    """Print the three figures at the size that the error asks for."""
    line = CommandLine(__doc__)
    line.add_argument("--error", type=float, default=2e-3)
    line.add_argument("--mesh", type=float, default=0.1)
    options = line.parse_args()
    begin = time.process_time()
    rich = machine(options.mesh)
    print(f"{rich!r}, {time.process_time() - begin:.0f} CPU s")
    begin = time.process_time()
    result = condense_bodies(rich, error=options.error)
    size = result.sizes["column"][1]
    print(f"{result!r}, {time.process_time() - begin:.0f} CPU s")
    own = estimate_reduction(rich, {"Z": 0.0137}, COUNT)
    print(f"all shapes: within {100 * own.error.max():.2g} % of all elements, by their own bound")
    lowest, highest = rich.chain.axes[0].lower, rich.chain.axes[0].upper
    positions = {"Z": np.sort(np.random.default_rng(0).uniform(lowest, highest, 40))}
    rise = natural_frequencies(result.machine, positions, COUNT) / natural_frequencies(rich, positions, COUNT) - 1
    statics = []
    for each in (rich, result.machine):
        system = assemble(each, positions, ["tool:+x", "tool:+y", "tool:+z"])
        flexibility = system.output_map @ np.linalg.solve(system.stiffness, system.input_map)
        statics.append(np.diagonal(flexibility, axis1=1, axis2=2))
    static = float(np.abs(statics[1] / statics[0] - 1).max())
    near = {"Z": np.linspace(0.0, 0.06, 31)}
    error = natural_frequencies(result.machine, near, COUNT) / natural_frequencies(rich, near, COUNT) - 1
    fit = np.polynomial.polynomial.polyfit(near["Z"], error, 1)
    ripple = float(np.abs(error - (fit[0] + np.outer(near["Z"], fit[1]))).max())
    print(f"{size} coordinates: worst {100 * rise.max():.2g} %, static {100 * static:.2g} %, ripple {100 * ripple:.2g} %")


if __name__ == "__main__":
    main()
