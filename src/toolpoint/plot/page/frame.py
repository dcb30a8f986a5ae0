"""Page: the frame of every HTML file that is written: style, scripts, and a policy that forbids outside requests."""

from __future__ import annotations

import base64
import gzip
import hashlib
import html
import json
import zlib
from collections.abc import Sequence
from functools import lru_cache
from importlib import resources
from typing import Any

LIBRARY = "plotly-cartesian.min.js.gz"
_MIN_DEFLATED_LENGTH = 12_000  # characters of a data block from which it is deflated: below, inflating costs more than it saves
_GZIP_HEADER_BYTES, _GZIP_TRAILER_BYTES = 10, 8  # bytes around the deflated stream of a file without a name


@lru_cache(maxsize=16)
def asset(name: str) -> str:
    """Return the text of a script or style sheet of the folder of web files."""
    return resources.files("toolpoint.plot.web").joinpath(name).read_text("utf-8")


@lru_cache(maxsize=1)
def chart_script() -> str:
    """Return the chart library as one script: the cartesian bundle of plotly.js (MIT), 1.4 MB."""
    return gzip.decompress(_library()).decode("utf-8")


@lru_cache(maxsize=1)
def chart_block() -> str:
    """Return the chart library as an inert block, deflated (0.6 MB), which the page's own script inflates and starts."""
    packed = base64.b64encode(_library()[_GZIP_HEADER_BYTES:-_GZIP_TRAILER_BYTES]).decode("ascii")
    size = len(chart_script().encode())
    return f'<script type="application/octet-stream" id="tp-library" data-size="{size}">{packed}</script>\n'


def data_block(identifier: str, data: Any) -> str:
    """Return data as an inert JSON block; no text in it can close the block or start a script."""
    text = data if isinstance(data, str) else json.dumps(data, separators=(",", ":"), allow_nan=False)
    # Escaped as JSON does, not as HTML does: inside a script nothing is unescaped, but `</script>` would end it.
    safe = text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
    return f'<script type="application/json" id="{html.escape(identifier)}">{safe}</script>\n'


def deflate_block(identifier: str, text: str) -> str:
    """Return JSON text as an inert block, deflated where it is long; `ToolpointBlock` of the page's script reads both."""
    if len(text) < _MIN_DEFLATED_LENGTH:
        return data_block(identifier, text)
    encoded = text.encode("utf-8")
    # Without header and trailer: browsers inflate a bare stream, and the block is inert text, not a file.
    compressor = zlib.compressobj(9, zlib.DEFLATED, -15)
    packed = base64.b64encode(compressor.compress(encoded) + compressor.flush()).decode("ascii")
    return (f'<script type="application/octet-stream" id="{html.escape(identifier)}" data-size="{len(encoded)}">{packed}'
            "</script>\n")


def page(title: str, body: str, scripts: Sequence[str], *, charts: bool = False, reload_seconds: int = 0) -> str:
    """Return a self-contained HTML page; with `charts` the chart library goes into it; the browser reloads it
    every so many seconds, 0 never.

    The content security policy allows exactly the given scripts and the library, by their SHA-256, and no connection:
    neither an escaped name that slips through nor a chart can run foreign code or reach a host.
    """
    allowed = [*scripts, chart_script()] if charts else scripts
    # By their digests and not by 'unsafe-inline': what a name of a file slips into the page can then not run.
    digests = [base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in allowed]
    hashes = " ".join(f"'sha256-{digest}'" for digest in digests) or "'none'"
    policy = (f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; img-src data: blob:; "
              "base-uri 'none'; form-action 'none'")
    style = asset("page.css") + asset("shape_view.css") + asset("program_view.css")
    return (
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
        f"<meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n"
        "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n"
        "<meta name=\"color-scheme\" content=\"light dark\">\n"
        + (f"<meta http-equiv=\"refresh\" content=\"{reload_seconds}\">\n" if reload_seconds else "")
        # An empty icon of its own: a browser would ask the server, or the folder, for one.
        + "<link rel=\"icon\" href=\"data:,\">\n"
        f"<title>{html.escape(title)}</title>\n<style>{style}</style></head>\n<body>\n{body}\n"
        + (chart_block() if charts else "")
        + "".join(f"<script>{script}</script>\n" for script in scripts) + "</body></html>\n")


@lru_cache(maxsize=1)
def _library() -> bytes:
    return resources.files("toolpoint.plot.web").joinpath(LIBRARY).read_bytes()
