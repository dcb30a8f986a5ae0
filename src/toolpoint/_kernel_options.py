"""Options of compiled kernels.

A kernel that takes a record of arrays counts references at every look into it: an atomic operation on each array, which took
three quarters of the time of a program's removal. A kernel that creates no array and returns none only borrows those of its
caller, and need not count: `@njit(cache=True, nogil=True, **BORROWS)`. Where it or a kernel that it calls creates one, the
compiler refuses it.
"""

from __future__ import annotations

from typing import Any

from numba.core.options import DefaultOptions

# Private to Numba: where a version does not know it, kernels count, and give the same.
BORROWS: dict[str, Any] = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}
