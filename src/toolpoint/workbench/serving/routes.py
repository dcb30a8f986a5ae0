"""Routes of the workbench: the one API, whose only user is the page; every answer is one call of a view or of the project.

| method and path | takes | gives |
|---|---|---|
| POST /api/session | ``{token}`` | the cookie that all others ask for |
| GET /api/view/NAME | | `WorkbenchView` as JSON |
| GET /api/events | Last-Event-ID | events ``step``, ``job``, ``recording``, ``changed``, ``reset`` |
| GET, POST, DELETE /api/job | ``{steps, overwrite}`` | the job; starts one, stops it |
| POST /api/machine/look, limit, curve, interval, band, map, limit_map | `MachineRequest` | numbers of one state |
| POST /api/machine/number | ``{text, path}`` | a typed number in SI |
| POST /api/machine/save | ``{name, values}`` | the file that was written |
| POST /api/begin | | begins a project in an empty folder |
| PUT /api/file/NAME | the file's bytes | puts it into ``incoming``, to be told and confirmed |
| GET, POST /api/intake | ``{kinds}`` | what the files there seem to be; enters them |
| POST /api/part | ``{place, value}`` | writes a part of project.yaml |
| POST /api/components | ``{text}`` | writes the components file and enters it |
| POST /api/test | ``{name, of, records, pattern, struck, channels}`` | enters a test of records that say no channels |
| POST /api/hit | ``{test, hit, accept}`` | writes a decision about a blow into its test file |
| POST /api/choice | ``{test, text}`` | writes poles chosen by clicks for a test |
| POST /api/tried | ``{speed_rpm, depth_m, stable, frequency_hz, cut}`` | reports a cut that was tried |
| GET, POST, DELETE /api/recording | `RecordingSettings` | blows that are recorded now; begins, ends |
| POST /api/recording/decision | ``{blow, accept}`` | writes a decision about a recorded blow into its test file |
| POST /api/pulse | ``{test, blow, is_recording}`` | the sound of a blow |
| GET /page/NAME | | an existing page, sandboxed |

A wrong input is answered by 422 and ``{error}``, the sentence that a command prints.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from toolpoint._check import ToolpointError, fail
from toolpoint.workbench.serving.intake_routes import intake_entries
from toolpoint.workbench.serving.recording_routes import recording_entries
from toolpoint.workbench.serving.requests import answer, error_answer, json_of, text_of
from toolpoint.workbench.state.machine_request import MachineRequest, read_typed_number
from toolpoint.workbench.views import catalogue
from toolpoint.workbench.web.assets import index_page, media_type, web_file

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.routing import Route

    from toolpoint.workbench.serving.server import Workbench


def routes_of(bench: Workbench) -> list[Route]:
    """Return the routes of a workbench."""
    from starlette.routing import Route

    api = _Api(bench)
    entries: list[tuple[str, Callable[..., Any], str]] = [
        ("/", api.index, "GET"), ("/web/{name}", api.web, "GET"), ("/api/session", api.session, "POST"),
        ("/api/view/{name}", api.view, "GET"), ("/api/events", api.events, "GET"), ("/api/job", api.job, "GET"),
        ("/api/job", api.start_job, "POST"), ("/api/job", api.stop_job, "DELETE"),
        ("/api/machine/{deed}", api.machine, "POST"), ("/page/{name:path}", api.page, "GET")]
    return [Route(path, endpoint, methods=[method]) for path, endpoint, method in (
        *entries, *intake_entries(bench), *recording_entries(bench))]


class _Api:
    """Answers of one workbench."""

    def __init__(self, bench: Workbench) -> None:
        self.bench = bench

    async def index(self, request: Request) -> Response:
        from starlette.responses import HTMLResponse

        return HTMLResponse(index_page())

    async def web(self, request: Request) -> Response:
        from starlette.responses import PlainTextResponse, Response

        name = request.path_params["name"]
        try:
            return Response(web_file(name), media_type=media_type(name), headers={"cache-control": "no-cache"})
        except (ToolpointError, KeyError, ValueError):
            return PlainTextResponse("no such file", 404)

    async def session(self, request: Request) -> Response:
        from starlette.responses import Response

        access = self.bench.access
        data = await json_of(request)
        if not access.has_token(data.get("token")):
            return error_answer("this token is not that of the workbench", 401)
        response = Response(status_code=204)
        response.set_cookie(access.cookie_name, access.cookie_value, httponly=True, samesite="strict", path="/")
        return response

    async def view(self, request: Request) -> Response:
        name = request.path_params["name"]
        if name == "list":
            return await answer(lambda: catalogue.list_views(self.bench.desk))
        return await answer(lambda: catalogue.view_of(self.bench.desk, name, dict(request.query_params)).to_dict())

    async def events(self, request: Request) -> Response:
        from starlette.responses import StreamingResponse

        self.bench.warm_up()
        return StreamingResponse(self.bench.log.stream(request.headers.get("last-event-id", "")),
                                 media_type="text/event-stream", headers={"x-accel-buffering": "no"})

    async def job(self, request: Request) -> Response:
        return await answer(lambda: self.bench.jobs.job.to_dict())

    async def start_job(self, request: Request) -> Response:
        data = await json_of(request)
        steps = data.get("steps") or []

        def start() -> dict[str, Any]:
            if not isinstance(steps, list) or not all(isinstance(name, str) for name in steps):
                fail("steps", repr(steps), "must be a list of names")
            self.bench.jobs.start(steps, overwrite=bool(data.get("overwrite")))
            return self.bench.jobs.job.to_dict()
        return await answer(start)

    async def stop_job(self, request: Request) -> Response:
        return await answer(lambda: {"stopped": self.bench.jobs.stop()})

    async def machine(self, request: Request) -> Response:
        """Answer a question about the machine: its deed is one of `catalogue.MACHINE_DEEDS`, a typed number, or saving."""
        data, deed, desk = await json_of(request), request.path_params["deed"], self.bench.desk

        def work() -> Any:
            if deed == "number":
                return {"value": read_typed_number(text_of(data, "text"), text_of(data, "path"))}
            if deed == "save":
                return {"file": catalogue.save(desk, text_of(data, "name"), MachineRequest.of(data).values)}
            return catalogue.machine_deed(desk, deed, MachineRequest.of(data))
        return await answer(work)

    async def page(self, request: Request) -> Response:
        from starlette.responses import HTMLResponse

        return await answer(lambda: catalogue.page_of(self.bench.desk, request.path_params["name"]), HTMLResponse)
