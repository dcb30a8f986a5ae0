"""Server of the workbench as a process of its own, and waits for a page of it."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest

from slow_browser import serve_command

PATIENCE_SECONDS = 240.0  # for what comes sooner or later: a loaded machine is slow, not wrong


class Server:
    """`toolpoint serve` as a process of its own."""

    def __init__(self, folder: Path) -> None:
        pytest.importorskip("uvicorn")
        self.folder = folder
        self.start()

    def start(self) -> None:
        self.process = subprocess.Popen([*serve_command(), "serve", "."], cwd=self.folder, text=True, stdout=subprocess.PIPE,
                                        env={**os.environ, "OMP_NUM_THREADS": "1"})
        assert self.process.stdout is not None
        self.address = self.process.stdout.readline().split()[-1]

    def kill(self) -> None:
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()

    def hold_job(self) -> int:
        """Halt the process of this folder's job as soon as there is one: what a page shows of it stays, on any machine."""
        end = time.monotonic() + PATIENCE_SECONDS
        while time.monotonic() < end:
            for line in Path("/proc").glob("[0-9]*/cmdline"):
                with contextlib.suppress(OSError):  # a process that ends meanwhile
                    if b"state.job_process" in (words := line.read_bytes()) and str(self.folder).encode() in words:
                        os.kill(number := int(line.parent.name), signal.SIGSTOP)
                        return number
            time.sleep(0.01)
        raise AssertionError("no job was started")


def wait(page: Any, expression: str, seconds: float = PATIENCE_SECONDS) -> None:
    end = time.monotonic() + seconds
    while not page.evaluate(expression):
        assert time.monotonic() < end, f"still false: {expression}; page: {page.inner_text('body')[:1500]}"
        time.sleep(0.05)


def ready(page: Any, view: str) -> None:
    wait(page, f"document.body.dataset.ready === '{view}' && window.Workbench.current === '{view}'")
