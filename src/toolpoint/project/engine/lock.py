"""Lock of a project: one process at a time changes its results; that of a dead process is taken over."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from toolpoint._check import ToolpointError


@contextmanager
def hold_lock(file: Path, what: str) -> Iterator[None]:
    """Hold the lock of a project, or raise ToolpointError with the process that holds it.

    The operating system releases the lock of a process that ends, however it ends; the number in the file only names it.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("a+", encoding="utf-8") as handle:
        if not _take(handle):
            handle.seek(0)
            holder = handle.read().strip() or "another"
            raise ToolpointError(f"{what}: process {holder} runs in it; wait until it has ended, or stop it")
        handle.seek(0)
        handle.truncate()
        handle.write(f"{os.getpid()}\n")
        handle.flush()
        yield


def _take(handle: Any) -> bool:
    """Take the system's lock of an open file; return whether it was free."""
    try:
        if sys.platform == "win32":
            import msvcrt

            handle.seek(1 << 20)  # beyond the number, which others may read
            msvcrt.locking(handle.fileno(), msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(handle.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
