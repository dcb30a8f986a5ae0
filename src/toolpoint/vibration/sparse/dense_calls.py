"""BLAS and LAPACK of SciPy called from compiled loops: addresses that are looked up at run time, so that kernels can be kept.

Numbers and letters are passed by their addresses, as Fortran wants them.
"""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic
from scipy.linalg import cython_blas, cython_lapack

from toolpoint._check import Array, FloatArray, IndexArray, fail

# Memory that the arguments of a call are passed in: integers, letters, numbers.
Scratch = tuple[IndexArray, Array, FloatArray]

ROUTINE_NAMES = ("dpotrf", "dtrsm", "dsyrk", "dgemm")


@cache
def addresses() -> IndexArray | None:
    """Return the addresses of the four routines; None where this SciPy keeps them otherwise (64-bit integers)."""
    name = ctypes.pythonapi.PyCapsule_GetName
    name.restype, name.argtypes = ctypes.c_char_p, [ctypes.py_object]
    pointer = ctypes.pythonapi.PyCapsule_GetPointer
    pointer.restype, pointer.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    result = []
    for routine in ROUTINE_NAMES:
        home: Any = cython_lapack if routine == "dpotrf" else cython_blas
        capsule = home.__pyx_capi__.get(routine)
        # The capsule's name is the routine's signature in C: where integers have 64 bits the call below would pass half of
        # them.
        if capsule is None or b"int *" not in name(capsule):
            return None
        result.append(pointer(capsule, name(capsule)))
    return np.array(result, dtype=np.int64)


def require_addresses() -> IndexArray:
    """Return the addresses of the four routines, for callers that have asked whether this SciPy has them.

    Raises
    ------
    ToolpointError
        Where it has not.
    """
    routines = addresses()
    if routines is None:
        fail("SciPy", "BLAS of 64-bit integers", "the multifrontal solver calls one of 32-bit integers",
             remedy="factorise by SuperLU or CHOLMOD")
    return routines


def _call(context: Any, address: Any, arguments: Any) -> Any:
    """Call the routine at an address with a tuple of addresses as its arguments."""
    def _generate(target: Any, builder: Any, signature: Any, values: Any) -> Any:
        byte = ir.IntType(8).as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [byte] * arguments.count)
        routine = builder.inttoptr(values[0], kind.as_pointer())
        builder.call(routine, [builder.inttoptr(builder.extract_value(values[1], i), byte) for i in range(arguments.count)])
        return target.get_dummy_value()

    return types.void(address, arguments), _generate


# Its stub asks for the typing context too, which the compiler supplies.
call: Any = intrinsic(_call)


@njit(cache=True, nogil=True)
def scratch() -> Scratch:
    """Return the memory that arguments are passed in: integers (8,) int32, letters L N T U R (5,) uint8, numbers 1, -1 (2,)."""
    integers = np.zeros(8, np.int32)
    letters = np.array([76, 78, 84, 85, 82], np.uint8)
    numbers = np.array([1.0, -1.0])
    return integers, letters, numbers


@njit(cache=True, nogil=True)
def cholesky(routines: IndexArray, places: Scratch, n: int, a: int, lda: int) -> int:
    """Factorise the lower triangle at address a in place; return 0, or the first row whose pivot is not positive."""
    integers, letters, _ = places
    i, c = integers.ctypes.data, letters.ctypes.data
    integers[0], integers[1], integers[2] = n, lda, 0
    call(routines[0], (c, i, a, i + 4, i + 8))
    return integers[2]


@njit(cache=True, nogil=True)
def solve_triangle(routines: IndexArray, places: Scratch, right: bool, transposed: bool, unit: bool, m: int, n: int, a: int,
                   lda: int, b: int, ldb: int) -> None:
    """B (m, n) becomes inv(L) B, or B inv(L) from the right, L transposed where asked, with ones on its diagonal or not."""
    integers, letters, numbers = places
    i, c, x = integers.ctypes.data, letters.ctypes.data, numbers.ctypes.data
    integers[0], integers[1], integers[2], integers[3] = m, n, lda, ldb
    call(routines[1], (c + (4 if right else 0), c, c + (2 if transposed else 1), c + (3 if unit else 1), i, i + 4, x, a, i + 8,
                       b, i + 12))


@njit(cache=True, nogil=True)
def square_update(routines: IndexArray, places: Scratch, n: int, k: int, a: int, lda: int, c_address: int, ldc: int) -> None:
    """The lower triangle of C (n, n) becomes C - A A^T, A (n, k)."""
    integers, letters, numbers = places
    i, c, x = integers.ctypes.data, letters.ctypes.data, numbers.ctypes.data
    integers[0], integers[1], integers[2], integers[3] = n, k, lda, ldc
    call(routines[2], (c, c + 1, i, i + 4, x + 8, a, i + 8, x, c_address, i + 12))


@njit(cache=True, nogil=True)
def product(routines: IndexArray, places: Scratch, shape: tuple[int, int, int], transposed: tuple[bool, bool],
            a: tuple[int, int], b: tuple[int, int], target: tuple[int, int]) -> None:
    """C (m, n) becomes C - op(A) op(B), op(A) (m, k), op(B) (k, n); `shape` m, n, k, `transposed` whether A, whether B is;
    each matrix is its address and its leading dimension."""
    integers, letters, numbers = places
    i, c, x = integers.ctypes.data, letters.ctypes.data, numbers.ctypes.data
    integers[0], integers[1], integers[2], integers[3], integers[4], integers[5] = *shape, a[1], b[1], target[1]
    call(routines[3], (c + (2 if transposed[0] else 1), c + (2 if transposed[1] else 1), i, i + 4, i + 8, x + 8, a[0], i + 12,
                       b[0], i + 16, x, target[0], i + 20))
