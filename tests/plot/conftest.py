"""Pages opened in the session's headless Chromium, and the scenes that the tests look at."""

from __future__ import annotations

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

    def wait(self, expression: str, seconds: float = 10.0) -> None:
        """Wait until an expression is true; page.wait_for_function evaluates text, which the policy forbids."""
        for _ in range(int(20 * seconds)):
            if self.page.evaluate(expression):
                return
            self.page.wait_for_timeout(50)
        raise AssertionError(f"still false after {seconds:g} s: {expression}")


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
