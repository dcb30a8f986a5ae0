"""Another tool on a machine: the same as a file with that tool, in place of the file's own, joined by its contacts."""

from dataclasses import replace

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.machine import build
from toolpoint.machine.attached_tool import attach_tool, detach_tool
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
from toolpoint.machine.description.machine import IdentifiedDescription
from toolpoint.studies.cuts.coupling.machine_spindle import bases_of_machine, couple_tips, tip_frf
from toolpoint.studies.machines.tool_point import tool_point
from toolpoint.substructuring import ContactDescription, SegmentDescription, ShaftDescription

LINES = np.linspace(15.0, 3000.0, 300)
NOSE, LENGTH, DIAMETER, LOSS = (0.02, -0.04, 0.55), 0.18, 0.03, 0.03
ROD = ShaftDescription({"rod": SegmentDescription(LENGTH, DIAMETER, loss_factor=LOSS)}, name="rod")


def swivel_machine(*, with_rod=False, tool_axis=(0.0, 0.0, 1.0)):
    """A head that swivels about x, on a bed beside a table, without a plane of symmetry; with a rod as its own tool."""
    def body(mass, inertia, centre):
        return BodyDescription(mass, centre=centre, inertia=InertiaDescription(*inertia))

    def joint(parent, child, scale, place):
        springs = {"x": 1.1e8, "y": 0.7e8, "z": 1.6e8, "rx": 6e6, "ry": 9e6, "rz": 5e6}
        return JointDescription(parent, child, FrameDescription(place), {way: scale * k for way, k in springs.items()},
                                loss_factor=LOSS)

    bodies = {"bed": body(900.0, (60.0, 90.0, 80.0), (0.1, 0.0, -0.2)), "head": body(130.0, (6.0, 5.0, 4.0), (0.05, 0.03, 0.7)),
              "table": body(220.0, (9.0, 14.0, 20.0), (0.0, -0.05, 0.1))}
    joints = {"feet": joint("ground", "bed", 1.0, (0.0, 0.1, -0.4)), "way": joint("bed", "head", 0.6, (0.25, 0.2, 0.7)),
              "slide": joint("bed", "table", 0.3, (0.05, 0.0, 0.0))}
    points = {"nose": PointDescription("head", NOSE), "table": PointDescription("table", (0.02, -0.04, 0.3))}
    if with_rod:
        beam = BeamDescription({"rod": BeamSegment(LENGTH, DIAMETER, loss_factor=LOSS)}, {"foot": 0.0, "tip": LENGTH}, 10e3)
        bodies["rod"] = BodyDescription(beam=beam, frame=FrameDescription(NOSE, (0.0, 0.0, np.pi)))  # turned over: along -z
        joints["collet"] = JointDescription("head", "rod", FrameDescription(NOSE), child_interface="foot")
        points["tip"] = PointDescription("rod", interface="tip")
    return build(MachineDescription("mill", bodies, joints, {"A": AxisDescription("way", "rx", (-1.0, 1.0))}, points,
                                    tool="tip" if with_rod else "nose", table="table", tool_axis=tool_axis))


def response(machine, pose):
    return tool_point(machine, [pose], LINES).frf.values[0]


@pytest.mark.parametrize("pose", [{}, {"A": 0.6}])
def test_a_shaft_on_a_machine_is_the_file_that_has_it_and_takes_the_place_of_the_own_tool(pose):
    whole = response(swivel_machine(with_rod=True), pose)
    attached = attach_tool(swivel_machine(), "nose", ROD)
    np.testing.assert_allclose(response(attached, pose), whole, rtol=1e-6, atol=1e-6 * np.abs(whole).max())
    changed = attach_tool(swivel_machine(with_rod=True), "nose", ROD)
    np.testing.assert_allclose(response(changed, pose), whole, rtol=1e-6, atol=1e-6 * np.abs(whole).max())
    assert not attached.description.doubts and "rod of the machine file taken off" in changed.description.doubts[0]
    assert detach_tool(swivel_machine(), "nose").description.tool == "nose"


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.0, -0.6, 0.8)])
def test_contacts_and_flutes_are_those_of_receptance_coupling(axis):
    shaft = ShaftDescription({
        "holder": SegmentDescription(0.06, 0.05, bore=0.01, loss_factor=0.01),
        "shank": SegmentDescription(0.05, 0.016, material="carbide", loss_factor=0.02,
                                    contact=ContactDescription(3e8, 2e5, 0.05)),
        "flutes": SegmentDescription(0.03, 0.016, material="carbide", loss_factor=0.02, fluted=True)})
    machine = swivel_machine(tool_axis=axis)
    coupled = tip_frf(couple_tips(bases_of_machine(machine, "nose", LINES, pose={"A": 0.3}), shaft, None)).values
    attached = response(attach_tool(machine, "nose", shaft), {"A": 0.3})[:, :2, :2]
    assert np.abs(coupled - attached).max() < 2e-6 * np.abs(attached).max()


def test_the_table_is_part_of_a_coupled_response():
    soft, alone = (tip_frf(couple_tips(bases_of_machine(machine, "nose", LINES), ROD, None)).values for machine in (
        swivel_machine(), swivel_machine().rebuild(replace(swivel_machine().description, table=None))))
    below_the_tool = LINES < 400
    assert np.abs(soft - alone)[below_the_tool].max() > 0.3 * np.abs(alone)[below_the_tool].max()
    assert np.abs(soft[:, 0, 1]).max() > 0.03 * np.abs(soft).max()  # nor would both planes apart be the whole


def test_a_damping_ratio_of_the_machine_is_its_own_and_the_tool_keeps_its_losses():
    """Alike where the tool is as lossy; a tool of a tenth of the machine's ratio keeps its own, which cannot be told as one."""
    ratio = swivel_machine()
    ratio = ratio.rebuild(replace(ratio.description, damping_ratio=LOSS / 2, joints={
        name: replace(joint, loss_factor=0.0) for name, joint in ratio.description.joints.items()}))
    np.testing.assert_allclose(response(attach_tool(ratio, "nose", ROD), {}),
                               response(attach_tool(swivel_machine(), "nose", ROD), {}), rtol=1e-9)
    dry = ShaftDescription({"rod": SegmentDescription(LENGTH, DIAMETER, loss_factor=LOSS / 10)})
    peaks = [np.abs(response(attach_tool(ratio, "nose", shaft), {})[:, 0, 0]).max() for shaft in (ROD, dry)]
    assert peaks[1] > 3 * peaks[0]
    lossless = ShaftDescription({"rod": SegmentDescription(LENGTH, DIAMETER)})
    assert any("no loss factor" in doubt for doubt in attach_tool(ratio, "nose", lossless).description.doubts)
    by_mode = ratio.rebuild(replace(ratio.description, damping_ratio=None, modal_damping=(0.01, 0.02)))
    attached = attach_tool(by_mode, "nose", ROD)
    assert "mean of 1.5 %" in attached.description.doubts[0]
    np.testing.assert_allclose(response(attached, {}), response(attach_tool(ratio, "nose", ROD), {}), rtol=1e-9)


def test_what_cannot_be_attached_is_refused_by_name():
    with pytest.raises(ToolpointError, match="must be of nose, table"):
        attach_tool(swivel_machine(), "noze", ROD)
    by_hutchinson = ShaftDescription({"rod": SegmentDescription(0.1, 0.02, shear="hutchinson")})
    with pytest.raises(ToolpointError, match=r"segments\.rod\.shear"):
        attach_tool(swivel_machine(), "nose", by_hutchinson)
    machine = swivel_machine(with_rod=True)
    own = IdentifiedDescription(("bodies.rod.beam.segments.rod.modulus",), ((1e18,),))
    identified = machine.rebuild(replace(machine.description, identified=own))
    with pytest.raises(ToolpointError, match=r"numbers were identified: bodies\.rod"):
        detach_tool(identified, "nose")
