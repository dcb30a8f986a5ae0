"""Compiled kernels that only kernels call: without the two wrappers by which Python and C would call them.

The wrapper for Python unpacks every argument, and of a kernel of ten arrays it is longer than the kernel. Left out where only
kernels call, it takes a tenth off the compiling of a first `lobes`, that for C some per cent more.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import cache
from typing import Any

import numba as nb
from numba.core.registry import CPUDispatcher


class InnerKernel(CPUDispatcher):
    """Kernel without a wrapper for Python: called from there, as tests do, it goes through a kernel compiled for that."""

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call the kernel from Python; without this the process would end, as there is nothing to call."""
        bound = inspect.signature(self.py_func).bind(*arguments, **named)
        bound.apply_defaults()
        return _caller_of(self)(*bound.args)


@cache
def _caller_of(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """Return a kernel that Python can call, and that calls the inner one."""
    def call(*arguments: Any) -> Any:
        return kernel(*arguments)

    return nb.njit(call)


def inner_njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return the decorator of a kernel that only kernels call; `options` are those of `numba.njit`.

    >>> @inner_njit()
    ... def double(x):
    ...     return 2 * x
    >>> double(21)  # from Python: slow, for tests
    42
    """
    def compile_inner(function: Callable[..., Any]) -> Any:
        compiler: Any = nb.njit  # its stubs do not know these two options
        kernel = compiler(no_cpython_wrapper=True, no_cfunc_wrapper=True, **options)(function)
        kernel.__class__ = InnerKernel
        return kernel

    return compile_inner
