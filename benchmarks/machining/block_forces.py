"""Forces and verdicts of random blocks against the time-domain engine: peak and mean forces with a rigid tip, verdicts with one
that chatters.

    python benchmarks/machining/block_forces.py [--blocks 50] [--seed 1]

The last line is the figure.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.cutting import Engagement, MillingProblem
from toolpoint.cutting.build import coefficients_of, tool_of
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.simulation.milling import RunningCut, run_until_decided, simulate
from toolpoint.io.program.gcode import parse
from toolpoint.material_removal import Stock
from toolpoint.studies import describe_machining, modal_dynamics, run_program
from toolpoint.vibration import Modes

MM = 1e-3
NEAR_RATIO = 0.03  # of the depth: verdicts nearer to a boundary are not counted
CUT = {"diameter": 0.01, "tangential": 8e8, "normal": 3e8, "edge_tangential": 1.5e4, "edge_normal": 1e4}
STOCK = Stock.box(np.array([0, 0, -20]) * MM, np.array([40, 60, 0]) * MM)


def force_program(rng: np.random.Generator, kind: str) -> str:
    """Return a cut whose arc is constant in its middle: a slot, a shoulder beside it, the inner corner of a pocket."""
    depth, feed = rng.uniform(0.5, 4), rng.integers(6, 30) * 100
    if kind == "slot":
        return f"S9000\nG0 X-7 Y30 Z-{depth:.3f}\nG1 X47 F{feed}"
    if kind == "shoulder":
        return (f"S9000\nG0 X-7 Y30 Z-{depth:.3f}\nG1 X47 F900\nG0 Z5\nX-7 Y{30 + rng.uniform(1, 8):.3f}\nZ-{depth:.3f}\n"
                f"G1 X47 F{feed}")
    radius = rng.uniform(3, 9)  # of the tool's centre; then once more, wider
    return (f"S9000\nG0 X{20 + radius:.3f} Y30 Z5\nG1 Z-{depth:.3f} F300\nG3 X{20 + radius:.3f} Y30 I-{radius:.3f} J0 F900\n"
            f"G1 X{21 + radius:.3f} F300\nG3 X{21 + radius:.3f} Y30 I-{radius + 1:.3f} J0 F{feed}")


def force_errors(rng: np.random.Generator, count: int) -> np.ndarray:
    """Return relative differences of the largest force and of the mean force, (count, 2)."""
    rigid = Modes([2e4, 2e4], [0.05, 0.05], np.diag([1e-3, 1e-3]), ("tip:+x", "tip:+y"))
    errors = []
    for n in range(count):
        kind = ("slot", "shoulder", "corner", "ball")[n % 4]
        described = CuttingDescription.of(**CUT, teeth=int(rng.integers(2, 5)), helix=float(rng.uniform(0.2, 0.7)),
                                          flute_length=0.03, corner_radius=0.005 if kind == "ball" else 0.0)
        setup = describe_machining(STOCK, described, spacing=0.4 * MM)
        result = run_program(parse(force_program(rng, "slot" if kind == "ball" else kind), start=(0, 0, 0.1)), setup)
        block = result.laid.moves.block[result.removed.piece[result.arcs.place]]
        places = np.flatnonzero(block == block.max())
        m = int(places[places.size // 2])
        place = int(result.arcs.place[m])
        feed = float(result.loads.feed_per_tooth[place])
        problem = MillingProblem(tool_of(described), Engagement(float(result.arcs.entry[m]), float(result.arcs.exit[m])),
                                 coefficients_of(described), rigid, "tip:+x", "tip:+y", feed_per_tooth=feed)
        run = simulate(problem, 9000.0, float(result.removed.depth[place]), revolutions=6)
        force = run.force[run.force.shape[0] // 2:]
        peak, mean = float(np.hypot(force[:, 0], force[:, 1]).max()), np.linalg.norm(force[:, :2].mean(axis=0))
        errors.append((result.loads.lateral[place] / peak - 1, np.linalg.norm(result.loads.force[place, :2]) / mean - 1))
        print(kind, f"{100 * errors[-1][0]:+.2f} % {100 * errors[-1][1]:+.2f} %", flush=True)
    return np.array(errors)


def verdict_program(rng: np.random.Generator) -> str:
    """Return ten shoulders and slots at their own speeds and depths."""
    lines = []
    for k in range(10):
        lines += [f"S{rng.integers(50, 160) * 100}", "G0 Z5", f"G0 X-8 Y{14 * k}", f"Z-{rng.uniform(0.2, 2.5):.3f}",
                  "G1 X40 F2000", "G0 Z5", f"G0 X-8 Y{14 * k + rng.uniform(1, 5):.3f}", f"Z-{rng.uniform(0.2, 2.5):.3f}",
                  "G1 X40 F2000"]
    return "\n".join([*lines, "G0 Z5"])


def verdicts(rng: np.random.Generator, count: int) -> tuple[int, int, int, int]:
    """Return blocks that agree, that are judged by both, undecided ones, and those nearer than 3 % to a boundary."""
    agree = judged = undecided = near = 0
    while judged < count:
        modes = Modes(np.sort(rng.uniform(500, 1800, 2)), rng.uniform(0.02, 0.05, 2), np.diag(rng.uniform(1.5, 4, 2)),
                      ("tip:+x", "tip:+y"))
        described = CuttingDescription.of(diameter=0.01, teeth=int(rng.integers(2, 5)), tangential=8e8, normal=3e8)
        stock = Stock.box(np.array([0, -8, -10]) * MM, np.array([32, 150, 0]) * MM)
        result = run_program(parse(verdict_program(rng), start=(0, 0, 0.1)),
                             describe_machining(stock, described, spacing=0.5 * MM), modal_dynamics(modes))
        arcs, margins = result.arcs, result.margins
        block = result.laid.moves.block[result.removed.piece[arcs.place]]
        for k in np.unique(block):
            places = np.flatnonzero(block == k)
            m = int(places[places.size // 2])
            if abs(margins.limit[m] / arcs.depth[m] - 1) < NEAR_RATIO:
                near += 1
                continue
            speed = float(result.laid.speed[k])
            problem = MillingProblem(tool_of(described), Engagement(float(arcs.entry[m]), float(arcs.exit[m])),
                                     coefficients_of(described), modes, "tip:+x", "tip:+y", feed_angle=float(arcs.angle[m]),
                                     feed_per_tooth=float(result.loads.feed_per_tooth[arcs.place[m]]))
            chatters = run_until_decided(RunningCut(problem, speed, float(arcs.depth[m])), 40, 640).verdict().chatters
            undecided += chatters is None
            if chatters is not None:
                judged += 1
                agree += chatters is not bool(margins.stable[m])
                if chatters is bool(margins.stable[m]):
                    print("differs:", speed, arcs.depth[m], margins.limit[m], np.degrees([arcs.entry[m], arcs.exit[m]]),
                          flush=True)
    return agree, judged, undecided, near


def main() -> None:
    """Print how forces and verdicts agree."""
    parser = CommandLine(__doc__)
    parser.cases("blocks", 50)
    parser.seed(1)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    errors = np.abs(force_errors(rng, options.blocks))
    agree, judged, undecided, near = verdicts(rng, options.blocks)
    print(f"largest force within {100 * errors[:, 0].max():.2f} % (median {100 * np.median(errors[:, 0]):.2f}), mean force "
          f"within {100 * errors[:, 1].max():.2f} % of the time domain in {len(errors)} cuts; verdicts {agree} of {judged} "
          f"beyond 3 % of a boundary ({near} nearer, {undecided} undecided)")


if __name__ == "__main__":
    main()
