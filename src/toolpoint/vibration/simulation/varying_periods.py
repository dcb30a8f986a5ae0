r"""Whole periods of a periodic input at once along a path: several times quicker than single steps, without feedback.

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
    """Maps of a period about a node.

    Columns: the state, the shares of the feeds of the table in three ways (see `_forced`), and the change of the static
    deflection a step. end (z, z + 3 s + n): state at the end; motion (6 m, ...): tip after every step.
    """

    end: FloatArray
    motion: FloatArray


def advance_periods(nodes: NodeArrays, cut: CutArrays, course: CourseArrays, *, motion: RunArrays, keep: int, first: int,
                    out: FloatArray, maps: dict[tuple[int, int], WholePeriod]) -> int:
    """Advance a block of steps by whole periods of the table; arguments and result as of `varying_kernel.advance`.

    maps : the last maps, by table and node, kept from block to block (empty at first). Steps before the first whole period and
    after the last are advanced one by one. Not for feedback of the chip, energies and what acts on the base.
    """
    from toolpoint.vibration.simulation.varying_kernel import advance

    steps, period = course.share.size, cut.table.shape[1]
    first_period = min(-first % period, steps)
    last_period = first_period + (steps - first_period) // period * period
    no_base = np.empty((0, 9))

    def single_steps(start: int, stop: int, n_written: int) -> int:
        part = course.at(np.s_[start:stop])
        return int(advance(nodes, cut, part, motion, keep, first + start, out[n_written:], no_base)) if stop > start else 0

    n_written = single_steps(0, first_period, 0)
    if last_period > first_period:
        part = course.at(np.s_[first_period:last_period])
        n_written += _whole_periods(nodes, cut, part, motion, keep, first + first_period, out[n_written:], maps)
    return n_written + single_steps(last_period, steps, n_written)


def _whole_periods(nodes: NodeArrays, cut: CutArrays, course: CourseArrays, motion: RunArrays, keep: int, first: int,
                   out: FloatArray, maps: dict[tuple[int, int], WholePeriod]) -> int:
    """Advance whole periods: vibration about the static deflection, by maps of two nodes blended at the period's middle."""
    period, count = cut.table.shape[1], course.share.size // cut.table.shape[1]
    static = _static(nodes, cut, course.at(np.s_[::period]), "deflection")
    static_end = _static(nodes, cut, course.at(np.s_[-1:]), "deflection")[0]
    change = np.diff(static, axis=0,
                     append=(static[-1] + (static_end - static[-1]) * period / max(period - 1, 1))[None]) / period
    half_way = course.at(np.s_[period // 2::period])
    inputs = np.concatenate([*_amplitudes(course, period, cut.table.shape[0]), change], axis=1)
    n_coordinates, size = static.shape[1], motion.state.size
    vibration = motion.state.copy()
    vibration[:n_coordinates] -= static[0] - change[0]
    motions = np.empty((count, period, 6))
    for start, stop, node, share in _stretches(half_way):
        map_before, map_after = _maps_about(nodes, cut, node, maps)
        columns = np.empty((size + inputs.shape[1], stop - start))
        columns[size:] = inputs[start:stop].T
        forced = [part.end[:, size:] @ columns[size:] for part in (map_before, map_after)]
        for k, t in enumerate(share):
            columns[:size, k] = vibration
            vibration = (1 - t) * (map_before.end[:, :size] @ vibration + forced[0][:, k]) + t * (
                map_after.end[:, :size] @ vibration + forced[1][:, k])
        tip = map_before.motion @ (columns * (1 - share)) + map_after.motion @ (columns * share)
        motions[start:stop] = tip.T.reshape(stop - start, period, 6)
    motion.state[:] = vibration
    motion.state[:n_coordinates] += static_end
    written = np.flatnonzero((first + np.arange(course.share.size)) % keep == 0)
    out[:written.size] = motions.reshape(-1, 6)[written] + _static(nodes, cut, course.at(written), "reading")
    return int(written.size)


def _amplitudes(course: CourseArrays, period: int, feeds: int) -> list[FloatArray]:
    """Return the amplitudes of every period's inputs.

    The shares of the feeds of the table, what a step adds to them, and the shares times the fraction of the way between nodes
    that a step goes.
    """
    start, half_way, end = (course.at(np.s_[offset::period]) for offset in (0, period // 2, period - 1))
    count = max(period - 1, 1)
    shares = _feed_shares(half_way.feed, feeds)
    progress = (end.node - start.node + end.share - start.share) / count
    return [shares, (_feed_shares(end.feed, feeds) - _feed_shares(start.feed, feeds)) / count, progress[:, None] * shares]


def _feed_shares(feed: FloatArray, feeds: int) -> FloatArray:
    """Return the shares of the feeds of the table, (k, feeds)."""
    position = feed * (feeds - 1)
    row = np.minimum(position.astype(int), max(feeds - 2, 0))
    rows, share = np.arange(len(position)), np.zeros((len(position), feeds))
    share[rows, row] = 1 - (position - row)
    if feeds > 1:
        share[rows, row + 1] = position - row
    return share


def _static(nodes: NodeArrays, cut: CutArrays, course: CourseArrays, quantity: str) -> FloatArray:
    """Return the deflection under the mean inputs at steps (k, n), or the tip's motion by it (k, 6)."""
    force = _feed_shares(course.feed, cut.table.shape[0]) @ cut.table.mean(axis=1)
    inputs = np.concatenate([force, course.loads], axis=1)
    result = np.empty((course.share.size, nodes.deflection.shape[2] if quantity == "deflection" else 6))
    for node in np.unique(course.node).tolist():
        rows = np.flatnonzero(course.node == node)
        t, forces = course.share[rows, None], inputs[rows]
        maps, slope = nodes.deflection[node], nodes.deflection[node + 1] - nodes.deflection[node]
        if quantity == "deflection":
            result[rows] = forces @ maps + t * (forces @ slope)
            continue
        # (R + t dR)(S + t dS) f by powers of t.
        reading, turn = nodes.reading[node].T, (nodes.reading[node + 1] - nodes.reading[node]).T
        result[rows] = forces @ (maps @ reading) + t * (forces @ (maps @ turn
                                                                  + slope @ reading)) + t**2 * (forces @ (slope @ turn))
    return result


def _stretches(course: CourseArrays) -> Iterator[tuple[int, int, int, FloatArray]]:
    """Yield first and last + 1 of the periods between two nodes, the node before, and the shares of the way to the next."""
    edges = np.concatenate([[0], np.flatnonzero(np.diff(course.node)) + 1, [course.node.size]])
    for start, stop in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        yield start, stop, int(course.node[start]), course.share[start:stop]


def _maps_about(nodes: NodeArrays, cut: CutArrays, node: int, maps: dict[tuple[int, int], WholePeriod]) -> list[WholePeriod]:
    """Return the maps of a node and the next; all others are dropped from `maps`, as the path does not come back."""
    keys = [(id(cut.table), node), (id(cut.table), node + 1)]
    maps_of_pair = [maps[key] if key in maps else _period_map(nodes, cut, key[1]) for key in keys]
    maps.clear()
    maps.update(zip(keys, maps_of_pair, strict=True))
    return maps_of_pair


def _period_map(nodes: NodeArrays, cut: CutArrays, node: int) -> WholePeriod:
    """Return the map of a period about a node."""
    phi, static, reading = nodes.transition[node].T, nodes.deflection[node].T, nodes.reading[node]
    n_coordinates, size, period = static.shape[0], len(phi), cut.table.shape[1]
    free_motion, power = np.concatenate([reading, np.zeros((6, size - n_coordinates))], axis=1), phi
    while len(free_motion) < 6 * (period + 1):  # R, R Phi, R Phi^2, ... by doubling
        free_motion = np.concatenate([free_motion, free_motion[:6 * (period + 1) - len(free_motion)] @ power])
        power = power @ power
    period_transition = np.linalg.matrix_power(phi, period)
    # A deflection that changes by d a step leaves -(Phi + Phi^2 + ...) d.
    summed = np.cumsum(free_motion[6:].reshape(period, 6, size), axis=0)[..., :n_coordinates].reshape(6 * period, n_coordinates)
    lag = np.linalg.solve(np.eye(size) - phi, (phi - phi @ period_transition)[:, :n_coordinates])
    alternating = np.swapaxes(cut.table - cut.table.mean(axis=1, keepdims=True), 0, 1)
    node_before, node_after = max(node - 1, 0), min(node + 1, len(nodes.transition) - 1)
    slopes = [(values[node_after] - values[node_before]).T / (node_after - node_before)
              for values in (nodes.transition, nodes.deflection)]
    states = _forced(phi, static, alternating, (slopes[0], slopes[1]), period_transition)
    answers = (reading @ states[1:, :n_coordinates]).reshape(6 * period, -1)
    return WholePeriod(np.concatenate([period_transition, states[-1], -lag], axis=1),
                       np.concatenate([free_motion[6:], answers, -summed], axis=1))


def _forced(phi: FloatArray, static_map: FloatArray, force: FloatArray, slopes: tuple[FloatArray, FloatArray],
            period_transition: FloatArray) -> FloatArray:
    """Return the states in a period from rest (m + 1, z, 3 s) to forces (m, s, 3) about their mean: held at one amplitude;
    growing by one a step about the middle; and under a structure that moves on by one node a step about the middle.

    Without the last two the amplitudes would jump from period to period, and each jump would excite the structure.
    """
    period, feeds, _ = force.shape
    size, n_coordinates = len(phi), len(static_map)
    static, static_slope = (np.einsum("ha,mfa->mhf", values[:, :3], force) for values in (static_map, slopes[1]))
    states = np.zeros((period + 1, size, 3 * feeds))

    def step(state: FloatArray, equilibrium: FloatArray) -> FloatArray:
        shifted = state.copy()
        shifted[:n_coordinates] -= equilibrium
        shifted = phi @ shifted
        shifted[:n_coordinates] += equilibrium
        return shifted

    state: FloatArray = np.zeros((size, feeds))
    for j in range(period):
        state = step(state, static[j])
    periodic_state = np.linalg.solve(np.eye(size) - period_transition, state)  # the state that repeats
    for j in range(period):
        steps_since_middle = j - period // 2
        equilibrium = np.concatenate([static[j], steps_since_middle * static[j], steps_since_middle * static_slope[j]], axis=1)
        states[j + 1] = step(states[j], equilibrium)
        deviation = periodic_state.copy()
        deviation[:n_coordinates] -= static[j]
        states[j + 1, :, 2 * feeds:] += steps_since_middle * (slopes[0] @ deviation)
        periodic_state = step(periodic_state, static[j])
    return states
