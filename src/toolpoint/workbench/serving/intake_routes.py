"""Routes that change a project: begin it, hand files over and enter them, write parts of project.yaml, report tried cuts."""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, cast

from toolpoint import project
from toolpoint._check import fail, one_of
from toolpoint.project.components_text import write_components
from toolpoint.workbench.serving.requests import answer, error_answer, json_of, text_of, write_answer
from toolpoint.workbench.state.access import MAX_FILE_BYTES, check_file_name
from toolpoint.workbench.views.hammer_views import decide_hit, keep_choice
from toolpoint.workbench.views.intake import INCOMING_FOLDER, enter_files, list_incoming

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response

    from toolpoint.workbench.serving.server import Workbench

MAX_COMPONENTS_TEXT = 100_000  # characters
MAX_REQUEST_NAME, MAX_REQUEST_LINES = 200, 1000  # characters of a name, lines of a list
TEST_SUBJECTS = ("structure", "tip x", "tip y")
MAX_INCOMING_FILES = 5000  # files that wait to be told


def intake_entries(bench: Workbench) -> list[tuple[str, Callable[..., Any], str]]:
    """Return path, endpoint and method of the routes by which a project grows."""
    api = _Intake(bench)
    return [("/api/begin", api.begin, "POST"), ("/api/file/{name:path}", api.file, "PUT"), ("/api/intake", api.listing, "GET"),
            ("/api/intake", api.enter, "POST"), ("/api/part", api.part, "POST"),
            ("/api/components", api.components, "POST"), ("/api/test", api.test, "POST"), ("/api/tried", api.tried, "POST"),
            ("/api/hit", api.hit, "POST"), ("/api/choice", api.choice, "POST")]


def _lines_of(data: dict[str, Any], name: str) -> tuple[str, ...]:
    """Return a list of short texts of a request; raises ToolpointError where it is none."""
    lines = data.get(name)
    if not isinstance(lines, list) or len(lines) > MAX_REQUEST_LINES or not all(
            isinstance(line, str) and len(line) <= MAX_REQUEST_NAME for line in lines):
        fail(name, type(lines).__name__, f"must be at most {MAX_REQUEST_LINES} texts of at most {MAX_REQUEST_NAME} characters")
    return tuple(lines)


class _Intake:
    """Answers to what a project is given."""

    def __init__(self, bench: Workbench) -> None:
        self.bench = bench

    async def begin(self, request: Request) -> Response:
        return await answer(lambda: {"file": project.write_folder(self.bench.desk.folder).name})

    async def file(self, request: Request) -> Response:
        """Write a file that is handed over into the folder of incoming ones, whole or not at all."""
        try:
            name = check_file_name(request.path_params["name"])
        except ValueError as error:
            return error_answer(str(error))
        place = self.bench.desk.folder / INCOMING_FOLDER
        place.mkdir(exist_ok=True)
        if sum(1 for _ in place.iterdir()) >= MAX_INCOMING_FILES:
            return error_answer(f"{MAX_INCOMING_FILES} files wait already; enter them first")
        draft, size = place / f".{secrets.token_hex(8)}.draft", 0
        try:
            with draft.open("xb") as handle:
                async for block in request.stream():
                    size += len(block)
                    if size > MAX_FILE_BYTES:
                        return error_answer(f"{name}: more than {MAX_FILE_BYTES} bytes", 413)
                    handle.write(block)
            os.replace(draft, place / name)
        except OSError as error:
            return error_answer(f"{name}: not written ({error.strerror or error}); free disk space", 507)
        finally:
            draft.unlink(missing_ok=True)
        return await answer(lambda: {"file": name, "bytes": size})

    async def listing(self, request: Request) -> Response:
        return await answer(lambda: {"files": list_incoming(self.bench.desk)})

    async def enter(self, request: Request) -> Response:
        data = await json_of(request)

        def work() -> dict[str, Any]:
            kinds = data.get("kinds")
            if not isinstance(kinds, dict) or not all(isinstance(kind, str) for kind in kinds.values()):
                fail("kinds", type(kinds).__name__, "must map names of files to kinds")
            return enter_files(self.bench.desk, kinds)
        return await write_answer(work, self.bench.desk.lock)

    async def part(self, request: Request) -> Response:
        data = await json_of(request)

        def work() -> dict[str, Any]:
            place, value = text_of(data, "place"), text_of(data, "value")
            named = project.add_part(self.bench.desk.folder, place, value)
            return {"entered": f"{place}: {value}", "named": list(named)}
        return await write_answer(work, self.bench.desk.lock)

    async def components(self, request: Request) -> Response:
        data = await json_of(request)

        def work() -> dict[str, Any]:
            return {"file": write_components(self.bench.desk.folder, text_of(data, "text", MAX_COMPONENTS_TEXT))}
        return await write_answer(work, self.bench.desk.lock)

    async def test(self, request: Request) -> Response:
        """Enter a test of records whose channels a person has said."""
        data = await json_of(request)

        def work() -> dict[str, Any]:
            draft = project.RecordsDraft(text_of(data, "name", MAX_REQUEST_NAME), _lines_of(data, "records"),
                                      text_of(data, "pattern", MAX_REQUEST_NAME), text_of(data, "struck", MAX_REQUEST_NAME),
                                      _lines_of(data, "channels"), cast(Any, one_of("of", text_of(data, "of", MAX_REQUEST_NAME),
                                                                                     TEST_SUBJECTS)))
            return {"entered": project.enter_test(self.bench.desk.folder, draft)}
        return await write_answer(work, self.bench.desk.lock)

    async def tried(self, request: Request) -> Response:
        data = await json_of(request)

        def work() -> dict[str, Any]:
            numbers = {name: data.get(name) for name in ("speed_rpm", "depth_m")}
            for name, value in numbers.items():
                if not isinstance(value, (int, float)) or isinstance(value, bool) or not value > 0:
                    fail(name, repr(value), "must be a number above zero")
            frequency_hz = data.get("frequency_hz")
            frequency = float(frequency_hz) if isinstance(frequency_hz, (int, float)) and frequency_hz > 0 else None
            cut = project.TriedCut(float(data["speed_rpm"]), float(data["depth_m"]), bool(data.get("stable")), frequency,
                                   str(data.get("cut") or ""))
            self.bench.desk.project().report_cut(cut)
            return {"reported": True}
        return await write_answer(work, self.bench.desk.lock)

    async def hit(self, request: Request) -> Response:
        data = await json_of(request)

        def work() -> dict[str, Any]:
            accept = data.get("accept")
            if accept not in (True, False, None):
                fail("accept", repr(accept), "must be true, false or null")
            return decide_hit(self.bench.desk, text_of(data, "test"), text_of(data, "hit"), accept=accept)
        return await write_answer(work, self.bench.desk.lock)

    async def choice(self, request: Request) -> Response:
        data = await json_of(request)
        return await write_answer(lambda: keep_choice(self.bench.desk, text_of(data, "test"), text_of(data, "text")),
                                  self.bench.desk.lock)
