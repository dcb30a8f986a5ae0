"""Nested dissection: an order of elimination by small separators, both sides before what separates them.

Source: George, SIAM J. Numer. Anal. 10 (1973). Compiled; imported only when a matrix is factorised.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from toolpoint.vibration.sparse.ordering.cuts import SEPARATOR, SHARE, cost_of, distances, farthest, refine, sweep
from toolpoint.vibration.sparse.ordering.levels import cut_by_levels

# Multilevel cuts are tried above this many vertices; below it the swept ones are as good.
_MULTILEVEL = 500


@njit(cache=True, nogil=True)
def dissect(xadj, adj, weight, places, leaf):
    """Return the vertices in elimination order.

    `xadj`, `adj` are pointers and neighbours (no loops), `weight` the rows of each vertex, `places` (n, any) its
    coordinates or any other smooth functions, none as (n, 0); parts of at most `leaf` vertices are ordered by minimum degree.
    """
    n = xadj.size - 1
    order = np.empty(n, np.int64)
    stack = [(np.arange(n), False)]
    where = np.full(n, -1, np.int64)
    done = 0
    while len(stack):
        vertices, is_separator = stack.pop()
        if vertices.size == 0:
            continue
        if is_separator or vertices.size <= leaf:
            if not is_separator and vertices.size > 2:
                sub_xadj, sub, _, sub_weight = _subgraph(xadj, adj, weight, vertices, where)
                vertices = vertices[_minimum_degree(sub_xadj, sub, sub_weight)]
            order[done:done + vertices.size] = vertices
            done += vertices.size
            continue
        sub_xadj, sub, edge, sub_weight = _subgraph(xadj, adj, weight, vertices, where)
        part = _separate(sub_xadj, sub, edge, sub_weight, places[vertices])
        # Last in, first out: both sides come before their separator.
        stack.append((vertices[part == SEPARATOR], True))
        stack.append((vertices[part == 1], (part == 0).sum() == 0))
        stack.append((vertices[part == 0], (part == 1).sum() == 0))
    return order


@njit(cache=True, nogil=True)
def _minimum_degree(xadj, adj, weight):
    """Return the vertices of a small graph, each time the one with the lightest neighbourhood; neighbours as bits."""
    n = xadj.size - 1
    words = (n + 63) // 64
    bits = np.zeros((n, words), np.uint64)
    unit = np.uint64(1)
    degree = np.zeros(n, np.int64)
    for v in range(n):
        for k in range(xadj[v], xadj[v + 1]):
            bits[v, adj[k] >> 6] |= unit << np.uint64(adj[k] & 63)
            degree[v] += weight[adj[k]]
    order, gone = np.empty(n, np.int64), np.zeros(n, np.bool_)
    for step in range(n):
        best = -1
        for v in range(n):
            if not gone[v] and (best < 0 or degree[v] < degree[best]):
                best = v
        order[step], gone[best] = best, True
        for u in range(n):
            if gone[u] or not (bits[best, u >> 6] >> np.uint64(u & 63)) & unit:
                continue
            for k in range(words):
                bits[u, k] |= bits[best, k]
            bits[u, u >> 6] &= ~(unit << np.uint64(u & 63))
            bits[u, best >> 6] &= ~(unit << np.uint64(best & 63))
            degree[u] = 0
            for w in range(n):
                if (bits[u, w >> 6] >> np.uint64(w & 63)) & unit:
                    degree[u] += weight[w]
    return order


@njit(cache=True, nogil=True)
def _subgraph(xadj, adj, weight, vertices, where):
    for i in range(vertices.size):
        where[vertices[i]] = i
    sub_xadj = np.zeros(vertices.size + 1, np.int64)
    total = 0
    for i in range(vertices.size):
        total += xadj[vertices[i] + 1] - xadj[vertices[i]]
    sub = np.empty(total, np.int64)
    at = 0
    for i in range(vertices.size):
        for k in range(xadj[vertices[i]], xadj[vertices[i] + 1]):
            if where[adj[k]] >= 0:
                sub[at] = where[adj[k]]
                at += 1
        sub_xadj[i + 1] = at
    for v in vertices:
        where[v] = -1
    return sub_xadj, sub[:at].copy(), np.ones(at, np.int64), weight[vertices]


@njit(cache=True, nogil=True)
def _separate(xadj, adj, edge, weight, places):
    """Return the side (0, 1) of each vertex, or that it is in the separator (2): the best of swept and multilevel cuts."""
    start = farthest(xadj, adj, 0)
    best = sweep(xadj, adj, weight, distances(xadj, adj, start))
    least = cost_of(weight, best)
    for column in range(places.shape[1]):
        for sign in (1.0, -1.0):
            part = sweep(xadj, adj, weight, sign * places[:, column])
            cost = cost_of(weight, part)
            if cost < least:
                best, least = part, cost
    refine(xadj, adj, weight, best, 4, SHARE)
    if xadj.size > _MULTILEVEL:
        part = cut_by_levels(xadj, adj, edge, weight)
        if cost_of(weight, part) < cost_of(weight, best):
            return part
    return best
