"""A small project (a drawn machine, a cut, a goal), its workbench in a thread, and a plain client."""

from __future__ import annotations

import http.client
import json
import shutil
import socket
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from toolpoint.workbench.serving.server import Workbench
from toolpoint.workbench.state.access import Access
from workbench_tabs import Server

ROOT = Path(__file__).resolve().parents[2]
MACHINE = ROOT / "src/toolpoint/project/demo_mill.yaml"
PROJECT = """# a comment that stays
toolpoint: 1
name: Small mill
machine: machine.yaml
draws: 20
cuts:
  face: {diameter: 50 mm, teeth: 5, immersion: 0.6, tangential: 1900 MPa, normal: 700 MPa, coefficient_deviation: 8 %,
         speeds: 500 2500 rpm}
goals:
  roughing: {speed: 1200 rpm, depth: 4 mm}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A project whose steps were never run."""
    place = tmp_path / "mill"
    place.mkdir()
    (place / "project.yaml").write_text(PROJECT)
    shutil.copy(MACHINE, place / "machine.yaml")
    return place


@dataclass
class Client:
    """What another program on this machine sends; every header can be left out or be another."""

    access: Access

    def ask(self, method: str, path: str, body: Any = None, **headers: str | None) -> tuple[int, dict[str, str], bytes]:
        """Return status, headers and content; a header that is None is left out."""
        port = self.access.port
        sent: dict[str, str | None] = {"Host": f"127.0.0.1:{port}",
                                       "Cookie": f"{self.access.cookie_name}={self.access.cookie_value}"}
        if method in ("POST", "PUT", "DELETE"):
            sent["Origin"] = f"http://127.0.0.1:{port}"
        if method == "POST":
            sent["Content-Type"] = "application/json"
            body = body if isinstance(body, (bytes, type(None))) else json.dumps(body).encode()
        if method == "PUT":
            sent["Content-Type"] = "application/octet-stream"
        sent |= {name.replace("_", "-"): value for name, value in headers.items()}
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
        connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
        if body is not None and "Transfer-Encoding" not in sent:
            sent.setdefault("Content-Length", str(len(body)))
        for name, value in sent.items():
            if value is not None:
                connection.putheader(name, value)
        connection.endheaders()
        try:
            if body is not None:
                connection.send(body)
            response = connection.getresponse()
            content = response.read()
        except (BrokenPipeError, ConnectionResetError):  # refused before all was sent
            return 0, {}, b""
        finally:
            connection.close()
        return response.status, {key.lower(): value for key, value in response.getheaders()}, content

    def json(self, method: str, path: str, body: Any = None) -> Any:
        """Return the JSON of an answer that must be good."""
        status, _, content = self.ask(method, path, body)
        assert status == 200, (status, content)
        return json.loads(content)


@dataclass
class Running:
    """A workbench in a thread, and its client."""

    bench: Workbench
    client: Client


@pytest.fixture
def running(folder: Path) -> Iterator[Running]:
    uvicorn = pytest.importorskip("uvicorn")
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    listener.bind(("127.0.0.1", 0))
    listener.listen(64)
    access = Access("a-token-of-the-tests-0123456789", listener.getsockname()[1])
    bench = Workbench(folder, access)
    bench.warm_up = lambda: None  # type: ignore[method-assign]
    server = uvicorn.Server(uvicorn.Config(bench.application(), log_level="critical", lifespan="off",
                                           timeout_graceful_shutdown=1))
    thread = threading.Thread(target=lambda: server.run(sockets=[listener]), daemon=True)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    yield Running(bench, Client(access))
    bench.close()
    server.should_exit = True
    thread.join(10)
    listener.close()


@pytest.fixture
def serve() -> Iterator[Callable[[Path], Server]]:
    servers: list[Server] = []

    def start(folder: Path) -> Server:
        servers.append(Server(folder))
        return servers[-1]

    yield start
    for server in servers:
        server.kill()


@pytest.fixture
def tab(browser: Any) -> Iterator[Callable[..., Any]]:
    contexts: list[Any] = []

    def open_tab(address: str, beside: Any = None, **options: Any) -> Any:
        if beside is None:
            contexts.append(browser.new_context(viewport={"width": 1400, "height": 900}, **options))
        context = contexts[-1] if beside is None else beside.context
        page = context.new_page()
        page.errors, page.requests = [], []
        page.on("pageerror", lambda error: page.errors.append(str(error)))
        page.on("request", lambda request: page.requests.append(request.url))
        page.goto(address)
        return page

    yield open_tab
    for context in contexts:
        context.close()
