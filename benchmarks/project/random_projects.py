"""Random machines from measured responses to answers by a project, nobody choosing: limits at untested poses, slips, changes.

The machines: benchmarks/joint_identification/joint_machines.py, by all laws of damping. The tester's masses are wrong by 5 %
(told), the true K_t and K_n differ by 10 % (told; `--coefficients` takes another share, 0.02 is a calibration of one's own).
Half of the tests have one slip: a turned channel, one 20 % off, two exchanged points, a wrong order, a mass 15 % off. Every
machine: responses as a universal file, a project folder, `Project.run`, then `Project.limits` at six random poses beside the
true machine's least limit over twelve speeds.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/project/random_projects.py [--first 0] [--seeds 20] [--draws 24]
        [--coefficients 0.1] [--results FILE] (resumes from it)

Whole: the least limits at all six poses within 10 % of the truth with the told coefficients (machines without a slip).
Width of the machine alone: what would be left with exact coefficients, by the shares that the project states.
Intervals hold: the truth with its own coefficients. Unsafe: the interval's lower end above the truth.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
import warnings
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine, read_rows
from benchmarks.joint_identification import joint_machines as jm
from toolpoint.project import Project
from toolpoint.project.limits.changes import rank_joints
from toolpoint.project.limits.drawn_limits import COEFFICIENTS_SOURCE, CutQuestion
from toolpoint.project.limits.systems import MachineDraws, problem_of
from toolpoint.studies.cuts.tool_dynamics import machine_dynamics
from toolpoint.studies.machines.tool_point import deep_chart

SLIPS = ("sign", "sensitivity", "exchanged", "order", "mass")
SPEEDS = np.linspace(800.0, 4000.0, 12)
MASS_DEVIATION = 0.05
PROJECT = """toolpoint: 1
name: random
tests:
  first: {responses: [test.uff]}
geometry: test.uff
components: components.yaml
cuts:
  half: {diameter: 50 mm, teeth: 4, immersion: 0.5, tangential: 800 MPa, normal: 300 MPa, speeds: 800 4000 rpm,
         coefficient_deviation: {coefficients} %}
goals:
  rough: {speed: 2500 rpm, depth: 4 mm}
"""


def slip_of(seed: int) -> str:
    """Return the slip of every second machine."""
    return SLIPS[seed // 2 % len(SLIPS)] if seed % 2 else ""


def write_project(case, rng, slip: str, folder: Path, *, coefficients: float) -> list[set[str]]:
    """Write the folder of a test; return sets of words of which one must be in one doubt that names the slip."""
    frf, coordinates = jm.responses(case, rng), dict(case.points.coordinates)
    values, order, words = frf.values.copy(), None, []
    masses = {name: float(np.exp(MASS_DEVIATION * rng.normal())) for name in case.machine.description.bodies}
    channel = int(rng.integers(len(frf.outputs)))
    point = str(frf.outputs[channel].point)
    if slip == "sign":
        values[:, channel] *= -1
        words = [{"points", point}, {point, frf.outputs[channel].direction}]
    elif slip == "sensitivity":
        values[:, channel] *= 1.2
        words = [{"points", point}, {point, frf.outputs[channel].direction}]
    elif slip == "exchanged":
        first, second = rng.choice(list(coordinates), 2, replace=False).tolist()
        coordinates[first], coordinates[second] = coordinates[second], coordinates[first]
        words = [{"points", str(first)}, {"points", str(second)}]
    elif slip == "order":
        parents = {joint.child: joint.parent for joint in case.machine.description.joints.values()}
        names = list(parents)
        swap = {names[1]: names[2], names[2]: names[1]}
        order = {swap.get(child, child): swap.get(parent, parent) for child, parent in parents.items()}
        words = [{"chain", "as", "told"}, {"order", "of", "the", "chain"}]
    elif slip == "mass":
        name = list(masses)[int(rng.integers(len(masses)))]
        masses[name] *= 1.15
        words = [{name, "mass"}]
    jm.write_test(case, replace(frf, values=values), folder, points=coordinates, masses=masses, order=order, deviation="5 %")
    (folder / "project.yaml").write_text(PROJECT.replace("{coefficients}", f"{100 * coefficients:g}"))
    return words


def is_named(words: list[set[str]], doubts: list[str]) -> bool:
    """Return whether one doubt holds all words of a set, by whole words; a Dof counts as its point too."""
    for doubt in doubts:
        for mark in ",.:;[]()/'\"#":
            doubt = doubt.replace(mark, " ")
        if any(several <= set(doubt.split()) for several in words):
            return True
    return False


def least_limit(machine, pose, cut, factors) -> float:
    """Return the true least limit over the speeds."""
    problem = problem_of(machine_dynamics(machine, pose), cut, factors)
    chart = deep_chart(problem, SPEEDS, None, share=0.5)
    return float(np.minimum(chart.limit, chart.depth_max).min())


def run_case(seed: int, draws: int, coefficients: float) -> dict:
    """Return what one machine gave."""
    case = jm.random_case(seed, jm.law_of(seed))
    rng, slip = np.random.default_rng(50_000 + seed), slip_of(seed)
    row = {"seed": seed, "law": case.law, "slip": slip}
    with tempfile.TemporaryDirectory() as name:
        words = write_project(case, rng, slip, Path(name), coefficients=coefficients)
        start = time.process_time()
        results = Project.open(name).run()
        row["run s"] = time.process_time() - start
        doubts = [entry["what"] + ": " + entry["why"] for entry in results.data["doubts"]]
        failed = [step["words"] for step in results.data["steps"] if step["state"] in ("failed", "stopped")]
        row |= {"doubts": doubts, "failed": failed, "named": is_named(words, doubts + failed) if slip else None}
        row["answered"] = not failed
        if not failed:
            row |= asked(case, Project.open(name), rng, draws=draws, changes=results.data["changes"],
                         coefficients=coefficients)
        row["cpu s"] = time.process_time() - start
    return row


def asked(case, project: Project, rng, *, draws: int, changes, coefficients: float) -> dict:
    """Return limits at six untested poses beside the truth, and whether the true soft joint is the first to change."""
    factors = np.exp(coefficients * rng.normal(size=2))
    cut = project.description.cuts["half"].cut
    rows = {"error": [], "inside": [], "unsafe": [], "width": [], "machine": []}
    weights = np.full(draws, 1 / draws)
    for pose in jm.random_poses(case, rng, 6):
        limits = project.limits(pose, speeds=SPEEDS, draws=draws)
        # A limit beyond the depths that were searched is "above" their end, and so is the true one.
        end = limits.depth_max
        value, lower, upper = (min(each, end) for each in limits.least(weights))
        truth = min(least_limit(case.machine, pose, cut, factors), end)
        rows["error"].append(value / min(least_limit(case.machine, pose, cut, np.ones(2)), end) - 1)
        rows["inside"].append(bool(lower <= truth <= upper))
        rows["unsafe"].append(bool(lower > truth))
        rows["width"].append((upper - lower) / value)
        of_machine = max(1 - limits.shares.get(COEFFICIENTS_SOURCE, 0.0), 0.0)
        rows["machine"].append(float(np.sqrt(of_machine)) * rows["width"][-1])
    question = CutQuestion("half", cut, coefficients, (2500.0,), {}, 0.004)
    true_first = rank_joints(MachineDraws(case.machine, 0, 1), {"rough": question}, {})[0].joint
    return {**rows, "soft first": changes[0]["joint"] == true_first}


def summary(rows: list[dict]) -> list[str]:
    """Return the figures in words."""
    clean = [row for row in rows if not row["slip"]]
    answered = [row for row in rows if row["answered"]]
    whole = [row for row in clean if row["answered"] and np.abs(row["error"]).max() <= 0.1]

    def over(name, part):
        return np.array([value for row in part if row["answered"] for value in row[name]], float)

    lines = [f"{len(rows)} machines, {len(clean)} without a slip, {len(answered)} answered"]
    for title, part in (("without a slip", clean), ("with a slip", [row for row in rows if row["slip"]])):
        inside = over("inside", part)
        if inside.size:
            lines.append(f"{title}: intervals hold {100 * inside.mean():.1f} % of {inside.size}, median width "
                         f"{100 * np.median(over('width', part)):.0f} % (of the machine alone "
                         f"{100 * np.median(over('machine', part)):.0f} %), unsafe {100 * over('unsafe', part).mean():.1f} %, "
                         f"error median {100 * np.median(np.abs(over('error', part))):.2g} %")
    slipped = [row for row in rows if row["slip"]]
    lines.append(f"slips named: {sum(row['named'] for row in slipped)} of {len(slipped)}")
    lines.append(f"soft joint first: {sum(row['soft first'] for row in answered)} of {len(answered)}")
    lines.append(f"CPU a machine: run median {np.median([row['run s'] for row in rows]):.0f} s, with six poses "
                 f"{np.median([row['cpu s'] for row in rows]):.0f} s")
    lines.append(f"whole: {len(whole)} of {len(clean)} machines without a slip have all six limits within 10 %")
    return lines


def main() -> None:
    """Run, print each machine and the figures."""
    parser = CommandLine(__doc__)
    parser.seed(0, "first")
    parser.cases("seeds", 20)
    parser.add_argument("--draws", type=int, default=24)
    parser.add_argument("--coefficients", type=float, default=0.1)
    parser.add_argument("--results", type=Path)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    rows = read_rows(given.results)
    done = {row["seed"] for row in rows}
    for seed in range(given.first, given.first + given.seeds):
        if seed in done:
            continue
        row = run_case(seed, given.draws, given.coefficients)
        rows.append(row)
        print(f"{seed} {row['law']} {row['slip'] or 'no slip'}: answered {row['answered']}, named {row['named']}, "
              f"{row['cpu s']:.0f} s {row['failed'][:1]} "
              f"{[doubt[:150] for doubt in row['doubts'] if 'axes.' not in doubt][:2]}", flush=True)
        if given.results is not None:
            with given.results.open("a") as file:
                file.write(json.dumps(row) + "\n")
    print("\n".join(summary(rows)))


if __name__ == "__main__":
    sys.exit(main())
