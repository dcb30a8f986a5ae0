"""Deprecation: an old name or argument goes on working for a while, says so, and names what takes its place."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")


class ToolpointDeprecationWarning(DeprecationWarning):
    """An old name or argument was used; the words say since when, and what to write instead."""


def deprecate(*, since: str, instead: str) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Mark a function or class of the public interface as old: a call of it warns, and its docstring says so.

    since : version; instead : what to write.

    Examples
    --------
    >>> @deprecate(since="0.2", instead="new_mean")
    ... def old_mean(values):
    ...     return sum(values) / len(values)
    >>> import warnings
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     old_mean([1, 3])
    2.0
    >>> print(caught[0].message)
    old_mean: deprecated since 0.2; write new_mean
    """
    def mark(function: Callable[P, T]) -> Callable[P, T]:
        words = f"{getattr(function, '__name__', 'this')}: deprecated since {since}; write {instead}"

        @functools.wraps(function)
        def called(*args: P.args, **kwargs: P.kwargs) -> T:
            warnings.warn(words, ToolpointDeprecationWarning, stacklevel=2)
            return function(*args, **kwargs)

        called.__doc__ = f"{function.__doc__ or ''}\n\n.. deprecated:: {since}\n   Write `{instead}`.\n"
        return called
    return mark


def rename_argument(old: str, new: str, *, since: str) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Let a function take an argument by its old name too, with a warning; raises TypeError where both names are given.

    Examples
    --------
    >>> @rename_argument("every", "interval", since="0.2")
    ... def record(*, interval):
    ...     return interval
    >>> record(interval=3)
    3
    """
    def mark(function: Callable[P, T]) -> Callable[P, T]:
        name = getattr(function, "__name__", "this")

        @functools.wraps(function)
        def called(*args: P.args, **kwargs: P.kwargs) -> T:
            if old in kwargs:
                if new in kwargs:
                    raise TypeError(f"{name}: {old!r} is the old name of {new!r}; give one of them")
                warnings.warn(f"{name}: the argument {old!r} is called {new!r} since {since}", ToolpointDeprecationWarning,
                              stacklevel=2)
                kwargs[new] = kwargs.pop(old)
            return function(*args, **kwargs)
        return called
    return mark
