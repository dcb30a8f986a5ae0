"""A coupled tip that went through a file keeps what its lines have in common: lobes, turn, mill and probability use it."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint.io import read_frf, write_frf
from toolpoint.studies.cuts.lobes_study import LobesStudy, chart_lobes
from toolpoint.studies.cuts.simulated_cut import simulate_cut
from toolpoint.studies.cuts.tool_coupling import study_tool
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics, response_dynamics
from toolpoint.studies.cuts.turning.study import TurningCut, chart_turning
from toolpoint.studies.cuts.uncertain_cut import Uncertainty
from toolpoint.substructuring import SegmentDescription, ShaftDescription
from toolpoint.substructuring.receptance import PlaneReceptance
from toolpoint.substructuring.shaft import ContactDescription
from toolpoint.vibration import Frf

LINES = np.arange(50.0, 3000.0, 4.0)
CUT = {"diameter": 0.016, "teeth": 4, "immersion": 0.5, "direction": "down", "tangential": 8e8, "normal": 2.5e8}
SPEEDS = np.array([5000.0, 8000.0, 11000.0])


@pytest.fixture(scope="module")
def tip() -> Frf:
    """A carbide tool in a collet that is known to 5 %, on a spindle of two modes."""
    r = [LINES / f for f in (600.0, 1400.0)]
    flexible = 2e-8 / (1 - r[0] ** 2 + 0.06j * r[0]) + 1e-8 / (1 - r[1] ** 2 + 0.06j * r[1])
    values = flexible[:, None, None] * np.outer([1, 6.0], [1, 6.0]) + np.diag([2e-9, 4e-6])
    tool = ShaftDescription({"shank": SegmentDescription(0.09, 0.016, material="carbide", loss_factor=0.005,
                                                         contact=ContactDescription(3e8, 2e5, 0.1))}, contact_deviation=0.05)
    base = [PlaneReceptance(LINES, values, plane) for plane in "xy"]
    return study_tool(base, tool, generator=np.random.default_rng(1)).frf


@pytest.fixture(scope="module")
def filed(tip: Frf, tmp_path_factory: pytest.TempPathFactory) -> ToolDynamics:
    """The tip as it comes back from a file."""
    path = tmp_path_factory.mktemp("drawn") / "tip.h5"
    write_frf(tip, path)
    return response_dynamics(read_frf(path), what="tip.h5")


@pytest.fixture(scope="module")
def by_file(filed: ToolDynamics) -> LobesStudy:
    return chart_lobes(filed, CUT, speeds=SPEEDS)


def test_both_planes_share_the_collet(tip: Frf) -> None:
    np.testing.assert_allclose(tip.draws[:, :, 0, 0], tip.draws[:, :, 1, 1])


def test_the_file_gives_the_interval_of_the_draws_and_no_hundred_per_cent(tip: Frf, by_file: LobesStudy) -> None:
    direct = chart_lobes(response_dynamics(tip), CUT, speeds=SPEEDS)
    np.testing.assert_allclose(by_file.chart.limit_error, direct.chart.limit_error, rtol=1e-3)
    share = by_file.chart.limit_error / np.minimum(by_file.chart.limit, by_file.chart.depth_max)
    assert (share < 0.4).all() and np.median(share) < 0.2
    rows = by_file.to_dict()["limit_interval_m"]
    assert any(row is not None and row[0] < limit < row[1] for row, limit in zip(rows, by_file.chart.limit, strict=True))
    assert any("95 % interval of the least charted limit" in note for note in by_file.chart.notes)


def test_probability_takes_the_draws(filed: ToolDynamics) -> None:
    exact_coefficients = Uncertainty(samples=40, coefficients=1e-6)
    study = chart_lobes(filed, CUT, speeds=SPEEDS, uncertainty=exact_coefficients)
    assert study.probability is not None
    # Samples are charted to a depth that the deepest pocket passes.
    charted = study.chart.limit * study.chart.limit_draws.max(axis=0) < study.probability.depths.max()
    assert charted.sum() >= 2
    scatter = np.log(study.probability.limit[:, charted]).std(axis=0)
    drawn = np.log(study.chart.limit_draws[:, charted]).std(axis=0)
    np.testing.assert_allclose(scatter, drawn, rtol=0.5)
    assert not any("taken as exact" in note for note in study.chart.notes)


def test_turning_states_the_interval_of_the_draws(tip: Frf, filed: ToolDynamics) -> None:
    study = chart_turning(filed, TurningCut(2e9), SPEEDS)
    least = tip.draws[:, :, 0, 0].real.min(axis=1)
    middle = tip.values[:, 0, 0].real.min()
    assert study.limit is not None
    assert study.limit.error / study.limit.width >= np.std(middle / least)


@pytest.mark.slow
def test_a_simulated_cut_is_doubted_where_the_draws_do_not_agree(filed: ToolDynamics, by_file: LobesStudy) -> None:
    limit = float(min(by_file.chart.limit[1], by_file.chart.depth_max))
    near = simulate_cut(filed, CUT, speed=8000.0, depth=limit, revolutions=12)
    assert near.drawn is not None and 0.1 < near.drawn.stable_share < 0.9
    assert any("equally likely responses" in note and note.startswith("verdict") for note in near.notes)
    far = simulate_cut(filed, CUT, speed=8000.0, depth=0.3 * limit, revolutions=12)
    assert far.drawn is not None and far.drawn.stable_share > 0.95
    assert far.to_dict()["probability_stable"] > 0.95
