"""Modes over a long traverse, and the joint that changes on the way: the vertical machining centre under random loads.

    python benchmarks/operational/traverse.py --cases 20            # one joint changes by 15 to 35 % from end to end
    python benchmarks/operational/traverse.py --cases 20 --unchanged    # none does: false alarms

Every mode obeys the recursion of its slowly moving pole; channels are accelerations at the machine's points with 5 % noise. The
machine that is handed to the study is the one before the change, with all its stiffnesses 3 % off at random.
"""

from __future__ import annotations

import sys
import warnings
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint import ToolpointWarning
from toolpoint.io import read_machine
from toolpoint.machine import Machine, assemble
from toolpoint.studies import cut_windows, study_traverse
from toolpoint.vibration import Record, eigen

MACHINE, MODES, NOISE_FRACTION, WINDOWS, FILE_ERROR = "src/toolpoint/app/machines/three_axis_vertical.yaml", 5, 0.05, 10, 0.03
STEPS = 41  # poses between which poles and shapes go linearly


@dataclass(frozen=True, eq=False)
class Traverse:
    """A record of a traverse: the true frequencies (STEPS, MODES) over the positions (STEPS,), and the joint that changed."""

    record: Record
    positions: np.ndarray
    frequency: np.ndarray
    joint: str


def joints_of(machine: Machine) -> dict[str, dict[str, float]]:
    """Return the stiffness paths of every joint with their values."""
    result: dict[str, dict[str, float]] = {}
    for name, joint in machine.description.joints.items():
        if joint.stiffness:
            result[name] = {f"joints.{name}.stiffness.{way}": value for way, value in joint.stiffness.items()}
    return result


def traverse(machine: Machine, axis: str, ends: tuple[float, float], *, joint: str, change: float, rng: np.random.Generator,
             seconds: float = 600.0) -> Traverse:
    """Return the record of a traverse during which a joint's stiffness goes by the factor exp(change) from end to end."""
    positions = np.linspace(*ends, STEPS)
    dofs = [f"{point}:{way}" for point in machine.description.points for way in ("+x", "+y", "+z")][:12]
    paths = joints_of(machine).get(joint, {})
    frequencies, damping, shapes = [], [], []
    for k, position in enumerate(positions):
        factor = np.exp(change * (k / (STEPS - 1) - 0.5))
        moved = machine.with_values({path: value * factor for path, value in paths.items()}) if paths else machine
        modes = eigen.solve_undamped(assemble(moved, {axis: float(position)}, outputs=dofs)).selected(range(MODES))
        shape = modes.shape if not shapes else modes.shape * np.sign((modes.shape * shapes[-1]).sum(axis=0))
        frequencies.append(modes.frequency)
        damping.append(np.linspace(0.01, 0.02, MODES))
        shapes.append(shape)
    return Traverse(_respond(np.array(frequencies), np.array(damping), np.array(shapes), dofs, seconds, rng), positions,
                    np.array(frequencies), joint)


def _respond(frequency: np.ndarray, damping: np.ndarray, shapes: np.ndarray, dofs: list[str], seconds: float,
             rng: np.random.Generator) -> Record:
    """Return accelerations of modes whose poles move slowly, under white loads."""
    rate = 2.56 * 1.3 * float(frequency.max())
    count = round(seconds * rate)
    course, places = np.linspace(0, STEPS - 1, count), np.arange(STEPS)
    samples = np.zeros((count, len(dofs)))
    for k in range(frequency.shape[1]):
        f, zeta = np.interp(course, places, frequency[:, k]), np.interp(course, places, damping[:, k])
        pole = np.exp(2 * np.pi * f * (-zeta + 1j * np.sqrt(1 - zeta**2)) / rate)
        load, state, motion = rng.standard_normal(count), 0j, np.empty(count, complex)
        for n, (z, force) in enumerate(zip(pole.tolist(), load.tolist(), strict=True)):
            state = z * state + force
            motion[n] = state
        motion *= np.sqrt(zeta * f)  # alike in power
        shape = np.array([np.interp(course, places, shapes[:, i, k]) for i in range(len(dofs))]).T
        samples += motion.imag[:, None] * shape / np.abs(shape).max()
    samples += NOISE_FRACTION * samples.std(axis=0) * rng.standard_normal(samples.shape)
    return Record(samples, rate, dofs, "acceleration")


def main() -> None:
    """Draw, study, print."""
    parser = CommandLine(__doc__)
    parser.cases("cases", 20)
    parser.seed(0)
    parser.add_argument("--unchanged", action="store_true")
    options = parser.parse_args()
    warnings.simplefilter("ignore", ToolpointWarning)
    machine = read_machine(MACHINE)
    axis = machine.description.axes
    counts = dict.fromkeys(("cases", "named", "wrong", "inside", "points", "found"), 0)
    for case in range(options.cases):
        rng = np.random.default_rng([options.seed, case])
        name = list(axis)[case % len(axis)]
        ends = tuple(map(float, axis[name].limits)) if hasattr(axis[name], "limits") else (-0.2, 0.2)
        joint = "" if options.unchanged else str(rng.choice(list(joints_of(machine))))
        change = float(rng.choice([-1, 1]) * np.log(rng.uniform(1.15, 1.35)))
        record = traverse(machine, name, ends, joint=joint, change=change, rng=rng)
        windows = cut_windows(record.record, ends, WINDOWS)
        rough = machine.with_values({path: value * np.exp(FILE_ERROR * rng.standard_normal())
                                     for paths in joints_of(machine).values() for path, value in paths.items()})
        study = study_traverse(windows, quantity=f"{name}, m", machine=rough, poses=[{name: w.value} for w in windows])
        _count(counts, record, study)
        print(case, name, joint or "none", f"{np.exp(change):.2f}", study.status, flush=True)
    held = 100 * counts["inside"] / max(counts["points"], 1)
    print(f"{counts['cases']} traverses: joint named {counts['named']}, wrong {counts['wrong']}; modes followed "
          f"{counts['found']} of {MODES * counts['cases']}; 95 % intervals of the courses hold {held:.1f} %")


def _count(counts: dict[str, int], record: Traverse, study) -> None:
    counts["cases"] += 1
    named = study.joints[0].joint if study.joints and study.joints[0].probability >= 0.8 and study.joints[0].fits else ""
    counts["named"] += bool(named) and named == f"joint {record.joint}"
    counts["wrong"] += bool(named) and named != f"joint {record.joint}"
    counts["found"] += len(study.tracks)
    for course in study.frequency:
        value, half_width = course.at_values(study.values)
        truth = np.array([np.interp(study.values, record.positions, record.frequency[:, k])
                          for k in range(record.frequency.shape[1])])
        k = int(np.argmin(np.abs(truth - value).sum(axis=1)))
        counts["inside"] += int((np.abs(value - truth[k]) < half_width).sum())
        counts["points"] += value.size


if __name__ == "__main__":
    main()
