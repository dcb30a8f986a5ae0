"""A machine updated to many responses on many lines: CPU time, and stiffnesses beside the true ones.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 \
        python benchmarks/updating/many_responses.py [--lines 1281] [--points 48] [--seed 0]

The published machining centre with feed drives (18 joint stiffnesses, each wrong by some 20 %), a force on one point, its
responses at `points` random points of all bodies in three directions, noise of 2 % of the root mean square of all responses
together (so weak responses hold noise alone at most lines). Counted are stiffnesses further from the truth than three of
their standard deviations.
"""

from __future__ import annotations

import sys
import time
import warnings
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import MACHINE_TEMPLATES, CommandLine
from toolpoint.io.yaml import machine_file
from toolpoint.machine import Machine, build
from toolpoint.machine.assembly.system import assemble
from toolpoint.machine.description import PointDescription, parameters
from toolpoint.studies.measured.measured_update import Measurement, update_machine
from toolpoint.vibration import Frf, frequency_response


def wrong_machine(points: int, rng: np.random.Generator) -> Machine:
    """Return the published machine with random points on its bodies."""
    file = MACHINE_TEMPLATES / "three_axis_vertical_drives.yaml"
    described = machine_file.read(file).description
    bodies = list(described.bodies)
    more = {f"p{i}": PointDescription(bodies[i % len(bodies)], tuple(rng.uniform(-0.4, 0.4, 3))) for i in range(points)}
    return build(replace(described, points={**described.points, **more}))


def measured(truth: Machine, points: int, lines: int, rng: np.random.Generator) -> Frf:
    """Return noisy responses of the true machine."""
    outputs = [f"p{i}:{way}" for i in range(points) for way in ("+x", "+y", "+z")]
    clean = frequency_response.direct(assemble(truth, None, outputs, inputs=["p5:+x"]), np.linspace(0.25, 320.25, lines))
    size = 0.02 * np.sqrt((np.abs(clean.values) ** 2).mean() / 2)
    shape = clean.values.shape
    return replace(clean, values=clean.values + size * (rng.normal(size=shape) + 1j * rng.normal(size=shape)))


def main() -> None:
    """Run and print; the figure last."""
    parser = CommandLine(__doc__)
    parser.add_argument("--lines", type=int, default=1281)
    parser.cases("points", 48)
    parser.seed(0)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    rng = np.random.default_rng(given.seed)
    machine = wrong_machine(given.points, rng)
    names = [path for path in parameters(machine.description) if ".stiffness." in path]
    truth = machine.with_values({name: machine.value(name) * float(np.exp(0.2 * rng.normal())) for name in names})
    frf = measured(truth, given.points, given.lines, rng)
    begin = time.process_time()
    fit = update_machine(machine, [Measurement(frf=frf)]).update.fit
    seconds = time.process_time() - begin
    far = 0
    for name, sd in zip(fit.free, np.sqrt(np.diag(fit.covariance)), strict=True):
        error = float(np.log(fit.values[name] / truth.value(name)))
        far += abs(error) > 3 * sd
        print(f"{name:40s}{100 * error:9.2f} % +- {100 * sd:.2g}")
    print(f"left alone: {', '.join(fit.left_alone) or 'none'}; {fit.status}")
    print(f"{len(frf.outputs)} responses x {given.lines} lines, {len(names)} parameters: {seconds:.1f} CPU s, "
          f"{far} of {len(fit.free)} stiffnesses beyond three standard deviations")


if __name__ == "__main__":
    main()
