"""Verdicts on simulated cuts 3 % off the boundary: how many are wrong, how many undecided."""

from __future__ import annotations

import json
import sys
import time
import warnings
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.cutting.time_domain import random_problem
from benchmarks.frame import CommandLine
from toolpoint import ToolpointWarning
from toolpoint.cutting import MillingProblem, stability
from toolpoint.cutting.simulation.milling import ExactSteps, RunningCut, run_until_decided

STEPS, FIRST, KEPT = 20_000_000, 60, 2_000_000  # steps of a cut at most; revolutions of its first look; steps that are kept


def verdict(problem: MillingProblem, speed: float, depth: float, keeps_contact: bool) -> tuple[str, int]:
    """Return the verdict on a cut run on until it is decided, and the time steps of the last run."""
    method = ExactSteps(keeps_contact=keeps_contact)
    per_turn = method.chosen(problem, speed) * problem.tool.teeth
    run = run_until_decided(RunningCut(problem, speed, depth, method=method, kept=KEPT), FIRST,
                            STEPS // per_turn)
    return run.verdict().state, run.time.size


def random_cuts(count: int, rng: np.random.Generator, off: float) -> Counter[str]:
    """Return how many verdicts of cuts `off` inside and outside the limit were right, wrong, undecided, or subcritical.

    Subcritical: stable, but the blow of the entry has thrown the edges out of the material and the cut chatters on, while
    the same cut with its edges kept in contact is stable: a right verdict on this start.
    """
    outcomes: Counter[str] = Counter()
    while outcomes.total() < count:
        problem = random_problem(rng, int(rng.integers(1, 5))).changed(feed_per_tooth=1e-4)
        speed = float(rng.uniform(6000, 15000))
        chart = stability.chart(problem, [speed], depth_max=0.012)
        limit = float(chart.limit[0])
        if not 1e-4 < limit < 0.011:
            continue
        for expected, factor in (("stable", 1 - off), ("chatter", 1 + off)):
            if chart.stable([factor * limit])[0, 0] != (factor < 1):
                continue
            state, steps = verdict(problem, speed, factor * limit, False)
            outcome = "undecided" if state == "undecided" else "right" if state == expected else "wrong"
            if outcome == "wrong" and factor < 1 and verdict(problem, speed, factor * limit, True)[0] == "stable":
                outcome = "subcritical"
            outcomes[outcome] += 1
            if outcome != "right":
                print(f"  {outcome}: {speed:.1f} rev/min, {1e3 * factor * limit:.4f} mm, {steps} steps, {problem!r}")
    return outcomes


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.json()
    parser.cases("cuts", 1000)
    parser.add_argument("--off", type=float, default=0.03)
    parser.seed(0)
    options = parser.parse_args()
    warnings.simplefilter("ignore", ToolpointWarning)
    start = time.perf_counter()
    outcomes = random_cuts(options.cuts, np.random.default_rng(options.seed), options.off)
    results = {**{name: outcomes[name] for name in ("right", "subcritical", "undecided", "wrong")},
               "seconds": round(time.perf_counter() - start, 1)}
    print(json.dumps(results) if options.json else "\n".join(f"{name:12s} {value}" for name, value in results.items()))


if __name__ == "__main__":
    main()
