"""Machines updated as a user updates them: whether the stated intervals hold the truth, and whether a wrong model is noticed.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/updating/random_updates.py [--seeds 20] [--case plain] [--by frf]

The random machines and hammer tests of benchmarks/joint_identification/joint_machines.py (noise of 1 to 5 %, a loss factor of 2
to 10 % a joint), with a floor of noise that is the same for all sensors. The user's model has every stiffness wrong by some 30
%, and beside that, by case:

    plain       nothing else is wrong
    damping     every loss factor is 4 %: nobody knows it before the test
    undamped    the model has no damping at all
    ratio       machine and model have one damping ratio for all modes, 0.5 to 5 %; the model says 3 %
    one-ratio   the machine's joints have loss factors, the model one damping ratio of 3 % in their place
    masses      every mass (with its inertia) is wrong by some 5 %, two thirds of them beyond 2.5 %
    places      every measured point lies some 10 mm from where the model has it
    fixed       one stiffness, wrong by a factor of two, is not among the parameters
    gain        one force channel reads 5 % too much
    worn        one joint of the machine is 3 to 30 times softer than the model says
    far         two joints are 10 to 100 times softer than the model says, and 6 points are measured, not 30

It is updated by the measured responses (--by frf), or by the modes that `identify` finds in them (--by modes). Counted: 95 %
intervals of stiffnesses that hold the truth, and machines of which a stiffness is further than three standard deviations off
and neither status nor doubts say a word. The last line is the figure.
"""

from __future__ import annotations

import sys
import time
import warnings
from dataclasses import dataclass, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from benchmarks.joint_identification.joint_machines import Case, random_case, responses
from toolpoint.machine import Machine, build
from toolpoint.machine.description import MachineDescription, parameters
from toolpoint.studies import Measurement, identify_modes, update_machine
from toolpoint.studies.machines.virtual_test import MeasuringPoints
from toolpoint.studies.measured.measured_update import MeasuredUpdate
from toolpoint.studies.measured.model_correlation import with_measured_points
from toolpoint.vibration import Frf

CASES = ("plain", "damping", "undamped", "ratio", "one-ratio", "masses", "places", "fixed", "gain", "worn", "far")
POINTS, FEW_POINTS = 30, 6
RATIOS = np.log([0.005, 0.05])
WEAR, FAR_WEAR = np.log([3.0, 30.0]), np.log([10.0, 100.0])  # model's stiffness over that of a worn joint


@dataclass(frozen=True)
class Trial:
    """What one machine came to: scores (errors over standard deviations) of the free stiffnesses, and what was said."""

    scores: np.ndarray
    errors: np.ndarray
    left_alone: tuple[str, ...]
    said: tuple[str, ...]


def model_of(case: Case, kind: str, rng: np.random.Generator) -> tuple[Machine, Machine, list[str]]:
    """Return the true machine with its measured points, the user's model, and the paths that he updates."""
    coordinates = dict(case.points.coordinates)
    truth = with_measured_points(case.machine, coordinates, case.points.components)
    if kind == "places":
        coordinates = {point: at + 0.01 * rng.normal(size=3) / np.sqrt(3) for point, at in coordinates.items()}
    model = with_measured_points(case.machine, coordinates, case.points.components)
    paths = [path for path in parameters(model.description) if ".stiffness." in path]
    described = model.description
    if kind in ("damping", "undamped"):
        described = replace(described, joints={name: replace(joint, loss_factor=0.04 if kind == "damping" else 0.0)
                                               for name, joint in described.joints.items()})
    if kind in ("ratio", "one-ratio"):
        described = with_one_ratio(described, 0.03)
    if kind == "masses":
        described = replace(described, bodies={name: replace(body, mass=body.mass * float(np.exp(0.05 * rng.normal())))
                                               for name, body in described.bodies.items()})
    model = build(described)
    wrong = {path: model.value(path) * float(np.exp(0.3 * rng.normal())) for path in paths}
    if kind in ("worn", "far"):
        for joint in rng.choice(list(described.joints), 1 if kind == "worn" else 2, replace=False):
            factor = float(np.exp(rng.uniform(*(WEAR if kind == "worn" else FAR_WEAR))))
            wrong |= {path: size * factor for path, size in wrong.items() if path.startswith(f"joints.{joint}.")}
    if kind == "fixed":
        stays = str(rng.choice(paths))
        wrong[stays] = 2 * model.value(stays)
        paths = [path for path in paths if path != stays]
    return truth, model.with_values(wrong), paths


def with_one_ratio(machine: MachineDescription, ratio: float) -> MachineDescription:
    """Return the machine damped by one ratio for all modes, no joint by itself."""
    return replace(machine, damping_ratio=ratio,
                   joints={name: replace(joint, loss_factor=0.0) for name, joint in machine.joints.items()})


def measure(case: Case, kind: str, rng: np.random.Generator) -> Frf:
    """Return the noisy responses of the true machine."""
    frf = responses(case, rng)
    # A sensor has a floor: responses that are zero by symmetry are not measured to the last digit of a computer.
    floor = 0.3 * case.noise * np.sqrt((np.abs(frf.values) ** 2).mean() / 2)
    noise = rng.normal(size=frf.values.shape) + 1j * rng.normal(size=frf.values.shape)
    frf = replace(frf, values=frf.values + floor * noise)
    if kind != "gain":
        return frf
    factor = np.ones(len(frf.inputs))
    factor[-1] = 1.05
    return replace(frf, values=frf.values * factor)


def run(seed: int, kind: str, by: str) -> Trial:
    """Return what the update of one random machine came to."""
    case, rng = random_case(seed), np.random.default_rng(1000 + seed)
    kept = rng.permutation(list(case.points.places))[:FEW_POINTS if kind == "far" else POINTS].tolist()
    case = replace(case, points=MeasuringPoints({name: case.points.places[name] for name in sorted(kept)}))
    if kind == "ratio":
        case = replace(case, machine=build(with_one_ratio(case.machine.description, float(np.exp(rng.uniform(*RATIOS))))))
    truth, model, paths = model_of(case, kind, rng)
    frf = measure(case, kind, rng)
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        part = Measurement(frf=frf) if by == "frf" else Measurement(identify_modes(frf).modes)
        result = update_machine(model, [part], () if kind != "fixed" else paths)
    fit = result.update.fit
    free = [name for name in fit.free if name in paths]
    errors = np.array([np.log(fit.values[name] / truth.value(name)) for name in free])
    deviations = np.sqrt(np.diag(fit.covariance))[[fit.free.index(name) for name in free]]
    return Trial(errors / deviations, errors, tuple(fit.left_alone), words_of(result, [str(w.message) for w in warned]))


def words_of(result: MeasuredUpdate, warned: list[str]) -> tuple[str, ...]:
    """Return what tells a user that the result may be wrong: the status of the fit, doubts, and doubtful warnings."""
    status = result.update.fit.status
    return (*(["status: " + status] if "does not explain" in status or "not converged" in status else []),
            *map(str, result.doubts), *(text for text in warned if "doubtful" in text))


def main() -> None:
    """Run and print; the figure last."""
    parser = CommandLine(__doc__)
    parser.seed(0, "first")
    parser.cases("seeds", 20)
    parser.part("case", default="plain", choices=CASES)
    parser.add_argument("--by", choices=("frf", "modes"), default="frf")
    given = parser.parse_args()
    scores, silent, said, seconds = [], 0, 0, time.process_time()
    for seed in range(given.first, given.first + given.seeds):
        trial = run(seed, given.case, given.by)
        scores += list(trial.scores)
        worst = float(np.abs(trial.scores).max(initial=0.0))
        silent += worst > 3 and not trial.said
        said += bool(trial.said)
        print(f"{seed:4d}: {len(trial.scores)} free, {len(trial.left_alone)} left alone, worst {worst:6.1f} sd, largest error "
              f"{100 * np.abs(trial.errors).max(initial=0.0):7.2f} %; {'; '.join(trial.said)[:150] or 'nothing said'}",
              flush=True)
    held = np.abs(scores) < 1.96
    print(f"{given.case}, by {given.by}: {100 * np.mean(held):.1f} % of {held.size} intervals hold; {said} of {given.seeds} "
          f"machines doubted, {silent} of {given.seeds} wrong by more than three deviations without a word; "
          f"{(time.process_time() - seconds) / given.seeds:.1f} CPU s a machine")


if __name__ == "__main__":
    main()
