"""Linear algebra of many small matrices on one thread: more threads wait for each other longer than they work."""

from __future__ import annotations

import functools
import os
import sys
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


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
