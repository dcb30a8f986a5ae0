"""Parts that lose material: random plates milled thinner, straight or to a taper, beside fresh meshes of what is left.

    python benchmarks/machining/thin_walls.py [--plates 12] [--seed 1]

The last line is the figure: largest difference of the four lowest frequencies and of the static compliance of a corner, and CPU
of a stage.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.bodies.solid import Casting, Cuboid, Material, SolidModel
from toolpoint.bodies.solid.cut_solid import CutSolid, CutState
from toolpoint.material_removal import MillShape, split_moves
from toolpoint.material_removal.sweep_times import SweepTimes
from toolpoint.vibration.sparse import factorise, modes

MM = 1e-3
ALUMINIUM = Material(70e9, 0.33, 2700.0, 0.01)
RADIUS = 5 * MM
NOWHERE = SweepTimes(split_moves([[9.0, 9, 9]], [[9.1, 9, 9]], step=1.0), (MillShape(2 * RADIUS),))


def solve(model: SolidModel, state: CutState, corner: tuple[float, float, float]) -> tuple[np.ndarray, float]:
    """Return the four lowest frequencies, Hz, and the compliance along y at a corner, m/N."""
    inverse = factorise(state.stiffness, coordinates=state.coordinates)
    pairs = modes(state.stiffness, state.mass, 4, shift=0, inverse=inverse, is_counted=False, coordinates=state.coordinates)
    row = int(np.flatnonzero(state.free == 3 * int(np.linalg.norm(model.nodes - corner, axis=1).argmin()) + 1)[0])
    load = np.zeros(state.free.size)
    load[row] = 1.0
    return pairs.frequency[:4], float(inverse.solve(load)[row])


def main() -> None:
    """Print the differences of every plate."""
    parser = CommandLine(__doc__)
    parser.cases("plates", 12)
    parser.seed(1)
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    worst, seconds, stages = np.zeros(2), 0.0, 0
    for number in range(arguments.plates):
        length, height, thickness = rng.uniform([40, 25, 3], [80, 50, 6]) * MM
        left = rng.uniform(0.3, 0.9) * thickness
        turn = rng.choice([0.0, rng.uniform(0.0, 0.5) * left / length])
        size = rng.uniform(3.5, 6.0) * MM
        model = Casting([Cuboid((0, 0, 0), (length, thickness, height))], {"body": ALUMINIUM}).meshed(size)
        fresh = Casting([Cuboid((0, 0, 0), (length, left, height))], {"body": ALUMINIUM}).meshed(size)
        nodes = np.array(fresh.nodes)
        nodes[:, 1] *= 1 - turn * nodes[:, 0] / left
        fresh = replace(fresh, nodes=nodes)
        levels = np.linspace(height, 0.0, int(rng.integers(2, 6)))[1:] - 1e-9
        start = np.array([[-0.02, left + RADIUS * np.hypot(1, turn) + 0.02 * turn, z] for z in levels])
        reach = length + 0.04
        sweep = SweepTimes(split_moves(start, start + np.array([reach, -reach * turn, 0.0]), step=2 * MM),
                           (MillShape(2 * RADIUS),))
        begin = time.process_time()
        cut = CutSolid(model, model.nodes_in((-1, -1, 0), (1, 1, 0)), sweep)
        first, own = (solve(model, cut.at(stage), (0.0, 0.0, height)) for stage in (0, sweep.count))
        seconds, stages = seconds + time.process_time() - begin, stages + 2
        other = solve(fresh, CutSolid(fresh, fresh.nodes_in((-1, -1, 0), (1, 1, 0)), NOWHERE).at(0), (0.0, 0.0, height))
        gap = np.array([np.abs(own[0] / other[0] - 1).max(), abs(own[1] / other[1] - 1)])
        worst = np.maximum(worst, gap)
        print(f"{number}: {1e3 * thickness:.2f} mm to {1e3 * left:.2f}, taper {turn:.3f}, {model.element_count} elements; "
              f"first mode {first[0][0]:.0f} to {own[0][0]:.0f} Hz; frequencies within {100 * gap[0]:.3f} %, compliance "
              f"{100 * gap[1]:.3f} %", flush=True)
    print(f"frequencies within {100 * worst[0]:.2g} %, compliance within {100 * worst[1]:.2g} % of fresh meshes of what is "
          f"left, {arguments.plates} plates; {seconds / max(stages, 1):.2f} CPU s a stage")


if __name__ == "__main__":
    main()
