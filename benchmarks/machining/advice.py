"""Advice on random pockets: is the written program stable at every block by the exact engine, and how long does it take?

    python benchmarks/machining/advice.py [--pockets 20] [--seed 1]

The last line is the figure. Both runs know the tip; the second takes the written program as it is.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.program.gcode import parse
from toolpoint.io.program.rewriting import SpeedAndFeed, rewritten
from toolpoint.material_removal import Stock
from toolpoint.studies import describe_machining, modal_dynamics, run_program
from toolpoint.vibration import Modes

MM = 1e-3


def pocket_text(rng: np.random.Generator) -> str:
    """Return a rectangular pocket in rings from inside out, at one depth."""
    depth, step = rng.uniform(1.0, 3.0), rng.uniform(2.0, 6.0)
    lines = ["G21 G90", f"S{rng.uniform(8000, 16000):.0f} M3", "G0 X0 Y0 Z5", f"G1 Z-{depth:.3f} F300", "F2400"]
    for k in range(1, int(rng.integers(2, 5))):
        a, b = k * step + 4, k * step
        lines += [f"G1 X{a:.3f} Y{-b:.3f}", f"G1 Y{b:.3f}", f"G1 X{-a:.3f}", f"G1 Y{-b:.3f}", f"G1 X{a:.3f}"]
    return "\n".join([*lines, "G0 Z5", ""])


def main() -> None:
    """Print how many written programs are stable, and their times."""
    parser = CommandLine(__doc__)
    parser.cases("pockets", 20)
    parser.seed(1)
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    stable = helped = hopeless = 0
    factors = []
    for number in range(arguments.pockets):
        text = pocket_text(rng)
        modes = Modes(np.sort(rng.uniform(600, 1800, 2)), rng.uniform(0.02, 0.05, 2), np.diag(rng.uniform(1.5, 3, 2)),
                      ("tip:+x", "tip:+y"))
        cut = CuttingDescription.of(diameter=0.01, teeth=int(rng.integers(2, 5)), tangential=8e8, normal=3e8)
        setup = describe_machining(Stock.box(np.array([-40, -40, -10]) * MM, np.array([40, 40, 0]) * MM), cut, spacing=0.5 * MM)
        dynamics = modal_dynamics(modes)
        before = run_program(parse(text, start=(0, 0, 0.1)), setup, dynamics, text=text, with_advice=True)
        advice = before.advice
        written = rewritten(text, SpeedAndFeed(advice.speed, advice.feed))
        after = run_program(parse(written, start=(0, 0, 0.1)), setup, dynamics, text=written)
        promised = advice.tools[0].chatter_after == 0
        hopeless += not promised
        stable += promised and after.chatter_blocks.size == 0
        helped += before.chatter_blocks.size > 0 and after.chatter_blocks.size == 0
        factors.append(float(after.laid.time.sum() / before.laid.time.sum()))
        print(f"{number}: {before.chatter_blocks.size} blocks chatter before, {after.chatter_blocks.size} after, time x "
              f"{factors[-1]:.2f}"
              + ("" if promised else " (told that no speed helps)"), flush=True)
    print(f"{stable} of {arguments.pockets - hopeless} promised programs are stable when run as written ({helped} "
          f"chattered before; {hopeless} were "
          f"told that no speed helps); time x {np.median(factors):.2f} in the median")


if __name__ == "__main__":
    main()
