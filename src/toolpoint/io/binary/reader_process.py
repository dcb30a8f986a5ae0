"""Binary files of C libraries are opened in a process of their own, with bounds of time and memory.

A damaged HDF5 or MATLAB file can kill the process that opens it, or hold it for ever, inside the library, where no Python
can end it. The process (`reader_worker`) is started at the first such file, serves all further ones, and is ended and
replaced where a file takes it down.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import pickle
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

from toolpoint._check import ToolpointError
from toolpoint.io.door import check_regular

BASE_READING_SECONDS, BYTES_A_SECOND = 3.0, 20e6  # of a file, beyond what starting the process takes
BASE_READING_BYTES, MAX_MEMORY_COPIES = 700_000_000, 40  # bytes, and how many times its size a file may need
# A cold disk or a virus scanner may take half a minute to load the libraries: a shorter wait would blame the file.
MAX_START_SECONDS = 60.0


class _Worker:
    """One running process; `owner` is the process that may use it (a fork must start its own)."""

    def __init__(self) -> None:
        script = Path(__file__).with_name("reader_worker.py")
        self.owner = os.getpid()
        self.process = subprocess.Popen([sys.executable, "-P", str(script)], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        stderr=subprocess.DEVNULL)
        if self._answer(MAX_START_SECONDS) is None:
            raise ToolpointError("the process that reads HDF5 and MATLAB files does not start; check the installation of h5py")

    def ask(self, request: dict[str, Any]) -> tuple[str, Any]:
        """Return the answer to one request; ``lost`` where the process died or hung, and is gone."""
        assert self.process.stdin is not None
        try:
            self.process.stdin.write(json.dumps(request).encode() + b"\n")
            self.process.stdin.flush()
        except OSError:
            return "lost", "it ended"
        packed = self._answer(request["seconds"])
        return ("lost", "") if packed is None else pickle.loads(packed)

    def _answer(self, seconds: float) -> bytes | None:
        parts: list[bytes] = []
        thread = threading.Thread(target=self._receive, args=(parts,), daemon=True)
        thread.start()
        thread.join(seconds)
        self.was_late = thread.is_alive()
        if self.was_late or not parts:
            self.end()
            return None
        return parts[0]

    def _receive(self, parts: list[bytes]) -> None:
        stream = self.process.stdout
        assert stream is not None
        head = stream.read(8)
        if len(head) == 8:
            size = int.from_bytes(head, "little")
            packed = stream.read(size)
            if len(packed) == size:
                parts.append(packed)

    def end(self) -> None:
        """End the process, whatever it does."""
        if self.owner == os.getpid():
            self.process.kill()
            self.process.wait()
            for stream in (self.process.stdin, self.process.stdout):
                if stream is not None:
                    with contextlib.suppress(OSError):  # what was not sent to a dead process is lost on purpose
                        stream.close()


_LOCK = threading.Lock()
_workers: list[_Worker] = []


def load(path: Path, format: str) -> Any:
    """Return the content of a file as `reader_worker` reads it: ``hdf5`` or ``mat``.

    Raises
    ------
    ToolpointError
        Where the library refuses the file, crashes, takes longer than 3 s and 1 s for each 20 MB, or needs more memory than
        0.7 GB and forty times the file's size.
    """
    check_regular(path)
    size = path.stat().st_size
    request = {"format": format, "path": str(path.resolve()), "seconds": BASE_READING_SECONDS + size / BYTES_A_SECOND,
               "memory": BASE_READING_BYTES + MAX_MEMORY_COPIES * size}
    with _LOCK:
        worker = _running()
        state, content = worker.ask(request)
    if state == "ok":
        return content
    if state == "lost":
        content = (f"the library did not come back from it within {request['seconds']:.0f} s" if worker.was_late
                   else "the library crashed on it")
    raise ToolpointError(f"{path}: not a whole {'HDF5' if format == 'hdf5' else 'MATLAB'} file ({content}); it is cut off, "
                         "damaged or something else; save it again")


def _running() -> _Worker:
    while _workers:
        worker = _workers[-1]
        if worker.owner == os.getpid() and worker.process.poll() is None:
            return worker
        _workers.pop()
    _workers.append(_Worker())
    return _workers[-1]


@atexit.register
def _close() -> None:
    for worker in _workers:
        worker.end()
