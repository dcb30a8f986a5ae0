"""Pictures of every view of the workbench, at two widths, light and dark: `python docs/generate/workbench_pictures.py PROJECT`.

PROJECT is a folder that was run, as `toolpoint demo project` leaves it; a copy of it is served. Needs Chromium and the extras
`app` and `pictures`.
"""

from __future__ import annotations

import argparse
import io
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

PLACE = Path(__file__).resolve().parents[1] / "workbench"
WIDTHS = {1400: 900, 390: 844}  # pixels of a window: its height
STORED_WIDTH = 1000  # pixels of a stored picture of the wide window
QUALITY = 50  # of WebP, of 100: words of 12 pixels can still be read
SETTLING_TIME = 2.5  # s after a view is there: charts, shapes and intervals follow


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
    page.wait_for_timeout(1e3 * SETTLING_TIME)


def store(png: bytes, target: Path) -> int:
    """Write a picture as WebP, a wide one made smaller; return its size in bytes."""
    from PIL import Image

    picture = Image.open(io.BytesIO(png)).convert("RGB")
    if picture.width > STORED_WIDTH:
        picture = picture.resize((STORED_WIDTH, round(picture.height * STORED_WIDTH / picture.width)), Image.Resampling.LANCZOS)
    picture.save(target, "WEBP", quality=QUALITY, method=6)
    return target.stat().st_size


def take_pictures(project: Path, target: Path, *, full: bool = False) -> dict[str, int]:
    """Write the pictures of every view; return their sizes in bytes by name.

    full : the whole page in place of the window.
    """
    from playwright.sync_api import sync_playwright

    sizes = {}
    target.mkdir(parents=True, exist_ok=True)
    browser_path = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
    with served(project) as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path, args=["--no-sandbox", "--use-gl=angle",
                                                                                 "--use-angle=swiftshader"])
        for width, height in WIDTHS.items():
            for theme in ("light", "dark"):
                page = browser.new_context(viewport={"width": width, "height": height}, color_scheme=theme).new_page()
                page.goto(address)
                settle(page, "project")
                for view in page.evaluate("window.Workbench.known"):
                    settle(page, view)
                    name = f"{view}_{width}_{theme}.webp"
                    sizes[name] = store(page.screenshot(full_page=full), target / name)
                page.context.close()
        browser.close()
    return sizes


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("project", type=Path)
    parser.add_argument("--to", type=Path, default=PLACE)
    parser.add_argument("--full", action="store_true", help="the whole page in place of the window")
    arguments = parser.parse_args()
    written = take_pictures(arguments.project, arguments.to, full=arguments.full)
    print(f"{len(written)} pictures, {sum(written.values()) / 1e3:.0f} kB in {arguments.to}")
