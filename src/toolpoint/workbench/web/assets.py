"""Files that the page loads: its own scripts and styles, those of the charts' scenes, words by language; a fixed list."""

from __future__ import annotations

from functools import lru_cache
from importlib import resources

from toolpoint._check import fail

SHARED_ASSETS = ("page.css", "shape_view.css", "packed_data.js", "shape_renderer.js", "shape_view.js", "shape_controls.js")
SCRIPTS = ("words.js", "parts.js", "redraw.js", "connection.js", "line_chart.js", "chain_picture.js", "machine_scene.js",
           "project_view.js", "intake_view.js", "machine_view.js", "machine_page.js", "workspace_map.js", "lobes_view.js",
           "test_views.js", "motion_views.js", "recording_view.js", "advice_view.js", "main.js")
STYLES = ("workbench.css",)
SCRIPT_BUNDLE, STYLE_BUNDLE = "bundle.js", "bundle.css"
LANGUAGES = ("en", "de", "fr")
SENTENCES = "sentences_de.json"  # what the package says, by templates with places for numbers: German as proof
MEDIA_TYPES = {".js": "text/javascript; charset=utf-8", ".css": "text/css; charset=utf-8", ".html": "text/html; charset=utf-8",
               ".json": "application/json"}


@lru_cache(maxsize=64)
def web_file(name: str) -> bytes:
    """Return a file of the page by its name; raises ToolpointError for any other name.

    The scripts come as one file, and so do the styles: a page of twenty requests would take longer to open.
    """
    if name in (SCRIPT_BUNDLE, STYLE_BUNDLE):
        parts = (*SHARED_ASSETS[2:], *SCRIPTS) if name == SCRIPT_BUNDLE else (*SHARED_ASSETS[:2], *STYLES)
        return b"\n".join(map(web_file, parts))
    if name in SHARED_ASSETS:
        return resources.files("toolpoint.plot.web").joinpath(name).read_bytes()
    if name not in (*SCRIPTS, *STYLES, "index.html", "export.js", SENTENCES,
                    *(f"words_{language}.json" for language in LANGUAGES)):
        fail("file", repr(name), "is not one of the page")
    return resources.files("toolpoint.workbench.web").joinpath(name).read_bytes()


def media_type(name: str) -> str:
    """Return the media type of a file by its ending."""
    return MEDIA_TYPES[name[name.rindex("."):]]


def index_page(*, base: str = "/web/", first_scripts: tuple[str, ...] = ()) -> str:
    """Return the page that loads all others; base : where its files lie; first_scripts : those that stand before them."""
    style = f'<link rel="stylesheet" href="{base}{STYLE_BUNDLE}">\n'
    scripts = "".join(f'<script src="{base}{name}" defer></script>\n' for name in (*first_scripts, SCRIPT_BUNDLE))
    return web_file("index.html").decode("utf-8").replace("<!-- styles -->", style).replace("<!-- scripts -->", scripts)
