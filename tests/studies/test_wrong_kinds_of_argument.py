"""Arguments of the wrong kind are answered with what to write instead, not with the fault that they cause inside."""

import numpy as np
import pytest

from toolpoint._check import ToolpointError
from toolpoint.cutting import stability
from toolpoint.cutting.stability import METHODS
from toolpoint.machine import assemble
from toolpoint.machine.description import parameters
from toolpoint.studies.cuts.example_cut import example_cut
from toolpoint.studies.machines.tool_point import milling_problem, tool_point


def test_values_with_a_unit(vertical):
    path = next(iter(parameters(vertical.description)))
    for value in ("9e8 N*m/rad", "9e8", [1.0, 2.0], True, None):
        with pytest.raises(ToolpointError, match=r"SI|number") as caught:
            vertical.with_values({path: value})
        assert path in str(caught.value)
    with pytest.raises(ToolpointError, match="must map paths"):
        vertical.with_values(path)


def test_a_list_of_poses_where_one_is_meant_and_one_where_a_list_is(vertical):
    pose = {axis.name: 0.1 for axis in vertical.chain.axes}
    for wrong in ([pose, pose], "X", 3.0):
        with pytest.raises(ToolpointError, match="must map axis names"):
            assemble(vertical, wrong)
    with pytest.raises(ToolpointError, match="put one pose into a list"):
        tool_point(vertical, pose)


@pytest.mark.parametrize("method", ["floquet", *METHODS, next(iter(METHODS.values()))])
def test_a_method_by_its_name(vertical, method):
    problem = stability_problem(vertical)
    with pytest.raises(ToolpointError, match="method_named"):
        stability.chart(problem, np.array([3000.0]), method)


def stability_problem(machine):
    study = tool_point(machine)
    return milling_problem(example_cut({})[0], study.modes.at_pose(0), f"{study.point}:+x", y=f"{study.point}:+y")
