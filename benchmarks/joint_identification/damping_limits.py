"""Depth limits of random machines whose joints differ in damping, against the response taken whole by an engine of its own.

The machines: benchmarks/joint_identification/joint_machines.py; a third with loss factors, a third with viscous dampers in some
joints besides, a third with viscous dampers alone. The cut: one of four tools at five speeds. `lobes FILE` and `lobes --frf` of
the response that `frf FILE --save` writes are set beside Hill's determinant on (K (1 + i eta) + i w C - w^2 M), solved at every
harmonic.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 \
        python benchmarks/joint_identification/damping_limits.py [--first 0] [--seeds 200] [--files]

With --files the saved response is charted too, which takes ten times as long. The last line is the figure.
"""

from __future__ import annotations

import sys
import tempfile
import warnings
from dataclasses import dataclass, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from benchmarks.joint_identification import joint_machines as jm
from toolpoint.cutting import HillDeterminant, stability
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.io import read_frf, uff
from toolpoint.machine import assemble, build
from toolpoint.studies.cuts.lobes_study import chart_lobes
from toolpoint.studies.cuts.tool_dynamics import machine_dynamics, response_dynamics
from toolpoint.vibration import SecondOrderSystem, frequency_response

TOOLS = (
    {"diameter": 0.05, "teeth": 4, "immersion": 0.5, "direction": "down"},
    {"diameter": 0.063, "teeth": 5, "immersion": 0.2, "direction": "up"},
    {"diameter": 0.08, "teeth": 6, "immersion": 0.6, "direction": "down"},
    {"diameter": 0.05, "teeth": 3, "immersion": 0.5, "direction": "up", "helix": 0.5},
)
KINDS = ("loss factors", "both", "dampers")
MAX_FREQUENCY_HZ = 1200.0


@dataclass(frozen=True, eq=False)
class WholeResponse(PlaneDynamics):
    """The response of a system taken whole at every frequency that is asked for; poles serve as hints of where to look."""

    system: SecondOrderSystem | None = None

    def response(self, frequency):
        assert self.system is not None
        f = np.asarray(frequency, float)
        lines, at = np.unique(np.abs(f), return_inverse=True)
        values = frequency_response.direct(self.system, lines).values[at.ravel()].reshape(*f.shape, 2, 2)
        return np.where((f < 0)[..., None, None], values.conj(), values)


def damped_otherwise(machine, kind: str, rng):
    """Return the machine with dampers in some joints, or in all in place of loss factors."""
    if kind == "loss factors":
        return machine
    joints = {}
    for name, joint in machine.description.joints.items():
        viscous = kind == "dampers" or rng.random() < 0.5
        omega = 2 * np.pi * float(np.exp(rng.uniform(np.log(25), np.log(90))))
        damping = {way: joint.loss_factor * k / omega for way, k in joint.stiffness.items()} if viscous else {}
        joints[name] = replace(joint, damping=damping, loss_factor=0.0 if viscous else joint.loss_factor)
    return build(replace(machine.description, joints=joints))


def limits_of(seed: int, with_files: bool) -> list[tuple]:
    """Return (kind, true limit, limit, stated error, whether the saved response agrees, its relative error) of every speed.

    Agreement is NaN where it was not asked, or where neither has a limit; no limit agrees with one whose error reaches the end.
    """
    rng = np.random.default_rng(seed + 7000)
    kind = KINDS[seed % 3]
    machine = damped_otherwise(jm.random_case(seed).machine, kind, rng)
    cut = TOOLS[int(rng.integers(len(TOOLS)))]
    speeds = np.sort(rng.uniform(600, 4000, 5))
    dynamics = machine_dynamics(machine)
    study = chart_lobes(dynamics, cut, speeds=speeds)
    system = assemble(machine, outputs=[dynamics.x, dynamics.y])
    plane = study.problem.plane
    whole = WholeResponse(plane.poles, plane.residues, plane.static, system=system)
    true = stability.chart(study.problem.changed(dynamics=whole), speeds, HillDeterminant(), depth_max=study.chart.depth_max)
    agrees, saved_error = np.full(5, np.nan), np.full(5, np.nan)
    if with_files:
        with tempfile.TemporaryDirectory() as folder:
            lines = np.arange(1.0, MAX_FREQUENCY_HZ, 0.1)
            uff.write(Path(folder) / "tip.uff", frequency_response.direct(system, lines))
            frf = read_frf([Path(folder) / "tip.uff"])
            # The machine file holds its coefficients; a response has none.
            coefficients = {"tangential": study.problem.coefficients.kt, "normal": study.problem.coefficients.kn}
            chart = chart_lobes(response_dynamics(frf, dynamics.x, dynamics.y), cut | coefficients, speeds=speeds).chart
            end = min(chart.depth_max, study.chart.depth_max)
            limits = [np.minimum(each.limit, end) for each in (study.chart, chart)]
            agrees = np.abs(limits[0] - limits[1]) <= study.chart.limit_error + chart.limit_error
            agrees = np.where((limits[0] < end) | (limits[1] < end), agrees, np.nan)
            saved_error = np.where(limits[1] < end, chart.limit_error / limits[1], np.nan)
    columns = [true.limit, study.chart.limit, study.chart.limit_error + true.limit_error, agrees, saved_error]
    return [(kind, *row) for row in np.stack(columns, axis=1)]


def summary(name: str, rows: list[tuple]) -> str:
    """Return the figures of some rows as a line."""
    table = np.array([row[1:] for row in rows], float).T
    agrees, saved_error = table[3:]
    true, mine, error = table[:3, np.isfinite(table[:2]).all(axis=0)]
    overlooked = int((np.isfinite(table[0]) != np.isfinite(table[1])).sum())
    off = np.abs(mine / true - 1)
    held = np.abs(mine - true) <= error
    text = (f"{name}: {true.size} limits, {overlooked} in one chart alone, "
            f"median error {100 * np.median(off):.3f} %, largest {100 * off.max():.2f} %, within "
            f"the stated error {100 * held.mean():.1f} %, too deep beyond it {100 * (mine - true > error).mean():.2f} %, "
            f"stated (median) {100 * np.median(error / mine):.2f} %")
    if np.isfinite(agrees).any():
        text += (f"; agrees with its saved response within both errors {100 * np.nanmean(agrees):.1f} % of "
                 f"{int(np.isfinite(agrees).sum())}, which states (median) {100 * np.nanmedian(saved_error):.2f} %")
    return text


def main() -> None:
    """Run the machines and print the figures of every kind of damping."""
    parser = CommandLine(__doc__)
    parser.seed(0, "first")
    parser.cases("seeds", 200)
    parser.add_argument("--files", action="store_true")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    rows: list[tuple] = []
    for seed in range(options.first, options.first + options.seeds):
        machine_rows = limits_of(seed, options.files)
        rows += machine_rows
        for row in machine_rows:
            if row[4] == 0:
                print(f"  {seed}: the saved response disagrees: {row}", flush=True)
        if (seed + 1) % 10 == 0:
            print(f"{seed + 1} machines", flush=True)
    for kind in KINDS:
        print(summary(kind, [row for row in rows if row[0] == kind]))
    print(summary("all", rows))


if __name__ == "__main__":
    main()
