"""`improve` on random machines: the promised goal against the full model, and the best single change of equal cost.

Machines are the elastic robot with random springs, masses and poses. Prints one line a machine; the last line is the figure.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import MACHINE_TEMPLATES, CommandLine
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io import read_machine
from toolpoint.machine.description.variation import Factor
from toolpoint.studies.screening.answers import DepthLimit, ResponsePeak
from toolpoint.studies.screening.improve import improve

CUT = CuttingDescription.of(diameter=0.02, teeth=4, tangential=8e8, normal=3e8, direction="down", immersion=0.5,
                            feed_per_tooth=1e-4)


def main() -> None:
    """Print how many goals are met and by how much the nearest single change falls behind."""
    parser = CommandLine(__doc__)
    parser.cases("machines", 50)
    count = parser.parse_args().machines
    robot = read_machine(MACHINE_TEMPLATES / "elastic_robot.yaml")
    met, ahead, worst = 0, 0, 0.0
    for seed in range(count):
        rng = np.random.default_rng(seed)
        values = {f"joints.joint_q{i}.stiffness.{way}": robot.value(f"joints.joint_q{i}.stiffness.{way}") * rng.uniform(0.5, 2)
                  for i in range(1, 7) for way in ("rx", "ry", "rz")}
        machine = robot.with_values(values)
        pose = {f"q{i}": float(rng.uniform(-1, 1)) for i in range(1, 7)}
        factors = [Factor(f"torsion {i}", (f"joints.joint_q{i}.stiffness.rz",), 1.0, 2.0, cost=float(rng.uniform(0.5, 2)))
                   for i in range(1, 7)] + [Factor(f"bending {i}", (f"joints.joint_q{i}.stiffness.rx",
                                                                    f"joints.joint_q{i}.stiffness.ry"),
                                                   1.0, 2.0, cost=float(rng.uniform(0.5, 2))) for i in range(1, 7)]
        answer = (ResponsePeak(static=True), ResponsePeak(), DepthLimit(CUT))[seed % 3]
        # As far as the ranges go.
        first = improve(machine, factors, answer, goal=1e-30 if not answer.rises else 1e6, poses=[pose])
        goal = first.start_value * (first.value / first.start_value) ** 0.5
        result = improve(machine, factors, answer, goal=goal, poses=[pose])
        good = result.value >= goal if answer.rises else result.value <= goal
        sense = 1 if answer.rises else -1
        behind = sense * (result.value - result.best_single[1]) / result.value
        met += good
        ahead += behind >= -3e-4
        worst = min(worst, behind)
        print(f"{seed:3d} {answer.name:18s} {result.start_value:.4g} -> {goal:.4g}: {result.value:.5g}, cost "
              f"{result.cost:.3f}, "
              f"{len(result.changes())} changes, single {result.best_single[1]:.5g}, affine error {result.error:.1e}",
              flush=True)
    print(f"{met} of {count} goals met by the full model; in {ahead} no single change of equal cost does better (least lead "
          f"{worst:.1e})")


if __name__ == "__main__":
    main()
