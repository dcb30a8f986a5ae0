"""Multilevel cuts: a graph is coarsened by matching heavy edges, cut where it is small, and the cut improved on the way back.

Source: Karypis, Kumar, SIAM J. Sci. Comput. 20 (1998). Compiled; imported only when a matrix is factorised.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from toolpoint.vibration.sparse.ordering.cuts import SHARE, cost_of, distances, farthest, put_separator, refine, sweep

# A coarse graph of this size is small enough for several first cuts.
_COARSE = 120
_TRIALS = 8
# Coarse cuts stay more even than the last: they must leave room.
_EVEN = 0.51


@njit(cache=True, nogil=True)
def cut_by_levels(xadj, adj, edge, weight):
    """Return a cut found on coarser graphs and carried back."""
    levels = [(xadj, adj, edge, weight)]
    maps = [np.empty(0, np.int64)]
    while levels[-1][0].size - 1 > _COARSE:
        xadj, adj, edge, weight = levels[-1]
        coarse, count = _matching(xadj, adj, edge, weight)
        if count > 0.93 * (xadj.size - 1):
            break
        levels.append(_contracted(xadj, adj, edge, weight, coarse, count))
        maps.append(coarse)
    xadj, adj, edge, weight = levels[-1]
    part = _first_cut(xadj, adj, edge, weight, _TRIALS)
    for level in range(len(levels) - 2, -1, -1):
        part = part[maps[level + 1]]
        xadj, adj, edge, weight = levels[level]
        refine(xadj, adj, weight, part, 4, SHARE if level == 0 else _EVEN)
    return part


@njit(cache=True, nogil=True)
def _matching(xadj, adj, edge, weight):
    """Pair each vertex with the neighbour of its heaviest edge, light vertices first; return the coarse vertex of each."""
    n = xadj.size - 1
    coarse = np.full(n, -1, np.int64)
    limit = max(3 * weight.sum() // (2 * _COARSE), 2 * weight.max() if n > 4 * _COARSE else 0)
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
def _contracted(xadj, adj, edge, weight, coarse, count):
    n = xadj.size - 1
    members = np.full((count, 2), -1, np.int64)
    heavy = np.zeros(count, np.int64)
    for v in range(n):
        c = coarse[v]
        members[c, 0 if members[c, 0] < 0 else 1] = v
        heavy[c] += weight[v]
    new_xadj, new, new_edge = np.zeros(count + 1, np.int64), np.empty(adj.size, np.int64), np.empty(adj.size, np.int64)
    place = np.full(count, -1, np.int64)
    at = 0
    for c in range(count):
        first = at
        for v in members[c]:
            if v < 0:
                continue
            for k in range(xadj[v], xadj[v + 1]):
                u = coarse[adj[k]]
                if u == c:
                    continue
                if place[u] < first:
                    place[u] = at
                    new[at], new_edge[at] = u, 0
                    at += 1
                new_edge[place[u]] += edge[k]
        new_xadj[c + 1] = at
    return new_xadj, new[:at].copy(), new_edge[:at].copy(), heavy


@njit(cache=True, nogil=True)
def _first_cut(xadj, adj, edge, weight, trials):
    """Cut across the slowest vibration of the graph, and grow sides from some vertices; refine each, keep the best."""
    n = xadj.size - 1
    start = farthest(xadj, adj, 0)
    best, least = np.zeros(n, np.int64), np.inf
    for trial in range(trials):
        if trial == 0:
            part = sweep(xadj, adj, weight, _slowest(xadj, adj, edge, weight, start))
        else:
            part = _grown(xadj, adj, weight, start)
            start = (start + 1 + n // trials) % n
        refine(xadj, adj, weight, part, 4, _EVEN)
        cost = cost_of(weight, part)
        if cost < least:
            best, least = part, cost
    return best


@njit(cache=True, nogil=True)
def _slowest(xadj, adj, edge, weight, start):
    """Return roughly the second vector of the weighted Laplacian, by damped iteration from the distance to a vertex."""
    n = xadj.size - 1
    x = distances(xadj, adj, start)
    y = np.empty(n)
    degree = np.zeros(n)
    for v in range(n):
        for k in range(xadj[v], xadj[v + 1]):
            degree[v] += edge[k]
    for _ in range(60):
        mean = (x * degree).sum() / max(degree.sum(), 1.0)
        x -= mean
        x /= np.abs(x).max() + 1e-300
        for v in range(n):
            total = 0.0
            for k in range(xadj[v], xadj[v + 1]):
                total += edge[k] * x[adj[k]]
            y[v] = 0.5 * (x[v] + (total / degree[v] if degree[v] > 0 else x[v]))
        x, y = y, x
    return x


@njit(cache=True, nogil=True)
def _grown(xadj, adj, weight, start):
    """Return side 0 grown from a vertex to half of the weight, its border as the separator; other pieces join as needed."""
    n = xadj.size - 1
    part, queue = np.ones(n, np.int64), np.empty(n, np.int64)
    head, tail, held, half = 0, 0, 0, weight.sum() / 2
    seen = np.zeros(n, np.bool_)
    following = 0
    queue[0], seen[start], tail = start, True, 1
    while held + weight[queue[head]] / 2 < half:
        v = queue[head]
        head += 1
        part[v] = 0
        held += weight[v]
        for k in range(xadj[v], xadj[v + 1]):
            if not seen[adj[k]]:
                seen[adj[k]] = True
                queue[tail] = adj[k]
                tail += 1
        while head == tail and following < n:
            if not seen[following]:
                seen[following] = True
                queue[tail] = following
                tail += 1
            following += 1
        if head == tail:
            break
    put_separator(xadj, adj, part)
    return part
