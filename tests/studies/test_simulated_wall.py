"""Wall of a simulated cut: scallop and mean height of a stiff one in closed form, bands that add up, walls that are none."""

import numpy as np
import pytest

from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool
from toolpoint.cutting.simulation.milling import simulate
from toolpoint.cutting.surface.location import location_error
from toolpoint.studies import modal_dynamics, simulate_cut
from toolpoint.studies.cuts.simulated_wall import measure_wall
from toolpoint.vibration import Dof, Modes

FEED, RADIUS, SPEED, DEPTH = 0.2e-3, 8e-3, 5000.0, 0.5e-3


def run_of(engagement, stiffness_shape, runout=0.0):
    modes = Modes([900.0, 950.0], [0.03, 0.03], stiffness_shape * np.eye(2), [Dof("tool", "+x"), Dof("tool", "+y")])
    problem = MillingProblem(Tool(2 * RADIUS, 2, runout=runout), engagement, CuttingCoefficients(7e8, 2e8), modes,
                             "tool:+x", "tool:+y", feed_per_tooth=FEED)
    return simulate(problem, SPEED, DEPTH, revolutions=40)


def test_a_stiff_tool_leaves_its_scallops():
    """f^2 / (8 R) for equal teeth; with run-out of more than the scallop one tooth marks each revolution: (2 f)^2 / (8 R)."""
    equal, offset = (measure_wall(run_of(Engagement.down(0.1), 1e-4, runout)) for runout in (0.0, 20e-6))
    assert np.ptp(equal.profile) == pytest.approx(FEED**2 / (8 * RADIUS), rel=0.05)
    assert np.ptp(offset.profile) == pytest.approx((2 * FEED) ** 2 / (8 * RADIUS), rel=0.05)
    assert offset.parameters["Rz"] > 3 * equal.parameters["Rz"]
    # Scallops lie far below the cutoff: every filter passes them nearly whole.
    for parameters in offset.filtered.values():
        assert parameters["Rz"] == pytest.approx((2 * FEED) ** 2 / (8 * RADIUS), rel=0.12)
        assert parameters["Ra"] == pytest.approx(offset.parameters["Ra"], rel=0.12)


@pytest.mark.parametrize(("engagement", "side"), [(Engagement.down(0.1), "exit"), (Engagement.up(0.1), "entry")])
def test_bands_add_up_and_the_mean_is_the_location_error(engagement, side):
    """The mean height is that of the harmonic solution, beside what scallops add: two thirds of them lie above the lowest."""
    run = run_of(engagement, 3.0)
    wall = measure_wall(run)
    assert wall.side == side
    assert wall.parts.roughness + wall.parts.waviness + wall.parts.form == pytest.approx(wall.profile, abs=1e-15)
    exact = float(location_error(run.problem, np.array([SPEED]), DEPTH, side=side)[0])
    scallop = FEED**2 / (8 * RADIUS)
    assert wall.location_error == pytest.approx(exact + scallop / 3, abs=0.25 * abs(exact) + scallop)
    assert abs(exact) > 2 * scallop


def test_cuts_without_a_wall_have_none():
    assert measure_wall(run_of(Engagement(0.5, 2.0), 1e-4)) is None


def test_the_study_carries_the_wall():
    modes = Modes([900.0, 950.0], [0.03, 0.03], 0.5 * np.eye(2), ("tip:+x", "tip:+y"))
    cut = {"diameter": 2 * RADIUS, "teeth": 2, "immersion": 0.1, "tangential": 7e8, "normal": 2e8, "feed_per_tooth": FEED}
    result = simulate_cut(modal_dynamics(modes), cut, speed=SPEED, depth=DEPTH, revolutions=30)
    assert any(name.startswith("wall, roughness") for name, _ in result.rows())
    assert result.to_dict()["wall"]["parameters_m"]["Ra"] == result.wall.parameters["Ra"] > 0
