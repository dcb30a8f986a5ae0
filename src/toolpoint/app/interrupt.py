"""Ctrl-C: a command ends at once with code 130, without a traceback, and its worker processes end with it.

Python's own way raises KeyboardInterrupt wherever the main thread happens to be: inside a call-back of a compiled kernel it is
swallowed or becomes a SystemError, inside a reader it becomes a message about the file. Here the signal is taken by a thread of
its own, which needs neither the main thread nor, as kernels release the interpreter's lock, a pause in the computation. What
is kept on disk is written to a draft and renamed, so it is whole at any moment; a file that is being written is waited for.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

INTERRUPT_EXIT_CODE = 130  # exit code of a command that Ctrl-C ended: 128 + SIGINT
MAX_WRITING_SECONDS = 2.0  # s that a file in the making is waited for; a second Ctrl-C does not wait
SAME_INTERRUPT_SECONDS = 0.1  # s within which a second signal is the first one, told twice
INTERRUPT_MESSAGE = "\nerror: interrupted; finished parts of a study are kept where it was given a --folder\n"
# A progress bar hides the cursor, and an interrupt may come before it is shown again.
SHOW_CURSOR = "\x1b[?25h"

_writing = threading.RLock()


def end_on_interrupt() -> None:
    """Let Ctrl-C end this process, which must be a command of its own, from now on."""
    if threading.current_thread() is not threading.main_thread():
        return
    receiver, sender = socket.socketpair()
    sender.setblocking(False)
    signal.set_wakeup_fd(sender.fileno(), warn_on_full_buffer=False)
    threading.Thread(target=_wait, args=(receiver, sender), daemon=True, name="interrupt").start()

    def wake(number: int, frame: object) -> None:
        # A signal that came before the wake-up was set reaches this handler alone.
        with contextlib.suppress(OSError):
            sender.send(bytes([signal.SIGINT]))

    signal.signal(signal.SIGINT, wake)


def ignore_interrupts() -> None:
    """Let a process whose result stands end in peace: while Python ends, it gives every other handler back to the system."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextlib.contextmanager
def unbroken_writing() -> Iterator[None]:
    """Hold the end of an interrupted process back, at most two seconds, while a file is written."""
    with _writing:
        yield


def _wait(receiver: socket.socket, sender: socket.socket) -> None:
    # `sender` is kept alive by this thread: the signal writes to its number.
    """Wait for Ctrl-C, then for a file in the making, and end the process."""
    while signal.SIGINT not in receiver.recv(1):
        pass
    threading.Thread(target=_wait_again, args=(receiver, time.monotonic()), daemon=True).start()
    _writing.acquire(timeout=MAX_WRITING_SECONDS)
    _end()


def _wait_again(receiver: socket.socket, first: float) -> None:
    # The wake-up and the handler each write a byte for one Ctrl-C.
    """End the process at once at a second Ctrl-C."""
    while signal.SIGINT not in receiver.recv(1) or time.monotonic() - first < SAME_INTERRUPT_SECONDS:
        pass
    _end()


def _end() -> None:
    """End all processes of the command at once, with its message."""
    for process in _descendants(os.getpid()):
        with contextlib.suppress(OSError):
            os.kill(process, signal.SIGKILL if hasattr(signal, "SIGKILL") else signal.SIGTERM)
    with contextlib.suppress(OSError, ValueError):
        os.write(2, ((SHOW_CURSOR if sys.stderr.isatty() else "") + INTERRUPT_MESSAGE).encode())
    os._exit(INTERRUPT_EXIT_CODE)


def _descendants(root: int) -> list[int]:
    """Return the processes that this one and its children began; where the system does not list them, those Python knows."""
    parents: dict[int, int] = {}
    for status in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError, ValueError, IndexError):
            # The name of a process may hold spaces and brackets: its numbers begin after the last bracket.
            text = status.read_text(encoding="utf-8", errors="replace")
            parents[int(status.parent.name)] = int(text.rpartition(")")[2].split()[1])
    if not parents:
        import multiprocessing

        return [child.pid for child in multiprocessing.active_children() if child.pid]
    children, last = list[int](), {root}
    while last := {process for process, parent in parents.items() if parent in last}:
        children += last
    return children
