"""Law: a warm chart finds the narrow band between two near roots as a cold one does, and no count is negative."""

import numpy as np
import pytest

from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool
from toolpoint.cutting.stability.panels.method import PanelArnoldi
from toolpoint.cutting.stability.panels.search import PanelSearch
from toolpoint.cutting.stability.panels.store import PanelStore
from toolpoint.vibration import Modes

HIGH = 0.62e-3 * (1 - 2e-6)  # m, a level beside the root at 0.62 mm


@pytest.fixture(scope="module")
def search():
    """A search whose growth is a known one: beyond the circle from 0.4 mm, back at 0.6 mm, beyond it again from 0.62 mm."""
    shape = 2 * np.pi * 800 / np.sqrt(2e7) * np.eye(2)
    modes = Modes(np.full(2, 800.0), np.full(2, 0.02), shape, ("tool:+x", "tool:+y"))
    problem = MillingProblem(Tool(0.016, 4, helix=0.5), Engagement.down(0.5), CuttingCoefficients(8e8, 3e8), modes)
    method = PanelArnoldi()

    class Known(PanelSearch):
        def growth(self, depth, more=0, accuracy=-1e-10):
            w = 1e3 * depth
            value = 40 * (w - 0.4) * (w - 0.6) * (w - 0.62)
            return float(value), complex(np.exp(value))

        def _rounding(self, depth, slope):
            return 0.0
    return Known((method.nodes, method.levels, method.tolerance), problem, 9000.0, 1e-3, PanelStore())


@pytest.mark.parametrize("start", [0.601e-3, 0.609e-3, 0.615e-3, 0.6195e-3, 0.6199e-3])
def test_a_root_that_was_led_to_the_other_end_of_a_band_is_not_taken(search, start):
    # The bracket holds the end of the unstable band at 0.6 mm and ends beside the next root: what is asked there may find that.
    low, high = (0.5e-3, search.growth(0.5e-3)[0]), (HIGH, search.growth(HIGH)[0])
    search.known_roots = np.array([[start, -1e3]])
    row, slope = search._boundary(low, high)
    assert row[0] == pytest.approx(0.6e-3, rel=1e-6) and slope < 0
    assert row[-1] < 1e-6 * row[0]
