r"""Compiled kernels of PanelArnoldi: the cut laid over panels of rotation, and the one-period map.

Over a panel the vibration is a polynomial through Gauss nodes, its equation the convolution with the modal impulse response,

.. math:: r_i = \sum_m L_m e^{s_m (t_i - t_0)} z_m + \sum_j R_{ij} F_j, \qquad
          F_j = -w A_j r_j - w D_j \dot r_j + w \sum_e A_{je}\, r(t_j - \tau_e)

with R in closed form (`responses`), so that no time step limits the modes. The delayed vibration is interpolated on the panel
where it lies, of this period or the one before (`look_back`): entries, exits and their images one delay later are ends of
panels, so nothing is interpolated across a kink. Solved panel by panel (`inverses`), one application of the map costs work in
proportion to nodes and modes (`advance`). Of its spectrum only the largest multipliers matter: an Arnoldi basis of some 14 to
160 vectors (`arnoldi`), begun with the Ritz vector of the depth before, gives them to rounding.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from toolpoint._check import BoolArray, ComplexArray, FloatArray, IndexArray
from toolpoint._inner_kernels import inner_njit
from toolpoint._kernel_options import BORROWS
from toolpoint.cutting.stability.panels.edge_walls import TURN, mark_walls, tooth_pieces
from toolpoint.cutting.stability.panels.records import (
    EdgeLaw,
    EdgeLines,
    LaidCut,
    LookBack,
    ModalWaves,
    PanelNodes,
    PanelTimes,
    PeriodOperator,
    Walls,
)
from toolpoint.cutting.stability.sorting import number_below

# Exponents of a pole's decay over a panel: up to which Gauss nodes may carry a pole that they do not resolve, and up to which
# the factors before and after a node stay within double precision.
MAX_UNRESOLVED_DECAY = 1.0
MAX_PRODUCT_DECAY = 300.0
SUMS = {"reassoc", "contract", "nsz"}  # sums in any order, so that they vectorise; what is infinite or no number stays so


@nb.njit(cache=True, nogil=True, **BORROWS)
def directions(phi: float, kappa: float, law: EdgeLaw, cut: FloatArray, drag: FloatArray) -> None:
    """Write k n^T and (n + mu t) n^T of an edge element."""
    directions_of(math.sin(phi), math.cos(phi), (math.sin(kappa), math.cos(kappa)), numbers_of(law), cut, drag)


@nb.njit(cache=True, nogil=True, inline="always")
def numbers_of(law: EdgeLaw) -> tuple[float, float, float, float]:
    """Return the numbers of a law: read once a layout, not at every place on an edge."""
    return law.material[0], law.material[1], law.material[2], law.friction


@nb.njit(cache=True, nogil=True, inline="always", **BORROWS)
def directions_of(s: float, c: float, leaning: tuple[float, float], numbers: tuple[float, float, float, float], cut: FloatArray,
                  drag: FloatArray) -> None:
    """Write what `directions` does from sine and cosine of phi, and of kappa (`leaning`), and the numbers of the law."""
    sk, ck = leaning
    tangential, normal, axial, friction = numbers
    n = (s * sk, c * sk, -ck)
    t = (c, -s, 0.0)
    m = (-s * ck, -c * ck, -sk)
    for a in range(cut.shape[0]):
        k = tangential * t[a] + normal * n[a] + axial * m[a]
        for b in range(cut.shape[0]):
            cut[a, b] = k * n[b]
            drag[a, b] = (n[a] + friction * t[a]) * n[b]


@inner_njit(cache=True, nogil=True)
def lay(angle: FloatArray, edges: EdgeLines, walls: Walls, law: EdgeLaw, gx: FloatArray, gw: FloatArray, laid: LaidCut) -> int:
    """Lay the cut on nodes at these angles: `laid` (`LaidCut`) is filled, gx and gw the Gauss rule along a piece of the edge.

    Where delays do not change with height all points of a tooth's edge share one entry. Returns the number of entries, -1 where
    they do not fit.
    """
    d = laid.now.shape[1]
    at_marks = np.empty((edges.marks.size, 4))
    mark_walls(edges.marks, walls, at_marks)
    room = np.empty((d, d)), np.empty((d, d)), np.empty((2 * edges.marks.size, 2)), np.empty((3, 2)), at_marks
    return _lay_nodes(angle, edges, walls, numbers_of(law), (gx, gw), room, laid)


@inner_njit(cache=True, nogil=True, **BORROWS)
def _lay_nodes(angle: FloatArray, edges: EdgeLines, walls: Walls, numbers: tuple[float, float, float, float],
               rule: tuple[FloatArray, FloatArray], room: tuple[FloatArray, ...], laid: LaidCut) -> int:
    """Lay the cut as `lay` does; numbers : of the law; rule : gx, gw; room : to work in, the last the walls at the marks."""
    start, slope, tip_delay, delay_slope = edges.start, edges.slope, edges.tip_delay, edges.delay_slope
    now, drag, first, matrix, entry_delay = laid.now, laid.drag, laid.first, laid.matrix, laid.entry_delay
    cut, push, pieces, ends, at_marks = room
    gx, gw = rule
    d, used, rounded = now.shape[1], 0, 0.5 * math.pi * walls.corner
    for i in range(angle.size):
        first[i] = used
        for j in range(start.size):
            number = tooth_pieces(angle[i] - start[j], slope[j], (edges.marks, at_marks), walls, ends, pieces)
            has_entry = False
            for p in range(number):
                a, b = pieces[p, 0], pieces[p, 1]
                for g in range(gx.size):
                    u = a + 0.5 * (b - a) * (1 + gx[g])
                    share = 0.5 * (b - a) * gw[g]
                    if u < rounded:  # as `place`, with the sine and the cosine that the directions take too
                        leaning = math.sin(u / walls.corner), math.cos(u / walls.corner)
                        z = walls.corner * (1 - leaning[1])
                    else:
                        leaning = 1.0, 0.0
                        z = walls.corner + (u - rounded)
                    phi = angle[i] - start[j] - slope[j] * z
                    directions_of(math.sin(phi), math.cos(phi), leaning, numbers, cut, push)
                    if edges.spread or not has_entry:
                        if used >= matrix.shape[0]:
                            return -1
                        delay = (tip_delay[j] + delay_slope[j] * z) % TURN
                        # A tooth that lags by a whole turn is behind itself: rounding of the remainder would make a delay
                        # of nothing.
                        if delay < 1e-9:
                            delay = TURN
                        entry_delay[used] = delay
                        matrix[used] = 0.0
                        used += 1
                        has_entry = True
                    for x in range(d):
                        for y in range(d):
                            now[i, x, y] += share * cut[x, y]
                            drag[i, x, y] += share * push[x, y]
                            matrix[used - 1, x, y] += share * cut[x, y]
    first[angle.size] = used
    return used


@inner_njit(cache=True, nogil=True, **BORROWS)
def look_back(angle: FloatArray, first: IndexArray, entry_delay: FloatArray, nodes: PanelNodes, needed: BoolArray,
              entries: LookBack) -> None:
    """Find the panel of every delayed angle and its interpolation row: `entries` (`LookBack`) are filled, and `needed` marks
    the panels that are looked back into."""
    ends, offset, count, xs, bary = nodes.ends, nodes.offset, nodes.number, nodes.gauss, nodes.barycentric
    source, past, rows = entries.source, entries.past, entries.rows
    for i in range(angle.size):
        for e in range(first[i], first[i + 1]):
            past_angle = angle[i] - entry_delay[e]
            # A delay that ends at the begin of the period belongs to this one, where rounding puts it a little before.
            past[e] = past_angle < -1e-12 * nodes.period
            if past[e]:
                past_angle += nodes.period
            p = min(max(number_below(ends, past_angle, True) - 1, 0), ends.size - 2)
            source[e] = p
            needed[p] = True
            x = 2 * (past_angle - ends[p]) / (ends[p + 1] - ends[p]) - 1
            n = count[p]
            total = 0.0
            hit = -1
            for k in range(n):
                gap = x - xs[offset[p] + k]
                # At a node itself the barycentric quotient is infinite over infinite.
                if abs(gap) < 1e-13:
                    hit = k
                    break
                rows[e, k] = bary[offset[p] + k] / gap
                total += rows[e, k]
            for k in range(n):
                if hit >= 0:
                    rows[e, k] = 1.0 if k == hit else 0.0
                else:
                    rows[e, k] /= total


@inner_njit(cache=True, nogil=True)
def steep(sigma: complex, legendre: FloatArray, weights: FloatArray, count: int, out: ComplexArray) -> None:
    r"""Write the weights of the nodes in :math:`\int_{-1}^{x_i} e^{\sigma (x_i - y)} f(y) dy`, f through `count` Gauss nodes.

    The kernel's own growth backwards in time is integrated in closed form against every Legendre polynomial,
    :math:`(2k + 1) I_k = P_{k+1} - P_{k-1} + \sigma (I_{k+1} - I_{k-1})`; upwards it is stable where sigma is large.

    legendre (count, count) : P_k at the nodes, row k; weights (count,) : of the Gauss rule; out (count + 1, count) : its last
    row is that of the whole panel.
    """
    moments = np.empty(count, np.complex128)
    for i in range(count + 1):
        x = legendre[1, i] if i < count else 1.0
        e = np.exp(sigma * (x + 1))
        moments[0] = (e - 1) / sigma
        moments[1] = (moments[0] - x - e) / sigma
        for k in range(1, count - 1):
            rise = legendre[k + 1, i] - legendre[k - 1, i] if i < count else 0.0
            moments[k + 1] = moments[k - 1] + ((2 * k + 1) * moments[k] - rise) / sigma
        for j in range(count):
            total = 0.0 + 0.0j
            for k in range(count):
                total += (k + 0.5) * legendre[k, j] * moments[k]
            out[i, j] = weights[j] * total


@nb.njit(cache=True, nogil=True)
def responses(times: PanelTimes, offset: IndexArray, count: IndexArray, poles: ComplexArray, left: ComplexArray,
              right: ComplexArray, static: FloatArray, waves: ModalWaves) -> None:
    """Fill the panels' closed-form responses (`ModalWaves`, here with complex rows of free).

    rising[kinds[p]] integrates from the panel's start to each node, its last row over the whole panel (weights). A pole that
    decays within the panel faster than its nodes resolve is integrated exactly (`steep`). static (d, d) : receptance of what
    answers at once: it has no state, and the force at a node moves that node alone.
    """
    begin, end, time, half, rising, kinds, legendre, is_uniform = times
    resp, speed_resp, free, free_speed, push, step = waves
    d, m = left.shape
    nodes_max = 0
    for n in count:
        nodes_max = max(nodes_max, n)
    forward, backward = np.empty((nodes_max, m), np.complex128), np.empty((nodes_max, m), np.complex128)
    exact, is_steep = np.empty((m, nodes_max + 1, nodes_max), np.complex128), np.zeros(m, np.bool_)
    for p in range(begin.size):
        long = end[p] - begin[p]
        for r in range(m):
            step[p, r] = np.exp(poles[r] * long)
        o, n = offset[p], count[p]
        for r in range(m):
            # Fast beside the panel and not resolved by its nodes: between them the exponential is no polynomial.
            is_steep[r] = (is_uniform and n > 1 and -poles[r].real * long > MAX_UNRESOLVED_DECAY
                           and n < 3 + 1.05 * abs(poles[r]) * long)
            if is_steep[r]:
                steep(0.5 * long * poles[r], legendre[kinds[p]], rising[kinds[p], n], n, exact[r])
        for i in range(n):
            for r in range(m):
                e = np.exp(poles[r] * (time[o + i] - begin[p]))
                forward[i, r], backward[i, r] = e, 0.0 if is_steep[r] else np.exp(poles[r] * (begin[p] - time[o + i]))
                for a in range(d):
                    free[p, i * d + a, r] = left[a, r] * e
                    free_speed[p, i * d + a, r] = left[a, r] * e * poles[r]
                to_end = np.exp(poles[r] * (end[p] - time[o + i])) * rising[kinds[p], n, i]
                to_end = half[o + i] * (exact[r, n, i] if is_steep[r] else to_end)
                for b in range(d):
                    weight = to_end * right[r, b]
                    push[p, 2 * r, i * d + b], push[p, 2 * r + 1, i * d + b] = weight.real, weight.imag
        for i in range(n):
            for j in range(n):
                for a in range(d):
                    for b in range(d):
                        resp[p, i * d + a, j * d + b] = static[a, b] if i == j else 0.0
                        speed_resp[p, i * d + a, j * d + b] = 0.0
                # e^{s (t_i - t_j)} as a product of two rows, as long as neither leaves the range of a double.
                share = half[o + j] * rising[kinds[p], i, j]
                for r in range(m):
                    e = forward[i, r] * backward[j, r] * (2 * share)
                    if is_steep[r]:
                        e = 2 * half[o + j] * exact[r, i, j]
                    # e^300 times e^-300 is the most that a double holds on either side: beyond, one factor is infinite and
                    # the product no number.
                    elif abs(poles[r].real) * long > MAX_PRODUCT_DECAY:
                        e = np.exp(poles[r] * (time[o + i] - time[o + j])) * (2 * share)
                    for a in range(d):
                        x = e * left[a, r]
                        y = x * poles[r]
                        for b in range(d):
                            resp[p, i * d + a, j * d + b] += (x * right[r, b]).real
                            speed_resp[p, i * d + a, j * d + b] += (y * right[r, b]).real


@nb.njit(cache=True, nogil=True)
def inverses(operator: PeriodOperator) -> None:
    """Write the inverse of I + own resp (+ drag resp') of every cutting panel into `operator.solved`."""
    layout, damped, depth, out = operator.layout, operator.damped, operator.depth, operator.solved
    offset, count, cutting, now, drag = layout.offset, layout.number, layout.cutting, layout.now, layout.drag
    resp, speed_resp = operator.waves.displacement, operator.waves.velocity
    d = now.shape[1]
    for p in range(count.size):
        n = count[p]
        if n == 0 or not cutting[p]:
            continue
        big = np.zeros((n * d, n * d))
        for i in range(n * d):
            big[i, i] = 1.0
        for i in range(n):
            for a in range(d):
                for c in range(d):
                    f = depth * now[offset[p] + i, a, c]
                    for j in range(n * d):
                        big[i * d + a, j] += f * resp[p, i * d + c, j]
                    if damped:
                        g = depth * drag[offset[p] + i, a, c]
                        for j in range(n * d):
                            big[i * d + a, j] += g * speed_resp[p, i * d + c, j]
        # An inverse, not a factorisation: it is applied once a vector, some fifty times, and a product of a row vectorises
        # where substitution does not.
        solved = np.linalg.inv(big)
        for i in range(n * d):
            for j in range(n * d):
                out[p, i, j] = solved[i, j]


@inner_njit(cache=True, nogil=True, fastmath=SUMS, **BORROWS)
def product(matrix: FloatArray, vector: FloatArray, size: int, out: FloatArray) -> None:
    """Write the product of a real matrix and the first `size` numbers of a vector, as many rows as `out` has."""
    for i in range(out.size):
        row = matrix[i]
        total = 0.0
        for j in range(size):
            total += row[j] * vector[j]
        out[i] = total


@inner_njit(cache=True, nogil=True, fastmath=SUMS)
def advance(x: FloatArray, y: FloatArray, operator: PeriodOperator) -> None:
    """Map the vibration at the nodes and the state of one period (x) on the next (y)."""
    depth, layout, waves, solved, damped = operator
    offset, count, cutting, now, drag, first, matrix, source, past, rows = layout
    resp, _, free, free_speed, push, step = waves
    d, m = now.shape[1], step.shape[1]
    nodes = now.shape[0]
    state, turned = np.empty(2 * m), np.empty(2 * m)  # turned: twice the conjugate, whose product is the vibration
    for r in range(m):
        state[2 * r], state[2 * r + 1] = x[nodes * d + r], x[nodes * d + m + r]
    rhs, force = np.empty(resp.shape[1]), np.empty(resp.shape[1])
    v0, pushed = np.empty(resp.shape[1]), np.empty(2 * m)
    for p in range(count.size):
        n, o = count[p], offset[p]
        for r in range(m):
            turned[2 * r], turned[2 * r + 1] = 2 * state[2 * r], -2 * state[2 * r + 1]
        r0 = y[o * d:(o + n) * d]
        product(free[p], turned, 2 * m, r0)
        for r in range(m):
            real, imag = state[2 * r], state[2 * r + 1]
            state[2 * r] = step[p, r].real * real - step[p, r].imag * imag
            state[2 * r + 1] = step[p, r].real * imag + step[p, r].imag * real
        if not cutting[p]:
            continue
        if damped:
            product(free_speed[p], turned, 2 * m, v0[:n * d])
        for i in range(n):
            for a in range(d):
                total = 0.0
                for c in range(d):
                    total -= now[o + i, a, c] * r0[i * d + c]
                    if damped:
                        total -= drag[o + i, a, c] * v0[i * d + c]
                rhs[i * d + a] = total
            for e in range(first[o + i], first[o + i + 1]):
                src = source[e]
                start, k = offset[src] * d, count[src]
                # This period's panels before this one are already solved: y is read where it is written, so panels go in
                # order of time.
                from_ = x if past[e] else y
                for c in range(d):
                    delayed = 0.0
                    for l in range(k):
                        delayed += rows[e, l] * from_[start + l * d + c]
                    for a in range(d):
                        rhs[i * d + a] += matrix[e, a, c] * delayed
        product(solved[p], rhs, n * d, force[:n * d])
        for i in range(n * d):
            force[i] *= depth
        product(resp[p], force, n * d, v0[:n * d])
        for i in range(n * d):
            r0[i] += v0[i]
        product(push[p], force, n * d, pushed)
        for r in range(2 * m):
            state[r] += pushed[r]
    for r in range(m):
        y[nodes * d + r], y[nodes * d + m + r] = state[2 * r], state[2 * r + 1]

# Code of other modules in these kernels: 7c2cf291de9a
