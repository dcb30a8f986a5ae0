"""Pictures of every view of the workbench, at two widths, light and dark, for the manual.

    python docs/generate/workbench_pictures.py MILL POCKET_MILL

Both are folders of projects that were run: that of `toolpoint demo project`, and that of `toolpoint samples program` with its
servo and a circle, which has the views that the first lacks. Copies are served. Needs Chromium and the extras `app` and
`pictures`.
"""

from __future__ import annotations

import argparse
import io
import itertools
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

PLACE = Path(__file__).resolve().parents[1] / "workbench"
WIDTHS = {1400: 1300, 390: 1200}  # pixels of a window: its height
STORED_WIDTHS = {1400: 860, 390: 300}  # pixels of a stored picture by the width of its window
QUALITY = 28  # of WebP, of 100: words of 12 pixels can still be read
SETTLING_TIME = 2.0  # s after a view is there: charts and shapes follow
WAITING_LIMIT = 120.0  # s for an interval, or a page in a frame
BROWSER_ARGUMENTS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"]
# Whether the interval of a limit, or the exact limits over the speeds, which come last, are still asked for.
IS_WAITING = """(document.getElementById('wb-interval')?.textContent || '').includes('…') || ('VIEW' === 'lobes' &&
    ![...document.querySelectorAll('main *')].some((node) => node.textContent === window.Workbench.word('exact')))"""
FRAMED_VIEWS = ("report", "servo", "program")  # whose page is shown


@contextmanager
def served(project: Path) -> Iterator[str]:
    """Serve a copy of a project in a process of its own; give its address."""
    with tempfile.TemporaryDirectory(prefix="toolpoint-pictures-") as place:
        folder = Path(shutil.copytree(project.resolve(), Path(place) / "project"))
        server = subprocess.Popen([sys.executable, "-m", "toolpoint", "serve", "."], cwd=folder, text=True,
                                  stdout=subprocess.PIPE, env={**os.environ, "OMP_NUM_THREADS": "1"})
        try:
            assert server.stdout is not None
            yield server.stdout.readline().split()[-1]
        finally:
            server.terminate()
            server.wait()


def settle(page: Any, view: str) -> None:
    """Wait until a view is there and its charts are drawn."""
    page.evaluate(f"location.hash = '#/{view}'")
    while not page.evaluate(f"document.body.dataset.ready === '{view}' && window.Workbench.current === '{view}'"):
        time.sleep(0.05)
    if view in FRAMED_VIEWS:
        page.get_by_role("button", name="Show the page").first.click()
        page.frame_locator("iframe.wb-page").locator("h1").wait_for(timeout=1e3 * WAITING_LIMIT)
    page.wait_for_timeout(1e3 * SETTLING_TIME)
    end = time.monotonic() + WAITING_LIMIT
    while page.evaluate(IS_WAITING.replace("VIEW", view)) and time.monotonic() < end:
        time.sleep(0.1)
    page.evaluate("scrollTo(0, 0)")  # a click scrolls to what it clicks
    page.wait_for_timeout(1e3 * SETTLING_TIME)


def store(png: bytes, target: Path) -> int:
    """Write a picture as WebP, made smaller; return its size in bytes."""
    from PIL import Image

    picture = Image.open(io.BytesIO(png)).convert("RGB")
    width = STORED_WIDTHS[picture.width]
    picture = picture.resize((width, round(picture.height * width / picture.width)), Image.Resampling.LANCZOS)
    picture.save(target, "WEBP", quality=QUALITY, method=6)
    return target.stat().st_size


def take_pictures(projects: Sequence[Path], target: Path) -> dict[str, int]:
    """Write the pictures of every view, of the first project that has it; return their sizes in bytes by name."""
    from playwright.sync_api import sync_playwright

    sizes: dict[str, int] = {}
    target.mkdir(parents=True, exist_ok=True)
    browser_path = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path, args=BROWSER_ARGUMENTS)
        for project in projects:
            with served(project) as address:
                for (width, height), theme in itertools.product(WIDTHS.items(), ("light", "dark")):
                    page = browser.new_context(viewport={"width": width, "height": height}, color_scheme=theme).new_page()
                    page.goto(address)
                    settle(page, "project")
                    for view in page.evaluate("window.Workbench.known"):
                        name = f"{view}_{width}_{theme}.webp"
                        if name not in sizes:
                            settle(page, view)
                            sizes[name] = store(page.screenshot(), target / name)
                    page.context.close()
        browser.close()
    return sizes


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("projects", type=Path, nargs="+")
    parser.add_argument("--to", type=Path, default=PLACE)
    arguments = parser.parse_args()
    written = take_pictures(arguments.projects, arguments.to)
    print(f"{len(written)} pictures, {sum(written.values()) / 1e3:.0f} kB in {arguments.to}")
