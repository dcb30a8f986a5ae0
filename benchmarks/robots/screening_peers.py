"""Sobol indices of a robot's first frequency beside those of SALib: the same number of variants, the same model.

Our points and `scipy.stats`' estimator against SALib's points and estimator (PYTHONPATH must hold SALib), both against a large
sample. Printed last: the largest error of both, in shares of the variance.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import MACHINE_TEMPLATES, CommandLine, import_peer
from toolpoint.io import read_machine
from toolpoint.studies import Factor, NamedMetrics, rank_changes
from toolpoint.studies.screening.designs import given_points, sobol_pairs
from toolpoint.studies.screening.fast import screen_frequencies
from toolpoint.studies.screening.screen import Screening, screen


def indices(result: Screening) -> np.ndarray:
    """Return main and total effects, (2, n)."""
    effects = {effect.name: effect for effect in rank_changes(result).effects}
    return np.array([[effects[name].value, effects[name].total] for name in result.design.names]).T


def main() -> None:
    """Print indices, errors and times."""
    parser = CommandLine(__doc__)
    parser.add_argument("--number", type=int, default=512)
    parser.add_argument("--large", type=int, default=16384)
    options = parser.parse_args()
    robot = read_machine(MACHINE_TEMPLATES / "elastic_robot.yaml")
    changes = [Factor(f"torsion {i}", (f"joints.joint_q{i}.stiffness.rz",), 0.5, 2.0) for i in (1, 2, 3)]
    changes.append(Factor("payload", ("bodies.link6.mass",), 0.5, 2.0))
    rng = np.random.default_rng(0)
    large = sobol_pairs(changes, options.large, rng)
    values = screen_frequencies(robot, large, 1)[:, 0]
    truth = indices_of(values, len(changes))
    start = time.process_time()
    ours = indices(screen(robot, sobol_pairs(changes, options.number, rng), NamedMetrics(("frequency 1",))))
    seconds = time.process_time() - start
    names = [change.name for change in changes]
    print(f"{'':12}" + "  ".join(f"{name:>12}" for name in names))
    for what, row in (("large main", truth[0]), ("large total", truth[1]), ("ours main", ours[0]), ("ours total", ours[1])):
        print(f"{what:12}" + "  ".join(f"{v:12.4f}" for v in row))
    errors = {"ours": np.abs(ours - truth).max()}
    analyse, sample = import_peer("SALib.analyze.sobol"), import_peer("SALib.sample.sobol")
    if analyse is not None:
        problem = {"num_vars": len(changes), "names": names, "bounds": [[0.0, 1.0]] * len(changes)}
        start = time.process_time()
        points = sample.sample(problem, options.number, calc_second_order=False, seed=1)
        answers = screen(robot, given_points(changes, points), NamedMetrics(("frequency 1",))).metric("frequency 1")[0]
        found = analyse.analyze(problem, answers, calc_second_order=False, seed=1)
        peer = np.array([found["S1"], found["ST"]])
        print(f"{'SALib main':12}" + "  ".join(f"{v:12.4f}" for v in peer[0]))
        print(f"{'SALib total':12}" + "  ".join(f"{v:12.4f}" for v in peer[1]))
        print(f"CPU s: ours {seconds:.2f}, SALib's points in the same screening {time.process_time() - start:.2f}; "
              f"{len(points)} variants each")
        errors["SALib"] = np.abs(peer - truth).max()
    print("largest error of an index with", options.number, "base points:",
          ", ".join(f"{name} {error:.4f}" for name, error in errors.items()))


def indices_of(values: np.ndarray, count: int) -> np.ndarray:
    """Return main and total effects of answers at the points of `sobol_pairs`, by scipy, (2, n)."""
    from scipy.stats import sobol_indices

    parts = values.reshape(count + 2, -1)
    result = sobol_indices(func={"f_A": parts[0][None], "f_B": parts[1][None], "f_AB": parts[2:, None, :]}, n=parts.shape[1])
    return np.array([np.ravel(result.first_order), np.ravel(result.total_order)])


if __name__ == "__main__":
    main()
