"""The report page: self-contained, escaped, whole on disk, charts alive in a browser and tied to the views."""

from __future__ import annotations

import re

import pytest

from toolpoint import ToolpointError
from toolpoint.plot import Cell, Chart, Listing, Notes, Report, ShapeView, Table, Text
from toolpoint.plot.figures.theme import figure
from toolpoint.plot.page.frame import chart_block

EVIL = "</script ><script >window.broken = 1</script><img src=x onerror=\"window.broken = 2\">"


def poles(title=""):
    made = figure(title)
    made.add_scatter(x=[10, 20, 30], y=[1, 2, 3], customdata=[0, 1, 2], mode="markers", name="poles",
                     marker={"size": 16})
    return made


def full(machine, shapes, words="plain"):
    view = ShapeView(machine, shapes, name="modes", title=words)
    return (
        Report(f"Report {words}", f"Summary {words}.\n\nMore.", subtitle=words)
        .with_section(f"Table {words}",
                      Table(["Mode", words], [[1, Cell(words, "published")], [2, Cell(2.5, "chosen")]], words))
        .with_section("Charts", Chart(poles(words), words, "poles", click_view="modes"), Chart(poles()), view)
        .with_section("Inputs", Listing(words, f"a: {words}"), Notes([words]), Notes([words], "warning"), words))


@pytest.mark.slow
def test_page_is_whole_quiet_and_asks_nothing(opened, machine, shapes):
    html = full(machine, shapes).html()
    assert html.count(chart_block()) == 1
    assert len(html) - len(chart_block()) < 200_000
    assert not re.search(r"<(script|link|img|iframe)[^>]+(src|href)=[\"']?(https?:)?//", html)
    seen = opened(html)
    seen.wait("Object.keys(window.toolpointCharts).length === 2")
    assert seen.page.locator(".tp-chart .main-svg").count() >= 2
    seen.page.wait_for_timeout(300)
    assert len(seen.requests) == 1 and seen.requests[0].startswith("file:")
    assert seen.errors == []


@pytest.mark.slow
def test_click_on_a_pole_shows_its_mode(opened, machine, shapes):
    seen = opened(full(machine, shapes).html(), reduced_motion="reduce")
    seen.wait("Object.keys(window.toolpointCharts).length === 2")
    chart = seen.page.locator(".tp-chart[data-name=poles]")
    for mode in (2, 1):
        seen.click_point("poles", chart.locator(".scatterlayer .point").nth(mode))
        seen.wait(f"window.toolpointViews.modes.mode === {mode}")
    assert seen.errors == []


@pytest.mark.slow
def test_user_text_is_escaped_everywhere(opened, machine, shapes):
    seen = opened(full(machine, shapes, EVIL).html(), reduced_motion="reduce")
    seen.wait("Object.keys(window.toolpointCharts).length === 2")
    assert seen.page.evaluate("window.broken") is None
    assert seen.page.locator("img[src=x]").count() == 0
    assert "onerror" in seen.page.locator("h1").inner_text()
    assert seen.errors == []


@pytest.mark.slow
def test_dark_page_has_light_chart_text(opened, machine, shapes):
    colours = []
    for scheme in ("dark", "light"):
        seen = opened(full(machine, shapes).html(), color_scheme=scheme, reduced_motion="reduce")
        seen.wait("Object.keys(window.toolpointCharts).length === 2")
        colours.append(seen.page.evaluate("window.toolpointCharts.poles._fullLayout.font.color"))
    assert colours[0] != colours[1]


def test_report_without_charts_carries_no_chart_script():
    html = Report("Title").with_section("One", Text("a\n\nb")).html()
    assert "Plotly" not in html.replace("window.Plotly", "")
    assert "<p>a</p><p>b</p>" in html
    assert len(html) < 30_000


def test_saved_whole_or_not_at_all(tmp_path):
    report = Report("Title", date="2024-05-06")
    path = report.save(tmp_path / "a" / "b")
    assert path == tmp_path / "a" / "b" / "index.html"
    assert path.read_text("utf-8") == report.html()
    assert report.save(tmp_path / "page.html").name == "page.html"
    assert sorted(p.name for p in path.parent.iterdir()) == ["index.html"]  # no draft left
    blocked = tmp_path / "file"
    blocked.write_text("x")
    with pytest.raises(ToolpointError, match="cannot be written"):
        report.save(blocked / "below")


def test_a_file_name_of_a_plain_locale_is_written_as_its_bytes(tmp_path):
    name = "Fräser.csv".encode().decode("ascii", errors="surrogateescape")  # as Python has it under LC_ALL=C
    assert "Fräser.csv" in Report("Tap test", subtitle=name).save(tmp_path).read_text("utf-8")


def test_failed_page_leaves_the_old_one(tmp_path, machine, shapes):
    path = Report("Old").save(tmp_path)
    broken = Report("New").with_section("x", Chart(poles(), click_view="nowhere"))
    with pytest.raises(ToolpointError, match="nowhere"):
        broken.save(tmp_path)
    assert "Old" in path.read_text("utf-8")
    assert len(list(tmp_path.iterdir())) == 1


def test_version_date_and_navigation():
    html = Report("T", date="2024-05-06").with_section("Same").with_section("Same").html()
    assert "2024-05-06" in html and "toolpoint 0." in html
    anchors = re.findall(r'href="#([^"]+)"', html)
    assert len(set(anchors) - {"content"}) == 2 and all(f'id="{a}"' in html for a in anchors)


def test_table_numbers_share_decimals_and_marks_have_a_key():
    html = Table(["f", "n"], [[58.0, "x"], [Cell(21.57, "published"), "y"], {"f": 4, "n": 1}]).fragment()
    assert "58.00" in html and "21.57" in html and ">4<" in html
    assert html.count("published") == 4  # class and tooltip of the cell, class and word of the key
    with pytest.raises(ToolpointError, match="row 0 has 1"):
        Table(["a", "b"], [[1]])


def test_wrong_parts_are_refused(machine, shapes):
    with pytest.raises(ToolpointError, match="wrap a plotly figure"):
        Report("T").with_section("x", poles())
    twice = ShapeView(machine, shapes)
    with pytest.raises(ToolpointError, match="twice"):
        Report("T").with_section("x", twice, twice).html()
    with pytest.raises(ToolpointError, match="did you mean"):
        Cell(1, "publishd")
