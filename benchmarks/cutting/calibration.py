"""Calibration: coverage of the 95 % intervals over simulated dynamometer records (five feeds, noise 2 %, run-out)."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint import Modes
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool
from toolpoint.cutting.force.calibration import instantaneous
from toolpoint.cutting.force.laws import rigid_forces


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.cases("runs", 200)
    parser.json()
    options = parser.parse_args()
    material = CuttingCoefficients(767e6, 168.8e6, 222e6, 27.7e3, 26.6e3, 0.7e3)
    tool = Tool(0.016, 4, helix=np.radians(30), runout=12e-6, runout_angle=0.7)
    modes = Modes([900.0], [0.02], [[1.0]], ("tool:+x",))
    problem = MillingProblem(tool, Engagement.slot(), material, modes)
    feeds = np.array([0.04, 0.08, 0.12, 0.16, 0.2]) * 1e-3
    turn = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    clean = np.array([rigid_forces(problem.changed(feed_per_tooth=f), 2e-3, turn, slices=10).force for f in feeds])
    truth = np.concatenate([material.cutting, material.edge, [12e-6, 0.7]])
    start = problem.changed(tool=tool.with_runout(0.0))
    rng, held, begin = np.random.default_rng(0), [], time.perf_counter()
    for _ in range(options.runs):
        noisy = clean + 0.02 * np.abs(clean).max() * rng.standard_normal(clean.shape)
        fit = instantaneous(start, feeds, turn, forces=noisy, depth=2e-3, slices=10)
        held.append((fit.interval[:, 0] <= truth) & (truth <= fit.interval[:, 1]))
    share = np.mean(held, axis=0)
    rows = {**dict(zip(fit.names, share.tolist())), "all": float(np.mean(held)),
            "seconds a fit": (time.perf_counter() - begin) / options.runs}
    if options.json:
        print(json.dumps(rows))
        return
    for name, value in rows.items():
        print(f"{name:<20}{value:.4g}")
    print(f"95 % intervals hold the truth in {100 * rows['all']:.1f} % (target 93-97 %)")


if __name__ == "__main__":
    main()
