"""Limits of uncertain responses that went through a file: whether their stated errors hold the truth, and match direct draws.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 \
        python benchmarks/substructuring/drawn_limits.py [--tips 40] [--machines 20] [--direct 4]

Tips: a random spindle in two planes (benchmarks/substructuring/coupling_records.py), a random end mill in a collet that is
known to 3 to 10 % and of a diameter known to 0.5 %; the tip is coupled, saved as HDF5 as `rcsa --save` does, read and charted
as `lobes --frf` does. The truth is the same spindle with a tool drawn from its deviations. Machines:
benchmarks/joint_identification/joint_machines.py, stiffnesses with errors of 3 to 10 % that joints share in part; `frf --save`,
then `lobes --frf`; and `lobes FILE` beside it. Direct: draws are charted by Hill's determinant. The last line is the figure.
"""

from __future__ import annotations

import sys
import tempfile
import warnings
from dataclasses import dataclass, field, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from benchmarks.joint_identification import joint_machines as jm
from benchmarks.substructuring.coupling_records import random_case
from toolpoint.cutting import stability
from toolpoint.io import read_frf, write_frf
from toolpoint.machine import build
from toolpoint.machine.description.machine import IdentifiedDescription
from toolpoint.studies.cuts.described_cut import build_problem
from toolpoint.studies.cuts.lobes_study import chart_lobes
from toolpoint.studies.cuts.tool_coupling import study_tool
from toolpoint.studies.cuts.tool_dynamics import machine_dynamics, response_dynamics
from toolpoint.studies.machines.machine_responses import study_responses_of_machine
from toolpoint.substructuring import couple_tool
from toolpoint.substructuring.receptance import PlaneReceptance
from toolpoint.substructuring.shaft import ContactDescription

IMMERSIONS = (("down", 0.5), ("up", 0.5), ("down", 0.15), ("down", 1.0))
DIRECT_DRAWS = 20


@dataclass
class Score:
    """Limits inside their stated error, relative half widths, and ratios of half widths to those of direct draws."""

    inside: list[bool] = field(default_factory=list)
    unsafe: list[bool] = field(default_factory=list)
    width: list[float] = field(default_factory=list)
    over_direct: list[float] = field(default_factory=list)

    def add(self, chart, truth):
        """Take the limits of a chart beside the true ones."""
        both = np.isfinite(chart.limit) & np.isfinite(truth)
        off = truth[both] - chart.limit[both]
        self.inside += (np.abs(off) <= chart.limit_error[both]).tolist()
        self.unsafe += (off < -chart.limit_error[both]).tolist()
        self.width += (chart.limit_error / chart.limit)[both].tolist()

    def words(self, name: str) -> str:
        """Return the score in words."""
        if not self.inside:
            return f"{name}: none"
        direct = f", half width over that of direct draws {np.median(self.over_direct):.2f}" if self.over_direct else ""
        inside, unsafe = 100 * np.mean(self.inside), 100 * np.mean(self.unsafe)
        return (f"{name}: {inside:.1f} % of {len(self.inside)} limits inside, {unsafe:.1f} % unsafe beyond, median half "
                f"width {100 * np.median(self.width):.1f} %{direct}")


def cut_of(rng: np.random.Generator, diameter: float) -> dict[str, object]:
    """Return a random cut."""
    direction, immersion = IMMERSIONS[int(rng.integers(len(IMMERSIONS)))]
    return {"diameter": diameter, "teeth": int(rng.integers(2, 6)), "tangential": 8e8, "normal": 2.5e8, "immersion": immersion,
            "direction": direction}


def tip_case(seed: int, score: Score, *, direct: bool) -> None:
    """Judge one coupled tip."""
    rng = np.random.default_rng(seed)
    spindles = [random_case(rng), random_case(rng)]
    frequency = np.arange(60.0, 3500.0, 2.0)
    w = 2 * np.pi * frequency
    bases = [PlaneReceptance(frequency, case.base(w), plane) for case, plane in zip(spindles, "xy", strict=True)]
    tool = spindles[0].tool
    blank = tool.segments["blank"]
    contact = ContactDescription(10 ** rng.uniform(8.0, 8.8), 10 ** rng.uniform(4.7, 5.5), 0.05)
    tool = replace(tool, segments={**tool.segments, "blank": replace(blank, contact=contact)},
                   contact_deviation=rng.uniform(0.03, 0.1), diameter_deviation=0.005)
    cut = cut_of(rng, blank.diameter)
    result = study_tool(bases, tool, generator=np.random.default_rng(1))
    with tempfile.TemporaryDirectory() as name:
        write_frf(result.frf, Path(name) / "tip.h5")
        back = read_frf(Path(name) / "tip.h5")
    dynamics = response_dynamics(back, what="tip.h5")
    speeds = np.sort(rng.uniform(4000, 18000, 12))
    chart = chart_lobes(dynamics, cut, speeds=speeds).chart
    true_tool = tool.drawn(rng)
    truth = replace(back, draws=None, variance=None)
    truth = replace(truth, values=np.stack([couple_tool(base, replace(true_tool, contact_deviation=0.0, diameter_deviation=0.0)
                                                        ).values[:, 0, 0] for base in bases], axis=-1)[:, :, None] * np.eye(2))
    score.add(chart, limits(truth, cut, chart))
    if direct:
        drawn = np.array([limits(back.at_draw(k), cut, chart) for k in range(DIRECT_DRAWS)])
        compare(score, chart, drawn)


def limits(frf, cut, chart):
    """Return the limits of a response by Hill's determinant, m."""
    problem = build_problem(response_dynamics(frf, what="the truth"), cut)[0]
    return stability.chart(problem, chart.speeds, depth_max=2 * chart.depth_max).limit


def compare(score: Score, chart, drawn) -> None:
    """Take the half widths of a chart over those of direct draws."""
    deviation = np.log(np.minimum(drawn, 2 * chart.depth_max)).std(axis=0, ddof=1)
    lower, upper = chart.ratio_ends
    keep = np.isfinite(chart.limit) & (deviation > 1e-3)
    score.over_direct += (np.log(upper / lower) / 2 / (2.05 * deviation))[keep].tolist()


def identified(machine, rng):
    """Return the machine with numbers known to some per cent, partly shared, and a true one drawn from them."""
    paths, values, sizes = [], [], []
    for name, joint in machine.description.joints.items():
        for way in joint.stiffness or {}:
            paths.append(f"joints.{name}.stiffness.{way}")
            values.append(joint.stiffness[way])
            sizes.append(rng.uniform(0.03, 0.1))
    deviation = np.array(values) * np.array(sizes)
    correlation = 0.5 * np.eye(len(paths)) + 0.5
    covariance = correlation * np.outer(deviation, deviation)
    rows = tuple(tuple(map(float, row[:k + 1])) for k, row in enumerate(covariance))
    told = build(replace(machine.description, identified=IdentifiedDescription(tuple(paths), rows)))
    errors = np.linalg.cholesky(covariance) @ rng.normal(size=len(paths))
    true = build(machine.description).with_values({path: float(max(v + e, 0.2 * v))
                                                   for path, v, e in zip(paths, values, errors, strict=True)})
    return told, true


def machine_case(seed: int, by_file: Score, by_response: Score) -> None:
    """Judge the limits of one machine by its file and by its saved response."""
    rng = np.random.default_rng(50_000 + seed)
    case = jm.random_case(seed)
    told, true = identified(case.machine, rng)
    cut = cut_of(rng, 0.05) | {"speeds": (800.0, 5000.0)}
    speeds = np.sort(rng.uniform(1000, 5000, 10))
    study = chart_lobes(machine_dynamics(told), cut, speeds=speeds)
    truth = chart_lobes(machine_dynamics(true), cut, speeds=speeds).chart.limit
    lower, upper = study.spread.ends(study.chart.limit)
    both = np.isfinite(truth) & np.isfinite(study.chart.limit) & np.isfinite(upper)
    by_file.inside += ((lower <= truth) & (truth <= upper))[both].tolist()
    by_file.unsafe += (truth < lower)[both].tolist()
    by_file.width += ((upper - lower) / 2 / study.chart.limit)[both].tolist()
    modes = machine_dynamics(told).response
    top = min(1.6 * float(modes.frequency.max()), 1500.0)
    lines = np.arange(2.0, top, max(0.25, 0.15 * float((modes.frequency * modes.damping_ratio).min())))
    frf = study_responses_of_machine(told, frequency=lines, keep_draws=True).frfs[0]
    with tempfile.TemporaryDirectory() as name:
        write_frf(frf, Path(name) / "tip.h5")
        back = read_frf(Path(name) / "tip.h5")
    by_response.add(chart_lobes(response_dynamics(back, what="tip.h5"), cut, speeds=speeds).chart, truth)


def main() -> None:
    parser = CommandLine(__doc__)
    parser.seed(0, "first")
    parser.cases("tips", 40)
    parser.add_argument("--machines", type=int, default=20)
    parser.add_argument("--direct", type=int, default=4)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    tips, by_file, by_response = Score(), Score(), Score()
    for k in range(options.tips):
        tip_case(options.first + k, tips, direct=k < options.direct)
        print(k, tips.words("tips"), flush=True)
    for k in range(options.machines):
        machine_case(options.first + k, by_file, by_response)
        print(k, by_file.words("by file"), by_response.words("by response"), flush=True)
    print("; ".join([tips.words("coupled tips"), by_file.words("machine files"), by_response.words("their saved responses")]))


if __name__ == "__main__":
    main()
