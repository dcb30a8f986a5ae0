"""Pages opened in the session's headless Chromium, and the scenes that the tests look at."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from toolpoint.plot import AnimatedShapes, Box, Scene


@dataclass
class Seen:
    """What a page did: requests, console errors, uncaught errors."""

    page: Any
    requests: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)

    def wait(self, expression: str, seconds: float = 240.0) -> None:
        """Wait until an expression is true; page.wait_for_function evaluates text, which the policy forbids.

        A loaded machine is slow, not wrong: the limit is there for what never comes.
        """
        end = time.monotonic() + seconds
        while not self.page.evaluate(expression):
            assert time.monotonic() < end, f"still false after {seconds:g} s: {expression}"
            self.page.wait_for_timeout(50)

    def wait_for_frames(self) -> None:
        """Wait until the page has drawn what was asked of it before."""
        self.page.evaluate("() => new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(go)))")

    def wait_for_rest(self, part: Any) -> dict[str, float]:
        """Return the box of a part of the page once it lies at the same place in two looks: a chart draws itself again."""
        part.scroll_into_view_if_needed()
        before, end = None, time.monotonic() + 240.0
        while (box := part.bounding_box()) is None or box != before:
            assert time.monotonic() < end, "a part of the page never comes to rest"
            before = box
            self.wait_for_frames()
            self.page.wait_for_timeout(100)
        return box

    def click_point(self, chart: str, point: Any) -> None:
        """Click on a drawn point of a chart by the mouse, as a person does: once the chart shows that the mouse is on it."""
        self.page.locator(f".tp-chart[data-name={chart}]").scroll_into_view_if_needed()
        hovered = f"(window.toolpointCharts['{chart}']._hoverdata || []).length > 0"
        end = time.monotonic() + 240.0
        while True:
            box = self.wait_for_rest(point)
            x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
            self.page.mouse.move(x + 1, y)
            self.page.mouse.move(x, y)
            self.page.wait_for_timeout(200)  # the chart looks where the mouse is a few times a second
            if self.page.evaluate(hovered):
                break
            assert time.monotonic() < end, f"the chart {chart} does not see the mouse"
            self.page.mouse.move(1, 1)
        self.page.mouse.click(x, y)


@pytest.fixture
def opened(browser: Any, tmp_path: Path) -> Iterator[Callable[..., Seen]]:
    """Open HTML text as a file:// page of its own context; keyword `script` runs before the page."""
    contexts = []

    def open_page(html: str, script: str = "", **options: Any) -> Seen:
        file = tmp_path / f"page{len(contexts)}.html"
        file.write_text(html, "utf-8")
        context = browser.new_context(viewport={"width": 1100, "height": 800}, **options)
        contexts.append(context)
        page = context.new_page()
        seen = Seen(page)
        page.on("request", lambda request: seen.requests.append(request.url))
        page.on("pageerror", lambda error: seen.errors.append(str(error)))
        page.on("console", lambda line: seen.errors.append(line.text) if line.type in ("error", "warning") else None)
        if script:
            page.add_init_script(script)
        page.goto(file.as_uri())
        seen.wait("document.readyState === 'complete'")
        return seen

    yield open_page
    for context in contexts:
        context.close()


@pytest.fixture
def machine() -> Scene:
    """Four boxes that stand like a small vertical machine."""
    return Scene.of_boxes([
        Box("bed", (0, 0, 0.3), (1.6, 1.2, 0.6)), Box("column", (0, 0.45, 1.4), (0.7, 0.5, 1.6)),
        Box("table", (0, -0.1, 0.7), (1.4, 0.6, 0.2)), Box("head", (0, -0.1, 1.9), (0.4, 0.7, 0.5))])


@pytest.fixture
def shapes(machine: Scene) -> AnimatedShapes:
    """Three modes: a real one, a travelling complex one, a real one in another direction."""
    x = machine.nodes
    weight = np.array([0, 1, 0.4, 1.3])[machine.node_body][:, None]
    rock = np.cross([1.0, 0, 0], x) * weight
    sway = np.cross([0, 1.0, 0], x) * weight
    return AnimatedShapes([21.5, 26.4, 132.8], [0.012, 0.02, 0.031], np.stack([rock + 0j, rock + 1j * sway, sway + 0j]),
                          ("rocking", "whirling", "swaying"))
