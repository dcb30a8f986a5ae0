"""Tools on random machines by their shaft files: coupled responses against the machine with the tool as a body of it.

Six templates in turn (two Cartesian machines, two parallel heads, a hexapod, a robot), every spring times a factor of 0.5 to 2,
Cartesian machines at random poses; random shafts (one to three segments, bores, flutes, elastic contacts) at the tool point.
Where a template states one damping ratio for all modes, both ways differ by what tells it from loss factors (some per cent).
Beside the agreement of both ways, what it costs to leave out what coupling by planes left out before: the table, and what the
machine couples between x and y; as the ratio of the least limit of a slot.

    python benchmarks/substructuring/tools_on_machines.py --machines 40
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from benchmarks.frame import MACHINE_TEMPLATES, CommandLine
from toolpoint import io
from toolpoint.cutting import stability
from toolpoint.cutting.description import CuttingDescription
from toolpoint.machine import Machine
from toolpoint.machine.attached_tool import attach_tool
from toolpoint.studies.cuts.coupling.machine_spindle import bases_of_machine, couple_tips, tip_frf
from toolpoint.studies.machines.tool_point import milling_problem, tool_point
from toolpoint.substructuring import ContactDescription, SegmentDescription, ShaftDescription
from toolpoint.vibration import Frf

LINES = np.linspace(20.0, 3000.0, 1500)  # Hz
CUT = CuttingDescription.of(diameter=0.016, teeth=4, direction="slot", tangential=8e8, normal=3e8)
SPEEDS = np.linspace(4000.0, 12000.0, 5)  # rev/min
LOSS_FACTOR = 0.02  # of every segment
TEMPLATES = ("three_axis_vertical", "gantry", "three_rps_head", "three_rps_elastic_head", "hexapod_6_ups", "milling_robot")
CARTESIAN = TEMPLATES[:2]


def random_machine(seed: int, rng: np.random.Generator) -> tuple[Machine, dict[str, float]]:
    """Return a template with other springs, and a pose of it."""
    name = TEMPLATES[seed % len(TEMPLATES)]
    machine = io.read_machine(MACHINE_TEMPLATES / f"{name}.yaml")
    values = {f"joints.{joint}.stiffness.{way}": size * 2 ** rng.uniform(-1, 1)
              for joint, part in machine.description.joints.items() if part.law is None for way, size in part.stiffness.items()}
    pose = {axis.name: axis.lower + rng.uniform(0.3, 0.7) * (axis.upper - axis.lower) for axis in machine.chain.axes
            if name in CARTESIAN}
    return machine.with_values(values), pose


def random_shaft(rng: np.random.Generator) -> ShaftDescription:
    """Return a holder and up to two slimmer segments beyond it."""
    segments, diameter = {}, rng.uniform(0.03, 0.06)
    for number in range(rng.integers(1, 4)):
        contact = ContactDescription(10 ** rng.uniform(8, 9), 10 ** rng.uniform(5, 6), 0.05) if rng.random() < 0.5 else None
        segments[f"part {number + 1}"] = SegmentDescription(
            rng.uniform(0.03, 0.09), diameter, bore=rng.choice([0.0, 0.2 * diameter]), loss_factor=LOSS_FACTOR,
            material=rng.choice(["steel", "carbide"]), fluted=bool(number == 2), contact=contact)
        diameter *= rng.uniform(0.5, 0.9)
    return ShaftDescription(segments, name="tool")


def least_limit(frf: Frf) -> float:
    """Return the least limit of a slot over the speeds, m."""
    problem = milling_problem(CUT, frf, "tool:+x", y="tool:+y")
    return float(np.min(stability.chart(problem, SPEEDS).limit))


def compare(machine: Machine, pose: dict[str, float], shaft: ShaftDescription) -> tuple[float, float]:
    """Return the largest difference of both responses over their peak, and the limit without table and cross response over
    that with them."""
    point = str(machine.description.tool)
    whole = tool_point(attach_tool(machine, point, shaft), [pose], LINES).frf.values[0, :, :2, :2]
    coupled = tip_frf(couple_tips(bases_of_machine(machine, point, LINES, pose=pose), shaft, None))
    alone = machine.rebuild(replace(machine.description, table=None))
    by_planes = tip_frf(replace(couple_tips(bases_of_machine(alone, point, LINES, pose=pose), shaft, None), cross=None))
    difference = float(np.abs(coupled.values - whole).max() / np.abs(whole).max())
    return difference, least_limit(by_planes) / least_limit(coupled)


def main() -> None:
    """Compare over random machines and shafts."""
    parser = CommandLine(__doc__)
    parser.cases("machines", 40)
    parser.seed(0)
    options = parser.parse_args()
    rows = []
    for seed in range(options.seed, options.seed + options.machines):
        rng = np.random.default_rng(seed)
        rows.append(compare(*random_machine(seed, rng), random_shaft(rng)))
        print(f"{seed:4d}  responses differ by {rows[-1][0]:.1e} of the peak; by planes without the table the limit is "
              f"{rows[-1][1]:.3f} times that", flush=True)
    difference, ratio = np.array(rows).T
    print(f"{len(rows)} machines: responses within {difference.max():.1e} of their peak (median {np.median(difference):.1e}); "
          f"by planes without the table limits would be {np.nanmin(ratio):.2f} .. {np.nanmax(ratio):.2f} times those")


if __name__ == "__main__":
    main()
