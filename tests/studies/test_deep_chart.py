"""A chart is deep enough to show a limit: a robot's softest mode is too slow for a fast cut, stiffer ones limit it."""

import numpy as np

from toolpoint.cutting import ZeroOrder, stability
from toolpoint.io import read_machine
from toolpoint.io.template_files import FOLDER
from toolpoint.studies.machines.tool_point import depth_limit, lobes, pose_problem, tool_point


def test_a_robot_that_cuts_fast_has_a_limit():
    study = tool_point(read_machine(FOLDER / "machine" / "robot.yaml"))
    speeds, method = np.linspace(6000, 18000, 5), ZeroOrder()
    problem = pose_problem(study, study.machine.description.cutting, 0)
    # The depth that the softest mode suggests holds no limit at all.
    assert not np.isfinite(stability.chart(problem, speeds, method, depth_max=depth_limit(problem)).limit).any()
    assert all(np.isfinite(chart.limit).any() for chart in lobes(study, speeds=speeds, method=method))
