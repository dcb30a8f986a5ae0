"""The reduction of elastic bodies enters the stated error of limits: of charts, of maps, of projects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from toolpoint._doubt import Doubt, mark_notes, read_marked
from toolpoint.bodies.solid import STEEL, Casting, Cuboid, Patch
from toolpoint.cutting import ZeroOrder
from toolpoint.cutting.description import CuttingDescription
from toolpoint.machine import Machine, build
from toolpoint.machine.description import (
    BodyDescription,
    FrameDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.machine.parts.elastic_body import reduce_solid
from toolpoint.material_removal import Stock
from toolpoint.project.limits.drawn_limits import CutQuestion, draw_limits
from toolpoint.project.limits.systems import MachineDraws
from toolpoint.studies.cuts.chatter_map import chatter_map
from toolpoint.studies.cuts.lobes_study import LobesStudy, chart_lobes
from toolpoint.studies.cuts.tool_dynamics import machine_dynamics
from toolpoint.studies.machining.setup import MachiningSetup
from toolpoint.studies.machining.solver import StabilitySolver
from toolpoint.studies.remark_kinds import first_of_each_kind

SPRINGS = {"x": 2e8, "y": 3e8, "z": 2.5e8, "rx": 1e6, "ry": 2e6, "rz": 8e5}
SPEEDS = np.linspace(2000.0, 9000.0, 7)
POOR, GOOD = {"band": 900.0, "size": 3}, {"band": 4000.0}
CUT = {"diameter": 0.05, "teeth": 4, "immersion": 0.5, "direction": "down", "tangential": 2e9, "normal": 7e8}


@pytest.fixture(scope="module")
def post():
    """A post with a foot and a head, 0.5 m high, in coarse elements."""
    model = Casting((Cuboid([0, 0, 0], [0.1, 0.06, 0.5]),), {"body": STEEL}).meshed(0.13)
    return model, {"foot": Patch([0.05, 0.03, 0], [1, 0, 0], [0, -1, 0], 0.1, 0.06),
                   "head": Patch([0.05, 0.03, 0.5], [1, 0, 0], [0, 1, 0], 0.1, 0.06)}


def machine_of(post, **reduction) -> Machine:
    inertia = InertiaDescription(0.05, 0.04, 0.06)
    bodies = {"post": BodyDescription(mass=1.0, inertia=inertia),
              "load": BodyDescription(mass=20.0, inertia=inertia, centre=(0.05, 0.03, 0.55))}
    joints = {"foot": JointDescription("ground", "post", FrameDescription((0.05, 0.03, 0)), SPRINGS, child_interface="foot"),
              "top": JointDescription("post", "load", FrameDescription((0.05, 0.03, 0.5)), SPRINGS, parent_interface="head")}
    description = MachineDescription("post", bodies, joints, points={"tip": PointDescription("load", (0.05, 0.03, 0.6))},
                                     tool="tip", damping_ratio=0.02)
    return build(description, {"post": reduce_solid(*post, **reduction)})


def lobes_of(post, **reduction) -> LobesStudy:
    return chart_lobes(machine_dynamics(machine_of(post, **reduction)), CUT, speeds=SPEEDS)


def assert_held(difference, error, limit) -> None:
    assert difference.size >= 6
    assert difference.max() > 1e-3 * limit.min()  # there is something to hold
    assert (difference <= error).all()


@pytest.mark.slow
def test_limits_of_a_poorly_reduced_body_hold_those_of_a_good_one(post) -> None:
    poor, good = lobes_of(post, **POOR), lobes_of(post, **GOOD)
    both = np.isfinite(poor.chart.limit) & np.isfinite(good.chart.limit)
    error = poor.chart.limit_error + good.chart.limit_error
    assert_held(np.abs(poor.chart.limit[both] - good.chart.limit[both]), error[both], good.chart.limit[both])
    assert any("elastic bodies are reduced" in note for note in poor.chart.notes)
    assert (good.chart.limit_error[both] < poor.chart.limit_error[both]).all()


@pytest.mark.slow
def test_a_map_over_feed_directions_holds_the_limits_of_a_good_reduction(post) -> None:
    poor, good = (chatter_map(machine_of(post, **reduction), [{}], CuttingDescription.of(**CUT), speeds=SPEEDS,
                              feed_angles=np.radians([0.0, 90.0]), method=ZeroOrder()) for reduction in (POOR, GOOD))
    both = np.isfinite(poor.limit) & np.isfinite(good.limit)
    assert_held(np.abs(poor.limit[both] - good.limit[both]), (poor.error + good.error)[both], good.limit[both])
    assert any("elastic bodies are reduced" in note for note in poor.notes)
    assert poor.worst().error > good.worst().error


def test_limits_of_a_project_hold_those_of_a_good_reduction(post) -> None:
    question = CutQuestion("steel", CuttingDescription.of(**CUT), 1e-9, tuple(SPEEDS.tolist()), {}, depth=1e-3)
    poor, good = (draw_limits(MachineDraws(machine_of(post, **reduction), 2, 0), question) for reduction in (POOR, GOOD))
    both = np.isfinite(poor.limit) & np.isfinite(good.limit)
    lower, upper = poor.interval(np.full(2, 0.5))
    difference = np.abs(poor.limit[both] - good.limit[both])
    assert_held(difference, (poor.error + good.error)[both], good.limit[both])
    assert ((lower - good.error <= good.limit) & (good.limit <= upper + good.error))[both].all()
    assert any("elastic bodies are reduced" in note for note in poor.notes)
    # A depth between both limits is neither surely stable nor surely not.
    speed = np.flatnonzero(both)[int(difference.argmax())]
    between = replace(question, speeds=(question.speeds[speed],), depth=float(poor.limit[speed] + good.limit[speed]) / 2)
    stable = draw_limits(MachineDraws(machine_of(post, **POOR), 2, 0), between).stable
    assert ((stable > 0) & (stable < 1)).all()


def test_doubts_stay_doubts_through_kept_maps_and_merged_remarks() -> None:
    doubts = [Doubt("reduction", f"at {count} of 12 speeds chatter lies above 900 Hz", "write a larger band")
              for count in (2, 7)]
    merged = first_of_each_kind(read_marked([*mark_notes([*doubts, "a note"]), ""]))
    assert merged == ("reduction: at 2 to 7 of 12 speeds chatter lies above 900 Hz; write a larger band", "a note")
    assert [isinstance(note, Doubt) for note in merged] == [True, False] and merged[0].remedy == "write a larger band"


@pytest.mark.slow
def test_limits_of_the_blocks_of_a_program_hold_those_of_a_good_reduction(post) -> None:
    setup = MachiningSetup(Stock.box((0, 0, -0.01), (0.04, 0.05, 0)), CuttingDescription.of(**CUT))
    poor, good = (StabilitySolver(setup, [machine_dynamics(machine_of(post, **reduction))]).chart(
        0, 0, (0.0, np.pi / 2), angle=0.3, speeds=SPEEDS, depth=5e-3) for reduction in (POOR, GOOD))
    both = np.isfinite(poor.limit) & np.isfinite(good.limit)
    held = np.abs(poor.limit[both] - good.limit[both]) <= (poor.limit_error + good.limit_error)[both]
    assert held.mean() > 0.9  # each mode is lowered alone: where lobes pass a speed, two at once change a limit by more
    assert (poor.limit_error[both] > 3 * good.limit_error[both]).all()
