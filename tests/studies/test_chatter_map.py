"""Stability over poses and feed directions."""

import numpy as np

from toolpoint.cutting import ZeroOrder, stability
from toolpoint.studies.chatter_map import chatter_map
from toolpoint.studies.tool_point import milling_problem, tool_point


def test_map_equals_single_charts(vertical_drives):
    speeds = np.linspace(800, 2500, 6)
    found = chatter_map(vertical_drives, speeds=speeds, feed_angles=[0.0, np.pi / 2], method=ZeroOrder())
    assert found.limit.shape == (4, 2, 6)
    study = tool_point(vertical_drives, [vertical_drives.description.poses[1]])
    problem = milling_problem(vertical_drives.description.cutting, study.modes.at_pose(0), "tool-table:+x", "tool-table:+y")
    single = stability.chart(problem.at_feed_angle(np.pi / 2), speeds, ZeroOrder(), depth_max=0.05)
    np.testing.assert_allclose(found.limit[1, 1], single.limit, rtol=1e-6)
    assert 0 <= found.worst_pose() < 4
