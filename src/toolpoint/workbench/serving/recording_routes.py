"""Routes of recordings: begin one, end it, decide about its blows, and hear a blow."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from toolpoint._check import fail
from toolpoint.workbench.serving.requests import answer, json_of, text_of, write_answer
from toolpoint.workbench.state.recording_settings import RecordingSettings

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response

    from toolpoint.workbench.serving.server import Workbench

MAX_BLOW_NAME_LENGTH = 300  # characters of the name of a blow or a test


def recording_entries(bench: Workbench) -> list[tuple[str, Callable[..., Any], str]]:
    """Return path, endpoint and method of the routes of recordings."""
    api = _Recording(bench)
    return [("/api/recording", api.state, "GET"), ("/api/recording", api.start, "POST"),
            ("/api/recording", api.stop, "DELETE"), ("/api/recording/decision", api.decide, "POST"),
            ("/api/pulse", api.pulse, "POST")]


class _Recording:
    """Answers about the recording of one workbench."""

    def __init__(self, bench: Workbench) -> None:
        self.bench = bench

    async def state(self, request: Request) -> Response:
        return await answer(self._state)

    async def start(self, request: Request) -> Response:
        data = await json_of(request)

        def work() -> dict[str, Any]:
            desk = self.bench.desk
            self.bench.recordings.start(RecordingSettings.of(data, desk.folder, self.bench.record_folders))
            return self._state()
        return await write_answer(work, self.bench.desk.lock)

    async def stop(self, request: Request) -> Response:
        return await answer(lambda: {"stopped": self.bench.recordings.stop()})

    async def decide(self, request: Request) -> Response:
        data = await json_of(request)

        def work() -> dict[str, Any]:
            from toolpoint.workbench.views.recording_view import decide_blow

            accept = data.get("accept")
            if accept not in (True, False, None):
                fail("accept", repr(accept), "must be true, false or null")
            blow = text_of(data, "blow", MAX_BLOW_NAME_LENGTH)
            return decide_blow(self.bench.desk, self.bench.recordings, blow, accept=accept)
        return await write_answer(work, self.bench.desk.lock)

    async def pulse(self, request: Request) -> Response:
        data = await json_of(request)

        def work() -> dict[str, Any]:
            from toolpoint.workbench.views.recording_view import sound_of

            return sound_of(self.bench.desk, text_of(data, "test", MAX_BLOW_NAME_LENGTH),
                            text_of(data, "blow", MAX_BLOW_NAME_LENGTH), is_recording=data.get("is_recording") is True)
        return await answer(work)

    def _state(self) -> dict[str, Any]:
        from toolpoint.workbench.views.recording_view import recording_state

        return recording_state(self.bench.recordings)
