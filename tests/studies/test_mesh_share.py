"""Share of a limit that the mesh of a yielding work may change: modes that are moved, errors that are looked up."""

import numpy as np
import pytest

from toolpoint import studies
from toolpoint.cutting import Engagement, MillingProblem, stability
from toolpoint.cutting.description import CuttingDescription
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.machines.tool_point import milling_problem
from toolpoint.studies.machining.mesh_share import MeshError, widen_by_mesh
from toolpoint.vibration import Modes

CUT = CuttingDescription.of(diameter=0.016, teeth=3, tangential=1.2e9, normal=6e8)
DEPTH = 0.02
ERROR = MeshError(np.array([400.0, 1500.0]), np.array([0.02, 0.03]))


def wall(scale: float = 1.0) -> ToolDynamics:
    """Return a wall whose frequencies err by their error times 1 - scale."""
    return studies.modal_dynamics(Modes(np.array([420.0, 1450.0]) * (1 + (scale - 1) * ERROR.error), 0.02, [[3.0, 2.0]],
                                        ("wall:+y",)), y="wall:+y")


def problem_with(work: ToolDynamics) -> MillingProblem:
    tip = studies.modal_dynamics(Modes([900.0, 1100.0], [0.03, 0.03], np.eye(2), ("tip:+x", "tip:+y")))
    both = studies.with_work(tip, work)
    return milling_problem(CUT.replaced(direction="slot"), both.response, both.x, y=both.y).changed(
        engagement=Engagement(2.5, np.pi))


@pytest.mark.parametrize("speed", [5200.0, 9100.0, 14300.0])
def test_limits_of_a_finer_mesh_lie_within_the_stated_error(speed: float) -> None:
    """A mesh whose frequencies fall by half, all or one and a half of the error has its limit in the interval."""
    speeds = np.array([speed])
    problem, work = problem_with(wall()), wall()
    chart = stability.chart(problem, speeds, depth_max=DEPTH)
    widened = widen_by_mesh(chart, problem, work, error=ERROR, depth=float(chart.limit[0]))
    error = float(widened.error[widened.limit_points()[0]])
    assert widened.limit[0] == chart.limit[0] and error > chart.error[chart.limit_points()[0]]
    for scale in (0.5, 0.0, -0.5):
        finer = stability.chart(problem_with(wall(scale)), speeds, depth_max=DEPTH)
        assert abs(finer.limit[0] - chart.limit[0]) <= error


def test_a_mesh_without_error_and_a_rigid_work_leave_the_chart() -> None:
    problem = problem_with(wall())
    chart = stability.chart(problem, np.array([9100.0]), depth_max=DEPTH)
    still = widen_by_mesh(chart, problem, wall(), error=MeshError(np.array([400.0]), np.array([0.0])), depth=1e-3)
    assert np.array_equal(still.error, chart.error)
    other = studies.modal_dynamics(Modes([5000.0], [0.02], [[1.0]], ("wall:+y",)), y="wall:+y")
    assert np.array_equal(widen_by_mesh(chart, problem, other, error=ERROR, depth=1e-3).error, chart.error)


def test_the_error_of_a_mode_is_the_largest_nearby_else_that_of_the_nearest() -> None:
    error = MeshError(np.array([100.0, 105.0, 1000.0]), np.array([0.01, 0.03, 0.002]))
    assert error.at(np.array([101.0, 300.0, 950.0, 9000.0])).tolist() == [0.03, 0.03, 0.002, 0.002]
