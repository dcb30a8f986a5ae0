"""Guard before every answer: refuses what `Access` refuses, limits sizes, and adds the headers of the content policy."""

from __future__ import annotations

import contextlib
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

from toolpoint.workbench.state.access import MAX_FILE_BYTES, MAX_JSON_BYTES, Access, Refusal

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

# Nothing from elsewhere is loaded or asked: a name in a file that holds markup can neither run nor call out.
POLICY = ("default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
          "connect-src 'self'; frame-src 'self'; media-src 'self' blob:; base-uri 'none'; form-action 'none'; "
          "frame-ancestors 'none'")
# An embedded page has scripts of its own, which its own policy names by their digests, and no origin: it reaches nothing.
PAGE_POLICY = "sandbox allow-scripts; frame-ancestors 'self'; base-uri 'none'; form-action 'none'; connect-src 'none'"


class TooLarge(Exception):
    """A request's content goes beyond its limit."""


class Guard:
    """ASGI application around another one."""

    def __init__(self, application: Application, access: Access) -> None:
        self.application, self.access = application, access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] == "lifespan":
            await self.application(scope, receive, send)
            return
        if scope["type"] != "http":  # no web sockets
            await send({"type": "websocket.close", "code": 1008})
            return
        headers: dict[str, list[str]] = {}
        for name, value in scope["headers"]:
            headers.setdefault(name.decode("latin-1").lower(), []).append(value.decode("latin-1"))
        refusal = self.access.refusal(scope["method"], scope["path"], headers) or _too_large(scope["method"], headers)
        if refusal is not None:
            await _refuse(refusal, send)
            return
        await self._answer(scope, receive, send)

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer with the headers of the policy; content that grows beyond its limit ends the request."""
        size, limit = 0, _limit_of(scope["method"])

        async def counted() -> Message:
            nonlocal size
            message = await receive()
            size += len(message.get("body", b""))
            if size > limit:
                raise TooLarge
            return message

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                # The framework answers what `counted` raises by 500 before it passes the error on.
                status = 413 if size > limit else message["status"]
                message = {**message, "status": status, "headers": [*message.get("headers", ()), *_headers(scope["path"])]}
            await send(message)

        with contextlib.suppress(TooLarge):
            await self.application(scope, counted, with_headers)


def _limit_of(method: str) -> int:
    return MAX_FILE_BYTES if method == "PUT" else MAX_JSON_BYTES


def _too_large(method: str, headers: dict[str, list[str]]) -> Refusal | None:
    """Return the refusal of a request that says that it is too large, or does not say a number."""
    stated = headers.get("content-length", ["0"])[0]
    if not stated.isdigit():
        return Refusal(400, "the length of the content is no number")
    limit = _limit_of(method)
    return Refusal(413, f"{stated} bytes; at most {limit} are taken") if int(stated) > limit else None


def _headers(path: str) -> list[tuple[bytes, bytes]]:
    policy = PAGE_POLICY if path.startswith("/page/") else POLICY
    return [(b"content-security-policy", policy.encode()), (b"x-content-type-options", b"nosniff"),
            (b"referrer-policy", b"no-referrer"), (b"cross-origin-opener-policy", b"same-origin"),
            (b"cross-origin-resource-policy", b"same-origin"),
            *([] if path.startswith("/web/") else [(b"cache-control", b"no-store")])]


async def _refuse(refusal: Refusal, send: Send) -> None:
    content = refusal.words.encode()
    await send({"type": "http.response.start", "status": refusal.status, "headers": [
        (b"content-type", b"text/plain; charset=utf-8"), (b"content-length", str(len(content)).encode()),
        (b"connection", b"close"), *_headers("/")]})
    await send({"type": "http.response.body", "body": content})
