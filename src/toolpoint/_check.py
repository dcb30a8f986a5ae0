"""Input checks: one line per check at the place of use, the argument's name in every message."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NoReturn, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

# Array: real or complex, as its docstring says.
Array = NDArray[Any]
FloatArray = NDArray[np.floating[Any]]
ComplexArray = NDArray[np.complexfloating[Any, Any]]
IndexArray = NDArray[np.integer[Any]]
BoolArray = NDArray[np.bool_]

# Default of a dataclass field that `__post_init__` fills in where it is left out: from then on the field holds what its
# annotation says, so readers of the field need no test for None.
LEFT_OUT: Any = None

Part = TypeVar("Part")
Result = TypeVar("Result")


class ToolpointError(ValueError):
    """A wrong input: the message names the argument, the value, the limit and the remedy.

    `argument` is the argument's name as data (``"Tool.pitch"``), empty where the fault is not one argument's.

    >>> try:
    ...     positive("Tool.diameter", -0.01)
    ... except ToolpointError as error:
    ...     error.argument
    'Tool.diameter'
    """

    def __init__(self, message: str = "", *, argument: str = "") -> None:
        super().__init__(message)
        self.argument = argument


class ToolpointWarning(UserWarning):
    """A doubtful input or result; what it marks is also written in the result.

    >>> import warnings
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always", ToolpointWarning)
    ...     warnings.warn("Frf: 3 lines are missing", ToolpointWarning)
    >>> str(caught[0].message)
    'Frf: 3 lines are missing'
    """


class FileDoubt(ToolpointWarning):
    """A doubt that came with an input file: every result that rests on the file repeats it first. Its argument is a `Doubt`."""


def fail(name: str, value: str, limit: str, *, remedy: str = "") -> NoReturn:
    """Raise a ToolpointError in the one form that every message of the package has."""
    raise ToolpointError(f"{name}: {value}; {limit}" + (f" ({remedy})" if remedy else ""), argument=name)


def frozen(array: Array) -> Array:
    """Return a read-only view, so that a frozen noun cannot be changed through its arrays."""
    view = array.view()
    view.flags.writeable = False
    return view


def floats(name: str, value: ArrayLike, shape: Sequence[int | None] | None = None, *, finite: bool = True) -> FloatArray:
    """Return a read-only float64 array; `shape` gives trailing axes, None for any length."""
    return _array(name, value, np.float64, shape, finite)


def complexes(
    name: str, value: ArrayLike, shape: Sequence[int | None] | None = None, *, finite: bool = True
) -> ComplexArray:
    """Return a read-only complex128 array; `shape` gives trailing axes, None for any length."""
    return _array(name, value, np.complex128, shape, finite)


def real_or_complex(name: str, value: ArrayLike, shape: Sequence[int | None] | None = None) -> Array:
    """Return a read-only float64 or complex128 array, whichever the value is."""
    kind = np.complex128 if np.iscomplexobj(value) else np.float64
    return _array(name, value, kind, shape, True)


def _array(name: str, value: ArrayLike, kind: Any, shape: Sequence[int | None] | None, finite: bool) -> Array:
    try:
        source = np.asarray(value)
        if kind is np.float64 and np.iscomplexobj(source):
            fail(name, "complex numbers", "must be real", remedy="take .real or .imag, whichever is meant")
        array = np.array(source, dtype=kind, order="C")
    except ToolpointError:
        raise
    except (TypeError, ValueError) as error:
        raise ToolpointError(f"{name}: not an array of numbers ({error})", argument=name) from None
    if shape is not None:
        _trailing_shape(name, array, shape)
    if finite and not np.isfinite(array).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        count = int((~np.isfinite(array)).sum())
        fail(name, f"{count} of {array.size} values are not finite, the first at index {where}", "must be finite",
             remedy="remove or replace the faulty lines before the call")
    return frozen(array)


def _trailing_shape(name: str, array: Array, shape: Sequence[int | None]) -> None:
    tail = array.shape[array.ndim - len(shape):] if array.ndim >= len(shape) else None
    if tail is None or any(want is not None and want != got for want, got in zip(shape, tail, strict=True)):
        expected = ", ".join("any" if want is None else str(want) for want in shape)
        fail(name, f"shape {array.shape}", f"must end in ({expected})")


def increasing(name: str, array: FloatArray) -> FloatArray:
    """Check that a one-dimensional array increases strictly."""
    if array.ndim != 1 or array.size == 0:
        fail(name, f"shape {array.shape}", "must be one-dimensional and not empty")
    step = np.diff(array)
    if (step <= 0).any():
        index = int(np.argmax(step <= 0))
        fail(name, f"value {array[index + 1]:g} at index {index + 1} follows {array[index]:g}", "must increase strictly",
             remedy="sort the lines and remove repeated ones")
    return array


def nonnegative(name: str, array: FloatArray) -> FloatArray:
    """Check that no value is negative."""
    if array.size and array.min() < 0:
        fail(name, f"value {array.min():g}", "must not be negative")
    return array


def symmetric(name: str, matrix: Array, tolerance: float = 1e-8) -> Array:
    """Check that the last two axes are symmetric within `tolerance` of the largest entry."""
    if matrix.size == 0:
        return matrix
    scale = float(np.abs(matrix).max())
    error = float(np.abs(matrix - np.swapaxes(matrix, -1, -2)).max())
    if error > tolerance * scale:
        fail(name, f"unsymmetric by {error:g} (largest entry {scale:g})", "must be symmetric",
             remedy="average the matrix with its transpose if the difference is measurement error")
    return matrix


def positive(name: str, value: float, limit: float = np.inf) -> float:
    """Check that a number is finite, above zero and at most `limit`."""
    number = scalar(name, value)
    if number <= 0 or number > limit:
        fail(name, f"{number:g}", "must be above zero" + (f" and at most {limit:g}" if np.isfinite(limit) else ""))
    return number


def scalar(name: str, value: float) -> float:
    """Check that a value is one finite real number."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        fail(name, repr(value), "must be a number")
    if not np.isfinite(number):
        fail(name, repr(value), "must be finite")
    return number


def count(name: str, value: int, minimum: int = 1) -> int:
    """Check that a value is a whole number of at least `minimum`."""
    if isinstance(value, bool) or int(value) != value or value < minimum:
        fail(name, repr(value), f"must be a whole number of at least {minimum}")
    return int(value)


def within(path: str, make: Callable[[Part], Result], part: Part) -> Result:
    """Return ``make(part)``; an error of it names the path before the argument."""
    try:
        return make(part)
    except ToolpointError as error:
        argument = f"{path}.{error.argument}" if error.argument else ""
        raise ToolpointError(f"{path}.{error}", argument=argument) from None


def one_of(name: str, value: str, allowed: Iterable[str]) -> str:
    """Check that a word is one of the allowed ones; suggest the nearest."""
    words = list(allowed)
    if value not in words:
        fail(name, repr(value), "must be one of " + ", ".join(words), remedy=suggestion(str(value), words))
    return value


# Words of the shop floor for words of files.
SYNONYMS = {"climb": "down", "climb milling": "down", "conventional": "up", "slotting": "slot", "full": "slot",
            "centered": "centred", "center": "centred", "symmetric": "centred"}


def suggestion(word: str, words: Iterable[str]) -> str:
    """Return 'did you mean ...?' for the word of the same meaning or else the nearest, or nothing where none is near."""
    words = list(words)
    if (synonym := SYNONYMS.get(str(word).lower())) in words:
        return f"did you mean {synonym!r}?"
    matches = difflib.get_close_matches(word, words, n=1, cutoff=0.5)
    return f"did you mean {matches[0]!r}?" if matches else ""
