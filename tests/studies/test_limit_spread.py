"""Law: intervals of limits from ratios of single-frequency limits are those of machines that are charted one by one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from toolpoint.cutting import stability
from toolpoint.machine import build
from toolpoint.machine.description import (
    BodyDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.machine.description.machine import IdentifiedDescription
from toolpoint.studies.cuts.described_cut import build_problem
from toolpoint.studies.cuts.limit_spread import spread_of_limits
from toolpoint.studies.cuts.tool_dynamics import machine_dynamics, modal_dynamics
from toolpoint.studies.cuts.work_dynamics import with_work
from toolpoint.studies.machines.machine_uncertainty import MACHINE_DRAW_COUNT, machine_uncertainty
from toolpoint.vibration import Modes

CUT = {"diameter": 0.05, "teeth": 4, "immersion": 0.5, "direction": "down", "tangential": 8e9, "normal": 3e9}
SPEEDS = np.array([1300.0, 1900.0, 2600.0, 3700.0])


def identified_machine():
    """A column and a head on springs that are known to 5 % together and 3 % each."""
    inertia = InertiaDescription(5.0, 5.0, 5.0)
    bodies = {"column": BodyDescription(400.0, inertia=inertia), "head": BodyDescription(150.0, inertia=inertia)}
    joints = {"foot": JointDescription("ground", "column", stiffness={"x": 6e7, "y": 9e7}, loss_factor=0.05),
              "guide": JointDescription("column", "head", stiffness={"x": 1.2e8, "y": 1.5e8}, loss_factor=0.05)}
    paths = tuple(f"joints.{name}.stiffness.{way}" for name, joint in joints.items() for way in joint.stiffness)
    values = np.array([6e7, 9e7, 1.2e8, 1.5e8])
    covariance = (0.05**2 + 0.03**2 * np.eye(4)) * np.outer(values, values)
    rows = tuple(tuple(map(float, row[:k + 1])) for k, row in enumerate(covariance))
    description = MachineDescription("pair", bodies, joints, points={"tip": PointDescription("head")}, tool="tip")
    return build(replace(description, identified=IdentifiedDescription(paths, rows)))


@pytest.mark.slow
def test_the_spread_is_that_of_exact_charts_of_the_same_machines() -> None:
    machine = identified_machine()
    dynamics = machine_dynamics(machine)
    problem = build_problem(dynamics, CUT)[0]
    chart = stability.chart(problem, SPEEDS, depth_max=0.02)
    spread = spread_of_limits(dynamics, CUT, chart)
    assert spread is not None and spread.samples == MACHINE_DRAW_COUNT
    uncertainty = machine_uncertainty(machine)
    assert uncertainty is not None
    exact = np.array([stability.chart(build_problem(machine_dynamics(sample), CUT)[0], SPEEDS, depth_max=0.04).limit
                      for sample in uncertainty.samples(MACHINE_DRAW_COUNT, np.random.default_rng(0))])
    finite = np.isfinite(chart.limit) & np.isfinite(exact).all(axis=0)
    assert finite.sum() >= 3
    assert spread.deviation[finite] == pytest.approx(np.log(exact[:, finite]).std(axis=0, ddof=1), rel=0.3)
    assert (spread.deviation[finite] > 0.02).all()


@pytest.mark.slow
def test_a_work_that_gives_way_takes_its_part_of_the_spread() -> None:
    """Limits beside a work that yields far more do not depend on the machine's numbers; beside a stiff one as before."""
    machine, speeds = machine_dynamics(identified_machine()), SPEEDS[1:2]
    spreads = {}
    for name, size in (("stiff", 1e-6), ("soft", 0.3)):
        wall = modal_dynamics(Modes([95.0, 110.0], [0.02, 0.02], size * np.eye(2), ["wall:+x", "wall:+y"]))
        both = with_work(machine, wall)
        chart = stability.chart(build_problem(both, CUT)[0], speeds, depth_max=0.02)
        spreads[name] = spread_of_limits(both, CUT, chart)
    alone = spread_of_limits(machine, CUT, stability.chart(build_problem(machine, CUT)[0], speeds, depth_max=0.02))
    finite = np.isfinite(alone.deviation) & np.isfinite(spreads["stiff"].deviation)
    # Beside a work the machine's structural modes are lines, of which 8 draws are charted exactly, of modes all 40.
    ratio = spreads["stiff"].deviation[finite] / alone.deviation[finite]
    assert finite.any() and np.all((ratio > 0.4) & (ratio < 2.5))
    assert np.nanmax(spreads["soft"].deviation) < 0.3 * np.nanmax(alone.deviation)
