"""100 000 blocks of finishing with a ball: processor time of engagement and forces, memory, and the growth with the blocks.

    python benchmarks/machining/long_program.py [--blocks 100000]

The last line is the figure.
"""

from __future__ import annotations

import resource
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.cutting.description import CuttingDescription
from toolpoint.drives.program.path import Path as ToolPath
from toolpoint.drives.program.path import polyline
from toolpoint.material_removal import RemovalSettings, Stock, remove_material
from toolpoint.studies import describe_machining
from toolpoint.studies.machining.loads import place_loads
from toolpoint.studies.machining.program_path import lay_program

MM = 1e-3
CUT = CuttingDescription.of(diameter=6 * MM, teeth=2, corner_radius=3 * MM, helix=np.radians(30), tangential=8e8, normal=3e8)


class Finishing:
    """A wavy surface in lines of 0.5 mm, 0.3 mm apart, as a reader would give it."""

    def __init__(self, blocks: int) -> None:
        per_line, self.length = 200, 0.1
        lines = max(blocks // per_line, 1)
        x = np.linspace(0, self.length, per_line + 1)
        rows = []
        for k in range(lines):
            along = x if k % 2 == 0 else x[::-1]
            y = 0.3 * MM * k
            rows.append(np.stack([along, np.full(x.size, y), -2 * MM + 1.5 * MM * np.sin(along / 8e-3) * np.cos(y / 9e-3)],
                                 axis=1))
        self.width = 0.3 * MM * lines
        self.path: ToolPath = polyline(np.concatenate(rows), feed=0.05)
        self.speed, self.tool, self.notes = np.full(self.path.count, 15000.0), np.ones(self.path.count, int), ()


def run(blocks: int, spacing: float) -> tuple[float, float]:
    """Return the processor time (s) of laying, removal and forces, and the number of places."""
    program = Finishing(blocks)
    stock = Stock.box(np.array([-2 * MM, -2 * MM, -20 * MM]), np.array([0.102, program.width + 2 * MM, 0.3 * MM]))
    setup = describe_machining(stock, CUT, spacing=spacing)
    begin = time.process_time()
    laid = lay_program(program, setup)
    removed = remove_material(laid.moves, stock, [setup.shape_of(1)], settings=RemovalSettings(spacing))
    place_loads(removed, laid, setup)
    return time.process_time() - begin, float(removed.piece.size)


def main() -> None:
    """Print the times."""
    parser = CommandLine(__doc__)
    parser.cases("blocks", 100_000)
    blocks = parser.parse_args().blocks
    run(400, 0.3 * MM)  # compiles
    times = {}
    for count in (blocks // 10, blocks // 2, blocks):
        times[count], places = run(count, 0.15 * MM)
        print(f"{count} blocks, {places:.0f} places: {times[count]:.1f} s", flush=True)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    growth = np.polyfit(np.log(list(times)), np.log(list(times.values())), 1)[0]
    print(f"{times[blocks]:.0f} CPU s for {blocks} blocks (engagement and forces), {memory:.2f} GB, time grows with "
          f"blocks^{growth:.2f}")


if __name__ == "__main__":
    main()
