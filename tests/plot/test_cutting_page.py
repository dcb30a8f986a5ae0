"""The stability page in a browser: hover facts are there, and a click on a simulated cut shows its own vibration."""

import numpy as np
import pytest

from toolpoint.cutting import CuttingCoefficients, Engagement, FloquetDeterminant, MillingProblem, Tool, stability
from toolpoint.cutting.simulation.milling import simulate
from toolpoint.pages.cuts.lobes import _coefficient_field, lobes_page
from toolpoint.studies.cuts.lobes_study import LobesStudy
from toolpoint.studies.cuts.uncertain_cut import Uncertainty, advice_rows, sample_charts
from toolpoint.vibration import Modes


@pytest.mark.slow
def test_click_on_a_cut_shows_its_simulation(opened):
    modes = Modes([922.0, 922.0], 0.011, np.eye(2) / np.sqrt(0.03993), ("tip:+x", "tip:+y"))
    problem = MillingProblem(Tool(0.012, 2), Engagement.slot(), CuttingCoefficients(6e8, 2e8), modes, feed_per_tooth=1e-4)
    chart = stability.chart(problem, np.linspace(8000, 20000, 7), FloquetDeterminant(), depth_max=0.0006)
    cuts = [(10000.0, 0.00005), (15000.0, 0.00008), (19000.0, 0.00025)]
    runs = [simulate(problem, speed, depth, revolutions=40) for speed, depth in cuts]
    seen = opened(lobes_page(LobesStudy(problem, chart, (), runs=tuple(runs))).html(), reduced_motion="reduce")
    seen.wait("'stability' in window.toolpointCharts && 'simulated' in window.toolpointCharts")
    seen.wait("window.toolpointCharts.simulated.dataset.shown === '0'")
    source = seen.page.locator(".tp-chart[data-name=stability]")
    title = "window.toolpointCharts.simulated.parentElement.querySelector('h3').textContent"
    for number, words in ((2, "19000 rev/min"), (1, "15000 rev/min")):
        seen.click_point("stability", source.locator(".scatterlayer .trace").last.locator(".point").nth(number))
        seen.wait(f"window.toolpointCharts.simulated.dataset.shown === '{number}'")
        assert words in seen.page.evaluate(title)
    expected = runs[1].verdict().state
    assert expected in seen.page.evaluate(title)
    drawn = seen.page.evaluate("Array.from(window.toolpointCharts.simulated.data[0].y)")
    tail = runs[1].displacement[-4 * runs[1].steps_per_revolution:, 0]
    np.testing.assert_allclose(drawn[:5], 1e6 * tail[::max(1, len(tail) // 400)][:5], rtol=1e-4)
    assert seen.errors == []
    assert len(seen.requests) == 1


@pytest.mark.slow
def test_the_probability_chart_and_the_cuts_made_are_drawn(opened):
    modes = Modes([922.0, 922.0], 0.011, np.eye(2) / np.sqrt(0.03993), ("tip:+x", "tip:+y"))
    problem = MillingProblem(Tool(0.012, 2), Engagement.down(0.05), CuttingCoefficients(6e8, 2e8), modes)
    chart = stability.chart(problem, np.linspace(8000, 20000, 9), depth_max=3e-3)
    known = Uncertainty(12, cuts=((9500.0, 0.4e-3, True), (16000.0, 2.5e-3, False)))
    sampled, _ = sample_charts(problem, chart, known, method=FloquetDeterminant())
    advice = tuple(map(tuple, advice_rows(chart, sampled, known)))
    report = lobes_page(LobesStudy(problem, chart, advice, probability=sampled, uncertainty=known))
    seen = opened(report.html(), reduced_motion="reduce")
    seen.wait("'probability' in window.toolpointCharts && 'importance' in window.toolpointCharts")
    drawn = seen.page.evaluate("Array.from(window.toolpointCharts.probability.data, trace => trace.name || trace.type)")
    assert drawn[0] == "heatmap" and "95 % stable" in drawn and drawn[-2:] == ["stable cut", "cut with chatter"]
    assert "best cut with 95 % certainty" in seen.page.content()
    assert seen.errors == []


@pytest.mark.slow
def test_depth_at_my_speed_is_the_lower_of_both_sides(opened):
    from toolpoint.plot import Lookup, Report

    lookup = Lookup("How deep at my speed", "rev/min", [1000, 2000, 3000], [1e-3, np.inf, 2e-3],
                    ["1000: 1 mm", "2000: no limit", "3000: 2 mm"], 1500)
    seen = opened(Report("x", "An answer.").with_section("Chart", lookup).html())
    place, field = seen.page.locator(".tp-lookup output"), seen.page.locator(".tp-lookup input")
    for value, words in (("1500", "1000: 1 mm"), ("2900", "3000: 2 mm"), ("2000", "2000: no limit"), ("5000", "Outside")):
        field.fill(value)
        assert place.locator("strong").inner_text().startswith(words)
    assert seen.errors == [] and len(seen.requests) == 1


@pytest.mark.slow
def test_the_field_of_the_coefficient_gives_the_limit_of_a_chart_with_that_coefficient(opened):
    """Straight edges: b K_t stays, so the page's answer is that of the engine for twice and 0.8 times the coefficient."""
    modes = Modes([922.0, 922.0], 0.011, np.eye(2) / np.sqrt(0.03993), ("tip:+x", "tip:+y"))
    problem = MillingProblem(Tool(0.012, 2), Engagement.slot(), CuttingCoefficients(6e8, 2e8), modes)
    speeds = np.linspace(8000, 20000, 7)
    page = lobes_page(LobesStudy(problem, stability.chart(problem, speeds, FloquetDeterminant(), depth_max=0.0006), ()))
    seen = opened(page.html(), reduced_motion="reduce")
    seen.page.locator("#tp-field-depth").fill("14000")
    field, answer = seen.page.locator("#tp-inverse-depth"), seen.page.locator(".tp-lookup output strong")
    for factor in (2.0, 0.8):
        changed = problem.changed(coefficients=CuttingCoefficients(factor * 6e8, factor * 2e8))
        limit = 1e3 * stability.chart(changed, speeds, FloquetDeterminant(), depth_max=0.0012).limit[3]
        field.fill(str(600 * factor))
        told = float(answer.inner_text().split("up to ")[1].split()[0])
        assert limit * (1 - 1.1e-2) <= told <= limit * (1 + 1e-4), (factor, limit, told)
    field.fill("0")
    assert "above zero" in answer.inner_text()
    assert seen.errors == []


def test_a_helix_has_no_field_of_the_coefficient():
    """A helix turns the teeth over the depth: the limit does not go inversely with K_t there."""
    modes = Modes([922.0, 922.0], 0.011, np.eye(2) / np.sqrt(0.03993), ("tip:+x", "tip:+y"))
    problem = MillingProblem(Tool(0.012, 2, helix=0.5), Engagement.slot(), CuttingCoefficients(6e8, 2e8), modes)
    straight = problem.changed(tool=Tool(0.012, 2))
    chart = stability.chart(straight, np.linspace(8000, 20000, 3), FloquetDeterminant(), depth_max=0.0006)
    assert _coefficient_field(problem, chart) is None and _coefficient_field(straight, chart) is not None


@pytest.mark.slow
def test_immersion_and_teeth_are_answered_where_computed_and_refused_by_name_elsewhere(opened):
    from toolpoint.plot import InverseField, Lookup, Report, TableFields

    values = np.array([[[1e-3, 3e-3], [4e-4, 5e-4]], [[6e-4, np.inf], [2e-4, 3e-4]]])
    fields = TableFields(("immersion", "teeth"), (0.5, 2), (0.25, 0.5), (2, 3), (1000, 2000), values, np.full((2, 2), 4e-3),
                         1e3, "mm", "By the engine.", "Run --immersion {0} --teeth {1}.")
    lookup = Lookup("How deep", "rev/min", [1000, 2000], [6e-4, np.inf], ["a", "b"], 1000, "depth",
                    InverseField("K_t", "N/mm²", 600.0, 1e3, "mm", 4e-3, "Exact."), fields)
    seen = opened(Report("x", "An answer.").with_section("Chart", lookup).html())

    def answer(immersion, teeth, speed="1000", kt="600"):
        for place, text in (("row", immersion), ("column", teeth), ("inverse", kt), ("field", speed)):
            seen.page.fill(f"#tp-{place}-depth", text)
        return seen.page.inner_text(".tp-lookup output")
    assert answer("0.5", "2") == "a"  # the chart's own answer
    assert answer("0.25", "3").startswith("1000 rev/min, 3 teeth, immersion 0.25: stable up to 0.4 mm.")
    assert "stable up to 0.2 mm" in answer("0.25", "3", kt="1200")  # goes with 1/Kt
    assert "stable up to 0.4 mm" in answer("0.25", "3", "1500")  # the lower of two speeds
    between = answer("0.3", "3")
    assert "immersion 0.25 is stable up to 0.4 mm, 0.5 stable up to 0.2 mm" in between
    assert "--immersion 0.3 --teeth 3" in between
    for immersion, teeth in (("0.3", "7"), ("0.1", "2"), ("0.9", "3"), ("0.3", "2.5")):
        refused = answer(immersion, teeth)
        assert "stable up" not in refused and f"--immersion {immersion} --teeth {teeth}" in refused
    assert answer("", "2") == "Write immersion and teeth above zero."
    assert answer("0.25", "2", "900") == "Outside what was computed: 1000 to 2000 rev/min." and seen.errors == []
