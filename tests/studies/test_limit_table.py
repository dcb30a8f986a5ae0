"""Limits at other immersions and numbers of teeth: those of the engine, with what a speed between two costs."""

import numpy as np
import pytest

from toolpoint.cutting.description import CuttingDescription
from toolpoint.studies import chart_lobes
from toolpoint.studies.cuts.limit_table import LimitTable, tabulate_limits
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.vibration import Modes

CUT = {"diameter": 0.012, "teeth": 2, "immersion": 0.4, "direction": "down", "tangential": 6e8, "normal": 2e8,
       "speeds": (8000.0, 20000.0)}


def tip() -> ToolDynamics:
    modes = Modes([922.0, 922.0], 0.011, np.eye(2) / np.sqrt(0.03993), ("tip:+x", "tip:+y"))
    return ToolDynamics(modes, "tip:+x", "tip:+y")


def table_of(count=121, **values) -> LimitTable | None:
    cut = {**CUT, **values}
    chart = chart_lobes(tip(), cut, speeds=np.linspace(8000, 20000, count)).chart
    return tabulate_limits(tip(), cut, CuttingDescription.of(**cut), chart=chart)


@pytest.fixture(scope="module")
def table() -> LimitTable:
    made = table_of()
    assert made is not None
    return made


@pytest.mark.slow
def test_every_place_is_the_engines_own_limit(table):
    assert table.immersions.tolist() == [0.1, 0.25, 0.4, 0.5, 0.75, 1.0] and table.teeth == (1, 2, 3)
    for i, k in ((1, 2), (5, 1)):
        cut = {**CUT, "immersion": float(table.immersions[i]), "teeth": table.teeth[k]}
        alone = chart_lobes(tip(), cut, speeds=table.speeds).chart
        within = np.isfinite(alone.limit) & np.isfinite(table.limit[i, k])
        assert np.isfinite(table.limit[i, k]).tolist() == np.isfinite(alone.limit).tolist()
        np.testing.assert_allclose(table.limit[i, k][within], alone.limit[within], rtol=1e-9)


def test_what_a_speed_between_two_costs_is_that_of_the_chart(table):
    fine = chart_lobes(tip(), CUT, speeds=np.linspace(8000, 20000, 121)).chart
    charted = table.limit[2, 1]
    worst = 0.0
    for speed, limit in zip(fine.speeds, fine.limit, strict=True):
        k = min(max(int(np.searchsorted(table.speeds, speed)), 1), 39)
        if np.isfinite(limit):
            worst = max(worst, min(charted[k - 1], charted[k], fine.depth_max) / limit - 1)
    assert table.overstated == pytest.approx(worst) and f"{100 * worst:.0f} % too much" in table.words


def test_a_cut_whose_immersion_or_teeth_cannot_be_changed_alone_has_no_table():
    assert table_of(5, immersion=None, direction="slot") is None
    assert table_of(5, pitch=(np.pi * 0.9, np.pi * 1.1)) is None
