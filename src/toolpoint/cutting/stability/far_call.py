"""Kernels called by their address: the many callers of one kernel then do not compile it again, each within itself.

The compiler takes every callee into its caller and optimises both together, so a kernel at the bottom of eight others is
compiled nine times. A kernel called by its address is compiled once, apart. The address changes from process to process, so
callers are handed it as a number, and stay on disk.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba as nb
from llvmlite import ir
from numba.extending import intrinsic


def address_of(kernel: Callable[..., int], kinds: tuple[Any, ...]) -> int:
    """Return where a kernel, compiled for arguments of these Numba types, is in this process; it returns an integer.

    What divides by zero gives infinity or no number, as in NumPy: nothing could pass an error on to the caller.
    """
    compiled: Any = nb.cfunc(nb.int64(*kinds), cache=True, error_model="numpy")(kernel)
    return int(compiled.address)


def caller_of(kinds: tuple[Any, ...]) -> Any:
    """Return a function for kernels that calls the kernel at an address with a tuple of arguments of just these types."""
    def _call(context: Any, address: Any, arguments: Any) -> Any:
        if tuple(arguments) != kinds:  # another layout would be read as this one
            raise nb.TypingError(f"a kernel called by its address takes {kinds}, not {tuple(arguments)}")

        def _generate(target: Any, builder: Any, signature: Any, values: Any) -> Any:
            shape = ir.FunctionType(target.get_value_type(nb.int64), [target.get_value_type(kind) for kind in kinds])
            parts = [builder.extract_value(values[1], i) for i in range(len(kinds))]
            return builder.call(builder.inttoptr(values[0], shape.as_pointer()), parts)

        return nb.int64(nb.int64, nb.types.Tuple(kinds)), _generate

    return intrinsic(_call)
