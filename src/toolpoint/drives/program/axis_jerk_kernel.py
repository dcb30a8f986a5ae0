"""Compiled slowdown of a raw law over the window that its average reads, where that passes a limit."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from numba import njit

from toolpoint._kernel_options import BORROWS

_FLAT_RATIO = 1.02  # of the largest to the least square of the rate in a window: below it the law is even there


@njit(cache=True, nogil=True, **BORROWS)
def slow_windows(time, squares, late, excess, window, caps):
    """Lower caps of the squares of the rate (m,), at rising times (s), within a window before times `late` (k,), rising.

    excess : (k,) factor by which the time there would have to be longer. Where the rate changes within the window its top is
    taken off, down to its least value: a change of acceleration is what a jerk comes from. Where it is even, all of it is
    slowed.
    """
    first = 0
    for n in range(late.size):
        while first < time.size - 1 and time[first + 1] < late[n] - window:
            first += 1
        last = first
        lower, upper = squares[first], squares[first]
        while last < time.size - 1 and time[last] < late[n]:
            last += 1
            lower, upper = min(lower, squares[last]), max(upper, squares[last])
        is_even = upper <= _FLAT_RATIO * lower
        level = upper / excess[n] ** 1
        for i in range(first, last + 1):
            caps[i] = min(caps[i], level if is_even else max(level, lower))

# Code of other modules in these kernels: 814697192537
