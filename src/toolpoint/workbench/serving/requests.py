"""Requests of the page, read with a check of what they are, and answers to them: JSON, or the sentence of a wrong input."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from toolpoint._check import ToolpointError, fail
from toolpoint.project.steps.plain_files import plain

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response

JSON_SPACING = (",", ":")


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


async def write_answer(work: Callable[[], Any], lock: Any) -> Response:
    """Return the answer of work that writes into the project: one after the other, whatever the number of tabs."""
    def locked() -> Any:
        with lock:
            return work()
    return await answer(locked)


async def answer(work: Callable[[], Any], kind: Any = None) -> Response:
    """Return the answer of work that is done in a thread; a wrong input is answered by its sentence."""
    from starlette.concurrency import run_in_threadpool
    from starlette.responses import Response

    try:
        result = await run_in_threadpool(work)
    except ToolpointError as error:
        return error_answer(str(error))
    except OSError as error:
        return error_answer(f"{error.filename or 'a file'}: {error.strerror or error}; check the folder and the disk", 507)
    if kind is not None:
        answer: Response = kind(result)
        return answer
    return Response(json.dumps(plain(result), separators=JSON_SPACING), media_type="application/json")


def error_answer(words: str, status: int = 422) -> Response:
    from starlette.responses import Response

    return Response(json.dumps({"error": words}), status, media_type="application/json")
