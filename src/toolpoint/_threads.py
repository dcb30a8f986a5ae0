"""Threads: linear algebra of many small matrices on one, compiled kernels side by side on the cores that are free.

More threads of linear algebra wait for each other longer than they work. Compiled kernels release the interpreter's lock.
"""

from __future__ import annotations

import contextvars
import functools
import os
import sys
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")

MAX_KERNEL_THREADS = 8  # beyond it the parts that hold the interpreter's lock leave nothing to gain

VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def hold_process() -> None:
    """Hold the BLAS libraries of this process to one thread, those that are loaded and those to come, unless one of the
    variables says otherwise. For a command of its own process, never for a caller's."""
    if any(name in os.environ for name in VARIABLES):
        return
    os.environ.update(dict.fromkeys(VARIABLES, "1"))
    from threadpoolctl import ThreadpoolController

    ThreadpoolController().limit(limits=1, user_api="blas")


def on_one_thread(compute: Callable[P, R]) -> Callable[P, R]:
    """Return the function with the BLAS libraries held to one thread while it runs; afterwards they are as before.

    For what solves thousands of matrices of a few dozen rows: an identification of five responses takes 23 s of processor
    time with two threads a library beside other work, 11 s with one. Large factorisations are not held.
    """
    @functools.wraps(compute)
    def held(*args: P.args, **kwargs: P.kwargs) -> R:
        with _libraries("scipy.linalg" in sys.modules).limit(limits=1, user_api="blas"):
            return compute(*args, **kwargs)

    return held


@functools.cache
def _libraries(has_scipy: bool) -> Any:
    """The BLAS libraries that are loaded; SciPy brings one of its own, later than NumPy's."""
    from threadpoolctl import ThreadpoolController  # looks through all loaded libraries: not at start-up

    return ThreadpoolController()


def available_threads() -> int:
    """Return how many threads may run kernels side by side: the cores of this process, at most eight.

    One where this is not the main thread: workers of a study and requests of a server share the cores already.
    """
    if threading.current_thread() is not threading.main_thread():
        return 1
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(cores, MAX_KERNEL_THREADS)


def run_side_by_side(compute: Callable[[T], R], parts: Sequence[T], threads: int) -> list[R]:
    """Return the results of all parts in their order, computed by several threads; an error or Ctrl-C drops what has not begun.

    Each part sees the settings of its caller (of NumPy, of warnings by context).
    """
    pool = ThreadPoolExecutor(threads, thread_name_prefix="kernels")
    try:
        return [future.result() for future in [pool.submit(contextvars.copy_context().run, compute, part) for part in parts]]
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
