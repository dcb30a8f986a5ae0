"""First use: kernels are compiled where they are first called and kept on disk; progress says so meanwhile."""

from __future__ import annotations

import sys

COMPILING = "compiling, at the first use only"


def is_compiling() -> bool:
    """Return whether a kernel is compiled right now: the compiler holds its lock meanwhile; where it is not loaded, none is."""
    module = sys.modules.get("numba.core.compiler_lock")
    lock = getattr(getattr(module, "global_compiler_lock", None), "_lock", None)
    if lock is None:
        return False
    # Its own question tells of the asking thread alone: whether another one holds it is told by trying.
    is_free = lock.acquire(blocking=False)
    if is_free:
        lock.release()
    return not is_free
