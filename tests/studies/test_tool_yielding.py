"""Shares of the springs in the tool's yielding: by the closed form of two springs in a row, and by finite differences."""

from pathlib import Path

import numpy as np
import pytest

from toolpoint import io
from toolpoint.machine import build
from toolpoint.machine.description import (
    BodyDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.studies.machines.tool_point import tool_point
from toolpoint.studies.machines.tool_yielding import compliance_shares, softest_joint, yielding_sentence

ROOT = Path(__file__).resolve().parents[2]


def test_two_slides_in_a_row_share_the_yielding_inversely_to_their_springs():
    body = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    joints = {"lower": JointDescription("ground", "slide", stiffness={"x": 1e7}),
              "upper": JointDescription("slide", "head", stiffness={"x": 3e7})}
    machine = build(MachineDescription("pair", {"slide": body, "head": body}, joints, tool="tip", damping_ratio=0.02,
                                       points={"tip": PointDescription("head")}))
    shares = compliance_shares(machine)
    assert shares == pytest.approx({"joints.lower.stiffness.x": 0.75, "joints.upper.stiffness.x": 0.25})
    assert softest_joint(shares) == ("lower", pytest.approx(0.75))
    assert yielding_sentence(shares) == "Most of the tool's static compliance, 75 %, comes from the joint lower."


def test_shares_are_the_slope_of_the_compliance_and_add_up_to_one():
    machine = io.read_machine(ROOT / "src/toolpoint/project/demo_mill.yaml")
    shares = compliance_shares(machine)
    assert sum(shares.values()) == pytest.approx(1, abs=1e-9)

    def compliance(path, factor):
        changed = machine.with_values({path: factor * machine.value(path)})
        return float(np.trace(np.real(tool_point(changed, [{}], np.array([0.0, 1.0])).frf.values[0, 0])))
    for path in ("joints.column_head.stiffness.rx", "joints.bed_table.stiffness.x"):
        slope = -np.log(compliance(path, 1.001) / compliance(path, 0.999)) / np.log(1.001 / 0.999)
        assert shares[path] == pytest.approx(slope, abs=1e-5)


def test_a_machine_without_a_tool_or_on_loose_ground_has_no_shares():
    body = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    foot = JointDescription("ground", "head", stiffness={"x": 1e7})
    machine = build(MachineDescription("one", {"head": body}, {"foot": foot}))
    assert compliance_shares(machine) == {} and yielding_sentence({}) == ""
