"""Requests of the page: their JSON, read with a check of what it is."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from toolpoint._check import fail

if TYPE_CHECKING:
    from starlette.requests import Request


async def json_of(request: Request) -> dict[str, Any]:
    """Return the content of a request as a mapping, empty for one without content or of another form."""
    try:
        data = json.loads(await request.body() or b"{}")
    except (ValueError, RecursionError):
        return {}
    return data if isinstance(data, dict) else {}


def text_of(data: dict[str, Any], name: str, largest: int = 10_000) -> str:
    """Return a text of a request; raises ToolpointError where it is none or too long (characters)."""
    value = data.get(name)
    if not isinstance(value, str) or len(value) > largest:
        fail(name, type(value).__name__, f"must be a text of at most {largest} characters")
    return value
