"""The reduction of elastic bodies enters the stated error of limits."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint.bodies.solid import STEEL, Casting, Cuboid, Patch
from toolpoint.machine import build
from toolpoint.machine.description import (
    BodyDescription,
    FrameDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.machine.parts.elastic_body import reduce_solid
from toolpoint.studies.cuts.lobes_study import LobesStudy, chart_lobes
from toolpoint.studies.cuts.tool_dynamics import machine_dynamics

SPRINGS = {"x": 2e8, "y": 3e8, "z": 2.5e8, "rx": 1e6, "ry": 2e6, "rz": 8e5}
CUT = {"diameter": 0.05, "teeth": 4, "immersion": 0.5, "direction": "down", "tangential": 2e9, "normal": 7e8}


@pytest.fixture(scope="module")
def post():
    """A post with a foot and a head, 0.5 m high, in coarse elements."""
    model = Casting((Cuboid([0, 0, 0], [0.1, 0.06, 0.5]),), {"body": STEEL}).meshed(0.13)
    return model, {"foot": Patch([0.05, 0.03, 0], [1, 0, 0], [0, -1, 0], 0.1, 0.06),
                   "head": Patch([0.05, 0.03, 0.5], [1, 0, 0], [0, 1, 0], 0.1, 0.06)}


def lobes_of(post, **reduction) -> LobesStudy:
    inertia = InertiaDescription(0.05, 0.04, 0.06)
    bodies = {"post": BodyDescription(mass=1.0, inertia=inertia),
              "load": BodyDescription(mass=20.0, inertia=inertia, centre=(0.05, 0.03, 0.55))}
    joints = {"foot": JointDescription("ground", "post", FrameDescription((0.05, 0.03, 0)), SPRINGS, child_interface="foot"),
              "top": JointDescription("post", "load", FrameDescription((0.05, 0.03, 0.5)), SPRINGS, parent_interface="head")}
    description = MachineDescription("post", bodies, joints, points={"tip": PointDescription("load", (0.05, 0.03, 0.6))},
                                     tool="tip", damping_ratio=0.02)
    machine = build(description, {"post": reduce_solid(*post, **reduction)})
    return chart_lobes(machine_dynamics(machine), CUT, speeds=np.linspace(2000.0, 9000.0, 12))


def test_limits_of_a_poorly_reduced_body_hold_those_of_a_good_one(post) -> None:
    poor, good = lobes_of(post, band=900.0, size=3), lobes_of(post, band=4000.0)
    both = np.isfinite(poor.chart.limit) & np.isfinite(good.chart.limit)
    difference = np.abs(poor.chart.limit - good.chart.limit)[both]
    assert both.sum() >= 6
    assert difference.max() > 1e-3 * good.chart.limit[both].min()  # there is something to hold
    assert (difference <= poor.chart.limit_error[both] + good.chart.limit_error[both]).all()
    assert any("elastic bodies are reduced" in note for note in poor.chart.notes)
    assert (good.chart.limit_error[both] < poor.chart.limit_error[both]).all()
