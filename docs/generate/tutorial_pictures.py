"""Pictures of the tutorials: what a reader's own page then shows, taken from the run of the tutorial itself.

    python docs/generate/tutorial_pictures.py docs/tutorials/*.md

A line ``![words](pictures/NAME.webp "Section")`` of a tutorial names a section of the page that the block before it wrote
last. The blocks of the tutorial are run in order, and the picture of that section is taken where the line stands. Needs
Chromium and Pillow.
"""

from __future__ import annotations

import io
import re
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))
from tutorials import run_tutorial

PICTURE = re.compile(r'^!\[[^\]]*\]\(pictures/([\w-]+\.webp) "([^"]+)"\)$', re.MULTILINE)
WINDOW = {"width": 1120, "height": 900}  # pixels
STORED_WIDTH, MAX_STORED_HEIGHT = 860, 640  # pixels
QUALITY, SETTLING_TIME = 40, 2.5  # of WebP, of 100; s until charts and shapes are drawn
BROWSER_ARGUMENTS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"]


def pictures_by_block(page: Path) -> dict[int, list[tuple[str, str]]]:
    """Return file and section of the pictures of a tutorial by the number of blocks that stand before them."""
    text = page.read_text(encoding="utf-8")
    wanted: dict[int, list[tuple[str, str]]] = {}
    for match in PICTURE.finditer(text):
        count = len(re.findall(r"^```(?:python|sh)$", text[:match.start()], re.MULTILINE))
        wanted.setdefault(count, []).append((match[1], match[2]))
    return wanted


def store(png: bytes, target: Path) -> int:
    """Write the upper part of a picture as WebP, made smaller; return its size in bytes."""
    from PIL import Image

    picture = Image.open(io.BytesIO(png)).convert("RGB")
    picture = picture.resize((STORED_WIDTH, round(picture.height * STORED_WIDTH / picture.width)), Image.Resampling.LANCZOS)
    picture = picture.crop((0, 0, STORED_WIDTH, min(picture.height, MAX_STORED_HEIGHT)))
    target.parent.mkdir(exist_ok=True)
    picture.save(target, "WEBP", quality=QUALITY, method=6)
    return target.stat().st_size


def take_picture(browser: Any, page: Path, section: str, target: Path) -> None:
    """Take the picture of a section of a page; "Answer" is its head, down to the doubts."""
    tab = browser.new_context(viewport=WINDOW, color_scheme="light", reduced_motion="reduce").new_page()
    tab.goto(page.resolve().as_uri())
    tab.wait_for_timeout(1e3 * SETTLING_TIME)
    if section == "Answer":
        png = tab.screenshot()
    else:
        part = tab.locator("section", has=tab.get_by_role("heading", level=2, name=section, exact=True)).first
        part.scroll_into_view_if_needed()
        tab.wait_for_timeout(1e3 * SETTLING_TIME)
        png = part.screenshot()
    print(f"{target.name}: {store(png, target) / 1e3:.0f} kB", flush=True)
    tab.context.close()


def newest_page(folder: Path) -> Path:
    """Return the page that was written last beneath a folder."""
    return max(folder.rglob("index.html"), key=lambda path: path.stat().st_mtime)


def main() -> None:
    """Run the tutorials that are named, and take their pictures."""
    from playwright.sync_api import sync_playwright

    browser_path = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path, args=BROWSER_ARGUMENTS)
        for name in sys.argv[1:]:
            tutorial = Path(name).resolve()
            wanted = pictures_by_block(tutorial)
            if wanted:
                run_tutorial(tutorial, after_block=_photographer(browser, wanted, tutorial.parent / "pictures"))
        browser.close()


def _photographer(browser: Any, wanted: dict[int, list[tuple[str, str]]], place: Path) -> Callable[[int, Path], None]:
    def photograph(count: int, folder: Path) -> None:
        for file, section in wanted.get(count, ()):
            take_picture(browser, newest_page(folder), section, place / file)
    return photograph


if __name__ == "__main__":
    main()
