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
from typing import NamedTuple, Protocol

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.vibration.simulation.varying import CourseArrays, CutArrays, NodeArrays, RunArrays


class WholePeriod(NamedTuple):
    """Maps of a period about a node.

    Columns: the state, the shares of the feeds of the table in three ways (see `_forced`), and the change of the static
    deflection a step. end (z, z + 3 s + n): state at the end; motion (6 m, ...): tip after every step.
    """

    end: FloatArray
    motion: FloatArray


class SteppedCourse(Protocol):
    """Course of a run that is asked for at some of its steps: `CourseArrays`, or one that computes them when asked."""

    @property
    def size(self) -> int:
        """Number of steps."""
        ...

    def at(self, steps: slice | IndexArray) -> CourseArrays:
        """Return some of the steps."""
        ...


def advance_periods(nodes: NodeArrays, cut: CutArrays, course: SteppedCourse, *, motion: RunArrays, keep: int, first: int,
                    out: FloatArray, maps: dict[tuple[int, int], WholePeriod]) -> int:
    """Advance a block of steps by whole periods of the table; arguments and result as of `varying_kernel.advance`.

    maps : the last maps, by table and node, kept from block to block (empty at first). Steps before the first whole period and
    after the last are advanced one by one; within them the course is asked for at three steps a period, and at those that are
    kept. Not for feedback of the chip, energies and what acts on the base.
    """
    from toolpoint.vibration.simulation.varying_kernel import advance

    steps, period = course.size, cut.table.shape[1]
    first_period = min(-first % period, steps)
    last_period = first_period + (steps - first_period) // period * period
    no_base = np.empty((0, 9))

    def single_steps(start: int, stop: int, n_written: int) -> int:
        part = course.at(np.s_[start:stop])
        return int(advance(nodes, cut, part, motion, keep, first + start, out[n_written:], no_base)) if stop > start else 0

    n_written = single_steps(0, first_period, 0)
    if last_period > first_period:
        part = _PeriodCourse(course, first_period, (last_period - first_period) // period, period)
        n_written += _whole_periods(nodes, cut, part, motion, keep, first + first_period, out[n_written:], maps)
    return n_written + single_steps(last_period, steps, n_written)


class _PeriodCourse(NamedTuple):
    """Whole periods of a course: the first of its steps, number of the periods and steps of each."""

    course: SteppedCourse
    begin: int
    number: int
    period: int

    def at(self, steps: IndexArray) -> CourseArrays:
        """Return some of the steps, counted from the first."""
        return self.course.at(self.begin + steps)

    def in_periods(self, step: int) -> CourseArrays:
        """Return one step of every period."""
        return self.at(step + self.period * np.arange(self.number))


def _whole_periods(nodes: NodeArrays, cut: CutArrays, course: _PeriodCourse, motion: RunArrays, keep: int, first: int,
                   out: FloatArray, maps: dict[tuple[int, int], WholePeriod]) -> int:
    """Advance whole periods: vibration about the static deflection, by maps of two nodes blended at the period's middle."""
    from toolpoint.vibration.simulation.varying_period_kernel import advance_vibration

    period, count = course.period, course.number
    static = _static(nodes, cut, course.in_periods(0), "deflection")
    static_end = _static(nodes, cut, course.at(np.array([period * count - 1])), "deflection")[0]
    change = np.diff(static, axis=0,
                     # The last period has none behind it: its change is led on from its own first to its last step.
                     append=(static[-1] + (static_end - static[-1]) * period / max(period - 1, 1))[None]) / period
    # Blended at the middle: what is linear along the period then cancels, and the error is of second order.
    half_way = course.in_periods(period // 2)
    inputs = np.concatenate([*_amplitudes(course, half_way, cut.table.shape[0]), change], axis=1)
    n_coordinates, size = static.shape[1], motion.state.size
    vibration = motion.state.copy()
    vibration[:n_coordinates] -= static[0] - change[0]
    starts = np.empty((count, size))
    written = np.arange(-first % keep, period * count, keep)
    motions = np.empty((written.size, 6))
    for start, stop, node, share in _stretches(half_way):
        pair = _maps_about(nodes, cut, node, maps)
        forced = [np.ascontiguousarray(inputs[start:stop] @ part.end[:, size:].T) for part in pair]
        transitions = [np.ascontiguousarray(part.end[:, :size].T) for part in pair]
        advance_vibration(transitions[0], transitions[1], forced[0], forced[1], np.ascontiguousarray(share), vibration,
                          starts[start:stop])
        columns = np.concatenate([starts[start:stop], inputs[start:stop]], axis=1)
        _read_kept(pair, columns, share, first=first + start * period, keep=keep,
                   out=motions[slice(*np.searchsorted(written, (start * period, stop * period)))])
    motion.state[:] = vibration
    motion.state[:n_coordinates] += static_end
    out[:written.size] = motions + _static(nodes, cut, course.at(written), "reading")
    return int(written.size)


def _read_kept(pair: list[WholePeriod], columns: FloatArray, share: FloatArray, *, first: int, keep: int, out: FloatArray
               ) -> None:
    """Write the tip's motion (k, 6) after the steps that are kept, of periods with inputs (periods, c) between two nodes.

    Periods whose kept steps have the same phases are read together: what is not kept is not computed.
    """
    period = len(pair[0].motion) // 6
    offset = (first + period * np.arange(len(share))) % keep
    counts = (period - 1 - (-offset) % keep) // keep + 1
    ends = np.cumsum(counts)
    for value in np.unique(offset):
        chosen = np.flatnonzero(offset == value)
        phases = np.arange((-value) % keep, period, keep)
        rows = (6 * phases[:, None] + np.arange(6)).ravel()
        part, t = columns[chosen], share[chosen, None]
        tip = ((1 - t) * part) @ pair[0].motion[rows].T + (t * part) @ pair[1].motion[rows].T
        out[(ends[chosen] - counts[chosen])[:, None] + np.arange(len(phases))] = tip.reshape(len(chosen), -1, 6)


def _amplitudes(course: _PeriodCourse, half_way: CourseArrays, feeds: int) -> list[FloatArray]:
    """Return the amplitudes of every period's inputs.

    The shares of the feeds of the table, what a step adds to them, and the shares times the fraction of the way between nodes
    that a step goes.
    """
    start, end = course.in_periods(0), course.in_periods(course.period - 1)
    count = max(course.period - 1, 1)
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
    # By identity: two tables of the same cut are rarely equal, and comparing them would cost as much as a period.
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
    # A geometric sum in closed form: no pole lies at one, as the structure is held.
    lag = np.linalg.solve(np.eye(size) - phi, (phi - phi @ period_transition)[:, :n_coordinates])
    alternating = np.swapaxes(cut.table - cut.table.mean(axis=1, keepdims=True), 0, 1)
    node_before, node_after = max(node - 1, 0), min(node + 1, len(nodes.transition) - 1)
    slopes = [(values[node_after] - values[node_before]).T / (node_after - node_before)
              for values in (nodes.transition, nodes.deflection)]
    states = _forced(phi, static, alternating, (slopes[0], slopes[1]), period_transition)
    answers = np.swapaxes(states[1:, :, :n_coordinates] @ reading.T, 1, 2).reshape(6 * period, -1)
    return WholePeriod(np.concatenate([period_transition, states[-1].T, -lag], axis=1),
                       np.concatenate([free_motion[6:], answers, -summed], axis=1))


def _forced(phi: FloatArray, static_map: FloatArray, force: FloatArray, slopes: tuple[FloatArray, FloatArray],
            period_transition: FloatArray) -> FloatArray:
    """Return the states in a period from rest (m + 1, 3 s, z) to forces (m, s, 3) about their mean: held at one amplitude;
    growing by one a step about the middle; and under a structure that moves on by one node a step about the middle.

    Without the last two the amplitudes would jump from period to period, and each jump would excite the structure.
    """
    from toolpoint.vibration.simulation.varying_period_kernel import answer_from_rest, sum_forced_states

    static, static_slope = (np.einsum("ha,mfa->mfh", values[:, :3], force) for values in (static_map, slopes[1]))
    columns = np.ascontiguousarray(phi.T)
    state = answer_from_rest(columns, np.ascontiguousarray(static))
    periodic_state = np.linalg.solve(np.eye(len(phi)) - period_transition, state.T).T  # the state that repeats
    return sum_forced_states(columns, np.ascontiguousarray(slopes[0].T), np.ascontiguousarray(static),
                         np.ascontiguousarray(static_slope), np.ascontiguousarray(periodic_state))
