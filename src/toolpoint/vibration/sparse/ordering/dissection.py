"""Nested dissection: an order of elimination by small separators, both sides before their separator.

Source: George, SIAM J. Numer. Anal. 10 (1973). Compiled; imported only when a matrix is factorised.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from toolpoint._check import FloatArray, IndexArray
from toolpoint.vibration.sparse.ordering.cuts import (
    MAX_SIDE_FRACTION,
    SEPARATOR_PART,
    cost_of,
    distances,
    farthest,
    refine,
    sweep,
)
from toolpoint.vibration.sparse.ordering.levels import cut_by_levels

_MIN_MULTILEVEL_SIZE = 500  # vertices plus one: below, swept cuts are as good as multilevel ones


@njit(cache=True, nogil=True)
def dissect(xadj: IndexArray, adj: IndexArray, weight: IndexArray, places: FloatArray, leaf: int) -> IndexArray:
    """Return the vertices in elimination order, (n,) int64.

    xadj (n + 1,), adj : pointers and neighbours (no loops), int64; weight (n,) int64: rows of each vertex; places (n, any)
    float64: coordinates or other smooth functions of the vertices, none as (n, 0); parts of at most `leaf` vertices are ordered
    by minimum degree.
    """
    n = xadj.size - 1
    order = np.empty(n, np.int64)
    # A stack of its own: compiled recursion would need the type of its own result first.
    stack = [(np.arange(n), False)]
    local_index = np.full(n, -1, np.int64)
    n_ordered = 0
    while len(stack):
        vertices, is_separator = stack.pop()
        if vertices.size == 0:
            continue
        if is_separator or vertices.size <= leaf:
            if not is_separator and vertices.size > 2:
                sub_xadj, sub_adj, _, sub_weight = _subgraph(xadj, adj, weight, vertices, local_index)
                vertices = vertices[_minimum_degree(sub_xadj, sub_adj, sub_weight)]
            order[n_ordered:n_ordered + vertices.size] = vertices
            n_ordered += vertices.size
            continue
        sub_xadj, sub_adj, edge, sub_weight = _subgraph(xadj, adj, weight, vertices, local_index)
        part = _separate(sub_xadj, sub_adj, edge, sub_weight, places[vertices])
        # Last in, first out: both sides come before their separator.
        stack.append((vertices[part == SEPARATOR_PART], True))
        # A side that took everything would be cut in the same way without end: it is ordered as it is.
        stack.append((vertices[part == 1], (part == 0).sum() == 0))
        stack.append((vertices[part == 0], (part == 1).sum() == 0))
    return order


@njit(cache=True, nogil=True)
def _minimum_degree(xadj: IndexArray, adj: IndexArray, weight: IndexArray) -> IndexArray:
    """Return the vertices of a small graph in elimination order, lightest neighbourhood first; neighbours as bits."""
    n = xadj.size - 1
    # Sixty-four neighbours in one word: joining two neighbourhoods is one operation, not a walk through lists.
    words = (n + 63) // 64
    bits = np.zeros((n, words), np.uint64)
    unit = np.uint64(1)
    degree = np.zeros(n, np.int64)
    for v in range(n):
        for k in range(xadj[v], xadj[v + 1]):
            bits[v, adj[k] >> 6] |= unit << np.uint64(adj[k] & 63)
            degree[v] += weight[adj[k]]
    order, is_eliminated = np.empty(n, np.int64), np.zeros(n, np.bool_)
    for step in range(n):
        pivot = -1
        for v in range(n):
            if not is_eliminated[v] and (pivot < 0 or degree[v] < degree[pivot]):
                pivot = v
        order[step], is_eliminated[pivot] = pivot, True
        for u in range(n):
            if is_eliminated[u] or not (bits[pivot, u >> 6] >> np.uint64(u & 63)) & unit:
                continue
            for k in range(words):
                bits[u, k] |= bits[pivot, k]
            bits[u, u >> 6] &= ~(unit << np.uint64(u & 63))
            bits[u, pivot >> 6] &= ~(unit << np.uint64(pivot & 63))
            degree[u] = 0
            for w in range(n):
                if (bits[u, w >> 6] >> np.uint64(w & 63)) & unit:
                    degree[u] += weight[w]
    return order


@njit(cache=True, nogil=True)
def _subgraph(xadj: IndexArray, adj: IndexArray, weight: IndexArray, vertices: IndexArray, local_index: IndexArray
              ) -> tuple[IndexArray, IndexArray, IndexArray, IndexArray]:
    """Return pointers, neighbours, edge and vertex weights of a graph on some vertices; `local_index` is -1 before, after."""
    for i in range(vertices.size):
        local_index[vertices[i]] = i
    sub_xadj = np.zeros(vertices.size + 1, np.int64)
    total = 0
    for i in range(vertices.size):
        total += xadj[vertices[i] + 1] - xadj[vertices[i]]
    sub_adj = np.empty(total, np.int64)
    n_edges = 0
    for i in range(vertices.size):
        for k in range(xadj[vertices[i]], xadj[vertices[i] + 1]):
            if local_index[adj[k]] >= 0:
                sub_adj[n_edges] = local_index[adj[k]]
                n_edges += 1
        sub_xadj[i + 1] = n_edges
    for v in vertices:
        local_index[v] = -1
    return sub_xadj, sub_adj[:n_edges].copy(), np.ones(n_edges, np.int64), weight[vertices]


@njit(cache=True, nogil=True)
def _separate(xadj: IndexArray, adj: IndexArray, edge: IndexArray, weight: IndexArray, places: FloatArray) -> IndexArray:
    """Return the part of each vertex, side 0 or 1 or separator 2: the best of swept and multilevel cuts."""
    start = farthest(xadj, adj, 0)
    best = sweep(xadj, adj, weight, distances(xadj, adj, start))
    lowest_cost = cost_of(weight, best)
    for column in range(places.shape[1]):
        # The separator lies on the upper side of a height, so the same direction swept from its other end gives another
        # cut.
        for sign in (1.0, -1.0):
            part = sweep(xadj, adj, weight, sign * places[:, column])
            cost = cost_of(weight, part)
            if cost < lowest_cost:
                best, lowest_cost = part, cost
    refine(xadj, adj, weight, best, 4, MAX_SIDE_FRACTION)
    if xadj.size > _MIN_MULTILEVEL_SIZE:
        part = cut_by_levels(xadj, adj, edge, weight)
        if cost_of(weight, part) < cost_of(weight, best):
            return part
    return best

# Code of other modules in these kernels: b68441662b2a
