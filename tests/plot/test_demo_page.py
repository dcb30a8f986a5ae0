"""The demo's page in a browser: it renders, moves, asks no host, and says so where WebGL is missing."""

import pytest

from toolpoint.app.main import main


@pytest.fixture(scope="module")
def html(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo")
    main(["demo", "-o", str(folder)])
    return (folder / "index.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_it_renders_moves_and_asks_nothing(opened, html):
    seen = opened(html, reduced_motion="reduce")
    seen.wait("Object.keys(window.toolpointViews).length === 2")
    seen.wait("Object.keys(window.toolpointCharts).length === 4")
    canvas = seen.page.locator(".tp-view[data-name=machine] canvas").first
    canvas.scroll_into_view_if_needed()  # what is not in the window is not drawn
    pictures = []
    for phase in (0, 1.57, 3.14):
        seen.page.evaluate(f"window.toolpointViews.machine.setPhase({phase})")
        seen.wait("!window.toolpointViews.machine.dirty")
        seen.wait_for_frames()
        pictures.append(canvas.screenshot())
    assert len(set(pictures)) == 3
    assert len(seen.requests) == 1
    assert seen.errors == []


@pytest.mark.slow
def test_mode_buttons_change_the_mode(opened, html):
    seen = opened(html, reduced_motion="reduce")
    seen.wait("Object.keys(window.toolpointViews).length === 2")
    seen.page.locator(".tp-view[data-name=machine]").get_by_role("button", name="57.98").click()
    seen.wait("window.toolpointViews.machine.mode === 5")


@pytest.mark.slow
def test_missing_webgl_is_said(opened, html):
    script = ("const get = HTMLCanvasElement.prototype.getContext;"
              "HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {"
              " return kind.startsWith('webgl') ? null : get.call(this, kind, ...rest); };")
    seen = opened(html, script)
    seen.wait("document.querySelector('.tp-view[data-name=machine]').innerText.includes('WebGL')")
