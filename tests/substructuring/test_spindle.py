"""A tool coupled to a machine's spindle is the machine with that tool as a body of it: table, tilt and both planes included."""

from dataclasses import replace

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.machine import build
from toolpoint.machine.description import (
    AxisDescription,
    BodyDescription,
    FrameDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.machine.description.beam import BeamDescription, BeamSegment
from toolpoint.studies.cuts.coupling.machine_spindle import bases_of_machine, couple_tips, tip_frf
from toolpoint.studies.machines.tool_point import tool_point
from toolpoint.substructuring import (
    ContactDescription,
    PlaneReceptance,
    SegmentDescription,
    ShaftDescription,
    SpindleReceptance,
    couple_spindle,
    couple_tool,
)

LINES = np.linspace(15.0, 1500.0, 300)
NOSE, LENGTH, DIAMETER, LOSS = (0.02, -0.04, 0.55), 0.18, 0.03, 0.03
ROD = ShaftDescription({"rod": SegmentDescription(LENGTH, DIAMETER, loss_factor=LOSS)})


def swivel_machine(*, with_rod=False, has_table=True):
    """A head that swivels about x, on a bed beside a table: nothing lies in a plane of symmetry."""
    def body(mass, inertia, centre):
        return BodyDescription(mass, centre=centre, inertia=InertiaDescription(*inertia))

    def joint(parent, child, scale, place, **more):
        springs = {"x": 1.1e8, "y": 0.7e8, "z": 1.6e8, "rx": 6e6, "ry": 9e6, "rz": 5e6}
        return JointDescription(parent, child, FrameDescription(place), {way: scale * k for way, k in springs.items()},
                                loss_factor=LOSS, **more)

    bodies = {"bed": body(900.0, (60.0, 90.0, 80.0), (0.1, 0.0, -0.2)), "head": body(130.0, (6.0, 5.0, 4.0), (0.05, 0.03, 0.7)),
              "table": body(220.0, (9.0, 14.0, 20.0), (0.0, -0.05, 0.1))}
    joints = {"feet": joint("ground", "bed", 1.0, (0.0, 0.1, -0.4)), "way": joint("bed", "head", 0.6, (0.25, 0.2, 0.7)),
              "slide": joint("bed", "table", 0.3, (0.05, 0.0, 0.0))}
    points = {"nose": PointDescription("head", NOSE), "table": PointDescription("table", (0.02, -0.04, 0.3))}
    if with_rod:
        beam = BeamDescription({"rod": BeamSegment(LENGTH, DIAMETER, loss_factor=LOSS)}, {"foot": 0.0, "tip": LENGTH}, 8e3)
        bodies["rod"] = BodyDescription(beam=beam, frame=FrameDescription(NOSE, (0.0, 0.0, np.pi)))  # turned over: along -z
        joints["collet"] = JointDescription("head", "rod", FrameDescription(NOSE), child_interface="foot")
        points["tip"] = PointDescription("rod", interface="tip")
    return build(MachineDescription("mill", bodies, joints, {"A": AxisDescription("way", "rx", (-1.0, 1.0))}, points,
                                    tool="tip" if with_rod else "nose", table="table" if has_table else None))


@pytest.mark.parametrize("has_table", [True, False])
@pytest.mark.parametrize("angle", [0.0, 0.6])
def test_the_coupled_tool_is_the_machine_with_the_tool_as_a_body(angle, has_table):
    pose = {"A": angle}
    # The whole machine's beam elements are Timoshenko's too, reduced to 8 kHz.
    whole = tool_point(swivel_machine(with_rod=True, has_table=has_table), [pose], LINES).frf.values[0, :, :2, :2]
    coupled = tip_frf(couple_tips(bases_of_machine(swivel_machine(has_table=has_table), "nose", LINES, pose=pose), ROD, None))
    assert np.abs(coupled.values - whole).max() < 2e-5 * np.abs(whole).max()
    # The cross response is no small part here, and the table none either: the law would not hold without them.
    assert np.abs(whole[:, 0, 1]).max() > 0.03 * np.abs(whole).max()


def test_the_table_is_part_of_the_response():
    soft, alone = (tip_frf(couple_tips(bases_of_machine(swivel_machine(has_table=flag), "nose", LINES), ROD, None)).values
                   for flag in (True, False))
    below_the_tool = LINES < 400
    assert np.abs(soft - alone)[below_the_tool].max() > 0.3 * np.abs(alone)[below_the_tool].max()


def test_one_plane_alone_is_the_receptance_carried_through_the_shaft():
    shaft = ShaftDescription({"holder": SegmentDescription(0.06, 0.05, contact=ContactDescription(3e8, 2e5, 0.05)),
                              "tool": SegmentDescription(0.09, 0.016, material="carbide", loss_factor=0.004)})
    section = 1e-8 / (1 - (LINES / 420) ** 2 + 0.05j * LINES / 420)[:, None, None] * np.outer([1, 5.0], [1, 5.0])
    section = section + np.diag([1e-9, 3e-6])
    values = np.zeros((LINES.size, 6, 6), complex)
    values[:, :2, :2], values[:, 2:4, 2:4] = section, 0.7 * section
    coupled = couple_spindle(SpindleReceptance(LINES, values), shaft)
    for tip, scale in zip(coupled.tips, (1.0, 0.7), strict=True):
        expected = couple_tool(PlaneReceptance(LINES, scale * section, tip.plane), shaft).values
        np.testing.assert_allclose(tip.values, expected, rtol=1e-8, atol=1e-8 * np.abs(expected[:, 0, 0]).max())
    assert not np.abs(coupled.cross).max()


def test_draws_of_spindle_and_tool_go_together_and_faults_are_named():
    values = np.zeros((LINES.size, 6, 6), complex) + np.diag([1e-8, 1e-6, 1e-8, 1e-6, 1e-9, 1e-7]) * (1 - 0.02j)
    spindle = SpindleReceptance(LINES, values, np.stack([0.9 * values, 1.1 * values]))
    unsure = replace(ROD, diameter_deviation=0.03)
    with pytest.raises(ToolpointError, match="needs a numpy Generator"):
        couple_spindle(spindle, unsure)
    coupled = couple_spindle(spindle, unsure, generator=np.random.default_rng(1))
    assert all(tip.draws.shape == (2, LINES.size, 2, 2) for tip in coupled.tips)
    np.testing.assert_allclose(coupled.tips[0].draws, coupled.tips[1].draws)  # one tool in both planes
    frf = tip_frf(coupled)
    assert frf.draws.shape == (2, LINES.size, 2, 2) and frf.variance.max() > 0
    with pytest.raises(ToolpointError, match="must be of nose, table"):
        bases_of_machine(swivel_machine(), "noze", LINES)
    with pytest.raises(ToolpointError, match="6 of the section"):
        SpindleReceptance(LINES, values[:, :5, :5])
