"""First losses of stability overlooked: the search for the first loss alone against counts, random machines, low speeds.

Machines of 2 to 14 modes over two octaves in any direction of the plane, slow enough that a tooth period lasts up to a dozen of
their vibrations; half of the tools are helical; the search goes 1 to 100 times as deep as the softest mode alone would ask for.
Beside it a chart of many levels that ends just above the limit found: straight tools by the counts of FloquetDeterminant,
helical ones by those of HillDeterminant (which no band of a level's width escapes). The last line is the share of cuts whose
first loss was overlooked (a limit more than 0.5 % too high).
"""

from __future__ import annotations

import sys
import time
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.cutting import (
    CuttingCoefficients,
    Engagement,
    FloquetDeterminant,
    HillDeterminant,
    MillingProblem,
    PanelArnoldi,
    Tool,
    stability,
)
from toolpoint.cutting.stability.automatic import Automatic
from toolpoint.studies.machines.tool_point import depth_limit
from toolpoint.vibration import Modes

METHODS = {"first": PanelArnoldi(first_only=True), "panels": PanelArnoldi(), "auto": Automatic()}
MARGIN = 1.02  # of the limit found: depth of the chart beside
OVERLOOKED = 0.005  # relative


def random_cut(rng: np.random.Generator) -> tuple[MillingProblem, float, float]:
    """Return a cut, a speed in rev/min and a depth to search to, m."""
    number = int(rng.integers(2, 15))
    hertz = np.sort(rng.uniform(30, 60) * 2 ** rng.uniform(0, rng.uniform(1, 4), number))
    damping, stiffness = rng.uniform(0.005, 0.05, number), 1e7 * 10 ** rng.uniform(0, 1.5, number)
    angle = rng.uniform(0, np.pi, number)
    shapes = 2 * np.pi * hertz / np.sqrt(stiffness) * np.stack([np.cos(angle), np.sin(angle)])
    tool = Tool(0.05, int(rng.integers(2, 7)), helix=np.radians(rng.uniform(10, 50)) if rng.random() < 0.5 else 0.0)
    arc = (Engagement.down if rng.random() < 0.5 else Engagement.up)(float(rng.uniform(0.05, 1.0)))
    tangential = rng.uniform(5e8, 2.5e9)
    problem = MillingProblem(tool, arc, CuttingCoefficients(tangential, tangential * rng.uniform(0.1, 0.6)),
                             Modes(hertz, damping, shapes, ("t:+x", "t:+y")), feed_per_tooth=1e-4)
    speed = 60 * hertz[-1] / tool.teeth / rng.uniform(0.7, 12)
    return problem, float(speed), min(depth_limit(problem) * 10 ** rng.uniform(0, 2), 0.3)


def limit_of(problem: MillingProblem, speed: float, method, depth: float) -> float:
    """Return the first loss of stability, m; the searched depth where there is none."""
    return float(min(stability.chart(problem, [speed], method, depth_max=depth).limit[0], depth))


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.cases("cuts", 300)
    parser.seed(0)
    parser.add_argument("--method", choices=METHODS, default="first")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    missed, seconds = 0, np.zeros(2)
    for number in range(options.cuts):
        problem, speed, depth = random_cut(np.random.default_rng([options.seed, number]))
        begin = time.process_time()
        limit = limit_of(problem, speed, METHODS[options.method], depth)
        middle = time.process_time()
        beside = HillDeterminant() if problem.tool.has_helix else FloquetDeterminant(levels=150)
        truth = limit_of(problem, speed, beside, MARGIN * limit)
        seconds += (middle - begin, time.process_time() - middle)
        if limit > truth * (1 + OVERLOOKED):
            missed += 1
            print(f"  {number}: {1e3 * limit:.4g} mm for {1e3 * truth:.4g} at {speed:.1f} rev/min, to {1e3 * depth:.3g} mm: "
                  f"{problem!r}", flush=True)
    print(f"CPU seconds a cut {seconds[0] / options.cuts:.3f}, beside {seconds[1] / options.cuts:.3f}")
    print(f"a first loss overlooked in {missed} of {options.cuts} cuts")


if __name__ == "__main__":
    main()
