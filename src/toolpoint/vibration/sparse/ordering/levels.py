"""Multilevel cuts: a graph is coarsened by matching heavy edges, cut where it is small, and refined level by level.

Source: Karypis, Kumar, SIAM J. Sci. Comput. 20 (1998). Compiled; imported only when a matrix is factorised.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from toolpoint._check import FloatArray, IndexArray
from toolpoint.vibration.sparse.ordering.cuts import (
    MAX_SIDE_FRACTION,
    VertexNumber,
    cost_of,
    distances,
    farthest,
    mark_separator,
    refine,
    sweep,
)

_MAX_COARSE_SIZE = 120  # vertices of a graph that is small enough for several first cuts
_FIRST_CUT_COUNT = 8
_MAX_COARSE_SIDE_FRACTION = 0.51  # of the weight: coarse cuts stay more even than the last, which must have room to improve


@njit(cache=True, nogil=True)
def cut_by_levels(xadj: IndexArray, adj: IndexArray, edge: IndexArray, weight: IndexArray) -> IndexArray:
    """Return a cut that was made on the coarsest graph and refined on every finer one, (n,) parts 0, 1, 2."""
    levels = [(xadj, adj, edge, weight)]
    maps: list[IndexArray] = [np.empty(0, np.int64)]
    while levels[-1][0].size - 1 > _MAX_COARSE_SIZE:
        xadj, adj, edge, weight = levels[-1]
        coarse, count = _matching(xadj, adj, edge, weight)
        # Hardly any edge was left to match: further levels would cost time and keep the graph as it is.
        if count > 0.93 * (xadj.size - 1):
            break
        levels.append(_contract(xadj, adj, edge, weight, coarse, count))
        maps.append(coarse)
    xadj, adj, edge, weight = levels[-1]
    part = _first_cut(xadj, adj, edge, weight, _FIRST_CUT_COUNT)
    for level in range(len(levels) - 2, -1, -1):
        part = part[maps[level + 1]]
        xadj, adj, edge, weight = levels[level]
        refine(xadj, adj, weight, part, 4, MAX_SIDE_FRACTION if level == 0 else _MAX_COARSE_SIDE_FRACTION)
    return part


@njit(cache=True, nogil=True)
def _matching(xadj: IndexArray, adj: IndexArray, edge: IndexArray, weight: IndexArray) -> tuple[IndexArray, int]:
    """Pair each vertex with the neighbour of its heaviest edge, light vertices first; return the coarse vertex of each."""
    n = xadj.size - 1
    coarse = np.full(n, -1, np.int64)
    limit = max(3 * weight.sum() // (2 * _MAX_COARSE_SIZE), 2 * weight.max() if n > 4 * _MAX_COARSE_SIZE else 0)
    degree = xadj[1:] - xadj[:-1]
    seed, count = np.uint64(12345), 0
    keys = np.empty(n, np.int64)
    for i in range(n):
        seed = seed * np.uint64(6364136223846793005) + np.uint64(1442695040888963407)
        keys[i] = min(degree[i], 1000) * 1024 + np.int64(seed >> np.uint64(54))
    for v in np.argsort(keys):
        if coarse[v] >= 0:
            continue
        best, heaviest = -1, -1
        for k in range(xadj[v], xadj[v + 1]):
            u = adj[k]
            if coarse[u] < 0 and edge[k] > heaviest and weight[u] + weight[v] <= limit:
                best, heaviest = u, edge[k]
        coarse[v] = count
        if best >= 0:
            coarse[best] = count
        count += 1
    return coarse, count


@njit(cache=True, nogil=True)
def _contract(xadj: IndexArray, adj: IndexArray, edge: IndexArray, weight: IndexArray, coarse: IndexArray, count: int
              ) -> tuple[IndexArray, IndexArray, IndexArray, IndexArray]:
    """Return pointers, neighbours, edge weights and vertex weights of the coarse graph: edges between the same pair add up."""
    n = xadj.size - 1
    members = np.full((count, 2), -1, np.int64)
    coarse_weight = np.zeros(count, np.int64)
    for v in range(n):
        c = coarse[v]
        members[c, 0 if members[c, 0] < 0 else 1] = v
        coarse_weight[c] += weight[v]
    new_xadj, new_adj, new_edge = np.zeros(count + 1, np.int64), np.empty(adj.size, np.int64), np.empty(adj.size, np.int64)
    slot = np.full(count, -1, np.int64)
    n_edges = 0
    for c in range(count):
        row_start = n_edges
        for v in members[c]:
            if v < 0:
                continue
            for k in range(xadj[v], xadj[v + 1]):
                u = coarse[adj[k]]
                if u == c:
                    continue
                if slot[u] < row_start:
                    slot[u] = n_edges
                    new_adj[n_edges], new_edge[n_edges] = u, 0
                    n_edges += 1
                new_edge[slot[u]] += edge[k]
        new_xadj[c + 1] = n_edges
    return new_xadj, new_adj[:n_edges].copy(), new_edge[:n_edges].copy(), coarse_weight


@njit(cache=True, nogil=True)
def _first_cut(xadj: IndexArray, adj: IndexArray, edge: IndexArray, weight: IndexArray, trials: int) -> IndexArray:
    """Cut across the slowest vibration of the graph, and grow sides from some vertices; refine each, keep the best."""
    n = xadj.size - 1
    start = farthest(xadj, adj, 0)
    best: IndexArray = np.zeros(n, np.int64)
    lowest_cost = np.inf
    for trial in range(trials):
        if trial == 0:
            part = sweep(xadj, adj, weight, _slowest_vector(xadj, adj, edge, weight, start))
        else:
            part = _grow_side(xadj, adj, weight, start)
            start = (start + 1 + n // trials) % n
        refine(xadj, adj, weight, part, 4, _MAX_COARSE_SIDE_FRACTION)
        cost = cost_of(weight, part)
        if cost < lowest_cost:
            best, lowest_cost = part, cost
    return best


@njit(cache=True, nogil=True)
def _slowest_vector(xadj: IndexArray, adj: IndexArray, edge: IndexArray, weight: IndexArray, start: VertexNumber) -> FloatArray:
    """Return roughly the second vector of the weighted Laplacian, by damped iteration from the distance to a vertex."""
    n = xadj.size - 1
    x = distances(xadj, adj, start)
    y = np.empty(n)
    degree = np.zeros(n)
    for v in range(n):
        for k in range(xadj[v], xadj[v + 1]):
            degree[v] += edge[k]
    # A rough vector will do: the cut is refined vertex by vertex anyhow, and coarse graphs have about a hundred vertices.
    for _ in range(60):
        mean = (x * degree).sum() / max(degree.sum(), 1.0)
        x -= mean
        x /= np.abs(x).max() + 1e-300
        for v in range(n):
            total = 0.0
            for k in range(xadj[v], xadj[v + 1]):
                total += edge[k] * x[adj[k]]
            # Half of the old value: without it the vector of the fastest vibration, of alternating sign, would not decay.
            y[v] = 0.5 * (x[v] + (total / degree[v] if degree[v] > 0 else x[v]))
        x, y = y, x
    return x


@njit(cache=True, nogil=True)
def _grow_side(xadj: IndexArray, adj: IndexArray, weight: IndexArray, start: VertexNumber) -> IndexArray:
    """Return side 0 grown from a vertex to half of the weight, with the separator along it; separate pieces join as needed."""
    n = xadj.size - 1
    part, queue = np.ones(n, np.int64), np.empty(n, np.int64)
    head, tail, side_weight, half_weight = 0, 0, 0, weight.sum() / 2
    is_queued = np.zeros(n, np.bool_)
    candidate = 0
    queue[0], is_queued[start], tail = start, True, 1
    while side_weight + weight[queue[head]] / 2 < half_weight:
        v = queue[head]
        head += 1
        part[v] = 0
        side_weight += weight[v]
        for k in range(xadj[v], xadj[v + 1]):
            if not is_queued[adj[k]]:
                is_queued[adj[k]] = True
                queue[tail] = adj[k]
                tail += 1
        while head == tail and candidate < n:
            if not is_queued[candidate]:
                is_queued[candidate] = True
                queue[tail] = candidate
                tail += 1
            candidate += 1
        if head == tail:
            break
    mark_separator(xadj, adj, part)
    return part

# Code of other modules in these kernels: 631cff1b0013
