"""Tools of a program that have a tip of their own: each block has its own tool's limit, and what stands for others is said."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint import ToolpointError, studies
from toolpoint.cutting import stability
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.program.gcode import parse
from toolpoint.machine import Machine, build
from toolpoint.machine.attached_tool import attach_tool
from toolpoint.machine.description import (
    BodyDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics, machine_dynamics
from toolpoint.studies.machines.tool_point import milling_problem
from toolpoint.studies.machining.result import MachiningStudy
from toolpoint.substructuring import SegmentDescription, ShaftDescription
from toolpoint.vibration import Modes

CUT = CuttingDescription.of(diameter=0.016, teeth=4, tangential=8e8, normal=3e8)
LONG = CuttingDescription.of(diameter=0.012, teeth=4, tangential=8e8, normal=3e8)
SHAFT = ShaftDescription({"holder": SegmentDescription(0.06, 0.05, loss_factor=0.02),
                          "tool": SegmentDescription(0.07, 0.012, material="carbide", loss_factor=0.02)})
TEXT = """S4000 M3
T1 M6
G0 X-20 Y0 Z-0.5
G1 X60 F1200
G0 Z20
T3 M6
G0 X-20 Y30
Z-0.5
G1 X60 F1200
G0 Z20
"""


@pytest.fixture(scope="module")
def mill() -> Machine:
    """A head on springs over a rigid table."""
    joint = JointDescription("ground", "head", stiffness={"x": 6e7, "y": 9e7, "z": 2e8, "rx": 8e6, "ry": 6e6, "rz": 5e6},
                             loss_factor=0.04)
    head = BodyDescription(150.0, centre=(0.0, 0.0, 0.3), inertia=InertiaDescription(6.0, 6.0, 4.0))
    return build(MachineDescription("mill", {"head": head}, {"way": joint}, points={"nose": PointDescription("head")},
                                    tool="nose"))


def run(mill: Machine | ToolDynamics, tips: studies.ToolTips | None) -> MachiningStudy:
    setup = studies.describe_machining(studies.stock_of("box", (0, -0.009, -0.02, 0.04, 0.037, 0)), CUT, cuts={1: CUT, 3: LONG},
                                       spacing=5e-4)
    return studies.run_program(parse(TEXT, start=(0, 0, 0.05)), setup, mill, tips=tips, text=TEXT)


def limits_of_tool(study: MachiningStudy, number: int) -> np.ndarray:
    assert study.judged is not None and study.margins is not None
    return study.margins.limit[study.laid.tool[study.judged.block] == number]


def chart_limit(dynamics: ToolDynamics, cut: CuttingDescription) -> float:
    """Return the limit of a whole slot along x at the program's speed."""
    problem = milling_problem(cut.replaced(direction="slot", immersion=1.0), dynamics.response, dynamics.x, y=dynamics.y)
    return float(stability.chart(problem, np.array([4000.0])).limit[0])


@pytest.mark.slow
def test_each_block_has_the_limit_of_its_own_tool_on_the_machine(mill):
    study = run(mill, studies.ToolTips(shafts={3: SHAFT}, point="nose"))
    own = chart_limit(machine_dynamics(attach_tool(mill, "nose", SHAFT)), LONG)
    foreign = chart_limit(machine_dynamics(mill), CUT)
    assert own < 0.5 * foreign  # or the law would not tell one from the other
    assert np.nanmedian(limits_of_tool(study, 3)) == pytest.approx(own, rel=1e-6)
    assert np.nanmedian(limits_of_tool(study, 1)) == pytest.approx(foreign, rel=1e-6)
    assert any("tools 1 are given the response" in doubt for doubt in study.doubts)
    setup, stand = study.setup, machine_dynamics(mill)
    assert "tools 1, 3 are given" in studies.ToolTips().doubts(setup, (1, 3), stand)[0]
    assert not studies.ToolTips(shafts={1: SHAFT, 3: SHAFT}, point="nose").doubts(setup, (1, 3), stand)


def test_a_struck_tip_stands_for_its_tool_at_every_pose_and_is_doubted(mill):
    tip = studies.modal_dynamics(Modes([900.0, 1100.0], [0.02, 0.02], [[4.0, 0], [0, 3.5]], ("tool:+x", "tool:+y")))
    study = run(mill, studies.ToolTips(struck={3: tip}))
    assert np.nanmedian(limits_of_tool(study, 3)) == pytest.approx(chart_limit(tip, LONG), rel=1e-6)
    assert any("have one response all along the program" in doubt for doubt in study.doubts)


def test_what_does_not_go_together_is_refused(mill):
    tip = studies.modal_dynamics(Modes([900.0], [0.02], [[4.0], [0.0]], ("tool:+x", "tool:+y")))
    with pytest.raises(ToolpointError, match="tool 3: has a response and a shaft"):
        studies.ToolTips(struck={3: tip}, shafts={3: SHAFT}, point="nose")
    with pytest.raises(ToolpointError, match="need the point"):
        studies.ToolTips(shafts={3: SHAFT})
    with pytest.raises(ToolpointError, match="its shaft needs a machine"):
        run(tip, studies.ToolTips(shafts={3: SHAFT}, point="nose"))
