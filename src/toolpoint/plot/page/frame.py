"""Page: the frame of every HTML file that is written: style, scripts, and a policy that forbids outside requests."""

from __future__ import annotations

import base64
import hashlib
import html
import json
from collections.abc import Sequence
from functools import lru_cache
from importlib import resources
from typing import Any


@lru_cache(maxsize=16)
def asset(name: str) -> str:
    """Return the text of a script or style sheet of the folder of web files."""
    return resources.files("toolpoint.plot.web").joinpath(name).read_text("utf-8")


@lru_cache(maxsize=1)
def chart_script() -> str:
    """Return the chart library as one script (about 4.8 MB)."""
    from plotly.offline import get_plotlyjs

    return get_plotlyjs()


def data_block(identifier: str, data: Any) -> str:
    """Return data as an inert JSON block; no text in it can close the block or start a script."""
    text = data if isinstance(data, str) else json.dumps(data, separators=(",", ":"), allow_nan=False)
    safe = text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
    return f'<script type="application/json" id="{html.escape(identifier)}">{safe}</script>\n'


def page(title: str, body: str, scripts: Sequence[str]) -> str:
    """Return a self-contained HTML page.

    The content security policy allows exactly the given scripts, by their SHA-256, and no connection: neither an
    escaped name that slips through nor a chart can run foreign code or reach a host.
    """
    digests = [base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts]
    hashes = " ".join(f"'sha256-{digest}'" for digest in digests) or "'none'"
    policy = (f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; img-src data: blob:; "
              "base-uri 'none'; form-action 'none'")
    style = asset("page.css") + asset("shape_view.css")
    return (
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
        f"<meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n"
        "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n"
        "<meta name=\"color-scheme\" content=\"light dark\">\n"
        "<link rel=\"icon\" href=\"data:,\">\n"
        f"<title>{html.escape(title)}</title>\n<style>{style}</style></head>\n<body>\n{body}\n"
        + "".join(f"<script>{script}</script>\n" for script in scripts) + "</body></html>\n")
