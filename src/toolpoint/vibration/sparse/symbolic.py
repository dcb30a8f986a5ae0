"""Layout of a factorisation, found before any number is computed: groups of columns with one pattern, and their rows.

Sources: Liu, SIAM J. Matrix Anal. Appl. 11 (1990) (elimination tree, postorder); Ashcraft, Grimes, ACM Trans. Math. Softw. 15
(1989) (columns joined at the price of some zeros). Compiled; works on vertices of weight (rows that share a pattern).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from toolpoint._check import FloatArray, IndexArray


@njit(cache=True, nogil=True)
def quotient(indptr: IndexArray, indices: IndexArray, group: IndexArray, count: int
             ) -> tuple[IndexArray, IndexArray, IndexArray]:
    """Return pointers and neighbours (no loops) of the graph of groups of rows, and the number of rows in each; int64."""
    weight = np.zeros(count, np.int64)
    for row in range(group.size):
        weight[group[row]] += 1
    first = np.zeros(count + 1, np.int64)
    for row in range(group.size):
        first[group[row] + 1] += 1
    first = np.cumsum(first)
    members, next_member = np.empty(group.size, np.int64), first[:-1].copy()
    for row in range(group.size):
        members[next_member[group[row]]] = row
        next_member[group[row]] += 1
    xadj, mark = np.zeros(count + 1, np.int64), np.full(count, -1, np.int64)
    adj = np.empty(0, np.int64)
    # Twice over the same loop: first the number of neighbours, then their list, as memory grows by no guess.
    for fill in range(2):
        total = 0
        mark[:] = -1
        for g in range(count):
            mark[g] = g
            for m in range(first[g], first[g + 1]):
                for k in range(indptr[members[m]], indptr[members[m] + 1]):
                    u = group[indices[k]]
                    if mark[u] != g:
                        mark[u] = g
                        if fill:
                            adj[total] = u
                        total += 1
            xadj[g + 1] = total
        if not fill:
            adj = np.empty(total, np.int64)
    return xadj, adj, weight


@njit(cache=True, nogil=True)
def twins(xadj: IndexArray, adj: IndexArray, keys: IndexArray) -> tuple[IndexArray, int]:
    """Return a number for each vertex, the same for vertices with the same closed neighbourhood, by sums of random keys."""
    n = xadj.size - 1
    total = keys.copy()
    for v in range(n):
        for k in range(xadj[v], xadj[v + 1]):
            total[v] += keys[adj[k]]
    order = np.argsort(total)
    group = np.empty(n, np.int64)
    count = -1
    for i in range(n):
        v = order[i]
        if i == 0 or total[v] != total[order[i - 1]] or xadj[v + 1] - xadj[v] != xadj[order[i - 1] + 1] - xadj[order[i - 1]]:
            count += 1
        group[v] = count
    return group, count + 1


@njit(cache=True, nogil=True)
def elimination_tree(xadj: IndexArray, adj: IndexArray, order: IndexArray) -> IndexArray:
    """Return the parent of each place in the order, -1 for roots."""
    n = order.size
    place = np.empty(n, np.int64)
    place[order] = np.arange(n)
    parent, ancestor = np.full(n, -1, np.int64), np.full(n, -1, np.int64)
    for j in range(n):
        for k in range(xadj[order[j]], xadj[order[j] + 1]):
            i = place[adj[k]]
            # Paths are compressed on the way: `ancestor` leads straight to the last root, so that a long chain is walked once
            # (Liu).
            while i < j and i >= 0:
                following = ancestor[i]
                ancestor[i] = j
                if following < 0:
                    parent[i] = j
                    break
                if following == j:
                    break
                i = following
    return parent


@njit(cache=True, nogil=True)
def column_weights(xadj: IndexArray, adj: IndexArray, order: IndexArray, parent: IndexArray, weight: IndexArray) -> IndexArray:
    """Return the rows of each column of L on and below the diagonal, in weight, by walking every row's subtree."""
    n = order.size
    place = np.empty(n, np.int64)
    place[order] = np.arange(n)
    rows, mark = weight[order].copy(), np.full(n, -1, np.int64)
    for i in range(n):
        mark[i] = i
        for k in range(xadj[order[i]], xadj[order[i] + 1]):
            j = place[adj[k]]
            while 0 <= j < i and mark[j] != i:
                rows[j] += weight[order[i]]
                mark[j] = i
                j = parent[j]
    return rows


@njit(cache=True, nogil=True)
def postorder(parent: IndexArray, size: IndexArray) -> IndexArray:
    """Return the places of a forest children first, the child of the largest size last before its parent."""
    n = parent.size
    head, following = np.full(n, -1, np.int64), np.full(n, -1, np.int64)
    roots = -1
    # Inserted from the largest to the smallest, so that the list of children begins with the smallest.
    for v in np.argsort(-size):
        if parent[v] < 0:
            following[v] = roots
            roots = v
        else:
            following[v] = head[parent[v]]
            head[parent[v]] = v
    order, stack = np.empty(n, np.int64), np.empty(n, np.int64)
    n_ordered = 0
    while roots >= 0:
        stack[0], depth = roots, 1
        roots = following[roots]
        while depth:
            v = stack[depth - 1]
            if head[v] >= 0:
                stack[depth] = head[v]
                head[v] = following[head[v]]
                depth += 1
            else:
                depth -= 1
                order[n_ordered] = v
                n_ordered += 1
    return order


@njit(cache=True, nogil=True)
def supernodes(parent: IndexArray, rows: IndexArray, weight: IndexArray) -> IndexArray:
    """Return the first column of each group of columns that are factorised together, and n at the end.

    Columns join where their patterns nest; a group joins its parent's that follows it where few zeros come in.
    """
    n = parent.size
    starts = [0]
    for j in range(1, n):
        if not (parent[j - 1] == j and rows[j - 1] - weight[j - 1] == rows[j]):
            starts.append(j)
    # Groups waiting to be joined, as stacks of first column, last column, width, zeros.
    first, last, widths, zero_counts = [0], [0], [0], [0.0]
    # A list must hold something once, so that the compiler knows its type.
    first.pop(), last.pop(), widths.pop(), zero_counts.pop()
    for i in range(len(starts)):
        a = starts[i]
        b = starts[i + 1] if i + 1 < len(starts) else n
        width, zeros = weight[a:b].sum(), 0.0
        while len(first) and parent[last[-1]] >= a and parent[last[-1]] < b:
            # `a` moves down as groups join: only the group that ends just before it can join next.
            height = rows[first[-1]]
            joined = widths[-1] + width
            new_zeros = widths[-1] * float(joined + rows[b - 1] - weight[b - 1] - height)
            all_zeros = zeros + zero_counts[-1] + new_zeros
            zero_fraction = all_zeros / (joined * (joined / 2.0 + rows[b - 1] - weight[b - 1]))
            # Dense columns of a group go through BLAS, which pays for zeros: narrow groups may take any, wide ones ever
            # fewer.
            if not (joined <= 24 or (joined <= 64 and zero_fraction < 0.5) or (joined <= 160 and zero_fraction < 0.15)
                    or zero_fraction < 0.06):
                break
            a, width, zeros = first.pop(), joined, all_zeros
            last.pop(), widths.pop(), zero_counts.pop()
        first.append(a)
        last.append(b - 1)
        widths.append(width)
        zero_counts.append(zeros)
    return np.array([*first, n])


@njit(cache=True, nogil=True)
def structure(xadj: IndexArray, adj: IndexArray, order: IndexArray, starts: IndexArray
              ) -> tuple[IndexArray, IndexArray, IndexArray]:
    """Return pointers and the vertices (by place) below each group of columns, ascending, and the parent of each group."""
    n, count = order.size, starts.size - 1
    place, group = np.empty(n, np.int64), np.empty(n, np.int64)
    place[order] = np.arange(n)
    for s in range(count):
        group[starts[s]:starts[s + 1]] = s
    head, following = np.full(count, -1, np.int64), np.full(count, -1, np.int64)
    parent, mark = np.full(count, -1, np.int64), np.full(n, -1, np.int64)
    pointers, rows, total = np.zeros(count + 1, np.int64), np.empty(16 * n + 64, np.int64), 0
    for s in range(count):
        # Below a group: what its columns touch, and what its children had below them (their fill). `mark` keeps each once.
        begin = total
        if total + n > rows.size:
            rows = np.concatenate((rows, np.empty(max(rows.size // 2, 2 * n), np.int64)))
        for column in range(starts[s], starts[s + 1]):
            for k in range(xadj[order[column]], xadj[order[column] + 1]):
                i = place[adj[k]]
                if i >= starts[s + 1] and mark[i] != s:
                    mark[i] = s
                    rows[total] = i
                    total += 1
        child = head[s]
        while child >= 0:
            for k in range(pointers[child], pointers[child + 1]):
                i = rows[k]
                if i >= starts[s + 1] and mark[i] != s:
                    mark[i] = s
                    rows[total] = i
                    total += 1
            child = following[child]
        # Sorted: a front takes its children's rows in order, and the first one below names the parent.
        rows[begin:total] = np.sort(rows[begin:total])
        pointers[s + 1] = total
        if total > begin:  # the first row below is eliminated next: its group takes this one's update
            parent[s] = group[rows[begin]]
            following[s] = head[parent[s]]
            head[parent[s]] = s
    return pointers, rows[:total].copy(), parent


@njit(cache=True, nogil=True)
def expand_rows(pointers: IndexArray, rows: IndexArray, order: IndexArray, weight: IndexArray, starts: IndexArray
                ) -> tuple[IndexArray, IndexArray, IndexArray]:
    """Return structure in single rows: first row of each group, pointers and rows below each group."""
    n, count = order.size, starts.size - 1
    first = np.zeros(n + 1, np.int64)
    for j in range(n):
        first[j + 1] = first[j] + weight[order[j]]
    begins, new_pointers = np.empty(count + 1, np.int64), np.zeros(count + 1, np.int64)
    for s in range(count + 1):
        begins[s] = first[starts[s]]
    for s in range(count):
        size = 0
        for k in range(pointers[s], pointers[s + 1]):
            size += first[rows[k] + 1] - first[rows[k]]
        new_pointers[s + 1] = new_pointers[s] + size
    new_rows = np.empty(new_pointers[-1], np.int32)
    n_rows = 0
    for k in range(rows.size):
        for row in range(first[rows[k]], first[rows[k] + 1]):
            new_rows[n_rows] = row
            n_rows += 1
    return begins, new_pointers, new_rows


@njit(cache=True, nogil=True)
def room_needed(begins: IndexArray, pointers: IndexArray, parent: IndexArray) -> tuple[int, int, int]:
    """Return the largest size of the stack (lower triangles of waiting contributions), and those of a front's columns and
    contribution.
    """
    waiting, largest_stack, columns, square = 0, 0, 0, 0
    pending = np.zeros(parent.size, np.int64)
    for s in range(parent.size):
        width, below = begins[s + 1] - begins[s], pointers[s + 1] - pointers[s]
        columns, square = max(columns, width * (width + below)), max(square, below * below)
        waiting -= pending[s]
        if parent[s] >= 0:
            triangle = below * (below + 1) // 2
            waiting += triangle
            pending[parent[s]] += triangle
        largest_stack = max(largest_stack, waiting)
    return largest_stack, columns, square


@njit(cache=True, nogil=True)
def factor_starts(begins: IndexArray, pointers: IndexArray, block: int) -> IndexArray:
    """Return where each group's columns start in the factor, and its size: blocks of columns, each from its diagonal down."""
    starts = np.zeros(begins.size, np.int64)
    for s in range(begins.size - 1):
        width = begins[s + 1] - begins[s]
        front = width + pointers[s + 1] - pointers[s]
        starts[s + 1] = starts[s]
        for a in range(0, width, block):
            starts[s + 1] += (min(a + block, width) - a) * (front - a)
    return starts


@njit(cache=True, nogil=True)
def asymmetry(indptr: IndexArray, indices: IndexArray, data: FloatArray) -> float:
    """Return the largest difference between entries and their mirror images; columns sorted, without repeated entries.

    Columns are walked in order; the next entry of every column that waits for its mirror image stands in `waiting`.
    """
    n, largest = indptr.size - 1, 0.0
    waiting = indptr[:-1].copy()
    for j in range(n):
        while waiting[j] < indptr[j + 1] and indices[waiting[j]] < j:  # above the diagonal and not met from below
            largest = max(largest, abs(data[waiting[j]]))
            waiting[j] += 1
        for k in range(indptr[j], indptr[j + 1]):
            i = indices[k]
            if i <= j:
                continue
            while waiting[i] < indptr[i + 1] and indices[waiting[i]] < j:
                largest = max(largest, abs(data[waiting[i]]))
                waiting[i] += 1
            if waiting[i] < indptr[i + 1] and indices[waiting[i]] == j:
                largest = max(largest, abs(data[k] - data[waiting[i]]))
                waiting[i] += 1
            else:
                largest = max(largest, abs(data[k]))
    return largest


@njit(cache=True, nogil=True)
def holds(indptr: IndexArray, indices: IndexArray, other_indptr: IndexArray, other_indices: IndexArray) -> bool:
    """Whether every entry of the other pattern has one in the first; columns of both are sorted."""
    for j in range(indptr.size - 1):
        position, last = other_indptr[j], other_indptr[j + 1]
        for k in range(indptr[j], indptr[j + 1]):
            if position < last and other_indices[position] == indices[k]:
                position += 1
        if position < last:
            return False
    return True
