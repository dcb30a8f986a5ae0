"""The gallery: the repository's examples, grouped and titled for sphinx-gallery, with a picture of the page that each saves.

An example that saves no page has a picture of what it prints.
"""

from __future__ import annotations

import html
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from generate.sites import ROOT

# Words in an example's name that put it into a group; the first that fits counts.
GROUPS = {
    "machines": ("Machines", ("machine_file", "template", "report_a_machine", "published_machine", "campbell", "map_fr",
                              "weigh_a", "sensitiv", "stiffen", "gantry", "parallel_head", "matrices", "environment",
                              "place_a_tool", "other_prog")),
    "measured": ("Measurement, modes, joints, updating", (
        "identif", "modal_test", "hammer", "joints", "update", "correlate", "test", "shake", "measured_resp", "clip", "records",
        "responses_from", "convert")),
    "robots": ("Robots", ("robot", "best_place")),
    "servos": ("Servos", ("circle", "servo", "axis", "controller", "friction")),
    "cuts": ("Cuts", ("",)),
}
PAGES: list[Path] = []
PRINTED: list[str] = []
SHOWN = 34  # lines of print in a picture
WINDOW = "1200,900"


def group_of(name: str) -> str:
    """Return the group of an example by its file name."""
    return next(group for group, (_, words) in GROUPS.items() if any(word in name for word in words))


def write_examples(folder: Path) -> None:
    """Copy the examples into folders of their groups, with the titles that sphinx-gallery asks for."""
    shutil.rmtree(folder, ignore_errors=True)
    for group, (title, _) in GROUPS.items():
        (folder / group).mkdir(parents=True)
        (folder / group / "GALLERY_HEADER.rst").write_text(f"{title}\n{'-' * len(title)}\n")
    words = "Every example is a deed, at most forty lines, with one number that the tests assert."
    (folder / "GALLERY_HEADER.rst").write_text(f"Examples\n========\n\n{words}\n")
    # The examples of the five sources are minutes long; their numbers are kept, and shown on pages of their own.
    for path in sorted(path for path in (ROOT / "examples").glob("*.py") if not path.stem.startswith("source_")):
        title = path.stem.replace("_", " ").capitalize()
        text = path.read_text(encoding="utf-8").replace('"""', f'r"""\n{title}\n{"=" * len(title)}\n\n', 1)
        (folder / group_of(path.stem) / path.name).write_text(text, encoding="utf-8")


def record_pages() -> None:
    """Keep a copy of every page that an example saves, and what it prints, for its picture."""
    from toolpoint.plot import Report

    save: Any = Report.save
    keep = Path(tempfile.mkdtemp(prefix="toolpoint-gallery-"))

    def saved(report: Any, path: Any) -> Path:
        target: Path = save(report, path)
        copy = keep / f"{len(list(keep.iterdir()))}.html"
        shutil.copy(target, copy)
        PAGES.append(copy)
        return target

    Report.save = saved  # type: ignore[method-assign]
    _record_print()


def _record_print() -> None:
    """Keep what examples print, as sphinx-gallery's own capture of it sees it."""
    from sphinx_gallery import gen_rst

    tee: Any = gen_rst._LoggingTee
    write = tee.write

    def written(self: Any, data: str) -> Any:
        PRINTED.append(data)
        return write(self, data)

    tee.write = written


class PageScraper:
    """A scraper of sphinx-gallery that takes pictures of the pages that an example saved."""

    def __repr__(self) -> str:
        return "PageScraper"

    def __call__(self, block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
        """Return the directive of the pictures taken since the last block."""
        from sphinx_gallery.scrapers import figure_rst

        pages, pictures = PAGES[-1:] or _page_of_print(), []
        PAGES.clear()
        PRINTED.clear()
        for page in pages:
            picture = next(block_vars["image_path_iterator"])
            if take_picture(page, Path(picture)):
                pictures.append(picture)
        return figure_rst(pictures, gallery_conf["src_dir"]) if pictures else ""


def _page_of_print() -> list[Path]:
    """Return a page of what was printed, as the terminal shows it; none where nothing was."""
    lines = "".join(PRINTED).splitlines()[:SHOWN]
    if not lines:
        return []
    page = Path(tempfile.mkdtemp(prefix="toolpoint-gallery-")) / "print.html"
    style = ("font: 20px/1.25 'DejaVu Sans Mono', monospace; background: #10243a; color: #e8f0f8; padding: 24px; margin: 0; "
             "height: 100vh")
    text = html.escape("\n".join(lines))
    page.write_text(f"<meta charset=utf-8><body style='margin:0'><pre style=\"{style}\">{text}</pre>", encoding="utf-8")
    return [page]


def take_picture(page: Path, picture: Path) -> bool:
    """Photograph a page with headless Chromium; return whether there is one."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if browser is None:
        return False
    subprocess.run([browser, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", f"--window-size={WINDOW}",
                    "--virtual-time-budget=4000", f"--screenshot={picture}", page.as_uri()], capture_output=True, timeout=120)
    return picture.is_file()
