"""Cuts of a graph into two sides and a separator: swept along a function, and refined by moves of single vertices.

Source of the refinement: Fiduccia, Mattheyses, 19th Design Automation Conference (1982), with gains of vertices that leave a
separator. Compiled; imported only when a matrix is factorised.
"""

from __future__ import annotations

import heapq

import numpy as np
from numba import njit

SEPARATOR = 2
# The larger side may hold this share of the weight: a smaller separator is worth some imbalance.
SHARE = 0.56
_PATIENCE = 120


@njit(cache=True, nogil=True)
def sweep(xadj, adj, weight, height):
    """Return the cut at the height that leaves the lightest separator between even sides.

    The separator is what lies above and touches what lies below: a vertex is in it from when its lowest neighbour is passed
    until it is passed itself.
    """
    n = xadj.size - 1
    order = np.argsort(height)
    rank = np.empty(n, np.int64)
    rank[order] = np.arange(n)
    change = np.zeros(n + 1, np.int64)
    lowest = rank.copy()
    for v in range(n):
        for k in range(xadj[v], xadj[v + 1]):
            lowest[v] = min(lowest[v], rank[adj[k]])
        change[lowest[v] + 1] += weight[v]
        change[rank[v] + 1] -= weight[v]
    total, below, across = weight.sum(), 0, 0
    best, least = n // 2, np.inf
    for k in range(n):
        across += change[k]
        uneven = max(below, total - below - across) / max(total - across, 1)
        cost = across * (1 + 2 * (uneven - 0.5) ** 2) + (total if uneven > SHARE else 0)
        if cost < least and below > 0:
            best, least = k, cost
        below += weight[order[k]]
    part = np.ones(n, np.int64)
    for v in range(n):
        if rank[v] < best:
            part[v] = 0
        elif lowest[v] < best:
            part[v] = SEPARATOR
    return part


@njit(cache=True, nogil=True)
def put_separator(xadj, adj, part):
    """Put what of side 1 touches side 0 into the separator."""
    for v in range(part.size):
        if part[v] == 1:
            for k in range(xadj[v], xadj[v + 1]):
                if part[adj[k]] == 0:
                    part[v] = SEPARATOR
                    break


@njit(cache=True, nogil=True)
def cost_of(weight, part):
    """Return what a cut costs: the weight of its separator, more where the sides are uneven."""
    size = np.zeros(3)
    for v in range(part.size):
        size[part[v]] += weight[v]
    uneven = max(size[0], size[1]) / (size[0] + size[1])
    if min(size[0], size[1]) == 0:
        return 2 * size.sum()
    return size[2] * (1 + 2 * (uneven - 0.5) ** 2)


@njit(cache=True, nogil=True)
def farthest(xadj, adj, start):
    """Return a vertex of the most edges away from one."""
    return np.argmax(distances(xadj, adj, start))


@njit(cache=True, nogil=True)
def distances(xadj, adj, start):
    """Return the number of edges from a vertex, a little more than the most for those out of reach."""
    distance = np.full(xadj.size - 1, -1.0)
    queue = np.empty(xadj.size - 1, np.int64)
    queue[0], distance[start], head, tail = start, 0.0, 0, 1
    while head < tail:
        v = queue[head]
        head += 1
        for k in range(xadj[v], xadj[v + 1]):
            if distance[adj[k]] < 0:
                distance[adj[k]] = distance[v] + 1
                queue[tail] = adj[k]
                tail += 1
    distance[distance < 0] = distance.max() + 1
    return distance


@njit(cache=True, nogil=True)
def refine(xadj, adj, weight, part, passes, share):
    """Move vertices from the separator to a side, their neighbours of the other side into it, while that pays; in place."""
    n = xadj.size - 1
    outside = np.zeros((2, n), np.int64)
    size = np.zeros(3, np.int64)
    for v in range(n):
        size[part[v]] += weight[v]
        if part[v] == SEPARATOR:
            _weigh(xadj, adj, weight, part, v, outside)
    limit = max(np.int64(share * size.sum()), max(size[0], size[1]))
    locked = np.zeros(n, np.int64)
    for turn in range(1, passes + 1):
        if not _pass(xadj, adj, weight, part, outside, size, limit, locked, turn):
            break
        limit = max(np.int64(share * size.sum()), max(size[0], size[1]))


@njit(cache=True, nogil=True)
def _weigh(xadj, adj, weight, part, v, outside):
    outside[0, v] = outside[1, v] = 0
    for k in range(xadj[v], xadj[v + 1]):
        u = adj[k]
        if part[u] != SEPARATOR:
            outside[part[u], v] += weight[u]


@njit(cache=True, nogil=True)
def _pass(xadj, adj, weight, part, outside, size, limit, locked, turn):
    """One pass of moves with their best prefix kept; return whether the separator became lighter."""
    heaps = [[(np.int64(0), np.int64(0)) for _ in range(0)] for _ in range(2)]
    for v in range(part.size):
        if part[v] == SEPARATOR:
            for side in range(2):
                heaps[side].append((outside[1 - side, v] - weight[v], v))
    for side in range(2):
        heapq.heapify(heaps[side])
    log = [(np.int64(0), np.int64(0)) for _ in range(0)]  # vertices that changed their part, and the part that they left
    before, best, best_uneven, kept = size[2], size[2], abs(size[0] - size[1]), 0
    since = 0
    patience = min(_PATIENCE, 15 + part.size // 40)
    while since < patience:
        side, v = _next_move(heaps, weight, part, outside, size, limit, locked, turn)
        if v < 0:
            break
        _move(xadj, adj, weight, part, outside, size, v, side, heaps, locked, turn, log)
        since += 1
        uneven = abs(size[0] - size[1])
        if size[2] < best or (size[2] == best and uneven < best_uneven):
            best, best_uneven, kept, since = size[2], uneven, len(log), 0
    # Moves may make it worse for a while, to get out of a local minimum; those after the best state are undone.
    for i in range(len(log) - 1, kept - 1, -1):
        v, left = log[i]
        size[part[v]] -= weight[v]
        part[v] = left
        size[part[v]] += weight[v]
    for i in range(kept, len(log)):
        v, _ = log[i]
        _weigh(xadj, adj, weight, part, v, outside)
        for k in range(xadj[v], xadj[v + 1]):
            if part[adj[k]] == SEPARATOR:
                _weigh(xadj, adj, weight, part, adj[k], outside)
    return best < before


@njit(cache=True, nogil=True)
def _next_move(heaps, weight, part, outside, size, limit, locked, turn):
    """Return the side and vertex of the most gain that keeps the balance; -1 where there is none."""
    for side in range(2):
        heap = heaps[side]
        while len(heap) and (part[heap[0][1]] != SEPARATOR or locked[heap[0][1]] == turn
                             or heap[0][0] != outside[1 - side, heap[0][1]] - weight[heap[0][1]]):
            heapq.heappop(heap)
    side, v, loss = -1, np.int64(-1), np.int64(0)
    for s in range(2):
        if len(heaps[s]):
            cost, u = heaps[s][0]
            if size[s] + weight[u] > limit:
                continue
            if v < 0 or cost < loss or (cost == loss and size[s] < size[1 - s]):
                side, v, loss = s, u, cost
    if v >= 0:
        heapq.heappop(heaps[side])
    return side, v


@njit(cache=True, nogil=True)
def _move(xadj, adj, weight, part, outside, size, v, side, heaps, locked, turn, log):
    log.append((v, np.int64(SEPARATOR)))
    part[v], locked[v] = side, turn
    size[2] -= weight[v]
    size[side] += weight[v]
    for k in range(xadj[v], xadj[v + 1]):
        u = adj[k]
        if part[u] == SEPARATOR:
            outside[side, u] += weight[v]
            heapq.heappush(heaps[1 - side], (outside[side, u] - weight[u], u))
        elif part[u] == 1 - side:
            log.append((np.int64(u), np.int64(part[u])))
            part[u] = SEPARATOR
            size[1 - side] -= weight[u]
            size[2] += weight[u]
            _weigh(xadj, adj, weight, part, u, outside)
            for s in range(2):
                heapq.heappush(heaps[s], (outside[1 - s, u] - weight[u], u))
            for j in range(xadj[u], xadj[u + 1]):
                w = adj[j]
                if part[w] == SEPARATOR and w != u:
                    outside[1 - side, w] -= weight[u]
                    heapq.heappush(heaps[side], (outside[1 - side, w] - weight[w], w))
