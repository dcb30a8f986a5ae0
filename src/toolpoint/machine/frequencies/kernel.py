"""Compiled kernels: mass matrices of a tree of rigid bodies, and the largest eigenvalues of small symmetric matrices.

Both run over blocks of poses with the pose as the innermost index, so that the compiler vectorises across poses.
Imported only when asked for: numba takes most of a second to load.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from toolpoint._check import FloatArray, IndexArray
from toolpoint.machine.frequencies.tree_arrays import POSE_BLOCK_SIZE, BodyMoments, JointMotions, JointTree


@njit(cache=True, nogil=True, fastmath=False)
def tree_mass_matrices(tree: JointTree, bodies: BodyMoments, motions: JointMotions, positions: FloatArray, out: FloatArray
                       ) -> None:
    """Fill `out` (P, n, n) with mass matrices of a `JointTree`, its `BodyMoments` and `JointMotions`, by composite inertias."""
    parents, (columns, column_link, on_path) = tree.parents, motions
    links, n, poses = parents.size, columns.shape[0], positions.shape[0]
    # Made once for all poses: memory asked for in the loop would cost more than the arithmetic of a small machine.
    moved_r, moved_t = np.empty((links, 3, 3)), np.empty((links, 3))
    rotation, place = np.empty((links, 3, 3)), np.empty((links, 3))
    mass, first_moment, second_moment = np.empty(links), np.empty((links, 3)), np.empty((links, 3, 3))
    twists, force, work = np.empty((n, 6)), np.empty(6), np.empty((4, 3, 3))
    for pose in range(poses):
        _place_links(tree, positions[pose], moved_r, moved_t, rotation, place, work)
        _inertias(parents, bodies, moved_r, moved_t, mass, first_moment, second_moment, work)
        for j in range(n):
            _twist(columns[j], rotation[column_link[j]], place[column_link[j]], twists[j])
        for j in range(n):
            link = column_link[j]
            _momentum(mass[link], first_moment[link], second_moment[link], twists[j], force)
            for i in range(j + 1):
                value = 0.0
                # Composite inertias: the momentum that motion j gives to all beyond it works on the motions of joints
                # before it alone.
                if on_path[column_link[i], link]:
                    for a in range(6):
                        value += twists[i, a] * force[a]
                out[pose, i, j] = value
                out[pose, j, i] = value


@njit(cache=True, nogil=True)
def _product(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    # Written out: the library call for 3x3 products allocates and costs ten times the arithmetic.
    """Fill `out` (3, 3) with A B."""
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@njit(cache=True, nogil=True)
def _product_transposed(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """Fill `out` (3, 3) with A B^T."""
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[j, 0] + a[i, 1] * b[j, 1] + a[i, 2] * b[j, 2]


@njit(cache=True, nogil=True)
def _transform_point(r: FloatArray, x: FloatArray, t: FloatArray, out: FloatArray) -> None:
    """Fill `out` (3,) with R x + t."""
    for i in range(3):
        out[i] = r[i, 0] * x[0] + r[i, 1] * x[1] + r[i, 2] * x[2] + t[i]


@njit(cache=True, nogil=True)
def _copy_frame(r: FloatArray, t: FloatArray, out_r: FloatArray, out_t: FloatArray) -> None:
    # Loops: a copy by slices compiles the text of its error for a second.
    """Copy a frame."""
    for i in range(3):
        out_t[i] = t[i]
        for j in range(3):
            out_r[i, j] = r[i, j]


@njit(cache=True, nogil=True)
def _place_links(tree: JointTree, position: FloatArray, moved_r: FloatArray, moved_t: FloatArray, rotation: FloatArray,
                 place: FloatArray, work: FloatArray) -> None:
    """Fill displacements of all links, and rotation and place of all joints, at one position of all steps."""
    parents, frame_r, frame_t, axis_of, axis_twists, at_child = tree
    now_r, spare, turn = work[0], work[1], work[2]
    now_t, shift, hold = work[3, 0], work[3, 1], work[3, 2]
    for i in range(parents.size):
        p = parents[i]
        if p >= 0:
            _product(moved_r[p], frame_r[i], rotation[i])
            _transform_point(moved_r[p], frame_t[i], moved_t[p], place[i])
        else:
            _copy_frame(frame_r[i], frame_t[i], rotation[i], place[i])
        _copy_frame(rotation[i], place[i], now_r, now_t)
        for k in range(axis_of.size):
            if axis_of[k] == i:
                _motion(axis_twists[k], position[k], turn, shift)
                _transform_point(now_r, shift, now_t, hold)
                _product(now_r, turn, spare)
                _copy_frame(spare, hold, now_r, now_t)
        # displacement = now * frame^-1
        _product_transposed(now_r, frame_r[i], moved_r[i])
        for a in range(3):
            moved_t[i, a] = now_t[a] - (moved_r[i, a, 0] * frame_t[i, 0] + moved_r[i, a, 1] * frame_t[i, 1]
                                        + moved_r[i, a, 2] * frame_t[i, 2])
            # Springs that ride with the child are turned and shifted by the steps of their own joint.
            if at_child[i]:
                place[i, a] = now_t[a]


@njit(cache=True, nogil=True)
def _motion(twist: FloatArray, amount: float, turn: FloatArray, shift: FloatArray) -> None:
    """Fill rotation and shift of a step: exp(twist amount) of a unit twist along or about one axis."""
    for a in range(3):
        shift[a] = twist[a] * amount
        for b in range(3):
            turn[a, b] = 1.0 if a == b else 0.0
    for a in range(3):
        sign = twist[3 + a]
        if sign != 0.0:
            b, c = (a + 1) % 3, (a + 2) % 3
            s, k = np.sin(sign * amount), np.cos(sign * amount)
            turn[b, b] = k
            turn[c, c] = k
            turn[b, c] = -s
            turn[c, b] = s


@njit(cache=True, nogil=True)
def _inertias(parents: IndexArray, bodies: BodyMoments, moved_r: FloatArray, moved_t: FloatArray, mass: FloatArray,
              first_moment: FloatArray, second_moment: FloatArray, work: FloatArray) -> None:
    """Fill mass, first and second moments of every link with all that it carries, about the machine's origin."""
    links = parents.size
    half_product, s, h, zero = work[0], work[1], work[2, 0], work[2, 1]
    zero[:] = 0.0
    for i in range(links):
        r, t, m = moved_r[i], moved_t[i], bodies.mass[i]
        _transform_point(r, bodies.first[i], zero, h)
        _product(r, bodies.second[i], half_product)
        _product_transposed(half_product, r, s)
        # Second moment about the origin after moving by t: S + h t^T + t h^T + m t t^T.
        for a in range(3):
            for b in range(3):
                second_moment[i, a, b] = s[a, b] + h[a] * t[b] + t[a] * h[b] + m * t[a] * t[b]
            first_moment[i, a] = h[a] + m * t[a]
        mass[i] = m
    # Children have larger numbers than their parents: backwards, a link is complete before it is added.
    for i in range(links - 1, -1, -1):
        p = parents[i]
        if p >= 0:
            mass[p] += mass[i]
            for a in range(3):
                first_moment[p, a] += first_moment[i, a]
                for b in range(3):
                    second_moment[p, a, b] += second_moment[i, a, b]


@njit(cache=True, nogil=True)
def _twist(column: FloatArray, rotation: FloatArray, place: FloatArray, out: FloatArray) -> None:
    """Fill `out` (6,) with a motion (6,) of a joint's frame as a twist in machine axes about the origin: (R v + p x R w, R
    w)."""
    for a in range(3):
        v, w = 0.0, 0.0
        for b in range(3):
            v += rotation[a, b] * column[b]
            w += rotation[a, b] * column[3 + b]
        out[a], out[3 + a] = v, w
    out[0] += place[1] * out[5] - place[2] * out[4]
    out[1] += place[2] * out[3] - place[0] * out[5]
    out[2] += place[0] * out[4] - place[1] * out[3]


@njit(cache=True, nogil=True)
def _momentum(m: float, h: FloatArray, s: FloatArray, xi: FloatArray, out: FloatArray) -> None:
    """Fill `out` (6,) with the momentum of mass m, first moment h and second moment S at a twist (v, w): (m v + w x h, h x v +
    (tr S - S) w)."""
    v0, v1, v2, w0, w1, w2 = xi[0], xi[1], xi[2], xi[3], xi[4], xi[5]
    out[0] = m * v0 + w1 * h[2] - w2 * h[1]
    out[1] = m * v1 + w2 * h[0] - w0 * h[2]
    out[2] = m * v2 + w0 * h[1] - w1 * h[0]
    # h x v + (trace(S) I - S) w, with S the second moment of mass.
    trace = s[0, 0] + s[1, 1] + s[2, 2]
    out[3] = h[1] * v2 - h[2] * v1 + trace * w0 - s[0, 0] * w0 - s[0, 1] * w1 - s[0, 2] * w2
    out[4] = h[2] * v0 - h[0] * v2 + trace * w1 - s[1, 0] * w0 - s[1, 1] * w1 - s[1, 2] * w2
    out[5] = h[0] * v1 - h[1] * v0 + trace * w2 - s[2, 0] * w0 - s[2, 1] * w1 - s[2, 2] * w2


@njit(cache=True, nogil=True)
def scale_blocks(matrices: FloatArray, factor: FloatArray, diagonal: bool, start: int, out: FloatArray) -> None:
    """Fill `out` (n, n, POSE_BLOCK_SIZE) with F M F^T for the poses from `start`; `factor` is F, lower triangular or
    diagonal."""
    n, poses = matrices.shape[1], matrices.shape[0]
    work, single = np.empty((n, n)), np.empty((n, n))
    for w in range(POSE_BLOCK_SIZE):
        # The last block is filled up with the last pose: inner loops have a fixed length, which the compiler turns into
        # whole vectors.
        source = matrices[min(start + w, poses - 1)]
        if diagonal:
            for i in range(n):
                for j in range(i + 1):
                    out[i, j, w] = factor[i, i] * source[i, j] * factor[j, j]
        else:
            np.dot(factor, source, work)
            np.dot(work, factor.T, single)
            for i in range(n):
                for j in range(i + 1):
                    out[i, j, w] = single[i, j]


@njit(cache=True, nogil=True, fastmath={"contract"})
def tridiagonalise(a: FloatArray, d: FloatArray, e: FloatArray) -> None:
    """Reduce lower triangles `a` (n, n, POSE_BLOCK_SIZE) by Householder steps to diagonals `d` and off-diagonals `e`.

    A <- A - v q^T - q v^T with q = beta (A v) - k v, beta = 2 / v^T v, k = beta v^T (beta A v) / 2, for every pose of the
    block.
    """
    n = a.shape[0]
    v, p = np.empty((n, POSE_BLOCK_SIZE)), np.empty((n, POSE_BLOCK_SIZE))
    beta, k = np.empty(POSE_BLOCK_SIZE), np.empty(POSE_BLOCK_SIZE)
    for c in range(n - 2):
        beta[:] = 0.0
        for i in range(c + 1, n):
            for w in range(POSE_BLOCK_SIZE):
                v[i, w] = a[i, c, w]
                beta[w] += a[i, c, w] * a[i, c, w]
        for w in range(POSE_BLOCK_SIZE):
            head = v[c + 1, w]
            alpha = -np.sqrt(beta[w]) if head > 0 else np.sqrt(beta[w])  # the sign that cancels no digits in head - alpha
            e[c, w] = alpha
            v[c + 1, w] = head - alpha
            size = beta[w] - head * alpha
            # A column that is nought already needs no reflection; poses of a block share the steps, so it cannot be
            # skipped.
            beta[w] = 1.0 / size if size > 0 else 0.0
        p[c + 1:n] = 0.0
        # p = A v from the lower triangle alone: each entry serves its row and, mirrored, its column.
        for i in range(c + 1, n):
            for j in range(c + 1, i):
                for w in range(POSE_BLOCK_SIZE):
                    p[i, w] += a[i, j, w] * v[j, w]
                    p[j, w] += a[i, j, w] * v[i, w]
            for w in range(POSE_BLOCK_SIZE):
                p[i, w] += a[i, i, w] * v[i, w]
        k[:] = 0.0
        for i in range(c + 1, n):
            for w in range(POSE_BLOCK_SIZE):
                p[i, w] *= beta[w]
                k[w] += v[i, w] * p[i, w]
        for w in range(POSE_BLOCK_SIZE):
            k[w] *= 0.5 * beta[w]
        for i in range(c + 1, n):
            for w in range(POSE_BLOCK_SIZE):
                p[i, w] -= k[w] * v[i, w]
        for i in range(c + 1, n):
            for j in range(c + 1, i + 1):
                for w in range(POSE_BLOCK_SIZE):
                    a[i, j, w] -= v[i, w] * p[j, w] + p[i, w] * v[j, w]
    for i in range(n):
        for w in range(POSE_BLOCK_SIZE):
            d[i, w] = a[i, i, w]
    if n > 1:
        for w in range(POSE_BLOCK_SIZE):
            e[n - 2, w] = a[n - 1, n - 2, w]


@njit(cache=True, nogil=True, fastmath={"contract"})
def largest_eigenvalues(d: FloatArray, e: FloatArray, number: int, out: FloatArray) -> None:
    """Fill `out` (wanted, POSE_BLOCK_SIZE) with the largest eigenvalues, descending, by bisection with Sturm counts.

    The sequence q_0 = d_0 - x, q_i = d_i - x - e_(i-1)^2 / q_(i-1) has as many positive members as eigenvalues above x.
    """
    n = d.shape[0]
    squares = np.empty((n, POSE_BLOCK_SIZE))
    lower, upper = np.empty(POSE_BLOCK_SIZE), np.empty(POSE_BLOCK_SIZE)
    x, q = np.empty(POSE_BLOCK_SIZE), np.empty(POSE_BLOCK_SIZE)
    gershgorin_min, gershgorin_max = np.empty(POSE_BLOCK_SIZE), np.empty(POSE_BLOCK_SIZE)
    count = np.empty(POSE_BLOCK_SIZE)
    # Gershgorin's discs hold all eigenvalues; the largest found bounds the next from above.
    gershgorin_max[:] = 0.0
    gershgorin_min[:] = 0.0
    for i in range(n):
        for w in range(POSE_BLOCK_SIZE):
            left = abs(e[i - 1, w]) if i > 0 else 0.0
            right = abs(e[i, w]) if i < n - 1 else 0.0
            gershgorin_max[w] = max(gershgorin_max[w], d[i, w] + left + right)
            gershgorin_min[w] = min(gershgorin_min[w], d[i, w] - left - right)
            squares[i, w] = left * left
    for r in range(number):
        for w in range(POSE_BLOCK_SIZE):
            lower[w] = gershgorin_min[w]
            # Widened by rounding, so that a repeated eigenvalue does not lie on the bound of its twin.
            upper[w] = gershgorin_max[w] * (1 + 1e-14) if r == 0 else out[r - 1, w] * (1 + 1e-14)
        for _ in range(52):  # halvings: the digits of a double
            for w in range(POSE_BLOCK_SIZE):
                x[w] = 0.5 * (lower[w] + upper[w])
                q[w] = d[0, w] - x[w]
                count[w] = 1.0 if q[w] > 0 else 0.0
            for i in range(1, n):
                for w in range(POSE_BLOCK_SIZE):
                    pivot = q[w] if abs(q[w]) > 1e-300 else 1e-300  # x on a leading minor's eigenvalue: either side will do
                    q[w] = d[i, w] - x[w] - squares[i, w] / pivot
                    count[w] += 1.0 if q[w] > 0 else 0.0
            for w in range(POSE_BLOCK_SIZE):
                is_above = count[w] > r
                lower[w] = x[w] if is_above else lower[w]
                upper[w] = upper[w] if is_above else x[w]
        for w in range(POSE_BLOCK_SIZE):
            out[r, w] = 0.5 * (lower[w] + upper[w])


@njit(cache=True, nogil=True)
def largest_scaled_eigenvalues(matrices: FloatArray, factor: FloatArray, diagonal: bool, number: int, out: FloatArray) -> None:
    """Fill `out` (P, wanted) with the largest eigenvalues of F M F^T for all matrices M (P, n, n), descending."""
    poses, n = matrices.shape[0], matrices.shape[1]
    a, d, e = np.empty((n, n, POSE_BLOCK_SIZE)), np.empty((n, POSE_BLOCK_SIZE)), np.empty((n, POSE_BLOCK_SIZE))
    values = np.empty((number, POSE_BLOCK_SIZE))
    for start in range(0, poses, POSE_BLOCK_SIZE):
        scale_blocks(matrices, factor, diagonal, start, a)
        tridiagonalise(a, d, e)
        largest_eigenvalues(d, e, number, values)
        for w in range(min(POSE_BLOCK_SIZE, poses - start)):
            for r in range(number):
                out[start + w, r] = values[r, w]

# Code of other modules in these kernels: 06dd92f988c6
