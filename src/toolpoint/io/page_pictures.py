"""Charts of a page of toolpoint (HTML) as PNG or SVG, drawn by a headless browser (extra `pictures`: playwright)."""

from __future__ import annotations

import base64
import shutil
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from toolpoint._check import ToolpointError
from toolpoint.io.door import new_files

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
MAX_CHART_SECONDS, CHART_LOOK_MS = 120.0, 100  # for a page to draw its charts, on a loaded machine too; between two looks
NAMES = "() => Object.keys(window.toolpointCharts || {})"
ALL_DRAWN = """() => window.toolpointCharts !== undefined
  && document.querySelectorAll('.tp-chart').length === Object.keys(window.toolpointCharts).length"""
DRAW = """async ([name, format, width, scale]) => {
  const chart = window.toolpointCharts[name];
  const height = chart.clientHeight || 420;
  return await Plotly.toImage(chart, {format, width, height, scale});
}"""


def write_pictures(page: str | Path, folder: str | Path, kind: str, *, width: int = 1000, scale: float = 2.0) -> list[Path]:
    """Write every chart of a page as a file of its name, ``png`` or ``svg``; return the files.

    Raises ToolpointError where playwright or a browser is missing, the page has no chart, or a file is there already.
    """
    page = Path(page) / "index.html" if Path(page).is_dir() else Path(page)
    if not page.is_file():
        raise ToolpointError(f"{page}: no such page; check the name and the folder")
    # In a thread of its own: a notebook's thread runs an event loop, in which playwright refuses to begin.
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(_open_and_draw, page, Path(folder), kind, width=width, scale=scale).result()


def _open_and_draw(page: Path, folder: Path, kind: str, *, width: int, scale: float) -> list[Path]:
    """Open a page in a browser and write its charts."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        raise ToolpointError(f"{page}: pictures are drawn by a browser through playwright; install it with pip install "
                             "'toolpoint[pictures]'") from None
    executable = next(filter(None, map(shutil.which, BROWSERS)), None)
    with sync_playwright() as playwright:
        try:
            browser = playwright.chromium.launch(executable_path=executable, args=["--no-sandbox"])
        except Exception as error:  # playwright has many words for a browser that is not there
            raise ToolpointError(f"{page}: no browser starts ({str(error).splitlines()[0]}); install chromium, or run: "
                                 "playwright install chromium") from None
        try:
            return _drawn(browser, page, folder, kind, width=width, scale=scale)
        finally:
            browser.close()


def _drawn(browser: Any, page: Path, folder: Path, kind: str, *, width: int, scale: float) -> list[Path]:
    tab = browser.new_page(viewport={"width": 1400, "height": 900})
    tab.goto(page.resolve().as_uri())
    end = time.monotonic() + MAX_CHART_SECONDS
    while not tab.evaluate(ALL_DRAWN) and time.monotonic() < end:  # the page's policy forbids the waits of playwright
        tab.wait_for_timeout(CHART_LOOK_MS)
    names = tab.evaluate(NAMES)
    if not names:
        raise ToolpointError(f"{page}: has no chart")
    files = new_files(folder, names, kind)
    for name, file in zip(names, files, strict=True):
        source = tab.evaluate(DRAW, [name, kind, width, scale])
        head, _, body = source.partition(",")
        file.write_bytes(base64.b64decode(body) if "base64" in head else unquote(body).encode())
    return files
