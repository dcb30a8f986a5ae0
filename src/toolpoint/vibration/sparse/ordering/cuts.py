"""Cuts of a graph into two sides and a separator: swept along a function, and refined by moves of single vertices.

Source of the refinement: Fiduccia, Mattheyses, 19th Design Automation Conference (1982), with gains of vertices that leave a
separator. Compiled; imported only when a matrix is factorised.
"""

from __future__ import annotations

import heapq
from typing import Any

import numpy as np
from numba import njit

from toolpoint._check import FloatArray, IndexArray

SEPARATOR_PART = 2  # number of the separator beside the sides 0 and 1
MAX_SIDE_FRACTION = 0.56  # of the weight, of the larger side: a smaller separator is worth some imbalance
_MAX_FUTILE_MOVES = 120  # since the best state of a pass

VertexNumber = int | np.integer[Any]
NumberPair = tuple[VertexNumber, VertexNumber]  # cost and vertex of a move, or vertex and the part that it left


@njit(cache=True, nogil=True)
def sweep(xadj: IndexArray, adj: IndexArray, weight: IndexArray, height: FloatArray) -> IndexArray:
    """Return the cut at the height that leaves the lightest separator between even sides, (n,) parts 0, 1, 2.

    xadj (n + 1,), adj : pointers and neighbours of the vertices, int; weight (n,) int; height (n,) float64. A vertex is in the
    separator from the height of its lowest neighbour up to its own.
    """
    n = xadj.size - 1
    order = np.argsort(height)
    rank = np.empty(n, np.int64)
    rank[order] = np.arange(n)
    weight_change = np.zeros(n + 1, np.int64)
    lowest = rank.copy()
    for v in range(n):
        for k in range(xadj[v], xadj[v + 1]):
            lowest[v] = min(lowest[v], rank[adj[k]])
        weight_change[lowest[v] + 1] += weight[v]
        weight_change[rank[v] + 1] -= weight[v]
    total, below, separator_weight = weight.sum(), 0, 0
    best_height, lowest_cost = n // 2, np.inf
    for k in range(n):
        separator_weight += weight_change[k]
        imbalance = max(below, total - below - separator_weight) / max(total - separator_weight, 1)
        # Uneven sides cost later what a light separator saves now: the larger side is cut again, and its factor fills.
        cost = separator_weight * (1 + 2 * (imbalance - 0.5) ** 2) + (total if imbalance > MAX_SIDE_FRACTION else 0)
        if cost < lowest_cost and below > 0:
            best_height, lowest_cost = k, cost
        below += weight[order[k]]
    part = np.ones(n, np.int64)
    for v in range(n):
        if rank[v] < best_height:
            part[v] = 0
        elif lowest[v] < best_height:
            part[v] = SEPARATOR_PART
    return part


@njit(cache=True, nogil=True)
def mark_separator(xadj: IndexArray, adj: IndexArray, part: IndexArray) -> None:
    """Move the vertices of side 1 adjacent to side 0 into the separator."""
    for v in range(part.size):
        if part[v] == 1:
            for k in range(xadj[v], xadj[v + 1]):
                if part[adj[k]] == 0:
                    part[v] = SEPARATOR_PART
                    break


@njit(cache=True, nogil=True)
def cost_of(weight: IndexArray, part: IndexArray) -> float:
    """Return the cost of a cut: the weight of its separator, increased where the sides are uneven."""
    size = np.zeros(3)
    for v in range(part.size):
        size[part[v]] += weight[v]
    imbalance = max(size[0], size[1]) / (size[0] + size[1])
    # No cut at all: dearer than any.
    if min(size[0], size[1]) == 0:
        return 2 * size.sum()
    return size[2] * (1 + 2 * (imbalance - 0.5) ** 2)


@njit(cache=True, nogil=True)
def farthest(xadj: IndexArray, adj: IndexArray, start: VertexNumber) -> VertexNumber:
    """Return a vertex at the largest number of edges from `start`."""
    return np.argmax(distances(xadj, adj, start))


@njit(cache=True, nogil=True)
def distances(xadj: IndexArray, adj: IndexArray, start: VertexNumber) -> FloatArray:
    """Return the number of edges from a vertex to each, (n,) float64; one more than the largest for vertices out of reach."""
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
def refine(xadj: IndexArray, adj: IndexArray, weight: IndexArray, part: IndexArray, passes: int, share: float) -> None:
    """Move separator vertices to a side, and their neighbours across into the separator, while it gets lighter; in place."""
    n = xadj.size - 1
    outside = np.zeros((2, n), np.int64)
    size = np.zeros(3, np.int64)
    for v in range(n):
        size[part[v]] += weight[v]
        if part[v] == SEPARATOR_PART:
            _weigh_neighbours(xadj, adj, weight, part, v, outside)
    # A cut that begins uneven may stay so, else no move at all would be allowed.
    limit = max(np.int64(share * size.sum()), max(size[0], size[1]))
    locked = np.zeros(n, np.int64)
    for pass_number in range(1, passes + 1):
        if not _pass(xadj, adj, weight, part, outside, size, limit, locked, pass_number):
            break
        limit = max(np.int64(share * size.sum()), max(size[0], size[1]))


@njit(cache=True, nogil=True)
def _weigh_neighbours(xadj: IndexArray, adj: IndexArray, weight: IndexArray, part: IndexArray, v: VertexNumber,
                      outside: IndexArray
                      ) -> None:
    """Set the weight of a separator vertex's neighbours on either side."""
    outside[0, v] = outside[1, v] = 0
    for k in range(xadj[v], xadj[v + 1]):
        u = adj[k]
        if part[u] != SEPARATOR_PART:
            outside[part[u], v] += weight[u]


@njit(cache=True, nogil=True)
def _pass(xadj: IndexArray, adj: IndexArray, weight: IndexArray, part: IndexArray, outside: IndexArray, size: IndexArray,
          limit: float, locked: IndexArray, pass_number: int) -> bool:
    """One pass of moves with their best prefix kept; return whether the separator became lighter."""
    v: VertexNumber
    side: VertexNumber
    heaps: list[list[NumberPair]] = [[(np.int64(0), np.int64(0)) for _ in range(0)] for _ in range(2)]
    for v in range(part.size):
        if part[v] == SEPARATOR_PART:
            for side in range(2):
                heaps[side].append((outside[1 - side, v] - weight[v], v))
    for side in range(2):
        heapq.heapify(heaps[side])
    # Vertices that changed their part, and the part that they left.
    log: list[NumberPair] = [(np.int64(0), np.int64(0)) for _ in range(0)]
    initial_weight, best_weight, best_imbalance, best_length = size[2], size[2], abs(size[0] - size[1]), 0
    futile_moves = 0
    max_futile_moves = min(_MAX_FUTILE_MOVES, 15 + part.size // 40)
    while futile_moves < max_futile_moves:
        side, v = _next_move(heaps, weight, part, outside, size, limit, locked, pass_number)
        if v < 0:
            break
        _move(xadj, adj, weight, part, outside, size, v, side, heaps, locked, pass_number, log)
        futile_moves += 1
        imbalance = abs(size[0] - size[1])
        if size[2] < best_weight or (size[2] == best_weight and imbalance < best_imbalance):
            best_weight, best_imbalance, best_length, futile_moves = size[2], imbalance, len(log), 0
    # Moves may make it worse for a while, to get out of a local minimum; those after the best state are undone.
    for i in range(len(log) - 1, best_length - 1, -1):
        v, old_part = log[i]
        size[part[v]] -= weight[v]
        part[v] = old_part
        size[part[v]] += weight[v]
    for i in range(best_length, len(log)):
        v, _ = log[i]
        _weigh_neighbours(xadj, adj, weight, part, v, outside)
        for k in range(xadj[v], xadj[v + 1]):
            if part[adj[k]] == SEPARATOR_PART:
                _weigh_neighbours(xadj, adj, weight, part, adj[k], outside)
    return best_weight < initial_weight


@njit(cache=True, nogil=True)
def _next_move(heaps: list[list[NumberPair]], weight: IndexArray, part: IndexArray, outside: IndexArray, size: IndexArray,
               limit: float,
               locked: IndexArray, pass_number: int) -> NumberPair:
    """Return the side and vertex of the most gain that keeps the balance; -1 where there is none."""
    for side in range(2):
        heap = heaps[side]
        # Gains change with every move; entries that are out of date are not looked for in the heap but dropped when they
        # come up.
        while len(heap) and (part[heap[0][1]] != SEPARATOR_PART or locked[heap[0][1]] == pass_number
                             or heap[0][0] != outside[1 - side, heap[0][1]] - weight[heap[0][1]]):
            heapq.heappop(heap)
    v: VertexNumber
    loss: VertexNumber
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
def _move(xadj: IndexArray, adj: IndexArray, weight: IndexArray, part: IndexArray, outside: IndexArray, size: IndexArray,
          v: VertexNumber, side: VertexNumber, heaps: list[list[NumberPair]], locked: IndexArray, pass_number: int,
          log: list[NumberPair]) -> None:
    """Move a separator vertex to a side, and its neighbours across into the separator; gains that change are pushed anew."""
    log.append((v, np.int64(SEPARATOR_PART)))
    part[v], locked[v] = side, pass_number
    size[2] -= weight[v]
    size[side] += weight[v]
    for k in range(xadj[v], xadj[v + 1]):
        u = adj[k]
        if part[u] == SEPARATOR_PART:
            outside[side, u] += weight[v]
            heapq.heappush(heaps[1 - side], (outside[side, u] - weight[u], u))
        elif part[u] == 1 - side:
            log.append((np.int64(u), np.int64(part[u])))
            part[u] = SEPARATOR_PART
            size[1 - side] -= weight[u]
            size[2] += weight[u]
            _weigh_neighbours(xadj, adj, weight, part, u, outside)
            for s in range(2):
                heapq.heappush(heaps[s], (outside[1 - s, u] - weight[u], u))
            for j in range(xadj[u], xadj[u + 1]):
                w = adj[j]
                if part[w] == SEPARATOR_PART and w != u:
                    outside[1 - side, w] -= weight[u]
                    heapq.heappush(heaps[side], (outside[1 - side, w] - weight[w], w))
