"""Linear algebra of many small matrices on one thread: more threads wait for each other longer than they work."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


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
