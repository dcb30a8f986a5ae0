"""Law: no depth of any command goes beyond the edges of the tool, and the end of the search is called one."""

import numpy as np
import pytest

from toolpoint import studies
from toolpoint.cutting.description import CuttingDescription
from toolpoint.studies.cuts.measured_response import study_responses
from toolpoint.studies.cuts.tool_coupling import study_tool
from toolpoint.studies.cuts.tool_dynamics import response_dynamics
from toolpoint.studies.cuts.turning.study import TurningCut, chart_turning
from toolpoint.substructuring.receptance import plane_receptance
from toolpoint.substructuring.shaft import SegmentDescription, ShaftDescription
from toolpoint.vibration import Dof, Frf, Modes
from toolpoint.vibration.frequency_response import modal

LINES = np.arange(50.0, 3000.0, 1.0)
CUT = {"diameter": 0.016, "teeth": 4, "immersion": 0.5, "tangential": 8e8, "normal": 3e8, "speeds": (4000.0, 12000.0)}


def tip(seed, stiffness):
    """Return the noisy receptance of a tip of one or two modes along x and y."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 3))
    f = rng.uniform(500, 900) * np.cumprod(np.append(1.0, rng.uniform(1.4, 2.0, count - 1)))
    shape = 2 * np.pi * f / np.sqrt(stiffness)
    modes = Modes(np.repeat(f, 2), np.full(2 * count, 0.02), np.stack([np.ravel([s * np.eye(2)[k] for s in shape])
                                                                      for k in (0, 1)]), ("tool:+x", "tool:+y"))
    frf = modal(modes, LINES)
    sd = 1e-3 * np.abs(frf.values).max(axis=0)
    noise = sd * (rng.normal(size=frf.values.shape) + 1j * rng.normal(size=frf.values.shape)) * np.eye(2)
    variance = np.broadcast_to(2 * sd**2 + 1e-30, frf.values.shape)
    return Frf(LINES, frf.values + noise, frf.outputs, frf.inputs, variance=variance)


@pytest.mark.slow
@pytest.mark.parametrize(("keys", "end", "stiffness"), [({"flute_length": 0.001}, 1e-3, 2e7), ({"deepest": 0.0005}, 5e-4, 2e8),
                                                      ({}, 32e-3, 2e7)])
def test_measured_lobes_of_a_report_end_with_the_edges(keys, end, stiffness):
    result = study_responses(tip(1, stiffness), CuttingDescription.of(**CUT, **keys))
    assert result.chart.depth_max <= end * (1 + 1e-12)
    told = result.to_dict()
    assert told["depth_max_m"] == result.chart.depth_max and len(told["is_end_of_search"]) == result.chart.speeds.size
    if not np.isfinite(result.chart.limit).all():
        assert any("the end of the searched depths" in note for note in result.notes)
    if not np.isfinite(result.chart.limit).any() and not result.withheld:
        assert "inf" not in result.table() and "end of the searched depths" in result.table()
        assert told["stable_at_every_speed_m"] is None


@pytest.mark.slow
@pytest.mark.parametrize(("keys", "end"), [({"flute_length": 0.002}, 2e-3), ({"deepest": 0.001}, 1e-3)])
def test_speeds_of_a_tap_end_with_the_edges(keys, end):
    result = studies.study_tap(tip(2, 5e7).selected([0], [0]), None, {**CUT, **keys}, rng=np.random.default_rng(0),
                               speeds=(4000.0, 12000.0))
    assert result.limits.chart.depth_max <= end
    assert all(use.depth <= end for use in result.limits.speeds)
    told = result.to_dict()
    assert max(told["limit_m"]) <= end and told["depth_max_m"] == result.limits.chart.depth_max
    if any(told["is_end_of_search"]):
        assert any("the end of the searched depths" in note for note in told["notes"])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:limits")
@pytest.mark.parametrize(("keys", "end"), [({"flute_length": 0.0005}, 5e-4), ({}, 32e-3)])
def test_advice_on_stick_outs_ends_with_the_edges(keys, end):
    n, labels = LINES.size, [Dof("nose", way) for way in ("+x", "+ry")]
    w = 2 * np.pi * LINES
    values = np.zeros((n, 2, 2), complex)
    values[:, 0, 0] = 1 / (8e7 * (1 - (w / (2 * np.pi * 900)) ** 2 + 0.06j))
    values[:, 1, 1] = 1 / (4e5 * (1 - (w / (2 * np.pi * 1500)) ** 2 + 0.06j))
    base = plane_receptance(Frf(LINES, values, labels, labels), "nose", "x")
    tool = ShaftDescription({"shank": SegmentDescription(0.05, 0.016)})
    result = study_tool([base], tool, cut={**CUT, **keys}, stick_out=("shank", np.array([0.04, 0.06])),
                        speeds=np.linspace(4000, 12000, 9))
    for part, told in zip(result.stick_outs, result.to_dict()["stick_out"], strict=True):
        assert part.chart.depth_max <= end * (1 + 1e-12) and told["depth_max_m"] == part.chart.depth_max
        if any(told["is_end_of_search"]):
            assert any(line.startswith("stick-out") and "the end of the searched depths" in line for line in result.notes)
    if keys:
        assert "(end of the search)" in result.table() or result.withheld


def test_turning_states_the_errors_of_its_widths():
    frf = tip(3, 4e7)
    study = chart_turning(response_dynamics(frf, "tool:+x", "tool:+y"), TurningCut(1e9), np.linspace(500, 3000, 12))
    told = study.to_dict()
    assert len(told["limit_error_m"]) == 12 and told["unconditional"]["width_error_m"] >= 0
    best = told["best_cut"]
    at = int(np.argmin(np.abs(study.chart.speeds - best["speed_rpm"])))
    assert best["limit_error_m"] == told["limit_error_m"][at] >= 0
    assert best["width_m"] <= study.chart.limit[at] - best["limit_error_m"] + 1e-12
