"""Bands of depths that lie between the search levels: the verdicts of a chart against those of one with many more levels.

Helical tools at low immersion and depths of one to five axial pitches, where stable bands are narrow and come back.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.cutting import CuttingCoefficients, Engagement, HillDeterminant, MillingProblem, PanelArnoldi, Tool, stability
from toolpoint.cutting.stability.levels import axial_pitch
from toolpoint.vibration import Modes

ENGINES = {"panels": PanelArnoldi, "hill": HillDeterminant}
DIAMETER = 0.010


def random_cut(rng: np.random.Generator) -> tuple[MillingProblem, float, float]:
    """A cut with one or two modes, a speed near a tooth frequency that excites the first, and a depth."""
    number = int(rng.integers(1, 3))
    hertz = np.sort(rng.uniform(300, 2000, number))
    damping, stiffness = rng.uniform(0.003, 0.03, number), 5e6 * rng.uniform(0.4, 6, number)
    angle = rng.uniform(0, np.pi, number)
    shapes = 2 * np.pi * hertz / np.sqrt(stiffness) * np.stack([np.cos(angle), np.sin(angle)])
    tool = Tool(DIAMETER, int(rng.integers(1, 6)), helix=np.radians(rng.choice([45.0, rng.uniform(30, 55)])))
    immersion = float(rng.choice([0.05, rng.uniform(0.02, 0.15)]))
    arc = Engagement.down(immersion) if rng.random() < 0.5 else Engagement.up(immersion)
    tangential = rng.uniform(4e8, 1.5e9)
    problem = MillingProblem(tool, arc, CuttingCoefficients(tangential, tangential * rng.uniform(0.1, 0.5)),
                             Modes(hertz, damping, shapes, ("t:+x", "t:+y")), feed_per_tooth=1e-4)
    speed = 60 * hertz[0] / tool.teeth / int(rng.integers(1, 5)) * rng.uniform(0.9, 2.2)
    return problem, float(np.clip(speed, 1500, 40000)), rng.uniform(1, 5) * axial_pitch(problem)


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.cases("cuts", 1000)
    parser.seed(0)
    parser.add_argument("--levels", type=int, default=120, help="of the chart beside")
    parser.add_argument("--engine", choices=ENGINES, default="panels")
    options = parser.parse_args()
    rng, engine = np.random.default_rng(options.seed), ENGINES[options.engine]
    missed, unsafe, seconds = 0, 0, np.zeros(2)
    for _ in range(options.cuts):
        problem, speed, depth_max = random_cut(rng)
        depths, verdicts = np.linspace(0, depth_max, 4001)[1:], []
        for k, method in enumerate((engine(), engine(levels=options.levels))):
            began = time.process_time()
            verdicts.append(stability.chart(problem, [speed], method, depth_max=depth_max).stable(depths).ravel())
            seconds[k] += time.process_time() - began
        differ = verdicts[0] != verdicts[1]
        if differ.sum() > 2:  # two points: the same root to the digits of its error
            missed, unsafe = missed + 1, unsafe + int(verdicts[0][differ].any())
            at = 1e3 * depths[differ]
            print(f"  {speed:.1f} rev/min, {at[0]:.3f} to {at[-1]:.3f} of {1e3 * depth_max:.1f} mm: {problem!r}")
    print(f"CPU seconds a chart {seconds[0] / options.cuts:.4f}, with {options.levels} levels {seconds[1] / options.cuts:.4f}")
    print(f"a band missed in {missed} of {options.cuts} cuts, called stable where it is not in {unsafe}")


if __name__ == "__main__":
    main()
