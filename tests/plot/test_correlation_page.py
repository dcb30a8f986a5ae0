"""Pages of correlation, sensitivity, joints and updating in a browser: charts drawn, pairs framed, shapes that move alike."""

from dataclasses import replace

import numpy as np
import pytest
from four_part_mill import four_part_mill

from toolpoint._check import ToolpointError
from toolpoint.machine import assemble
from toolpoint.machine.pose.named_points import point_positions
from toolpoint.pages.machines.sensitivity import sensitivity_page
from toolpoint.pages.measured.correlation import correlation_page
from toolpoint.pages.measured.update import update_page
from toolpoint.plot.figures.machines.joint_views import joint_views
from toolpoint.plot.figures.machines.point_views import point_pairs, point_values
from toolpoint.plot.figures.machines.sensitivity import cumulative_bars, sensitivity_map
from toolpoint.plot.figures.measured.bands import frac_bands
from toolpoint.plot.figures.measured.correlation import mac_matrix
from toolpoint.plot.shape_view.shape_pairs import partners, turn_alike
from toolpoint.studies.machines.sensitivity_study import study_sensitivity
from toolpoint.studies.measured import machine_update
from toolpoint.studies.measured.measured_comparison import Comparison, MeasuredTest
from toolpoint.studies.measured.measured_update import MeasuredUpdate, Measurement
from toolpoint.studies.measured.model_correlation import correlate
from toolpoint.studies.measured.point_pairing import pair_points
from toolpoint.vibration import eigen, frequency_response
from toolpoint.vibration.geometry import Geometry


@pytest.fixture(scope="module")
def mills():
    mill = four_part_mill()
    path = "joints.column_housing.stiffness.x"
    return mill, mill.with_values({path: 0.5 * mill.value(path)}), path


@pytest.mark.slow
def test_correlation_page(mills, opened):
    mill, wrong, _ = mills
    modes = eigen.solve_undamped(assemble(mill), 6)
    frf = frequency_response.direct(assemble(mill, None, modes.dofs[:3], inputs=modes.dofs[:1]), np.arange(5.0, 80.0, 0.5))
    places = point_positions(mill)
    pairing = pair_points(places, places, 0.01)
    runs = [correlate(m, modes, pairing, frf=frf) for m in (mill, wrong)]
    test = MeasuredTest(modes, frf, Geometry(places, [("base0", "base1")]), None)
    seen = opened(correlation_page(Comparison(*runs, mill, test)).html(), reduced_motion="reduce")
    seen.wait("Object.keys(window.toolpointCharts).length >= 6 && 'pairs' in window.toolpointViews")
    # One frame a paired mode.
    frames = "document.querySelectorAll('.tp-chart[data-name=chart-1] .shapelayer path').length"
    seen.wait(f"{frames} === {len(runs[1].pairs.pairs)}")
    both = seen.page.evaluate("[0, 1].map(k => Array.from(window.toolpointViews.pairs.positions(k)))")
    np.testing.assert_allclose(both[0], both[1], atol=1e-4)
    assert seen.errors == [] and len(seen.requests) == 1


@pytest.mark.slow
def test_sensitivity_page(mills, opened):
    mill, _, _ = mills
    seen = opened(sensitivity_page(study_sensitivity(mill), mill).html(), reduced_motion="reduce")
    seen.wait("Object.keys(window.toolpointCharts).length >= 5 && 'modes' in window.toolpointViews")
    seen.wait("document.querySelectorAll('.tp-chart[data-name=chart-2] .barlayer .trace').length === 4")  # four interfaces
    assert seen.errors == [] and len(seen.requests) == 1


@pytest.mark.slow
def test_update_page_pairs_shapes_and_frames_modes(mills, opened):
    mill, wrong, path = mills
    modes = eigen.solve_undamped(assemble(mill), 6)
    frf = frequency_response.direct(assemble(mill, None, modes.dofs[:2], inputs=modes.dofs[:1]), np.arange(5.0, 80.0, 0.5))
    found = machine_update.update(wrong, [path], modes, frf=frf)
    assert found.machine.value(path) == pytest.approx(mill.value(path), rel=1e-3)
    seen = opened(update_page(MeasuredUpdate(wrong, found, (Measurement(modes, frf),))).html(), reduced_motion="reduce")
    seen.wait("Object.keys(window.toolpointCharts).length >= 4 && 'pair' in window.toolpointViews")
    for number in (1, 2):
        seen.wait(f"document.querySelectorAll('.tp-chart[data-name=chart-{number}] .shapelayer path').length === 6")
    for mode in range(6):
        # Paired shapes move to the same side: their motions have a positive product.
        both = seen.page.evaluate(
            f"(() => {{ const v = window.toolpointViews.pair, at = phase => (v.setPhase(phase), "
            f"[0, 1].map(k => Array.from(v.positions(k)))); v.showMode({mode}); return [...at(0), ...at(Math.PI)]; }})()")
        first, second = (np.array(both[k]) - np.array(both[k + 2]) for k in (0, 1))
        assert first @ second > 0
    assert seen.errors == [] and len(seen.requests) == 1


def test_pairs_are_turned_alike_and_partners_found(shapes):
    other = replace(shapes, displacement=-shapes.displacement[[2, 0, 1]])
    assert partners(shapes, other) == [1, 2, 0]
    turned = turn_alike(other.selected(partners(shapes, other)), shapes)
    np.testing.assert_allclose(turned.displacement.real, shapes.displacement.real)


def test_figures_refuse_wrong_input():
    with pytest.raises(ToolpointError, match="parameters, modes"):
        sensitivity_map(np.zeros((2, 3)), ["a"], [1.0, 2.0, 3.0])
    with pytest.raises(ToolpointError, match="at least one"):
        cumulative_bars({}, [1.0])
    with pytest.raises(ToolpointError, match="bands, responses"):
        frac_bands(np.ones((1, 2)), [[1, 2]], ["a"])
    with pytest.raises(ToolpointError, match="without a position"):
        point_values({"a": (0, 0, 0)}, {"b": 1.0}, quantity="COMAC")
    with pytest.raises(ToolpointError, match="points of test and model"):
        point_pairs({"a": (0, 0, 0)}, {"b": (0, 0, 0)}, {"a": "c"})


def test_names_are_shown_as_they_are():
    made = point_values({"<b>": (0, 0, 0)}, {"<b>": 0.5}, quantity="COMAC")
    assert "&lt;b&gt;" in made.data[0].text[0]
    assert len(mac_matrix(np.eye(2), "ab", "ab", pairs=[[0, 0], [1, 1]]).layout.shapes) == 2
    assert joint_views({"1": (0, 0, 0), "2": (1, 0, 0)}, {"base": ["1", "2"]}, []).data
