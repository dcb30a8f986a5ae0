"""Total-energy law from force records: random laws, tools and feeds; how many 95 % intervals hold, how often the law is named.

Records have 2 % noise, unknown starts of rotation, run-out where there are teeth enough to show it. The same records are
fitted by the linear-edge law first: a doubt that names the force law is wanted there, not one of the tool.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.cutting import Engagement, MillingProblem, Tool
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.cut.total_energy import TotalEnergy
from toolpoint.cutting.force.laws import rigid_forces
from toolpoint.studies import CuttingTest, calibrate
from toolpoint.vibration import Dof, Record

FEEDS = (0.04e-3, 0.08e-3, 0.12e-3, 0.2e-3)
SPEED, RATE, DEPTH = 3000.0, 10_000.0, 2e-3
RIGID = PlaneDynamics(np.zeros(0, complex), np.zeros((0, 2, 2), complex), np.zeros((2, 2)))


def records(random: np.random.Generator, tool: Tool, law: TotalEnergy) -> list[tuple[str, Record]]:
    result = []
    for feed in FEEDS:
        problem = MillingProblem(tool, Engagement.down(0.5), law.linearised(0.5 * feed), RIGID, feed_per_tooth=feed, law=law)
        angle = random.uniform(0, 2 * np.pi) + 2 * np.pi * SPEED / 60 / RATE * np.arange(4000)
        force = rigid_forces(problem, DEPTH, angle, slices=100).force
        force = force + 0.02 * np.abs(force).max() * random.standard_normal(force.shape)
        channels = tuple(Dof("tool", f"+{way}") for way in "xyz")
        result.append((f"{1e3 * feed:g} mm", Record(force, RATE, channels, ("force",) * 3)))
    return result


def main() -> None:
    parser = CommandLine(__doc__)
    parser.cases("cuts", 40)
    count = parser.parse_args().cuts
    inside, named = [], 0
    for seed in range(count):
        random = np.random.default_rng(seed)
        law = TotalEnergy(random.uniform(3e8, 2e9), random.uniform(0.1, 0.4), random.uniform(0.2, 0.7),
                          random.uniform(0.05, 0.3))
        teeth, helix = int(random.choice([1, 2, 4])), float(random.choice([0.0, 30.0]))
        offset = float(random.uniform(2e-6, 10e-6)) if teeth > 2 else 0.0
        data = records(random, Tool(0.016, teeth, helix=np.radians(helix), runout=offset, runout_angle=0.7), law)
        cut = {"diameter": 0.016, "teeth": teeth, "helix": float(np.radians(helix)), "immersion": 0.5}
        test = CuttingTest(cut, SPEED, DEPTH, FEEDS, runout=teeth > 2)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            study = calibrate(data, test)
        named += any(getattr(doubt, "what", "") == "force law" for doubt in study.doubts)
        if study.energy is None:
            continue
        truth = {"energy": law.energy, "exponent": law.exponent, "normal_ratio": law.normal_ratio,
                 "axial_ratio": law.axial_ratio}
        for name, value in truth.items():
            lower, upper = study.energy.interval[study.energy.names.index(name)]
            inside.append(lower <= value <= upper)
        print(f"{seed + 1} of {count}: {teeth} teeth, helix {helix:g}, exponent {law.exponent:.2f}: "
              f"{sum(inside)} of {len(inside)} inside, {named} named", flush=True)
    print(f"{100 * np.mean(inside):.1f} % of {len(inside)} intervals hold; the force law is named in {named} of {count}")


if __name__ == "__main__":
    main()
