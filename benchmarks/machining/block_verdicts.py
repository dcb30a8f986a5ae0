"""Stability verdicts of random blocks, grouped as in a program, against the exact engine at each block's own arc.

    python benchmarks/machining/block_verdicts.py [--blocks 500] [--seed 1]

Each program is a set of shoulders and slots at random depths, speeds and directions on a random tip. The last line is the
figure.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.cutting import Engagement, MillingProblem, stability
from toolpoint.cutting.build import coefficients_of, tool_of
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.program.gcode import parse
from toolpoint.material_removal import Stock
from toolpoint.studies import describe_machining, modal_dynamics, run_program
from toolpoint.vibration import Modes

MM = 1e-3
BLOCKS_PER_PROGRAM = 25


def random_text(rng: np.random.Generator) -> str:
    """Return a program of shoulders, each at its own depth, direction and speed, 14 mm apart."""
    lines = ["G21 G90"]
    for k in range(BLOCKS_PER_PROGRAM):
        y, depth = 14.0 * k, rng.uniform(0.1, 2.0)
        a, b = (-8, 40) if rng.random() < 0.5 else (40, -8)
        lines += [f"S{rng.uniform(6000, 18000):.0f}", "G0 Z5", f"G0 X{a} Y{y:.3f}", f"G0 Z-{depth:.3f}",
                  f"G1 X{b} Y{y + rng.uniform(-2, 2):.3f} F2000"]
    return "\n".join([*lines, "G0 Z5"])


def main() -> None:
    """Print how many verdicts agree."""
    parser = CommandLine(__doc__)
    parser.cases("blocks", 500)
    parser.seed(1)
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    agreed = judged = wrong_near = 0
    seconds, solved = 0.0, 0
    for _ in range(-(-arguments.blocks // BLOCKS_PER_PROGRAM)):
        text = random_text(rng)
        f = rng.uniform(500, 1800, 2)
        modes = Modes(np.sort(f), rng.uniform(0.01, 0.04, 2), np.diag(rng.uniform(1.5, 4, 2)), ("tip:+x", "tip:+y"))
        cut = CuttingDescription.of(diameter=0.01, teeth=int(rng.integers(2, 5)), tangential=8e8, normal=3e8)
        stock = Stock.box(np.array([0, -5, -10]) * MM, np.array([32, 14 * BLOCKS_PER_PROGRAM, 0]) * MM)
        setup, dynamics = describe_machining(stock, cut, spacing=0.5 * MM), modal_dynamics(modes)
        begin = time.process_time()
        result = run_program(parse(text, start=(0, 0, 0.1)), setup, dynamics, text=text)
        seconds, solved = seconds + time.process_time() - begin, solved + result.solutions
        arcs, margins = result.arcs, result.margins
        block = result.laid.moves.block[result.removed.piece[arcs.place]]
        for k in np.unique(block):
            m = int(rng.choice(np.flatnonzero(block == k)))
            problem = MillingProblem(tool_of(cut), Engagement(float(arcs.entry[m]), float(arcs.exit[m])),
                                     coefficients_of(setup.cut), dynamics.response, "tip:+x", "tip:+y",
                                     feed_angle=float(arcs.angle[m]))
            chart = stability.chart(problem, result.laid.speed[k:k + 1], depth_max=max(4 * float(arcs.depth[m]), 1e-3))
            same = bool(chart.stable(arcs.depth[m:m + 1])[0, 0]) == bool(margins.stable[m])
            judged, agreed = judged + 1, agreed + same
            wrong_near += not same and abs(chart.limit[0] / arcs.depth[m] - 1) < 0.03
        print(f"{agreed} of {judged}", flush=True)
    print(f"{agreed} of {judged} verdicts agree with the exact engine at the block's own arc "
          f"({judged - agreed - wrong_near} of the others are "
          f"beyond 3 % of the limit); {solved} solutions, {seconds:.0f} CPU s in all")


if __name__ == "__main__":
    main()
