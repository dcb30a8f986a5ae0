"""100 000 blocks of finishing with a ball: processor time of engagement and forces, memory, and the growth with the blocks;
then that of the stability of its distinct engagements on a tip with two modes a direction.

    python benchmarks/machining/long_program.py [--blocks 100000] [--without-stability]

The last two lines are the figures.
"""

from __future__ import annotations

import resource
import sys
import time
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.cutting.description import CuttingDescription
from toolpoint.drives.program.path import Path as ToolPath
from toolpoint.drives.program.path import polyline
from toolpoint.material_removal import RemovalSettings, RemovedMaterial, Stock, remove_material
from toolpoint.studies import describe_machining, modal_dynamics
from toolpoint.studies.machining.engagement_classes import arcs_of_places, group_places
from toolpoint.studies.machining.loads import place_loads
from toolpoint.studies.machining.margins import place_margins
from toolpoint.studies.machining.program_path import ProgramPath, lay_program
from toolpoint.studies.machining.setup import MachiningSetup
from toolpoint.studies.machining.solver import StabilitySolver
from toolpoint.vibration import Modes

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


def run(blocks: int, spacing: float) -> tuple[float, float, Case]:
    """Return the processor time (s) of laying, removal and forces, the number of places, and the case."""
    program = Finishing(blocks)
    stock = Stock.box(np.array([-2 * MM, -2 * MM, -20 * MM]), np.array([0.102, program.width + 2 * MM, 0.3 * MM]))
    setup = describe_machining(stock, CUT, spacing=spacing)
    begin = time.process_time()
    laid = lay_program(program, setup)
    removed = remove_material(laid.moves, stock, [setup.shape_of(1)], settings=RemovalSettings(spacing))
    place_loads(removed, laid, setup)
    return time.process_time() - begin, float(removed.piece.size), Case(setup, laid, removed)


@dataclass(frozen=True)
class Case:
    """Program that was laid and cut."""

    setup: MachiningSetup
    laid: ProgramPath
    removed: RemovedMaterial


def judge(case: Case) -> tuple[float, str]:
    """Return the processor time (s) of stability at every place, and what was solved."""
    modes = Modes([700.0, 900.0, 1600.0, 1750.0], [0.03, 0.03, 0.02, 0.02],
                  [[1.5, 0, 2.5, 0], [0, 1.4, 0, 2.4]], ("tip:+x", "tip:+y"))
    solver = StabilitySolver(case.setup, [modal_dynamics(modes)])
    begin = time.process_time()
    arcs, pose = arcs_of_places(case.removed), np.zeros(case.removed.piece.size, int)
    groups = group_places(arcs, case.laid, case.removed.piece, pose=pose, isotropic=solver.is_isotropic)
    margins = place_margins(arcs, groups, case.laid, piece=case.removed.piece, solver=solver, pose=pose)
    return time.process_time() - begin, f"{groups.count} distinct engagements, {margins.solutions} solved"


def main() -> None:
    """Print the times."""
    parser = CommandLine(__doc__)
    parser.cases("blocks", 100_000)
    parser.add_argument("--without-stability", action="store_true", help="engagement and forces alone")
    arguments = parser.parse_args()
    blocks = arguments.blocks
    _, _, case = run(400, 0.3 * MM)  # compiles
    if not arguments.without_stability:
        judge(case)
    times = {}
    for count in (blocks // 10, blocks // 2, blocks):
        times[count], places, case = run(count, 0.15 * MM)
        print(f"{count} blocks, {places:.0f} places: {times[count]:.1f} s", flush=True)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    growth = np.polyfit(np.log(list(times)), np.log(list(times.values())), 1)[0]
    print(f"{times[blocks]:.0f} CPU s for {blocks} blocks (engagement and forces), {memory:.2f} GB, time grows with "
          f"blocks^{growth:.2f}", flush=True)
    if not arguments.without_stability:
        seconds, words = judge(case)
        print(f"{seconds:.0f} CPU s for the stability of {blocks} blocks: {words}; "
              f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6:.2f} GB")


if __name__ == "__main__":
    main()
