"""Charts: what they show, in which unit and on which axis; and that bad input is refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from toolpoint import Dof, Frf, Modes, ToolpointError
from toolpoint.plot import (
    StabilityCurve,
    StabilityIntervals,
    bode,
    coherence,
    frequency_curves,
    frequency_map,
    mac_matrix,
    nyquist,
    real_imaginary,
    stability_chart,
)

F = np.linspace(0, 100, 401)
TIP = [Dof("tip", "x")]
FIVE = [Dof(i, "x") for i in range(5)]


def one_mode(frequency=40.0, damping=0.02, **more):
    w, wr = 2 * np.pi * F, 2 * np.pi * frequency
    values = 1 / (wr**2 - w**2 + 2j * damping * wr * w)
    return Frf(F, values[:, None, None], TIP, TIP, **more)


def test_bode_has_log_magnitude_unit_phase_and_mode_marks():
    modes = Modes([40.0, 500.0], [0.02, 0.02], np.ones((1, 2)), TIP)
    made = bode(one_mode(), modes=modes)
    assert made.layout.yaxis.type == "log"
    assert made.layout.yaxis.title.text == "Receptance, m/N"
    assert made.layout.xaxis2.title.text == "Frequency, Hz"
    size, phase = made.data
    # at resonance |H| = 1/(2 zeta w^2)
    assert size.y.max() == pytest.approx(1 / (2 * 0.02 * (2 * np.pi * 40) ** 2), rel=1e-3)
    assert np.interp(40.0, phase.x, phase.y) == pytest.approx(-90, abs=1e-3)
    assert {shape.x0 for shape in made.layout.shapes} == {40.0}  # the mode outside the band has no mark


def test_labels_of_close_modes_are_one_label_and_none_overlap():
    """A label turned upright is about 14 px wide; the axis is some 700 px wide, so labels stand 2 % of it apart."""
    low = [10.3, 10.9, 11.2, 30.0, 60.0, 60.5, 61.0, 61.5, 62.0, 99.5]
    made = bode(one_mode(), modes=Modes(low, 0.02, np.ones((1, 10)), TIP))
    words = {float(note.x): note.text for note in made.layout.annotations}
    assert words == {11.2: "10.3, 10.9, 11.2 Hz", 30.0: "30 Hz", 62.0: "60 .. 62 Hz, 5 modes", 99.5: "99.5 Hz"}
    assert made.layout.annotations[-1].xanchor == "right"  # it would leave the chart
    assert {shape.x0 for shape in made.layout.shapes} == set(low)  # every mode has its line
    single = bode(one_mode(), modes=Modes(low, 0.02, np.ones((1, 10)), TIP), log_frequency=True)
    assert 1.0 <= single.layout.annotations[0].x <= 2.0  # decades on a logarithmic axis


def test_measured_and_synthesised_differ_in_line_and_carry_their_names():
    made = bode({"measured": one_mode(), "synthesised": one_mode(41.0)})
    shown = [trace for trace in made.data if trace.showlegend]
    assert [trace.name for trace in shown] == ["measured", "synthesised"]
    assert shown[0].line.color != shown[1].line.color and shown[0].line.dash != shown[1].line.dash


def test_coherence_gets_its_own_row_and_figure():
    gamma = np.full((F.size, 1, 1), 0.97)
    made = bode(one_mode(coherence=gamma))
    assert made.layout.yaxis3.title.text == "Coherence"
    np.testing.assert_allclose(made.data[2].y, 0.97, rtol=1e-6)
    np.testing.assert_allclose(coherence(one_mode(coherence=gamma)).data[0].y, 0.97, rtol=1e-6)
    with pytest.raises(ToolpointError, match="must carry one"):
        coherence(one_mode())


def test_real_imaginary_and_nyquist_show_the_same_numbers():
    frf = one_mode(quantity="accelerance")
    parts, circle = real_imaginary(frf), nyquist(frf)
    np.testing.assert_array_equal(parts.data[0].y, circle.data[0].x)
    np.testing.assert_array_equal(parts.data[1].y, circle.data[0].y)
    assert circle.layout.yaxis.scaleanchor == "x"
    assert "m/s²/N" in circle.layout.xaxis.title.text


@pytest.mark.parametrize(("frfs", "message"), [
    ({"a": one_mode(), "b": one_mode(quantity="mobility")}, "one quantity"), ({}, "at least one Frf"),
    (Frf(F, np.ones((2, F.size, 1, 1)), TIP, TIP), "one pose"),
    (Frf(F, np.ones((F.size, 5, 5)), FIVE, FIVE), "at most 24")])
def test_frf_charts_refuse(frfs, message):
    with pytest.raises(ToolpointError, match=message):
        bode(frfs)


def test_markup_in_names_stays_text():
    made = bode({"<b>a</b>": one_mode(), "b": one_mode()}, title="<a href='x'>t</a>")
    assert "<" not in made.data[0].name and "<" not in made.layout.title.text


def test_stability_chart_is_in_mm_and_hover_tells_frequency_and_error():
    speed = np.array([1000.0, 2000, 3000])
    depth, chatter, error = [1e-3, 4e-3, np.inf], [300, 310, 320.0], [1e-6, 2e-6, 0.0]
    curve = StabilityCurve(speed, depth, "zero order", chatter, error, ["Hopf"] * 3)
    made = stability_chart(curve, points=[(1500, 2e-3, "cut")])
    line = made.data[0]
    assert line.y[:2] == pytest.approx([1, 4])
    assert line.text[2].startswith("none found")
    assert "rev/min" in made.layout.xaxis.title.text and "mm" in made.layout.yaxis.title.text
    assert all(words in line.hovertemplate for words in ("customdata[0]", "Hz", "customdata[2]"))
    assert list(line.customdata[1]) == [310, 0.002, "Hopf"]
    assert made.data[1].y == (2.0,)


def test_intervals_are_drawn_island_by_island_and_open_ends_reach_the_top():
    intervals = [[(0, 1e-3), (2e-3, 3e-3)], np.zeros((0, 2)), [(0, np.inf)]]
    made = stability_chart(StabilityIntervals([1000, 2000, 3000], intervals), max_depth=5e-3)
    region, ends = made.data
    assert region.fill == "toself"
    pieces = np.array([v for v in region.y if v is not None]).reshape(-1, 4)  # each alone: no neighbour overlaps it
    np.testing.assert_allclose(pieces, [[0, 0, 1, 1], [2, 2, 3, 3], [0, 0, 5, 5]])
    np.testing.assert_allclose(ends.x, [1000, 1000, 3000])
    np.testing.assert_allclose(ends.y, [1, 3, 5])


def test_stable_region_ends_on_the_limit_line_between_speeds():
    speeds, limit = [1000.0, 2000.0, 3000.0], np.array([1e-3, 3e-3, 2e-3])
    made = stability_chart([StabilityIntervals(speeds, [[(0, b)] for b in limit]), StabilityCurve(speeds, limit)])
    x, y = (np.array([v for v in values if v is not None]).reshape(-1, 4) for values in (made.data[0].x, made.data[0].y))
    for piece_x, piece_y in zip(x, y):
        np.testing.assert_allclose(piece_y[[3, 2]], np.interp(piece_x[[3, 2]], speeds, 1e3 * limit))


@pytest.mark.parametrize(("make", "message"), [
    (lambda: StabilityCurve([2000, 1000.0], [1, 1]), "increase"),
    (lambda: StabilityCurve([1.0, 2], [1, -1]), "negative"),
    (lambda: StabilityCurve([1.0, 2], [1, 1], kind=["Hopf"]), "one for each speed"),
    (lambda: StabilityIntervals([1.0], [[(2, 1)]]), "from < to"),
    (lambda: stability_chart([]), "at least one"),
    (lambda: stability_chart(StabilityCurve([1.0], [np.inf])), "no finite depth")])
def test_stability_chart_refuses(make, message):
    with pytest.raises(ToolpointError, match=message):
        make()


def test_mac_matrix_numbers_and_order():
    mac = np.array([[1, 0.2], [0.1, 0.95], [0, 0]])
    made = mac_matrix(mac, ["a", "b", "c"], Modes([10.0, 20.0], [0, 0], np.eye(2), [Dof(1, "x"), Dof(1, "y")]))
    np.testing.assert_allclose(made.data[0].z, mac, atol=1e-7)
    assert made.data[0].text[1][1] == "0.95"
    assert made.layout.yaxis.autorange == "reversed"  # the first row on top, as a matrix is written
    assert made.layout.xaxis.ticktext == ("1: 10 Hz", "2: 20 Hz")
    with pytest.raises(ToolpointError, match="must be within 0"):
        mac_matrix(2 * mac, ["a", "b", "c"], ["d", "e"])
    with pytest.raises(ToolpointError, match="must be 3"):
        mac_matrix(mac, ["a", "b"], ["d", "e"])


def test_pose_maps_put_x_across_and_mark_failures():
    x, y = np.array([0, 0.1, 0.2]), np.array([0, 1.0])
    values = np.stack([10 + x[:, None] + 5 * y, 20 + 0 * x[:, None] + y], axis=-1)
    values[1, 1] = np.nan
    made = frequency_map(x, y, values)
    assert made.data[0].z[1][2] == pytest.approx(15.2)  # z[y][x]
    assert [trace.type for trace in made.data[:2]] == ["heatmap", "heatmap"]  # too few positions to be smoothed
    assert [trace.visible for trace in made.data[:4]] == [True, False, True, False]
    lowest = made.data[2]
    assert (lowest.x[0], lowest.y[0]) == (0, 0) and lowest.text[0] == "10"
    cross = made.data[4]
    assert (cross.x[0], cross.y[0]) == (0.1, 1.0)
    assert made.layout.updatemenus[0].buttons[1].args[0]["visible"] == [False, True, False, True, True]
    small = frequency_map(x, y, 26 + 0.01 * np.arange(6.0).reshape(3, 2, 1))  # a difference of 0.2 %
    assert small.data[0].zmax - small.data[0].zmin == pytest.approx(0.2 * 26.025)
    assert small.data[0].text[0][0] == "26.00<br>▽" and made.data[0].zmin is None
    lines = frequency_map(x, np.arange(90.0), np.ones((3, 90, 1)) + np.arange(90.0)[:, None])
    assert lines.data[0].ygap is None and lines.data[0].texttemplate is None  # 90 lines with gaps would be blank
    fine = frequency_map(np.arange(8.0), np.arange(9.0), np.arange(72.0).reshape(8, 9, 1))
    assert fine.data[0].type == "contour" and fine.data[2].name == "poses computed" and len(fine.data[2].x) == 72
    lines = frequency_curves(x, values[:, 0], axis="Y")
    assert len(lines.data) == 2 and lines.layout.xaxis.title.text == "Y, m"
    with pytest.raises(ToolpointError, match="frequency_curves"):
        frequency_map([0.0], y, values[:1])


def test_every_light_of_a_table_has_its_own_colour():
    """Amber is drawn amber: each light has a rule with a background and a text colour of its own, in light and in dark."""
    style = (Path(__file__).resolve().parents[2] / "src/toolpoint/plot/web/page.css").read_text(encoding="utf-8")
    rules = [re.search(rf"\.mark\.{light}\{{(.*?)\}}", style).group(1) for light in ("green", "amber", "red")]
    assert len(set(rules)) == 3
    for name in ("--amber:", "--amberbg:", "--red:", "--redbg:"):
        assert style.count(name) == 2, name
