"""Very low speeds with low immersion, where a cut lasts a hundred vibrations and the one-period map is far from normal.

Case of an examination (two modes 922 Hz, 1.1 %, 0.03993 kg, N = 2, a/D 0.05 down, K_t 600, K_n 200 N/mm^2): at 50 rev/min the
limit lies between 1.06 and 1.10 mm, and at 0.54 mm the vibration of one revolution is 0.27 times that of the one before.
"""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint import Modes, ToolpointError
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool, stability
from toolpoint.cutting.cut.modal_state import modal_plane
from toolpoint.cutting.stability.panels.method import PanelArnoldi
from toolpoint.cutting.stability.panels.search import PeriodMap, waves_of
from toolpoint.cutting.stability.panels.store import PanelStore


def low_immersion() -> MillingProblem:
    x, y = (Modes([922.0], [0.011], np.array([[1 / np.sqrt(0.03993)]]), (dof,)) for dof in ("tool:+x", "tool:+y"))
    return MillingProblem(Tool(0.0127, 2), Engagement.down(0.05), CuttingCoefficients(6e8, 2e8), (x, y))


def test_the_limit_at_fifty_revolutions_is_that_of_the_examination() -> None:
    chart = stability.chart(low_immersion(), [50.0], depth_max=0.005)
    assert chart.status == "complete" and 1.06e-3 < chart.limit[0] < 1.10e-3
    assert chart.error[0] < 1e-4 * chart.limit[0]
    tooth = np.abs(PanelArnoldi().multipliers(low_immersion(), 50.0, 0.54e-3)[0])
    assert tooth**2 == pytest.approx(0.27, abs=0.005)


@pytest.mark.parametrize("speed", [50.0, 80.0])
def test_the_multipliers_do_not_depend_on_how_the_map_is_balanced(speed) -> None:
    """Similar maps have equal eigenvalues; what differs is rounding, which the plain map (tilt 0) shows to be large."""
    problem = low_immersion()
    plane = modal_plane(problem.plane_at(speed))
    turn, waves = PeriodMap(problem, plane, speed, 7, 4, PanelStore()), waves_of(modal_plane(plane), problem, speed)
    values = [abs(turn.rebalanced_multipliers(1.06e-3, waves, 1e-10, balance_fraction=tilt)[0]) for tilt in (0.0, 0.7, 1.0)]
    assert turn.balances and values[1] == pytest.approx(values[2], rel=1e-5)
    if speed == 50.0:
        assert abs(values[0] - values[2]) > 1e-2


def test_a_speed_that_would_take_minutes_is_refused_with_its_estimate() -> None:
    with pytest.raises(ToolpointError, match=r"speeds: 1 rev/min takes about \d+ min .*raise the least speed"):
        stability.chart(low_immersion(), [1.0, 100.0], depth_max=0.005)
