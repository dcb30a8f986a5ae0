"""Goals and programs of tools that stand on the machine by their shaft files: limits, draws, what is run again, refusals."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from toolpoint import io
from toolpoint._check import ToolpointError
from toolpoint.cutting import stability
from toolpoint.machine import build
from toolpoint.machine.attached_tool import attach_tool
from toolpoint.machine.description import (
    BodyDescription,
    IdentifiedDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.project import Project
from toolpoint.project.limits.attached_tool_draws import AttachedToolDraws
from toolpoint.project.limits.drawn_limits import CutQuestion, DrawnLimits
from toolpoint.project.limits.systems import MachineDraws, problem_of
from toolpoint.project.steps.answering import _numbers
from toolpoint.samples import write_samples
from toolpoint.studies.cuts.tool_dynamics import machine_dynamics

SHAFT = """toolpoint: 1
name: end mill
segments:
  holder: {length: 60 mm, diameter: 40 mm, loss_factor: 2 %}
  shank: {length: 70 mm, diameter: 12 mm, material: carbide, loss_factor: 2 %}
"""
PROJECT = """toolpoint: 1
name: coupled
machine: machine.yaml
coupling: {tool: tool.yaml, segment: shank, point: nose}
cuts:
  half: {diameter: 12 mm, teeth: 4, immersion: 0.5, tangential: 800 MPa, normal: 300 MPa, speeds: 10000 40000 rpm,
         coefficient_deviation: 2 %}
goals:
  short: {speed: 30000 rpm, depth: 0.2 mm, stick_out: 60 mm}
  long: {speed: 30000 rpm, depth: 0.2 mm, stick_out: 90 mm}
draws: 20
"""


def mill(*, identified=False):
    """A head on springs over a table that stands still; its spring along x is known to 3 %."""
    joint = JointDescription("ground", "head", stiffness={"x": 6e7, "y": 9e7, "z": 2e8, "rx": 8e6, "ry": 6e6, "rz": 5e6})
    head = BodyDescription(150.0, centre=(0.0, 0.0, 0.3), inertia=InertiaDescription(6.0, 6.0, 4.0))
    numbers = IdentifiedDescription(("joints.way.stiffness.x",), (((0.03 * 6e7) ** 2,),)) if identified else None
    return MachineDescription("mill", {"head": head}, {"way": joint}, points={"nose": PointDescription("head")}, tool="nose",
                              identified=numbers, damping_ratio=0.03)


@pytest.fixture
def folder(tmp_path):
    place = tmp_path / "mill"
    place.mkdir()
    io.write_machine(mill(), place / "machine.yaml")
    (place / "tool.yaml").write_text(SHAFT)
    (place / "project.yaml").write_text(PROJECT)
    return place


@pytest.mark.slow
def test_a_goal_of_a_stick_out_has_the_limit_of_the_machine_with_that_tool(folder):
    results = Project.open(folder).run()
    goals = results.to_dict()["goals"]
    tool = io.read_shaft(folder / "tool.yaml")
    cut = Project.open(folder).description.cuts["half"].cut
    for name, length in (("short", 0.06), ("long", 0.09)):
        whole = machine_dynamics(attach_tool(build(mill()), "nose", tool.with_length("shank", length)))
        limit = stability.chart(problem_of(whole, cut), np.array([30000.0])).limit[0]
        assert goals[name]["limit_m"] == pytest.approx(limit, rel=1e-4)
    assert abs(goals["short"]["limit_m"] / goals["long"]["limit_m"] - 1) > 0.1
    assert any("no tool was struck at this length" in doubt for doubt in results.doubts)
    (folder / "project.yaml").write_text(PROJECT.replace("stick_out: 90 mm", "stick_out: 80 mm"))
    actions = {}
    Project.open(folder).run(listen=lambda event: actions.update({event.decision.step: event.decision.action}))
    assert actions == {"machine": "fresh", "limits/short": "fresh", "limits/long": "run"}


@pytest.mark.slow
def test_draws_are_those_of_the_machine_with_shafts_of_their_own_and_shares_add_up():
    machine = build(mill(identified=True))
    shaft = replace(_shaft(), modulus_deviation=0.02)
    draws = AttachedToolDraws(machine, 10, 3, "nose", shaft, 0.13)
    bare = MachineDraws(machine, 10, 3).samples
    for sample, alone in zip(draws.samples, bare, strict=True):
        assert sample.value("joints.way.stiffness.x") == alone.value("joints.way.stiffness.x")
    moduli = {sample.description.bodies["attached tool 1"].beam.segments["rod"].modulus for sample in draws.samples}
    assert len(moduli) == 10
    cut = replace(_cut(), engagement=_cut().engagement)
    shares = draws.shares({}, cut)
    assert set(shares) == {"joint way", "tool"} and sum(shares.values()) == pytest.approx(1.0)
    assert draws.shares({}, cut)["tool"] > 0.2  # the tool's own mode is the softest
    exact = AttachedToolDraws(build(mill()), 10, 3, "nose", _shaft(), 0.13)
    assert len(set(map(id, exact.samples))) == 1


def _shaft():
    from toolpoint.substructuring import SegmentDescription, ShaftDescription

    return ShaftDescription({"rod": SegmentDescription(0.13, 0.016, loss_factor=0.02)})


def _cut():
    from toolpoint.cutting.description import CuttingDescription

    return CuttingDescription.of(diameter=0.016, teeth=4, immersion=0.5, tangential=8e8, normal=3e8)


@pytest.mark.slow
def test_a_goal_on_a_struck_gauge_needs_no_machine(tmp_path):
    write_samples("rcsa", tmp_path / "mill")
    text = PROJECT.replace("machine: machine.yaml\n", "").replace("point: nose", "gauge: gauge.yaml, responses: [gauge.uff], "
                                                                  "noise: 0.3 %").replace("60 mm", "65 mm")
    (tmp_path / "mill/project.yaml").write_text(text)
    project = Project.open(tmp_path / "mill")
    results = project.run()
    lower, upper = results.to_dict()["goals"]["short"]["interval_m"]
    assert lower < results.to_dict()["goals"]["short"]["limit_m"] < upper


@pytest.mark.slow
def test_a_program_has_the_draws_of_each_tool(folder):
    (folder / "cut3.yaml").write_text("toolpoint: 1\ncutting: {diameter: 12 mm, teeth: 4, tangential: 800 MPa, "
                                      "normal: 300 MPa}\n")
    (folder / "slots.nc").write_text("S9000 M3\nT1 M6\nG0 X-20 Y0 Z-0.1\nG1 X60 F1200\nG0 Z20\nT3 M6\nG0 X-20 Y30\nZ-0.1\n"
                                     "G1 X60 F1200\nG0 Z20\n")
    start = PROJECT[:PROJECT.index("goals:")]
    (folder / "project.yaml").write_text(start + """programs:
  slots: {program: slots.nc, stock: "box=0,-9,-20,40,37,0", spacing: 0.5 mm, tools: {3: cut3.yaml}, shafts: {3: tool.yaml}}
draws: 20
""")
    Project.open(folder).run()
    data = json.loads((folder / "results/program/slots/program.json").read_text())
    limits = {place["tool"]: place["limit_m"] for place in reversed(data["places"])}
    assert limits[3] is not None and (limits[1] is None or limits[3] < 0.7 * limits[1])  # none within four times the depth
    command = next(step.command for step in Project.open(folder).chain.steps if step.name == "program/slots")
    assert "--shaft 3=tool.yaml --at nose" in command


@pytest.mark.parametrize(("old", "new", "words"), [
    ("coupling: {tool: tool.yaml, segment: shank, point: nose}\n", "", "needs the section coupling"),
    ("stick_out: 60 mm", "stick_out: 60", "unit"),
])
def test_what_is_missing_or_far_is_refused(folder, old, new, words):
    (folder / "project.yaml").write_text(PROJECT.replace(old, new))
    with pytest.raises(ToolpointError, match=words):
        io.read_project(folder / "project.yaml")


def test_a_far_length_is_told_by_its_step_and_stops_no_other(folder):
    (folder / "project.yaml").write_text(PROJECT.replace("stick_out: 60 mm", "stick_out: 600 mm").replace("90 mm", "80 mm"))
    steps = {entry["step"]: entry for entry in Project.open(folder).run(["limits/short", "machine"]).to_dict()["steps"]}
    assert steps["limits/short"]["state"] == "failed" and "within a factor of 1.6" in steps["limits/short"]["words"]
    assert steps["machine"]["state"] == "done"


@pytest.mark.parametrize("count", [20, 60, 100])
def test_without_tried_cuts_the_limit_is_that_of_the_likeliest_system(count):
    """Weights of 1/20 or 1/100 have a standard deviation of some 1e-18, and are equal all the same."""
    question = CutQuestion("half", _cut(), 0.1, (9000.0,), {}, 1e-3)
    drawn = np.linspace(1e-3, 3e-3, count)[:, None]
    limits = DrawnLimits(question, np.array([1.7e-3]), np.zeros(1), np.array([900.0]), drawn, np.ones((count, 1)),
                         np.full((count, 1), 900.0), 0.02, {})
    assert _numbers(limits, np.full(count, 1 / count))["limit_m"] == 1.7e-3
    tried = np.arange(1.0, count + 1)
    assert _numbers(limits, tried / tried.sum())["limit_m"] != 1.7e-3
