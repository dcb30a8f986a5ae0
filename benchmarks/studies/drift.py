"""Random machines tested twice: is a joint that became softer named, and is an unchanged machine left in peace?

The machines: benchmarks/joint_identification/joint_machines.py, their hammer tests with noise of 1 to 5 % of the rms of every
response. The baseline is tested at all points (30 to 150), later tests at three points of three bodies. Between tests every
stiffness scatters by 0.3 % (temperature, a sensor put back), whatever else happens, so frequencies repeat within the 0.2 % that
is the default; modes are identified by the package (`identify_modes`) from the responses. The machine file that the user has is
a calibrated one: every stiffness is 3 % (standard deviation) off.

Every machine has one later test unchanged, and one with a joint 5 to 30 % softer (all its directions, or one of them by turns).

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/studies/drift.py [--first 0] [--seeds 100] [--results FILE]
        [--model-scatter 0.03] [--two]

--model-scatter makes the machine file worse; with --two a second joint softens as well, so that both are to be named, or none.

Last line: how often the joint was named first, how often with the probability that names it alone and how many of these were
right, how many changes were seen, and the false alarms.
"""

from __future__ import annotations

import json
import sys
import warnings
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine, read_rows
from benchmarks.joint_identification import joint_machines as jm
from toolpoint.machine import Machine, build
from toolpoint.studies.drift.drift_study import MIN_NAMED_PROBABILITY, DriftStudy, study_drift
from toolpoint.studies.machines.virtual_test import MeasuringPoints
from toolpoint.studies.measured.identification import identify_modes
from toolpoint.studies.measured.model_correlation import with_measured_points
from toolpoint.vibration import Modes

TEST_SCATTER = 3e-3  # of every stiffness between two tests, relative
MODEL_SCATTER = 0.03  # of every stiffness of the machine file
SOFTER = (0.05, 0.30)  # range of what a joint loses
LATER_POINTS = 3


def run_case(seed: int, model_scatter: float = MODEL_SCATTER, *, two: bool = False) -> dict:
    """Return what the two later tests of one machine gave."""
    case, rng = jm.random_case(seed), np.random.default_rng([seed, 35])
    model = with_measured_points(scattered(case.machine, model_scatter, rng), case.points.coordinates, case.points.components)
    few = few_points(case.points, rng)
    baseline = tested(case, scattered(case.machine, TEST_SCATTER, rng), case.points, rng)
    name = str(rng.choice(list(case.machine.description.joints)))
    ways = list(case.machine.description.joints[name].stiffness)
    changed_ways = ways if seed % 2 == 0 else [str(rng.choice(ways))]
    factor = 1 - float(rng.uniform(*SOFTER))
    changed = softened(case.machine, name, changed_ways, factor)
    if two:
        other = str(rng.choice([each for each in case.machine.description.joints if each != name]))
        every_way = list(case.machine.description.joints[other].stiffness)
        changed = softened(changed, other, every_way, 1 - float(rng.uniform(*SOFTER)))
    pair = {f"joint {name}", f"joint {other}"} if two else {f"joint {name}"}
    row: dict = {"seed": seed, "joints": len(case.kinds), "joint": name, "ways": changed_ways, "factor": factor}
    for label, machine in (("same", case.machine), ("softer", changed)):
        later = tested(case, scattered(machine, TEST_SCATTER, rng), few, rng)
        study = study_drift(baseline, [later], model)
        row[label] = judged(study, f"joint {name}", factor) | {"pair": bool(study.parts) and set(
            study.parts[0][0].split(" and ")) == pair}
    return row


def judged(study: DriftStudy, part: str, factor: float) -> dict:
    """Return what a study said of one later test."""
    row = {"changed": study.has_changed, "probability": study.last.probability, "paired": int(study.last.paired.size),
           "doubts": list(study.doubts), "parts": study.parts[:3]}
    if study.explanations:
        first, share = study.parts[0]
        best = study.explanations[0]
        row |= {"first": first == part, "alone": share >= MIN_NAMED_PROBABILITY and best.fits,
                "inside": best.interval[0] <= factor <= best.interval[1], "misfit": best.misfit,
                "doubted": any("single change" in doubt for doubt in study.doubts)}
    return row


def scattered(machine: Machine, deviation: float, rng: np.random.Generator) -> Machine:
    """Return the machine with every stiffness multiplied by a random factor."""
    joints = {name: replace(joint, stiffness={way: value * float(np.exp(deviation * rng.normal()))
                                              for way, value in joint.stiffness.items()})
              for name, joint in machine.description.joints.items()}
    return build(replace(machine.description, joints=joints))


def softened(machine: Machine, name: str, ways: list[str], factor: float) -> Machine:
    """Return the machine with these directions of a joint multiplied by a factor."""
    joint = machine.description.joints[name]
    stiffness = {way: value * (factor if way in ways else 1.0) for way, value in joint.stiffness.items()}
    return build(replace(machine.description, joints=machine.description.joints | {name: replace(joint, stiffness=stiffness)}))


def few_points(points: MeasuringPoints, rng: np.random.Generator) -> MeasuringPoints:
    """Return three points, on three bodies where there are so many, the last body's among them."""
    bodies = list(points.components)
    chosen = [bodies[-1], *rng.permutation(bodies[:-1])][:LATER_POINTS]
    names = [points.components[body][int(rng.integers(len(points.components[body])))] for body in map(str, chosen)]
    return MeasuringPoints({name: points.places[name] for name in names})


def tested(case: jm.Case, machine: Machine, points: MeasuringPoints, rng: np.random.Generator) -> Modes:
    """Return the modes identified from a hammer test of a machine."""
    frf = jm.responses(replace(case, machine=machine, points=points), rng)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return identify_modes(frf, band=(float(frf.frequency[0]), float(frf.frequency[-1]))).modes


def summary(rows: list[dict]) -> str:
    """Return the shares in a line."""
    seen = [row["softer"] for row in rows if row["softer"]["changed"]]
    explained = [each for each in seen if "first" in each]
    alone = [each for each in explained if each["alone"]]
    first, right = sum(each["first"] for each in explained), sum(each["first"] for each in alone)
    inside = sum(each["inside"] for each in explained if each["first"])
    false = sum(row["same"]["changed"] for row in rows)
    both = sum(each["pair"] for each in explained)
    half = sum(each["alone"] and " and " not in each["parts"][0][0] for each in explained)
    doubted = sum(each["doubted"] for each in explained)
    return (f"{len(rows)} machines: joint first {first} of {len(rows)}, named alone {len(alone)} ({right} right), interval "
            f"holds {inside} of {first}, no single change fits {doubted}, change seen {len(seen)}, false alarms {false}; "
            f"all that changed first {both}, one part named alone {half}")


def main() -> None:
    """Run the cases that the results do not have yet, and print the summary."""
    parser = CommandLine(__doc__)
    parser.seed(0, "first")
    parser.cases("seeds", 100)
    parser.add_argument("--results", type=Path)
    parser.add_argument("--model-scatter", type=float, default=MODEL_SCATTER)
    parser.add_argument("--two", action="store_true")
    options = parser.parse_args()
    rows = read_rows(options.results)
    done = {row["seed"] for row in rows}
    for seed in range(options.first, options.first + options.seeds):
        if seed in done:
            continue
        row = run_case(seed, options.model_scatter, two=options.two)
        rows.append(row)
        print(seed, row["joint"], row["ways"], f"{row['factor']:.2f}", row["softer"].get("parts"), row["softer"]["changed"],
              f"{row['softer'].get('misfit', 1):.2g}", "| same:", f"{row['same']['probability']:.2g}", flush=True)
        if options.results:
            with options.results.open("a") as file:
                file.write(json.dumps(row) + "\n")
    print(summary(rows))


if __name__ == "__main__":
    main()
