"""Access to the workbench: which requests are answered, by host, origin, token and kind; names of files that are safe."""

from __future__ import annotations

import hashlib
import hmac
import os
import re
import secrets
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from pathlib import Path

from toolpoint._check import ToolpointError, fail

TOKEN_BYTES = 24  # 192 bits, drawn by the operating system
MAX_JSON_BYTES = 1_000_000  # of a request in JSON
MAX_FILE_BYTES = 500_000_000  # of a file that is handed over
MAX_NAME_LENGTH = 120  # characters of a file's name
READING_METHODS = ("GET", "HEAD")  # requests that change nothing: all others must state their origin
# Content type that each changing method must have. A form of another site can send none of them.
CONTENT_TYPES = {"POST": "application/json", "PUT": "application/octet-stream", "DELETE": ""}
# Names that Windows keeps for devices, with or without an ending.
_DEVICE_NAMES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)


@dataclass(frozen=True)
class Refusal:
    """Why a request is refused: HTTP status and words."""

    status: int
    words: str


@dataclass(frozen=True)
class Access:
    """Access rules of a server.

    token : secret in the address that a user opens; port : on which the server listens; host : name of the server in that
    address.
    """

    token: str
    port: int
    host: str = "127.0.0.1"

    @property
    def hosts(self) -> frozenset[str]:
        """Values of the Host header that are answered: a foreign name that resolves here is refused (DNS rebinding)."""
        names = {"127.0.0.1", "localhost", "[::1]", self.host}
        return frozenset(f"{name}:{self.port}" for name in names)

    @property
    def origins(self) -> frozenset[str]:
        """Values of the Origin header that are answered."""
        return frozenset(f"http://{host}" for host in self.hosts)

    @property
    def cookie_name(self) -> str:
        """Name of the cookie; cookies do not know ports, so the port is in it."""
        return f"toolpoint_{self.port}"

    @property
    def cookie_value(self) -> str:
        """Value of the cookie: made of the token, which cannot be had back from it."""
        return hmac.new(self.token.encode(), b"toolpoint workbench session", hashlib.sha256).hexdigest()

    @property
    def address(self) -> str:
        """Address to open; the token stands in the fragment, which no browser sends or logs."""
        return f"http://{self.host}:{self.port}/#token={self.token}"

    def has_token(self, text: object) -> bool:
        """Whether a text is the token, compared in constant time."""
        return isinstance(text, str) and hmac.compare_digest(text.encode(), self.token.encode())

    def refusal(self, method: str, path: str, headers: Mapping[str, list[str]]) -> Refusal | None:
        """Return why a request is refused, None where it is answered.

    method, path : of the request line; headers : all values of a header by its lower-case name. The order of the tests is:
    host, origin, site, then method and content of a change, then the cookie, which pages and data need.
    """
        if len(headers.get("host", [])) != 1 or headers["host"][0].lower() not in self.hosts:
            return Refusal(403, "this host name is not that of the workbench")
        origins = headers.get("origin", [])
        if any(origin not in self.origins for origin in origins):
            return Refusal(403, "requests of other sites are refused")
        if headers.get("sec-fetch-site", ["none"])[0] not in ("none", "same-origin") and path != "/":
            return Refusal(403, "requests of other sites are refused")
        if method not in READING_METHODS and (refusal := _refused_change(method, origins, headers)) is not None:
            return refusal
        if path.startswith(("/api/", "/page/")) and path != "/api/session" and not self._has_cookie(headers):
            return Refusal(401, "open the address that `toolpoint serve` printed")
        return None

    def _has_cookie(self, headers: Mapping[str, list[str]]) -> bool:
        """Whether the session cookie is there and right, compared in constant time."""
        cookies: SimpleCookie = SimpleCookie()
        try:
            cookies.load("; ".join(headers.get("cookie", [])))
        except CookieError:
            return False
        morsel = cookies.get(self.cookie_name)
        return morsel is not None and hmac.compare_digest(morsel.value.encode(), self.cookie_value.encode())


def _refused_change(method: str, origins: list[str], headers: Mapping[str, list[str]]) -> Refusal | None:
    """Return why a changing request is refused, None where it is answered: it needs one origin and its own content type."""
    if method not in CONTENT_TYPES:
        return Refusal(405, f"{method} is not answered")
    if len(origins) != 1:
        return Refusal(403, "a change must say its origin")
    kind = headers.get("content-type", [""])[0].partition(";")[0].strip().lower()
    if kind != CONTENT_TYPES[method]:
        return Refusal(415, f"{method} must be {CONTENT_TYPES[method] or 'without content'}")
    return None


def keep_token(file: Path) -> str:
    """Return the token kept in a file, made where there is none or a short one; only its owner may read the file."""
    try:
        token = file.read_text(encoding="ascii").strip()
        if len(token) >= TOKEN_BYTES:
            file.chmod(0o600)
            return token
    except (OSError, UnicodeDecodeError):
        pass
    file.parent.mkdir(parents=True, exist_ok=True)
    token = secrets.token_urlsafe(TOKEN_BYTES)
    file.unlink(missing_ok=True)  # O_EXCL below refuses a file, or a link, that someone else puts there meanwhile
    with os.fdopen(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="ascii") as handle:
        handle.write(token)
    return token


def check_file_name(name: str) -> str:
    """Return the name of a file that is handed over, in Unicode form NFC.

    Raises ToolpointError for a name that leads out of the folder, hides the file, or is no plain name on some system.
    """
    text = unicodedata.normalize("NFC", name)
    if not text or len(text) > MAX_NAME_LENGTH:
        fail("name of the file", f"{len(text)} characters", f"must have 1 to {MAX_NAME_LENGTH}")
    if any(unicodedata.category(letter).startswith("C") or letter in '/\\:*?"<>|' for letter in text):
        fail("name of the file", repr(text), "must be without path, control and wildcard characters")
    if text.startswith((".", "~", "-")) or text != text.strip() or text.endswith(".") or _DEVICE_NAMES.fullmatch(text):
        fail("name of the file", repr(text), "must be a plain name", remedy="rename the file")
    return text


def path_beneath(root: Path, relative: str) -> Path:
    """Return the resolved path of a file beneath a folder; raises ToolpointError where it leads out, through links too."""
    # A null byte ends in a ValueError of the file system before any place could be looked at.
    if "\0" in relative or not (place := (root / relative).resolve()).is_relative_to(root.resolve()):
        raise ToolpointError(f"{relative}: lies outside the project")
    return place
