"""Advice on random pockets: is the written program stable at every block by the exact engine, are the blocks nearest to their
limit stable in time domain, and is it as quick as the best constant speed and feed of a grid?

    python benchmarks/machining/advice.py [--pockets 20] [--seed 1] [--keep]

The last line is the figure. Both runs know the tip; the second takes the written program as it is. The grid goes down from 1.3
times the programmed speed to 0.4 at the programmed feed per tooth, which loads no block more than the program does, to the
first speed at which all blocks are stable: once with 10 % of depth in hand, as the advice promises, once with none.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.cutting import Engagement
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.simulation.milling import RunningCut, run_until_decided
from toolpoint.io.program.gcode import parse
from toolpoint.io.program.rewriting import SpeedAndFeed, rewritten
from toolpoint.material_removal import Stock
from toolpoint.studies import describe_machining, modal_dynamics, run_program
from toolpoint.studies.machining.advice import HAND_MARGIN, SPEED_RANGE
from toolpoint.studies.machining.result import MachiningStudy
from toolpoint.vibration import Modes

MM = 1e-3
TIMED_PLACES = 5  # of a written program, nearest to their limit, each of another line
SORTING_CLASSES = 20  # engagements by which speeds of the grid are sorted out
GRID_SPEEDS = np.linspace(*SPEED_RANGE, 19)[::-1]


def pocket_text(rng: np.random.Generator) -> str:
    """Return a rectangular pocket in rings from inside out, at one depth."""
    depth, step = rng.uniform(1.0, 3.0), rng.uniform(2.0, 6.0)
    lines = ["G21 G90", f"S{rng.uniform(8000, 16000):.0f} M3", "G0 X0 Y0 Z5", f"G1 Z-{depth:.3f} F300", "F2400"]
    for k in range(1, int(rng.integers(2, 5))):
        a, b = k * step + 4, k * step
        lines += [f"G1 X{a:.3f} Y{-b:.3f}", f"G1 Y{b:.3f}", f"G1 X{-a:.3f}", f"G1 Y{-b:.3f}", f"G1 X{a:.3f}"]
    return "\n".join([*lines, "G0 Z5", ""])


def chattering_places(study: MachiningStudy) -> tuple[int, int]:
    """Return how many of the places nearest to their limit chatter in time domain, and how many were decided."""
    chatters = decided = 0
    for m in study.judged.nearest(TIMED_PLACES).tolist():
        place, block = int(study.arcs.place[m]), int(study.judged.block[m])
        problem = study.judged.solver.problem(int(study.laid.tool[block]), int(study.judged.pose[place])).changed(
            engagement=Engagement(float(study.arcs.entry[m]), float(study.arcs.exit[m])), feed_angle=float(study.arcs.angle[m]),
            feed_per_tooth=float(study.loads.feed_per_tooth[place]))
        cut = RunningCut(problem, float(study.laid.speed[block]), float(study.arcs.depth[m]))
        answer = run_until_decided(cut, 40, 640).verdict().chatters
        decided += answer is not None
        chatters += bool(answer)
    return chatters, decided


def grid_times(study: MachiningStudy) -> list[float]:
    """Return the least times, s, of a program at one speed and the programmed feed per tooth, with 10 % of depth in hand and
    with none; not a number where no speed of the grid keeps all blocks stable.

    The engagements that remove most sort out speeds; the quickest that is left is checked on all, until one holds.
    """
    groups, programmed = study.judged.groups, float(study.laid.speed.max())
    ratio = np.full(GRID_SPEEDS.size, np.inf)
    for k in np.argsort(-groups.depth * (groups.exit - groups.entry))[:SORTING_CLASSES].tolist():
        arc = float(groups.entry[k]), float(groups.exit[k])
        chart = study.judged.solver.chart(int(groups.tool[k]), int(groups.pose[k]), arc, angle=float(groups.angle[k]),
                                          speeds=programmed * GRID_SPEEDS[::-1], depth=float(groups.depth[k]))
        ratio = np.minimum(ratio, chart.limit[::-1] / groups.depth[k])
    cutting, times = ~study.laid.path.rapid, []
    for hand in (HAND_MARGIN, 0.0):
        best = float("nan")
        for factor in GRID_SPEEDS[ratio >= 1 + hand].tolist():
            judged = study.judged.at_speeds(dict.fromkeys(study.laid.numbers, factor))
            if (judged.margins.stable & ~(judged.margins.limit < (1 + hand) * judged.arcs.depth)).all():
                best = float(study.laid.time[~cutting].sum() + study.laid.time[cutting].sum() / factor)
                break
        times.append(best)
    return times


def main() -> None:
    """Print how many written programs are stable, in time domain too, and their times beside the grid's."""
    parser = CommandLine(__doc__)
    parser.cases("pockets", 20)
    parser.seed(1)
    parser.add_argument("--keep", action="store_true", help="a speed that holds is not raised (as without --faster)")
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    stable = helped = hopeless = chattering = decided = grid_finds = 0
    ratios = []
    for number in range(arguments.pockets):
        text = pocket_text(rng)
        modes = Modes(np.sort(rng.uniform(600, 1800, 2)), rng.uniform(0.02, 0.05, 2), np.diag(rng.uniform(1.5, 3, 2)),
                      ("tip:+x", "tip:+y"))
        cut = CuttingDescription.of(diameter=0.01, teeth=int(rng.integers(2, 5)), tangential=8e8, normal=3e8)
        setup = describe_machining(Stock.box(np.array([-40, -40, -10]) * MM, np.array([40, 40, 0]) * MM), cut, spacing=0.5 * MM,
                                   raises_speed=not arguments.keep)
        dynamics = modal_dynamics(modes)
        before = run_program(parse(text, start=(0, 0, 0.1)), setup, dynamics, text=text, with_advice=True)
        advice = before.advice
        promised = advice.tools[0].chatter_after == 0
        grid = grid_times(before)
        if not promised:
            hopeless += 1
            grid_finds += np.isfinite(grid[0])
            print(f"{number}: told that no speed helps; the grid finds {'none' if np.isnan(grid[0]) else 'one'} with 10 % in "
                  f"hand, {'none' if np.isnan(grid[1]) else 'one'} without", flush=True)
            continue
        written = rewritten(text, SpeedAndFeed(advice.speed, advice.feed))
        after = run_program(parse(written, start=(0, 0, 0.1)), setup, dynamics, text=written)
        stable += after.chatter_blocks.size == 0
        helped += before.chatter_blocks.size > 0 and after.chatter_blocks.size == 0
        places = chattering_places(after)
        chattering, decided = chattering + places[0], decided + places[1]
        ratios.append(float(after.laid.time.sum()) / np.array(grid))
        print(f"{number}: {before.chatter_blocks.size} blocks chatter before, {after.chatter_blocks.size} after; in time "
              f"domain {places[0]} of {places[1]} places; time over the grid's {ratios[-1][0]:.2f} with 10 % in hand, "
              f"{ratios[-1][1]:.2f} without", flush=True)
    table = np.array(ratios).reshape(-1, 2)
    quick = (table <= 1.001).sum(axis=0)
    print(f"{stable} of {arguments.pockets - hopeless} promised programs are stable when run as written ({helped} chattered "
          f"before; {hopeless} were told that no speed helps, the grid finds one for {grid_finds}); in time domain "
          f"{chattering} of {decided} places nearest to their limit chatter; no longer than the grid's best in {quick[0]} with "
          f"the same 10 % in hand, in {quick[1]} with none (median {np.nanmedian(table[:, 0]):.2f}, "
          f"{np.nanmedian(table[:, 1]):.2f}, largest {np.nanmax(table[:, 0]):.2f}, {np.nanmax(table[:, 1]):.2f})")


if __name__ == "__main__":
    main()
