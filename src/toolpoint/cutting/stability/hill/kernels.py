"""Compiled kernel of HillDeterminant: the Hill matrix of a cut with any number of delays."""

from __future__ import annotations

import numba as nb
import numpy as np

from toolpoint._check import ComplexArray


@nb.njit(cache=True, nogil=True)
def fill_blocks(now: ComplexArray, drag: ComplexArray, late: ComplexArray, turned: ComplexArray, rate: ComplexArray,
                response: ComplexArray, first_row: int, first_column: int, out: ComplexArray) -> None:
    """Write the blocks G_k (now_{k-l} + rate_l drag_{k-l} - sum_q turned_lq late_{k-l,q}) into out, (rows a, columns b).

    All arrays complex128. now, drag (2 order_max + 1, c, b) and late (2 order_max + 1, q, c, b) : orders of the period;
    turned (columns, q) : exp(-i omega_l delay_q); rate (columns,) : i omega_l C/v; response (rows, a, c) : G_k; harmonics k
    of rows and l of columns count from first_row and first_column.
    """
    order_max = (now.shape[0] - 1) // 2
    rows, ways, sides = response.shape
    directions = now.shape[-1]
    force = np.empty((sides, directions), np.complex128)
    damped = np.any(rate != 0)
    for l in range(turned.shape[0]):
        for k in range(rows):
            h = first_row + k - first_column - l + order_max
            for c in range(sides):
                for b in range(directions):
                    force[c, b] = now[h, c, b]
                    if damped:
                        force[c, b] += rate[l] * drag[h, c, b]
            for q in range(late.shape[1]):
                for c in range(sides):
                    for b in range(directions):
                        force[c, b] -= turned[l, q] * late[h, q, c, b]
            for a in range(ways):
                for b in range(directions):
                    total = 0.0 + 0.0j
                    for c in range(sides):
                        total += response[k, a, c] * force[c, b]
                    out[k * ways + a, l * directions + b] = total
