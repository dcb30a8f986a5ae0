"""The next test that is chosen against a random one: by how much each narrows the interval of the asked limit.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/studies/next_test.py [--machines 50] [--first 0] [--made 8]

Random machines (`joint_machines`) whose stiffnesses and loss factors are known from a short test at the reference pose: the
lower half of the modes, frequencies within 0.2 %, damping ratios within 5 %, from 10 % before it (linear, Kalman). Asked is the
least limit at a random pose; candidates are the frequencies and damping ratios of all modes at six other poses, and the shapes
of all modes at eight points in each direction. `rank_tests` chooses. The width is that of the least single-frequency limit
(its logarithm, to first order): today, after the chosen test, and after each candidate; slopes and updates are made here. With
`--made N` on the first N machines the test is really made: a true machine is drawn, measured with noise, the numbers are
updated, and the interval over 60 machines drawn from the new covariance must hold the true limit. The last line is the figure.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from benchmarks.joint_identification import joint_machines as jm
from toolpoint._check import ToolpointError
from toolpoint.cutting import ZeroOrder
from toolpoint.machine import Machine, assemble, build
from toolpoint.machine.description import IdentifiedDescription
from toolpoint.studies.machines.machine_uncertainty import machine_uncertainty
from toolpoint.studies.machines.next_test import rank_tests
from toolpoint.studies.machines.tool_point import lobes, tool_point
from toolpoint.studies.measured.model_correlation import with_measured_points
from toolpoint.vibration import Dof
from toolpoint.vibration.damped_modes import solve_as_damped

DRAWS, POSES, POINTS = 60, 6, 8
STEPS = 12  # of Gauss-Newton, where a test is made
SPEEDS = np.linspace(800.0, 4000.0, 24)
FIRST_DEVIATION = (0.002, 0.05)  # relative, of frequencies and of damping ratios in the first test
BEFORE = 0.1  # relative deviation of every number before it
NEXT_DEVIATION = (1e-4, 0.005, 0.02)  # frequencies, damping, shapes: what `rank_tests` takes
Measure = Callable[[Machine], np.ndarray]


@dataclass(frozen=True, eq=False)
class Test:
    """A candidate by its name in `rank_tests`: what it measures, each value over its deviation."""

    name: str
    measure: Measure


def poles(machine: Machine, pose: dict[str, float], label: Dof, deviation: tuple[float, float], count: int | None = None
          ) -> np.ndarray:
    """Return logarithms of frequencies and damping ratios at a pose over their deviations."""
    modes = solve_as_damped(assemble(machine, pose, [label]))
    return np.concatenate([np.log(modes.frequency[:count]) / deviation[0],
                           np.log(np.maximum(modes.damping_ratio[:count], 1e-9)) / deviation[1]])


def limit(machine: Machine, pose: dict[str, float]) -> float:
    """Return the logarithm of the least limit at a pose by the single-frequency solution."""
    chart = lobes(tool_point(machine, [pose]), speeds=SPEEDS, method=ZeroOrder())[0]
    return float(np.log(np.minimum(chart.limit, chart.depth_max).min()))


def slopes(machine: Machine, paths: tuple[str, ...], measure: Measure) -> np.ndarray:
    """Return the slopes (values, numbers) of what is measured by the logarithms of the numbers."""
    columns = []
    for path in paths:
        value, step = machine.value(path), 1e-4
        columns.append((measure(machine.with_values({path: value * (1 + step)}))
                        - measure(machine.with_values({path: value * (1 - step)}))) / (2 * step))
    return np.array(columns).T


def updated(covariance: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Return the covariance after a test whose values have a noise of one."""
    cross = slope @ covariance
    after = covariance - cross.T @ np.linalg.solve(cross @ slope.T + np.eye(len(slope)), cross)
    return (after + after.T) / 2


def known(machine: Machine, paths: tuple[str, ...], covariance: np.ndarray) -> Machine:
    """Return the machine with its numbers known within a covariance of their logarithms."""
    values = np.array([machine.value(path) for path in paths])
    matrix = covariance * np.outer(values, values)
    rows = tuple(tuple(map(float, row[:i + 1])) for i, row in enumerate(matrix))
    return build(replace(machine.description, identified=IdentifiedDescription(paths, rows)))


def candidates(machine: Machine, poses: list[dict[str, float]], points: list[str], names: tuple[str, ...]) -> list[Test]:
    """Return the candidates in the order of `rank_tests`' names, which are told by their last words."""
    label = Dof.parse(f"{points[0]}:+x")
    labels = [Dof.parse(f"{point}:{way}") for point in points for way in ("+x", "+y", "+z")]
    scale = np.abs(solve_as_damped(assemble(machine, {}, labels)).shape).max(axis=0)

    def shape(sample: Machine, dof: Dof) -> np.ndarray:
        return (np.abs(solve_as_damped(assemble(sample, {}, [dof])).shape[0]) / scale / NEXT_DEVIATION[2])

    tests = {f"shapes at {dof}": Test(f"shapes at {dof}", lambda sample, dof=dof: shape(sample, dof)) for dof in labels}
    at_poses = [name for name in names if name not in tests]
    from toolpoint.studies.machines.pose_words import pose_words

    for pose in poses:
        name = f"frequencies and damping at {pose_words(machine, pose)}"
        assert name in at_poses
        tests[name] = Test(name, lambda sample, pose=pose: poles(sample, pose, label, NEXT_DEVIATION[:2]))
    return [tests[name] for name in names]


def made(machine: Machine, paths: tuple[str, ...], covariance: np.ndarray, pose: dict[str, float], *, test: Test,
         rng: np.random.Generator) -> tuple[bool, float]:
    """Draw a true machine, make the test, update the numbers: does the new interval hold the true limit, and its half width."""
    truth = next(iter(machine_uncertainty(known(machine, paths, covariance)).samples(1, rng)))
    value = test.measure(truth) + rng.standard_normal(test.measure(machine).size)
    estimate = machine
    for _ in range(STEPS):  # Gauss-Newton about the last estimate, from the same prior
        slope = slopes(estimate, paths, test.measure)
        away = np.log([estimate.value(path) / machine.value(path) for path in paths])
        cross = slope @ covariance
        move = cross.T @ np.linalg.solve(cross @ slope.T + np.eye(len(slope)), value - test.measure(estimate) + slope @ away)
        estimate = machine.with_values({path: machine.value(path) * float(np.exp(step)) for path, step in zip(
            paths, move, strict=True)})
    after = known(estimate, paths, updated(covariance, slopes(estimate, paths, test.measure)))
    drawn = [limit(sample, pose) for sample in machine_uncertainty(after).samples(DRAWS, rng)]
    low, high = np.quantile(drawn, [0.025, 0.975], method="weibull")
    return bool(low <= limit(truth, pose) <= high), float(high - low) / 2


def main() -> None:
    """Run and print; the figure last."""
    parser = CommandLine(__doc__)
    parser.cases("machines", 50)
    parser.seed(0, "first")
    parser.add_argument("--made", type=int, default=0)
    options = parser.parse_args()
    gains, shares, ranks, held, begun = [], [], [], [], time.process_time()
    for seed in range(options.first, options.first + options.machines):
        rng = np.random.default_rng([seed, 34])
        case = jm.random_case(seed)
        points = [str(name) for name in rng.choice(list(case.points.coordinates), POINTS, replace=False)]
        machine = with_measured_points(case.machine, {name: case.points.coordinates[int(name)] for name in points},
                                       {body: [p for p in map(str, own) if p in points]
                                        for body, own in case.points.components.items()})
        paths = tuple(f"joints.{name}.{number}" for name, joint in machine.description.joints.items()
                      for number in (*(f"stiffness.{way}" for way in joint.stiffness), "loss_factor"))
        label = Dof.parse(f"{points[0]}:+x")
        half = len(solve_as_damped(assemble(machine, {}, [label])).frequency) // 2
        first = slopes(machine, paths, lambda sample, label=label, half=half: poles(sample, {}, label, FIRST_DEVIATION, half))
        covariance = updated(BEFORE**2 * np.eye(len(paths)), first)
        pose, *poses = jm.random_poses(case, rng, POSES + 1)
        today_machine = known(machine, paths, covariance)
        try:
            ranked = rank_tests(today_machine, pose, poses, points=points)
            tests = candidates(machine, poses, points, ranked.names)
            asked = slopes(machine, paths, lambda sample, pose=pose: np.array([limit(sample, pose)]))[0]
            today = float(np.sqrt(asked @ covariance @ asked))
            after = np.sqrt([asked @ updated(covariance, slopes(machine, paths, test.measure)) @ asked for test in tests])
        except ToolpointError as error:
            print(f"{seed}: left out: {str(error)[:120]}", flush=True)
            continue
        if today < 1e-3:  # the cut has no limit below the searched depth, or none of the numbers moves it
            print(f"{seed}: left out: the limit is known within {196 * today:.2g} %", flush=True)
            continue
        gains.append((today - after[0]) / max(today - after.mean(), 1e-3 * today))
        shares.append((after[0] / today, after.mean() / today, after.min() / today))
        ranks.append(np.mean(after >= after[0] * 0.999))
        words = ""
        if len(held) < options.made:
            is_inside, half = made(machine, paths, covariance, pose, test=tests[0], rng=rng)
            held.append(is_inside)
            words = f", made: {'inside' if is_inside else 'OUTSIDE'} ± {100 * half:.3g} %"
        print(f"{seed}: {len(paths)} numbers, ± {196 * today:.3g} % -> {196 * after[0]:.3g} % chosen ({ranked.names[0]}), "
              f"{196 * after.mean():.3g} % random, {196 * after.min():.3g} % best (compliance: {100 * ranked.today:.3g} -> "
              f"{100 * ranked.after[0]:.3g}, {100 * ranked.random:.3g} %){words}", flush=True)
    left = np.median(np.array(shares), axis=0)
    factor = np.median([random / chosen for chosen, random, _ in shares])
    print(f"{len(gains)} machines: after the chosen test the asked limit is {factor:.1f} times as narrow as after a random one "
          f"(median; {100 * left[0]:.0f} and {100 * left[1]:.0f} % of today's width, the best possible {100 * left[2]:.0f} %); "
          f"what it takes off is {np.median(gains):.2f} times that of a random one; as good as {100 * np.mean(ranks):.0f} % of "
          f"the candidates; made: {sum(held)} of {len(held)} inside; "
          f"{(time.process_time() - begun) / max(len(gains), 1):.1f} CPU s a machine")


if __name__ == "__main__":
    main()
