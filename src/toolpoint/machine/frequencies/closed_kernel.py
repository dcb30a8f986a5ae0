"""Compiled kernels of closed chains: every pose followed from the last, its loops closed.

The same equations as `kinematics.closure`, a pose at a time, without temporary arrays. A pose that the kernel
does not settle is left to the NumPy path, which knows the reason. Imported only when asked for: numba takes most of a second to
load.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from toolpoint._check import BoolArray, FloatArray, IndexArray
from toolpoint.machine.frequencies.kernel import _product, _product_transposed, _transform_point

MAX_NEWTON_STEPS = 7  # steps of Newton at one part of the way
MAX_FIRST_CORRECTION = 0.12  # of the machine's size or a radian: a larger first step may reach another assembly mode
MIN_CONTINUATION_STEP = 1 / 512  # of the way from the start to the goal


@njit(cache=True, nogil=True)
def _rotation_of(x: float, y: float, z: float, out: FloatArray) -> None:
    """Fill `out` (3, 3) with the rotation of a vector (x, y, z): R = I + a [v] + b [v]^2, a = sin t / t, b = (1 - cos t) /
    t^2."""
    angle = np.sqrt(x * x + y * y + z * z)
    # Series: below, 1 - cos loses half of its digits, while the next terms of the series are below 1e-17.
    if angle < 1e-4:
        a, b = 1.0 - angle * angle / 6.0, 0.5 - angle * angle / 24.0
    else:
        a, b = np.sin(angle) / angle, (1.0 - np.cos(angle)) / (angle * angle)
    out[0, 0], out[0, 1], out[0, 2] = 1.0 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y
    out[1, 0], out[1, 1], out[1, 2] = b * x * y + a * z, 1.0 - b * (x * x + z * z), b * y * z - a * x
    out[2, 0], out[2, 1], out[2, 2] = b * x * z - a * y, b * y * z + a * x, 1.0 - b * (x * x + y * y)


@njit(cache=True, nogil=True)
def _vector_of(r: FloatArray, out: FloatArray) -> None:
    """Fill `out` (3,) with the rotation vector of a matrix (3, 3) whose angle is below half a turn."""
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    x, y, z = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    sine = 0.5 * np.sqrt(x * x + y * y + z * z)
    # Not by arccos of the trace, which knows nothing of small angles: its slope is infinite at one.
    angle = np.arctan2(sine, 0.5 * (trace - 1.0))
    factor = 0.5 * (angle / sine) if sine > 1e-9 else 0.5
    out[0], out[1], out[2] = factor * x, factor * y, factor * z


@njit(cache=True, nogil=True)
def forward(tree: tuple[Any, ...], ways: IndexArray, values: FloatArray, state: tuple[Any, ...], work: FloatArray) -> None:
    """Fill places of all links and joints and the twists of all steps for step values (n_steps,).

    tree : parents (n,), frames (n, 3, 3) and (n, 3), first step of every link (n + 1,), steps in order, whether each is of a
    ball; ways : (n_steps,) directions 0 .. 5; state : displacements of links, frames of joints, twists (n_steps, 6); work : (7,
    3, 3). A step moves by exp(x value), x the unit twist along or about its direction; three of a ball are one rotation vector.
    """
    parents, frame_r, frame_t, first, order, ball = tree
    moved_r, moved_t, base_r, end_t, twists = state
    turn, now_r, spare = work[0], work[1], work[2]
    now_t = work[3, 0]
    for i in range(parents.size):
        p = parents[i]
        if p >= 0:
            _product(moved_r[p], frame_r[i], base_r[i])
            _transform_point(moved_r[p], frame_t[i], moved_t[p], now_t)
        else:
            base_r[i] = frame_r[i]
            now_t[:] = frame_t[i]
        now_r[:] = base_r[i]
        k = first[i]
        while k < first[i + 1]:
            step = order[k]
            if ball[k]:  # three steps are one rotation vector; its twists are about the axes after the turn
                _rotation_of(values[step], values[order[k + 1]], values[order[k + 2]], turn)
                _product(now_r, turn, spare)
                now_r[:] = spare
                for b in range(3):
                    _line(now_r, now_t, b, twists[order[k + b]])
                k += 3
                continue
            way = ways[step]
            if way < 3:
                for a in range(3):
                    twists[step, a], twists[step, 3 + a] = now_r[a, way], 0.0
                    now_t[a] += now_r[a, way] * values[step]
            else:
                _line(now_r, now_t, way - 3, twists[step])
                b, c = (way - 2) % 3, (way - 1) % 3  # the columns that a turn about `way` mixes
                cosine, sine = np.cos(values[step]), np.sin(values[step])
                for a in range(3):
                    u, v = now_r[a, b], now_r[a, c]
                    # A turn about an own axis mixes two columns only: no product of matrices for the most frequent step.
                    now_r[a, b], now_r[a, c] = u * cosine + v * sine, v * cosine - u * sine
            k += 1
        end_t[i] = now_t
        # What the link moved by since the reference pose, in which every frame is described: children and bodies ride on it.
        _product_transposed(now_r, frame_r[i], moved_r[i])
        for a in range(3):
            moved_t[i, a] = now_t[a] - (moved_r[i, a, 0] * frame_t[i, 0] + moved_r[i, a, 1] * frame_t[i, 1]
                                        + moved_r[i, a, 2] * frame_t[i, 2])


@njit(cache=True, nogil=True)
def _line(r: FloatArray, t: FloatArray, axis: int, out: FloatArray) -> None:
    """Fill `out` (6,) with the unit twist about an axis of a frame (r, t) through its origin: (t x a, a)."""
    x, y, z = r[0, axis], r[1, axis], r[2, axis]
    out[3], out[4], out[5] = x, y, z
    out[0], out[1], out[2] = t[1] * z - t[2] * y, t[2] * x - t[0] * z, t[0] * y - t[1] * x


@njit(cache=True, nogil=True)
def side(link: int, frame_r: FloatArray, frame_t: FloatArray, state: tuple[Any, ...], r: FloatArray, t: FloatArray) -> None:
    """Fill `r`, `t` with a frame that rides on a link, or stays on the ground where the link is -1."""
    if link < 0:
        r[:] = frame_r
        t[:] = frame_t
    else:
        _product(state[0][link], frame_r, r)
        _transform_point(state[0][link], frame_t, state[1][link], t)


@njit(cache=True, nogil=True)
def _equations(loops: tuple[Any, ...], state: tuple[Any, ...], residual: FloatArray, rate: FloatArray, work: FloatArray
               ) -> None:
    """Fill weighted gaps of all loops (n_rows,) and their derivatives to all steps (n_rows, n_steps)."""
    parent, child, frame_r, frame_t, turning, row_loop, row_way, weight, signs = loops
    twists = state[4]
    base_r, end_r, rel = work[4], work[5], work[6]
    base_t, end_t, t = work[3, 0], work[3, 1], work[3, 2]
    gap, column = np.empty(6), np.empty(6)
    row = 0
    for l in range(parent.size):
        side(parent[l], frame_r[l], frame_t[l], state, base_r, base_t)
        side(child[l], frame_r[l], frame_t[l], state, end_r, end_t)
        for a in range(3):
            t[a] = 0.0
            for b in range(3):
                t[a] += base_r[b, a] * (end_t[b] - base_t[b])
                rel[a, b] = base_r[0, a] * end_r[0, b] + base_r[1, a] * end_r[1, b] + base_r[2, a] * end_r[2, b]
        _gap(rel, t, turning[l], gap)
        last = row
        while last < row_loop.size and row_loop[last] == l:
            residual[last] = weight[last] * gap[row_way[last]]
            last += 1
        for s in range(twists.shape[0]):
            # A step that is on neither branch of a loop, or on both alike, does not move its gap.
            if signs[l, s] == 0.0:
                for k in range(row, last):
                    rate[k, s] = 0.0
                continue
            _gap_rate(rel, t, turning[l], base_r, base_t, twists[s], column)
            for k in range(row, last):
                rate[k, s] = signs[l, s] * weight[k] * column[row_way[k]]
        row = last


@njit(cache=True, nogil=True)
def _gap(r: FloatArray, t: FloatArray, turning: IndexArray, gap: FloatArray) -> None:
    """Fill `gap` (6,) with the distance of the child's frame from the parent's, zero along free rotations.

    None free: half the skew part of r; one free about a: tilt of that axis; two free about a, b: product of their directions.
    """
    gap[:3] = t
    gap[3:] = 0.0
    number = turning[0]
    if number == 0:
        # The sine of the rotation, not its angle: smooth through zero. Its other zero, half a turn, is out of reach of one
        # part of the way.
        gap[3], gap[4], gap[5] = 0.5 * (r[2, 1] - r[1, 2]), 0.5 * (r[0, 2] - r[2, 0]), 0.5 * (r[1, 0] - r[0, 1])
    elif number == 1:
        a = turning[1]
        b, c = (a + 1) % 3, (a + 2) % 3
        gap[3 + b], gap[3 + c] = -r[c, a], r[b, a]
    elif number == 2:
        a, b = turning[1], turning[2]
        hand = 1.0 if (b - a) % 3 == 1 else -1.0
        gap[6 - a - b] = -hand * r[a, b]


@njit(cache=True, nogil=True)
def _gap_rate(r: FloatArray, t: FloatArray, turning: IndexArray, base_r: FloatArray, base_t: FloatArray, xi: FloatArray,
              out: FloatArray) -> None:
    """Fill `out` (6,) with the derivative of `_gap` along a unit twist xi (6,) of the child in machine axes."""
    v0 = xi[0] - (base_t[1] * xi[5] - base_t[2] * xi[4])
    v1 = xi[1] - (base_t[2] * xi[3] - base_t[0] * xi[5])
    v2 = xi[2] - (base_t[0] * xi[4] - base_t[1] * xi[3])
    # v0 is the velocity of the point at the parent's origin: v + w x p.
    for a in range(3):
        out[a] = base_r[0, a] * v0 + base_r[1, a] * v1 + base_r[2, a] * v2
        out[3 + a] = base_r[0, a] * xi[3] + base_r[1, a] * xi[4] + base_r[2, a] * xi[5]
    w0, w1, w2 = out[3], out[4], out[5]
    out[0] += w1 * t[2] - w2 * t[1]
    out[1] += w2 * t[0] - w0 * t[2]
    out[2] += w0 * t[1] - w1 * t[0]
    number = turning[0]
    if number == 0:
        trace = r[0, 0] + r[1, 1] + r[2, 2]
        for a in range(3):
            out[3 + a] = 0.5 * (trace * (w0, w1, w2)[a] - r[a, 0] * w0 - r[a, 1] * w1 - r[a, 2] * w2)
        return
    out[3] = out[4] = out[5] = 0.0
    if number == 3:
        return
    a = turning[1]
    b = (a + 1) % 3 if number == 1 else turning[2]
    c = (a + 2) % 3
    k = a if number == 1 else b
    x, y, z = r[0, k], r[1, k], r[2, k]
    d0, d1, d2 = w1 * z - w2 * y, w2 * x - w0 * z, w0 * y - w1 * x
    if number == 1:
        out[3 + b], out[3 + c] = -(d0, d1, d2)[c], (d0, d1, d2)[b]
    else:
        hand = 1.0 if (b - a) % 3 == 1 else -1.0
        out[6 - a - b] = -hand * (d0, d1, d2)[a]


@njit(cache=True, nogil=True)
def solve(matrix: FloatArray, right: FloatArray, n: int, columns: int) -> float:
    """Solve in place by elimination with row pivots; return the sign of the determinant, zero where it is singular."""
    sign = 1.0
    for k in range(n):
        pivot, size = k, abs(matrix[k, k])
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > size:
                pivot, size = i, abs(matrix[i, k])
        # Rows are weighted to the machine's size, so a pivot of rounding means a singular position, where assembly modes
        # meet.
        if size < 1e-13:
            return 0.0
        if pivot != k:
            sign = -sign
            for j in range(n):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            for j in range(columns):
                right[k, j], right[pivot, j] = right[pivot, j], right[k, j]
        if matrix[k, k] < 0:
            sign = -sign
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            if factor != 0.0:
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]
                for j in range(columns):
                    right[i, j] -= factor * right[k, j]
    for k in range(n - 1, -1, -1):
        for j in range(columns):
            total = right[k, j]
            for i in range(k + 1, n):
                total -= matrix[k, i] * right[i, j]
            right[k, j] = total / matrix[k, k]
    return sign


@njit(cache=True, nogil=True)
def _advance(values: FloatArray, delta: FloatArray, passive: IndexArray, balls: IndexArray, work: FloatArray) -> None:
    """Change the passive step values; a ball turns further about its moved directions."""
    for k in range(passive.size):
        values[passive[k]] += delta[k]
    for b in range(balls.shape[0]):
        i, j, k = balls[b]
        x, y, z = delta[i - passive[0]], delta[j - passive[0]], delta[k - passive[0]]
        # The loop above has added the change as if rotation vectors added up: it is taken back, and the turn composed.
        _rotation_of(values[i] - x, values[j] - y, values[k] - z, work[0])
        _rotation_of(x, y, z, work[1])
        _product(work[0], work[1], work[2])
        _vector_of(work[2], work[3, 0])
        values[i], values[j], values[k] = work[3, 0, 0], work[3, 0, 1], work[3, 0, 2]


@njit(cache=True, nogil=True)
def _corrected(system: tuple[Any, ...], state: tuple[Any, ...], passive: IndexArray, delta: FloatArray, work: FloatArray
               ) -> float:
    """Return the sign of the determinant after filling the change of the passive steps that removes the residuals."""
    residual, rate, matrix, right = system
    n = passive.size
    for i in range(n):
        right[i, 0] = -residual[i]
        for j in range(n):
            matrix[i, j] = rate[i, passive[j]]
    sign = solve(matrix, right, n, 1)
    for j in range(n):
        delta[j] = right[j, 0]
    return sign


@njit(cache=True, nogil=True)
def _settle(chain: tuple[Any, ...], start: FloatArray, goal: FloatArray, values: FloatArray, state: tuple[Any, ...],
            system: tuple[Any, ...], sign: float, work: FloatArray) -> bool:
    """Follow a pose from start values to driven values of the goal; return whether it closed in the same assembly mode."""
    tree, ways, loops, passive, balls, _ = chain
    driven = passive[0]
    done_part, step = 0.0, 1.0
    last_values, delta = start.copy(), np.empty(passive.size)
    while done_part < 1.0 and step >= MIN_CONTINUATION_STEP:
        target_part = min(1.0, done_part + step)
        values[:] = last_values
        forward(tree, ways, values, state, work)
        _equations(loops, state, system[0], system[1], work)
        for s in range(driven):
            # The passive steps follow the drives to first order before Newton begins: so whole ways are mostly one step.
            move = (goal[s] - start[s]) * (target_part - done_part)
            values[s] += move
            for i in range(passive.size):
                system[0][i] += system[1][i, s] * move
        is_closed = _corrected(system, state, passive, delta, work) != 0.0
        if is_closed:
            _advance(values, delta, passive, balls, work)
            is_closed = _newton(chain, values, state, system, sign, work, delta)
        if is_closed:
            # Quartered where it fails and doubled where it does not: one hard place does not make the rest of the way slow.
            done_part, step = target_part, 2 * step
            last_values[:] = values
        else:
            step /= 4
    return done_part >= 1.0


@njit(cache=True, nogil=True)
def _newton(chain: tuple[Any, ...], values: FloatArray, state: tuple[Any, ...], system: tuple[Any, ...], sign: float,
            work: FloatArray, delta: FloatArray) -> bool:
    """Return whether at most `MAX_NEWTON_STEPS` corrections close the loops with an unchanged sign of the determinant."""
    tree, ways, loops, passive, balls, scale = chain
    for number in range(MAX_NEWTON_STEPS):
        forward(tree, ways, values, state, work)
        _equations(loops, state, system[0], system[1], work)
        # The determinant changes its sign where assembly modes meet: the other sign means that the loops closed the other
        # way.
        if _corrected(system, state, passive, delta, work) != sign:
            return False
        size = 0.0
        for k in range(passive.size):
            size = max(size, abs(delta[k]) * scale[k])
        if number == 0 and size > MAX_FIRST_CORRECTION:
            return False
        _advance(values, delta, passive, balls, work)
        if size < 1e-7:
            # Convergence is quadratic: the next correction would be below rounding.
            return True
    return False


@njit(cache=True, nogil=True)
def settle_poses(tree: tuple[Any, ...], ways: IndexArray, loops: tuple[Any, ...], passive: IndexArray, balls: IndexArray,
                 scale: FloatArray, start: FloatArray, goals: FloatArray, sign: float, values: FloatArray, settled: BoolArray
                 ) -> None:
    """Fill step values (P, n_steps) for driven step values `goals` (P, n_driven), from the last pose where it is nearer."""
    links, steps, count = tree[0].size, ways.size, passive.size
    state = (np.empty((links, 3, 3)), np.empty((links, 3)), np.empty((links, 3, 3)), np.empty((links, 3)),
             np.empty((steps, 6)))
    system = (np.empty(count), np.empty((count, steps)), np.empty((count, count)), np.empty((count, 1)))
    work, last_values, chain = np.empty((7, 3, 3)), start.copy(), (tree, ways, loops, passive, balls, scale)
    for pose in range(goals.shape[0]):
        start_distance, last_distance = 0.0, 0.0
        for s in range(goals.shape[1]):
            start_distance += abs(goals[pose, s] - start[s])
            last_distance += abs(goals[pose, s] - last_values[s])
        settled[pose] = _settle(chain, last_values if last_distance < start_distance else start, goals[pose], values[pose],
                                state, system, sign, work)
        if settled[pose]:
            last_values[:] = values[pose]

# Code of other modules in these kernels: b39adf2947bc
