"""Correlation of a test with a machine as a user does it: points in another frame, mirrored, in mm; another machine.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/updating/correlation.py [--seeds 20]

The random machines of benchmarks/joint_identification/joint_machines.py with measured points on their bodies as named points;
the test holds a share of them (other names, permuted), 2 mm off, in a frame turned and shifted at random, and modes with 2 %
noise. Right: every point is paired with its own. The last line is the figure.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.frame import CommandLine
from benchmarks.joint_identification.joint_machines import random_case
from toolpoint.machine import assemble
from toolpoint.machine.description import parameters
from toolpoint.machine.pose.named_points import point_positions
from toolpoint.studies.measured.measured_comparison import MeasuredTest, compare_with_test
from toolpoint.studies.measured.model_correlation import with_measured_points
from toolpoint.vibration import Dof, Modes, eigen
from toolpoint.vibration.geometry import Geometry

CASES = ("same frame", "turned", "turned, six points", "four points", "on a line", "mirrored", "mm as m", "a symmetric machine",
         "another machine", "sensors turned")


def trial(seed: int, case: str) -> tuple[str, list[str], float]:
    """Return whether points are right, wrong or refused, the doubts, and the least MAC of a pair."""
    rng = np.random.default_rng(seed + 77)
    random = random_case(seed)
    machine = with_measured_points(random.machine, random.points.coordinates, random.points.components)
    places = point_positions(machine)
    names = [str(n) for n in random.points.coordinates]
    used = list(rng.permutation(names)[:{"turned, six points": 6, "four points": 4, "on a line": 5}.get(case, 25)])
    if case == "a symmetric machine":  # only the four corners of a block, alike from several sides
        corners = np.array([(x, y, z) for x in (-0.2, 0.2) for y in (-0.2, 0.2) for z in (0.3, 0.7)])
        owner = next(iter(random.points.components))
        used = [f"c{k}" for k in range(8)]
        machine = with_measured_points(random.machine, dict(zip(used, corners, strict=True)), {owner: used})
        machine = machine.rebuild(type(machine.description)(**{**vars(machine.description), "points": {
            k: v for k, v in machine.description.points.items() if k in used or k in ("tool", "table")}}))
        places = point_positions(machine)
    rotation = np.eye(3) if case == "same frame" else Rotation.random(random_state=int(seed)).as_matrix()
    shift = np.zeros(3) if case == "same frame" else rng.normal(size=3)
    labels = [Dof(name, f"axis {k}", tuple(rotation[:, k])) for name in used for k in range(3)]
    tested = machine
    if case == "another machine":
        values = {p: machine.value(p) * float(np.exp(1.5 * rng.normal())) for p in parameters(machine.description)
                  if ".stiffness." in p}
        tested = machine.with_values(values)
    modes = eigen.solve_undamped(assemble(tested, outputs=labels), 6)
    shape = modes.shape + 0.02 * np.abs(modes.shape).max(axis=0) * rng.normal(size=modes.shape.shape)
    numbers = {name: int(k) + 1 for name, k in zip(used, rng.permutation(len(used)), strict=True)}
    if case == "sensors turned":
        shape[:3] *= -1
    dofs = tuple(Dof(numbers[str(d.point)], "+" + "xyz"[int(d.direction[-1])]) for d in labels)
    at = {numbers[n]: rotation.T @ (places[n] - shift) + 0.002 / np.sqrt(3) * rng.normal(size=3) for n in used}
    if case == "on a line":
        at = {k: np.array([0.1 * k, 0.0, 0.0]) for k in at}
    if case == "mirrored":
        at = {k: v * [1, 1, -1] for k, v in at.items()}
    if case == "mm as m":
        at = {k: 1000 * v for k, v in at.items()}
    saved = Modes(modes.frequency, modes.damping_ratio, shape, dofs, scaling="unscaled")
    test = MeasuredTest(saved, None, Geometry(at, ()))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = compare_with_test(machine, test)
    except Exception as error:
        return "refused", [str(error)[:60]], 0.0
    pairs = {str(a): str(b) for a, b in result.correlation.points.pairs.items()}
    wrong = [n for n in used if pairs.get(str(numbers[n])) not in (n, None)]
    kind = "wrong" if wrong else "right" if len(pairs) >= 0.6 * len(used) else "few pairs"
    return (kind, [str(d) for d in result.correlation.doubts],
            float(result.correlation.pairs.values.min(initial=1.0)))


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.cases("seeds", 20)
    given = parser.parse_args()
    right = wrong = doubted = 0
    for case in CASES:
        trials = [trial(seed, case) for seed in range(given.seeds)]
        words = []
        for kind in ("right", "few pairs", "wrong", "refused"):
            those = [t for t in trials if t[0] == kind]
            words.append(f"{kind} {len(those):2d} (doubted {sum(bool(t[1]) for t in those)})")
        print(f"{case:<22}{', '.join(words)}", flush=True)
        if case in ("same frame", "turned", "turned, six points"):
            right += sum(t[0] == "right" for t in trials)
        wrong += sum(t[0] in ("wrong", "few pairs") for t in trials)
        doubted += sum(t[0] in ("wrong", "few pairs") and bool(t[1]) for t in trials)
    print(f"points of good tests right in {right} of {3 * given.seeds}; wrong or few pairs doubted in {doubted} of {wrong}")


if __name__ == "__main__":
    main()
