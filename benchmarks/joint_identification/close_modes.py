"""Machines whose feet give several modes almost one frequency: is a joint called established whose modes were not all found?

A box on isolators, of whose six modes two to five lie within 0.05 to 3 % of one frequency (half-power widths 2 to 10 %), with a
second box on a hinge; one or two driving points, noise of 0.5 to 5 %. From responses to joints by command, nobody choosing.
A joint is wrong where its number of freedoms is, or a value of its stiffness lies more than three half widths and a tenth from
the truth (`random_machines.judged`). The last line is the number of wrong joints that no doubt marks.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/joint_identification/close_modes.py [--first 0] [--seeds 60]
"""

from __future__ import annotations

import json
import sys
import tempfile
import warnings
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from benchmarks.joint_identification import joint_machines as jm
from benchmarks.joint_identification.random_machines import called, judged
from toolpoint.machine.description import (
    BodyDescription,
    FrameDescription,
    JointDescription,
    ShapeDescription,
)
from toolpoint.studies.machines.virtual_test import surface_points


def close_case(seed: int) -> jm.Case:
    """Return a machine with close modes of its first joint."""
    rng = np.random.default_rng(seed)
    size, mass = rng.uniform(0.6, 1.4, 3), float(rng.uniform(800, 3000))
    small = rng.uniform(0.3, 0.5, 3)
    shapes = [ShapeDescription("box", tuple(map(float, edges))) for edges in (size, small)]
    bodies = {"b0": BodyDescription(mass, (0.0, 0.0, float(size[2] / 2)), shape=shapes[0]),
              "b1": BodyDescription(mass / 40, (0.0, 0.0, float(size[2] + small[2] / 2)), shape=shapes[1])}
    inertia = mass / 12 * ((size**2).sum() - size**2)
    hertz = rng.uniform(12, 60, 6)
    close = rng.permutation(6)[:int(rng.integers(2, 6))]
    hertz[close] = 30.0 * (1 + 10 ** rng.uniform(-3.3, -1.5) * np.linspace(-0.5, 0.5, close.size))
    stiffness = np.array([mass, mass, mass, *inertia]) * (2 * np.pi * hertz) ** 2
    loss = float(10 ** rng.uniform(np.log10(0.02), -1))
    hinge = float(mass / 40 * (small**2).sum() / 6 * (2 * np.pi * rng.uniform(90, 150)) ** 2)
    joints = {"ground_b0": JointDescription("ground", "b0", FrameDescription((0.0, 0.0, float(size[2] / 2))),
                                            dict(zip(jm.WAYS, map(float, stiffness), strict=True)), loss_factor=loss),
              "b0_b1": JointDescription("b0", "b1", FrameDescription((0.0, 0.0, float(size[2]))), {"rx": hinge},
                                        loss_factor=0.04)}
    machine = jm._complete(rng, bodies, joints)
    points = surface_points(machine, int(rng.integers(30, 80)), rng)
    noise = float(10 ** rng.uniform(np.log10(0.005), np.log10(0.05)))
    return jm.Case(machine, {"b0": "isolators", "b1": "hinge"}, points, noise)


def run_case(seed: int) -> dict:
    """Return what one machine gave."""
    case = close_case(seed)
    rng = np.random.default_rng(70_000 + seed)
    frf = jm.responses(case, rng)
    if seed % 2:
        frf = replace(frf, values=frf.values[:, :, :1], inputs=frf.inputs[:1])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        arguments = jm.write_test(case, frf, folder)
        code, text = called([*arguments, "--machine", str(folder / "found.yaml"), "-o", str(folder / "page"), "--json"])
    if not text.startswith("{"):
        return {"seed": seed, "code": code, "told": True, "wrong": True, "words": text[:300]}
    shown = json.loads(text)
    found = judged(case, shown)
    scores, errors = np.abs(found["stiffness scores"]), np.array(found["stiffness %"])
    wrong = found["found"] < 2 or bool((errors > 10).any() and (scores / 1.96 > 3).any()) or bool(
        (errors > 10).any() and not scores.size)
    return {"seed": seed, "code": code, "told": bool(shown["doubts"]), "wrong": wrong, "found": found["found"],
            "error": float(errors.max(initial=0.0)), "modes": len(shown["modes"]["measured_hz"]) if shown.get("modes") else 0,
            "words": " | ".join(shown["doubts"])[:260] or shown["status"]}


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.seed(0, "first")
    parser.cases("seeds", 60)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    rows = []
    for seed in range(given.first, given.first + given.seeds):
        row = run_case(seed)
        rows.append(row)
        print(row, flush=True)
    wrong = [row for row in rows if row["wrong"]]
    right = [row for row in rows if not row["wrong"]]
    print(f"right {len(right)} of {len(rows)}, of which doubted {sum(row['told'] for row in right)}")
    print(f"wrong {len(wrong)}, of which not doubted {sum(not row['told'] for row in wrong)}")


if __name__ == "__main__":
    sys.exit(main())
