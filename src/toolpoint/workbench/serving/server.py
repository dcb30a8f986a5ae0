"""Server of the workbench: one project folder, on this machine only unless asked; started anew it goes on where it was."""

from __future__ import annotations

import contextlib
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from toolpoint._check import ToolpointError
from toolpoint.project.engine.lock import hold_lock
from toolpoint.workbench.serving.guard import Guard
from toolpoint.workbench.state.access import Access, keep_token
from toolpoint.workbench.state.desk import STATE_PLACE, Desk
from toolpoint.workbench.state.events import EventLog
from toolpoint.workbench.state.jobs import Jobs
from toolpoint.workbench.state.kept_files import keep_file
from toolpoint.workbench.state.recordings import Recordings

# This machine alone: the server runs commands on files, and asks nobody who they are.
LOCAL_HOST = "127.0.0.1"
ANY_HOSTS = ("0.0.0.0", "::", "*", "")  # ways to say every address of a machine
FOLDER_LOOK_SECONDS = 1.0  # between two looks for files that somebody changed
STOP_SECONDS = 2  # that open connections get when the server ends


class Workbench:
    """A project's workbench: the desk, its jobs, recordings and events, and who may ask.

    record_folders : folders beside the project from which recordings may read.
    """

    def __init__(self, folder: str | Path, access: Access, record_folders: Sequence[str | Path] = ()) -> None:
        self.access, self.desk, self.log = access, Desk(Path(folder).resolve()), EventLog()
        self.jobs = Jobs(self.desk.folder, self.desk.folder / STATE_PLACE / "job.json", self.log)
        self.recordings = Recordings(self.desk.folder, self.log)
        self.record_folders = tuple(Path(place).resolve() for place in record_folders)
        self._closing, self._is_warm = threading.Event(), False

    def application(self) -> Guard:
        """Return the ASGI application."""
        from starlette.applications import Starlette

        from toolpoint.workbench.serving.routes import routes_of

        return Guard(Starlette(routes=routes_of(self)), self.access)

    def watch(self) -> None:
        """Say in the log when files of the project have changed, until the workbench closes; in a thread of its own."""
        stamp = self.desk.stamp()
        while not self._closing.wait(FOLDER_LOOK_SECONDS):
            with contextlib.suppress(OSError):
                if (new := self.desk.stamp()) != stamp:
                    stamp = new
                    self.log.publish("changed")

    def begin(self) -> None:
        """Go on with a job that was cut off, watch the folder, and read the project before the first view asks for it."""
        self.jobs.resume()
        threading.Thread(target=self._read, daemon=True).start()
        threading.Thread(target=self.watch, daemon=True).start()

    def warm_up(self) -> None:
        """Load what the first move of a slider needs, once, beside the first view."""
        if not self._is_warm:
            self._is_warm = True
            threading.Thread(target=self._load, daemon=True).start()

    def _read(self) -> None:
        from toolpoint.workbench.views.catalogue import list_views, view_of

        with contextlib.suppress(ToolpointError, OSError):  # what is wrong with it the view says
            list_views(self.desk)
            view_of(self.desk, "project")

    def _load(self) -> None:
        from toolpoint.workbench.state.machine_request import MachineRequest
        from toolpoint.workbench.views.catalogue import machine_deed

        with contextlib.suppress(ToolpointError, OSError):  # a project without a machine yet
            machine_deed(self.desk, "look", MachineRequest())

    def close(self) -> None:
        """Stop watching, the recording and the job that runs."""
        self._closing.set()
        self.recordings.stop()
        self.jobs.stop()


def serve(folder: str | Path, *, port: int = 0, host: str = LOCAL_HOST, ready: Callable[[str], None] = lambda address: None,
          records: Sequence[str | Path] = ()) -> None:
    """Serve the workbench of a project's folder until it is interrupted.

    Parameters
    ----------
    folder : of a project, or of one that is to be begun
    port : int
        That of the last time, or a free one, where 0.
    host : str
        Another than 127.0.0.1 lets other machines in; what they exchange is not encrypted.
    ready : function of the address to open, called once the server listens
    records : sequence of paths
        Folders beside the project's own from which blows may be recorded: that of a measuring program.

    Raises ToolpointError where the extra ``app`` is not installed, where the folder is none, and where a workbench of it runs.

    Examples
    --------
    Runs in ``examples/share_a_project_as_a_folder.py``.
    """
    uvicorn = _load_uvicorn()
    if host in ANY_HOSTS:
        raise ToolpointError(f"{host}: means every address of this machine; name the one by which others reach it, so that a "
                             "foreign name that leads here can be told from it")
    place = Path(folder)
    if not place.is_dir():
        raise ToolpointError(f"{place}: is no folder; make it first, or a project with `toolpoint new project {place}`")
    state = place / STATE_PLACE
    with _only_server(place, state), _listen(host, port or _last_port(state)) as listener:
        access = Access(keep_token(state / "token"), listener.getsockname()[1], host)
        bench = Workbench(place, access, records)
        bench.begin()
        keep_file(state / "server.json", json.dumps({"port": access.port, "host": host}))
        settings = uvicorn.Config(bench.application(), log_level="warning", access_log=False, server_header=False,
                                  date_header=False, timeout_graceful_shutdown=STOP_SECONDS, lifespan="off", workers=1)
        server = uvicorn.Server(settings)
        threading.Thread(target=_say_when_ready, args=(server, access.address, ready), daemon=True).start()
        try:
            server.run(sockets=[listener])
        finally:
            bench.close()


def _load_uvicorn() -> Any:
    """Return the server's library, or say which extra brings it."""
    try:
        import starlette  # noqa: F401
        import uvicorn
    except ImportError:
        raise ToolpointError("the workbench needs Starlette and uvicorn, which are not installed; install them with "
                             "pip install 'toolpoint[app]'") from None
    return uvicorn


@contextlib.contextmanager
def _only_server(folder: Path, state: Path) -> Iterator[None]:
    """Hold the lock of a project's workbench; say where the other one is, where there is one."""
    with contextlib.ExitStack() as stack:
        try:
            stack.enter_context(hold_lock(state / "lock", folder.name))
        except ToolpointError as error:
            raise ToolpointError(f"{error}; its workbench may be open already: {_last_address(state)}") from None
        yield


def _listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens on a port, on a free one where it is taken."""
    for number in dict.fromkeys((port, 0)):
        # With the protocol named asyncio sends at once; without, Nagle's algorithm holds back the content of an answer 40 ms.
        listener = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((host, number))
        except OSError as error:
            listener.close()
            if number == 0:
                raise ToolpointError(f"{host}: cannot be listened on ({error.strerror}); name another host") from None
            continue
        listener.listen(128)
        return listener
    raise ToolpointError(f"{host}: no port is free")


def _last_port(state: Path) -> int:
    """Return the port of the last time: tabs that are open still find the server there."""
    try:
        return int(json.loads((state / "server.json").read_text(encoding="utf-8"))["port"])
    except (OSError, ValueError, KeyError, TypeError):
        return 0


def _last_address(state: Path) -> str:
    try:
        data = json.loads((state / "server.json").read_text(encoding="utf-8"))
        return Access(keep_token(state / "token"), int(data["port"]), str(data["host"])).address
    except (OSError, ValueError, KeyError, TypeError):
        return "its address is not known"


def _say_when_ready(server: Any, address: str, ready: Callable[[str], None]) -> None:
    while not server.started and not server.should_exit:
        time.sleep(0.01)
    if server.started:
        ready(address)
