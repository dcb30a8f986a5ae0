r"""Whole periods of a periodic input at once along a path: several times quicker than step by step, where nothing feeds back.

The motion is split into the static deflection :math:`S \bar f` under the mean input of the period, which follows the path
step by step, and the rest z, which is small: :math:`z_{k+1} = \Phi z_k + (I - \Phi) S (f_k - \bar f) - \Phi \Delta(S \bar f)`,
as `varying_kernel` has it. About a place of the path the transition of a period of m steps is :math:`\Phi^m`, the motion within
it :math:`R \Phi^j z`, and the answers to the inputs without their mean and to a steady change of the deflection are the same
for every period there. They are computed at the nodes and blended linearly in between: a period costs one product by a matrix,
and the motion of all periods between two nodes is one product of matrices.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.vibration.simulation.varying import CourseArrays, CutArrays, NodeArrays, RunArrays


class WholePeriod(NamedTuple):
    """A period about a node, by columns of the state, the shares of the feeds of the table in three ways (see `_forced`) and
    the change of the static deflection a step: its end state (z, z + 3 s + n); the tip's motion after every step (6 m, ...).
    """

    end: FloatArray
    motion: FloatArray


def advance_periods(nodes: NodeArrays, cut: CutArrays, course: CourseArrays, *, motion: RunArrays, keep: int, first: int,
                    out: FloatArray, known: dict[tuple[int, int], WholePeriod]) -> int:
    """Advance a block of steps by whole periods of the table; arguments and result as of `varying_kernel.advance`.

    known : the last maps, by table and node, kept from block to block (empty at first). Steps before the first whole period and
    after the last are advanced one by one. Not for feedback of the chip, energies and what acts on the base.
    """
    from toolpoint.vibration.simulation.varying_kernel import advance

    steps, period = course.share.size, cut.table.shape[1]
    begin = min(-first % period, steps)
    end = begin + (steps - begin) // period * period
    none = np.empty((0, 9))

    def single(low: int, high: int, kept: int) -> int:
        part = course.at(np.s_[low:high])
        return int(advance(nodes, cut, part, motion, keep, first + low, out[kept:], none)) if high > low else 0

    kept = single(0, begin, 0)
    if end > begin:
        part = course.at(np.s_[begin:end])
        kept += _whole_periods(nodes, cut, part, motion, keep, first + begin, out[kept:], known)
    return kept + single(end, steps, kept)


def _whole_periods(nodes: NodeArrays, cut: CutArrays, course: CourseArrays, motion: RunArrays, keep: int, first: int,
                   out: FloatArray, known: dict[tuple[int, int], WholePeriod]) -> int:
    """Advance whole periods."""
    period, count = cut.table.shape[1], course.share.size // cut.table.shape[1]
    still = _static(nodes, cut, course.at(np.s_[::period]), "deflection")
    last = _static(nodes, cut, course.at(np.s_[-1:]), "deflection")[0]
    change = np.diff(still, axis=0, append=(still[-1] + (last - still[-1]) * period / max(period - 1, 1))[None]) / period
    middle = course.at(np.s_[period // 2::period])
    inputs = np.concatenate([*_amplitudes(course, period, cut.table.shape[0]), change], axis=1)
    half, size = still.shape[1], motion.state.size
    rest = motion.state.copy()
    rest[:half] -= still[0] - change[0]
    read = np.empty((count, period, 6))
    for low, high, node, share in _stretches(middle):
        before, after = _maps_about(nodes, cut, node, known)
        columns = np.empty((size + inputs.shape[1], high - low))
        columns[size:] = inputs[low:high].T
        pushes = [part.end[:, size:] @ columns[size:] for part in (before, after)]
        for k, t in enumerate(share):
            columns[:size, k] = rest
            rest = (1 - t) * (before.end[:, :size] @ rest + pushes[0][:, k]) + t * (
                after.end[:, :size] @ rest + pushes[1][:, k])
        both = before.motion @ (columns * (1 - share)) + after.motion @ (columns * share)
        read[low:high] = both.T.reshape(high - low, period, 6)
    motion.state[:] = rest
    motion.state[:half] += last
    picked = np.flatnonzero((first + np.arange(course.share.size)) % keep == 0)
    out[:picked.size] = read.reshape(-1, 6)[picked] + _static(nodes, cut, course.at(picked), "reading")
    return int(picked.size)


def _amplitudes(course: CourseArrays, period: int, feeds: int) -> list[FloatArray]:
    """Return by period the shares of the feeds of the table, what a step adds to them, and the shares times the way between
    nodes that a step goes."""
    start, middle, end = (course.at(np.s_[at::period]) for at in (0, period // 2, period - 1))
    count = max(period - 1, 1)
    shares = _feed_shares(middle.feed, feeds)
    way = (end.node - start.node + end.share - start.share) / count
    return [shares, (_feed_shares(end.feed, feeds) - _feed_shares(start.feed, feeds)) / count, way[:, None] * shares]


def _feed_shares(feed: FloatArray, feeds: int) -> FloatArray:
    """Return the shares of the feeds of the table, (k, feeds)."""
    at = feed * (feeds - 1)
    low = np.minimum(at.astype(int), max(feeds - 2, 0))
    rows, share = np.arange(len(at)), np.zeros((len(at), feeds))
    share[rows, low] = 1 - (at - low)
    if feeds > 1:
        share[rows, low + 1] = at - low
    return share


def _static(nodes: NodeArrays, cut: CutArrays, course: CourseArrays, what: str) -> FloatArray:
    """Return the deflection under the mean inputs at steps (k, n), or the tip's motion by it (k, 6)."""
    force = _feed_shares(course.feed, cut.table.shape[0]) @ cut.table.mean(axis=1)
    inputs = np.concatenate([force, course.loads], axis=1)
    result = np.empty((course.share.size, nodes.deflection.shape[2] if what == "deflection" else 6))
    for node in np.unique(course.node).tolist():
        rows = np.flatnonzero(course.node == node)
        t, part = course.share[rows, None], inputs[rows]
        maps, turn = nodes.deflection[node], nodes.deflection[node + 1] - nodes.deflection[node]
        if what == "deflection":
            result[rows] = part @ maps + t * (part @ turn)
            continue
        # (R + t dR)(S + t dS) f by powers of t.
        read, bend = nodes.reading[node].T, (nodes.reading[node + 1] - nodes.reading[node]).T
        result[rows] = part @ (maps @ read) + t * (part @ (maps @ bend + turn @ read)) + t**2 * (part @ (turn @ bend))
    return result


def _stretches(course: CourseArrays) -> Iterator[tuple[int, int, int, FloatArray]]:
    """Yield first and last + 1 of the periods between two nodes, the node before, and the shares of the way to the next."""
    edges = np.concatenate([[0], np.flatnonzero(np.diff(course.node)) + 1, [course.node.size]])
    for low, high in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        yield low, high, int(course.node[low]), course.share[low:high]


def _maps_about(nodes: NodeArrays, cut: CutArrays, node: int, known: dict[tuple[int, int], WholePeriod]) -> list[WholePeriod]:
    """Return the maps of a node and the next, which alone are known afterwards."""
    keys = [(id(cut.table), node), (id(cut.table), node + 1)]
    maps = [known[key] if key in known else _period_map(nodes, cut, key[1]) for key in keys]
    known.clear()
    known.update(zip(keys, maps, strict=True))
    return maps


def _period_map(nodes: NodeArrays, cut: CutArrays, node: int) -> WholePeriod:
    """Return the map of a period about a node."""
    phi, still, reading = nodes.transition[node].T, nodes.deflection[node].T, nodes.reading[node]
    half, size, period = still.shape[0], len(phi), cut.table.shape[1]
    free, power = np.concatenate([reading, np.zeros((6, size - half))], axis=1), phi
    while len(free) < 6 * (period + 1):  # R, R Phi, R Phi^2, ... by doubling
        free = np.concatenate([free, free[:6 * (period + 1) - len(free)] @ power])
        power = power @ power
    whole = np.linalg.matrix_power(phi, period)
    # A deflection that changes by d a step leaves -(Phi + Phi^2 + ...) d.
    summed = np.cumsum(free[6:].reshape(period, 6, size), axis=0)[..., :half].reshape(6 * period, half)
    lag = np.linalg.solve(np.eye(size) - phi, (phi - phi @ whole)[:, :half])
    alternating = np.swapaxes(cut.table - cut.table.mean(axis=1, keepdims=True), 0, 1)
    before, after = max(node - 1, 0), min(node + 1, len(nodes.transition) - 1)
    slopes = [(values[after] - values[before]).T / (after - before) for values in (nodes.transition, nodes.deflection)]
    states = _forced(phi, still, alternating, (slopes[0], slopes[1]), whole)
    answers = (reading @ states[1:, :half]).reshape(6 * period, -1)
    return WholePeriod(np.concatenate([whole, states[-1], -lag], axis=1), np.concatenate([free[6:], answers, -summed], axis=1))


def _forced(phi: FloatArray, still: FloatArray, force: FloatArray, slopes: tuple[FloatArray, FloatArray],
            whole: FloatArray) -> FloatArray:
    """Return the states in a period from rest (m + 1, z, 3 s) to forces (m, s, 3) about their mean: held at one amplitude;
    growing by one a step about the middle; and under a structure that moves on by one node a step about the middle.

    Without the last two the amplitudes would jump from period to period, each jump a push that is not there.
    """
    period, feeds, _ = force.shape
    size, half = len(phi), len(still)
    static, turned = (np.einsum("ha,mfa->mhf", values[:, :3], force) for values in (still, slopes[1]))
    states = np.zeros((period + 1, size, 3 * feeds))

    def step(state: FloatArray, about: FloatArray) -> FloatArray:
        low = state.copy()
        low[:half] -= about
        low = phi @ low
        low[:half] += about
        return low

    state: FloatArray = np.zeros((size, feeds))
    for j in range(period):
        state = step(state, static[j])
    swing = np.linalg.solve(np.eye(size) - whole, state)  # the state that repeats
    for j in range(period):
        since = j - period // 2
        about = np.concatenate([static[j], since * static[j], since * turned[j]], axis=1)
        states[j + 1] = step(states[j], about)
        rest = swing.copy()
        rest[:half] -= static[j]
        states[j + 1, :, 2 * feeds:] += since * (slopes[0] @ rest)
        swing = step(swing, static[j])
    return states
