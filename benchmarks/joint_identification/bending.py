"""Joints of machines with one bending body that the fit takes as rigid: is every stiffness inside its interval, or doubted?

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/joint_identification/bending.py [--machines 30] [--first 0]

Random chains of three boxes on joints of one to three freedoms; the middle or last box is two halves on a hinge of three
rotations that bends it a little. Shapes have noise of 0.01 to 1 % (known in two of three tests); all modes of the rigid machine
are there, or the lowest two thirds of them; masses are those of the boxes joined. Counted for every stiffness of a joint whose
kind was found: inside 1.5 times its 95 % interval, doubted at that joint, or neither. The last line is the figure.
"""

from __future__ import annotations

import sys
import time
import warnings
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.joint_identification import ComponentMass, identify_joints
from toolpoint.machine import Machine, build
from toolpoint.machine.description import (
    BodyDescription,
    FrameDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
    ShapeDescription,
)
from toolpoint.machine.parts.mass import mass_properties
from toolpoint.studies.machines.virtual_test import surface_points, true_modes
from toolpoint.vibration import Modes

KINDS = (("rx", "ry"), ("rx", "rz"), ("x", "rz"), ("rx",), ("rx", "ry", "rz"), ("z", "rx", "ry"))


def random_machine(rng: np.random.Generator) -> tuple[Machine, str, dict[str, dict[str, float]]]:
    """Return the machine with halves of a bending body, that body's name, and the stiffnesses of its true joints by child."""
    names, bodies, joints, truth, height = ["bed", "column", "head"], {}, {}, {}, 0.0
    bent, parent = str(rng.choice(names[1:])), "ground"
    for name in names:
        size = np.array([*rng.uniform(0.5, 1.1, 2), rng.uniform(0.5, 1.8 if name == bent else 0.9)])
        mass = float(rng.uniform(800, 2000) * size.prod())
        centre = np.array([*rng.uniform(-0.1, 0.1, 2), height + size[2] / 2])
        foot = (float(centre[0]), float(centre[1]), height)
        stiffness = {}
        for way in KINDS[int(rng.integers(len(KINDS)))] if name != "bed" else ("z", "rx", "ry"):
            f = np.exp(rng.uniform(np.log(15 if name == "bed" else 30), np.log(40 if name == "bed" else 150)))
            inertia = 3 * mass * (1.0 if len(way) == 1 else 0.5 * size.max() ** 2)
            stiffness[way] = float(inertia * (2 * np.pi * f) ** 2)
        truth[name] = stiffness
        first = name if name != bent else "lower"
        joints[f"{name} joint"] = JointDescription(parent, first, FrameDescription(foot), stiffness, loss_factor=0.03)
        if name != bent:
            box = ShapeDescription("box", tuple(map(float, size)))
            bodies[name] = BodyDescription(mass, tuple(map(float, centre)), shape=box)
            parent = name
        else:
            half = (float(size[0]), float(size[1]), float(size[2]) / 2)
            for k, part in enumerate(("lower", "upper")):
                at = (float(centre[0]), float(centre[1]), float(height + (0.25 + 0.5 * k) * size[2]))
                bodies[part] = BodyDescription(mass / 2, at, shape=ShapeDescription("box", half))
            hinge = {way: float(np.exp(rng.uniform(np.log(5), np.log(400))) * mass * size[2] ** 2 * (2 * np.pi * 60) ** 2)
                     for way in ("rx", "ry", "rz")}
            joints["bending"] = JointDescription("lower", "upper", FrameDescription(tuple(map(float, centre))), hinge)
            parent = "upper"
        height += float(size[2])
    tip = PointDescription(parent, (0.2, 0.1, height))
    return build(MachineDescription("bending", bodies, joints, points={"tip": tip})), bent, truth


def with_noise(modes: Modes, rng: np.random.Generator) -> Modes:
    """Return modes with noise of shapes of 0.01 to 1 % of each one's rms, and of frequencies; known in two of three tests."""
    level = np.exp(rng.uniform(np.log(1e-4), np.log(1e-2))) * np.sqrt((modes.shape**2).mean(axis=0))
    deviation = np.broadcast_to(level, modes.shape.shape)
    spread = np.zeros((modes.count, 2, 2))
    spread[:, 0, 0], spread[:, 1, 1] = (1e-5 * modes.frequency) ** 2, 1e-8
    is_known = rng.random() < 2 / 3
    return replace(modes, shape=modes.shape + deviation * rng.normal(size=modes.shape.shape),
                   frequency=modes.frequency * (1 + 1e-5 * rng.normal(size=modes.count)),
                   shape_variance=deviation**2 if is_known else None, covariance=spread if is_known else None)


def judge(seed: int) -> dict[str, int]:
    """Return counts over the stiffnesses of one machine."""
    rng = np.random.default_rng(seed)
    machine, bent, truth = random_machine(rng)
    points = surface_points(machine, 90, rng)
    parts = dict(points.components)
    parts[bent] = [*parts.pop("lower"), *parts.pop("upper")]
    freedoms = sum(map(len, truth.values()))
    number = freedoms if rng.random() < 0.7 else max(4, (2 * freedoms + 2) // 3)
    modes = with_noise(true_modes(machine, points, 0.02).selected(list(range(number))), rng)
    masses = {}
    lower, upper = (machine.description.bodies[part] for part in ("lower", "upper"))
    whole = BodyDescription(lower.mass + upper.mass, tuple((np.array(lower.centre) + upper.centre) / 2),
                            shape=ShapeDescription("box", (*lower.shape.size[:2], 2 * lower.shape.size[2])))
    for name in truth:
        known = mass_properties(whole if name == bent else machine.description.bodies[name])
        masses[name] = ComponentMass(known.mass, known.centre, known.inertia)
    counts = {"inside": 0, "doubted": 0, "neither": 0, "kind": 0}
    worst = ""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = identify_joints(modes, points.coordinates, parts, chain=["ground", "bed", "column", "head"], masses=masses)
    for child, true in truth.items():
        joint = found.joint(child)
        if joint.stiffness is None or set(joint.freedoms) != set(true):
            counts["kind"] += not joint.doubts
            continue
        for way, value, half in zip(joint.freedoms, joint.stiffness, joint.stiffness_interval, strict=True):
            away = abs(value - true[way]) / max(half, 1e-12 * value)
            if away <= 1.5:
                counts["inside"] += 1
            elif joint.doubts:
                counts["doubted"] += 1
            else:
                counts["neither"] += 1
                worst += f" {child} {way}: {value:.4g} +- {half:.2g} for {true[way]:.4g} ({away:.1f} half widths)"
    print(f"{seed}: bent {bent}, {number} of {freedoms} modes, {counts}{worst}"
          + ("" if found.certain else "; doubted"), flush=True)
    return counts


def main() -> None:
    """Run and print; the figure last."""
    parser = CommandLine(__doc__)
    parser.cases("machines", 30)
    parser.seed(0, "first")
    given, start, total = parser.parse_args(), time.process_time(), dict[str, int]()
    for seed in range(given.first, given.first + given.machines):
        for key, value in judge(seed).items():
            total[key] = total.get(key, 0) + value
    number = total["inside"] + total["doubted"] + total["neither"]
    print(f"{number} stiffnesses of {given.machines} machines with a bending body: {total['inside']} inside, "
          f"{total['doubted']} outside and doubted, {total['neither']} outside without a doubt; {total['kind']} joints of "
          f"another kind without a doubt; {time.process_time() - start:.0f} CPU s")


if __name__ == "__main__":
    main()
