r"""Responses of a part at the places of the cut: few distinct ones for each state, modes and what answers at once.

With the shape :math:`\phi_r` averaged over the height of the cut, :math:`G = \sum_r \phi_r \phi_r^T / (\omega_r^2 -
\omega^2 + 2 i \zeta_r \omega_r \omega) + R`, where R is the static response of the stage before less that of its modes, written
as stiff modes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.bodies.solid.cut_solid import CutSolid
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.machining.thin_walls.part_stages import PartStage
from toolpoint.studies.machining.thin_walls.part_states import PartState
from toolpoint.studies.machining.thin_walls.wall_contacts import WallContacts
from toolpoint.vibration import Dof, Modes
from toolpoint.vibration.sparse.factorisation import Factorisation

WORK_LABELS = tuple(Dof("work", way) for way in ("+x", "+y", "+z"))
GROUP_STEP = 0.1  # of the largest amplitude of a state, within which places are one
STIFF_FREQUENCY_RATIO = 4.0  # of the highest mode: where the modes stand that answer at once
MIN_JUDGED_SHARE = 0.05  # of the largest compliance of a stage: stiffer places are not asked how evenly they move
MIN_MODE_SHARE = 0.01  # of the largest peak of a place: a mode with a smaller one answers at once
_MIN_RESIDUAL_SHARE = 1e-3  # of the static response: a smaller part of what answers at once is left out


@dataclass(frozen=True, eq=False)
class PartResponses:
    """Responses at places of one state: group (k,) of each place, the place that stands for each group (the one that gives way
    most), modes of each group, distance (k,) of places from the part, m, spread (k,) of the compliance over the cut's height:
    mean square over squared mean of the motion along the wall's normal."""

    group: IndexArray
    leader: IndexArray
    modes: tuple[Modes, ...]
    distance: FloatArray
    spread: FloatArray


def respond(state: PartState, contacts: WallContacts, members: IndexArray, *, cut: CutSolid, inverse: Factorisation,
            damping: str) -> PartResponses:
    """Return the responses of a state at some contacts.

    inverse : factors of the stiffness of the stage before it, of which what answers at once is taken; damping : of the modes,
    ``viscous`` or ``structural``.
    """
    count, heights = members.size, contacts.places.shape[1]
    located = state.locate(cut, contacts.places[members].reshape(-1, 3))
    motion = state.motion(located).reshape(count, heights, 3, -1)
    omega = 2 * np.pi * state.frequency
    mean = motion.mean(axis=1)
    amplitude = mean / omega
    group, leader = _group(amplitude)
    along = np.einsum("khcm,kc->khm", motion / omega, contacts.wall[members])
    mean_square, square = (along.mean(axis=1) ** 2).sum(axis=1), (along**2).mean(axis=1).sum(axis=1)
    # Where the wall hardly moves its mean may vanish; nothing rests on it there.
    spread = np.where(mean_square > MIN_JUDGED_SHARE * mean_square.max(), square / np.maximum(mean_square, 1e-300), 1.0)
    static = _static(state.around[0], inverse, located.nodes.reshape(count, heights, -1)[leader],
                     located.values.reshape(count, heights, -1)[leader])
    base = located.motion(state.around[0].shapes).reshape(count, heights, 3, -1).mean(axis=1)[leader]
    base /= 2 * np.pi * state.around[0].frequency
    residual = static - base @ np.swapaxes(base, 1, 2)
    modes = tuple(_modes(state, mean[place], residual[k], damping) for k, place in enumerate(leader.tolist()))
    return PartResponses(group, leader, modes, located.distance.reshape(count, heights).max(axis=1), spread)


def _group(amplitude: FloatArray) -> tuple[IndexArray, IndexArray]:
    """Return groups of places of like amplitudes (k, 3, modes), whatever their sign, and the member that gives way most."""
    rows, size = amplitude.copy(), np.abs(amplitude)
    largest = np.take_along_axis(rows, size.argmax(axis=1)[:, None, :], axis=1)
    rows *= np.where(largest < 0, -1.0, 1.0)
    step = GROUP_STEP * max(float(np.sqrt((size**2).sum(axis=(1, 2))).max()), 1e-300)
    keys = np.rint(rows.reshape(len(rows), -1) / step).astype(np.int64)
    _, group = np.unique(keys, axis=0, return_inverse=True)
    group = group.reshape(-1)
    strength = (amplitude**2).sum(axis=(1, 2))
    leader = np.zeros(int(group.max()) + 1, np.int64)
    order = np.argsort(strength, kind="stable")
    leader[group[order]] = order  # written last gives way most
    return group, leader


def _static(stage: PartStage, inverse: Factorisation, nodes: IndexArray, values: FloatArray) -> FloatArray:
    """Return the static responses (k, 3, 3), m/N, of a force spread over the heights of places (k, heights, nodes)."""
    count, size = len(nodes), stage.shapes.shape[0]
    load = np.zeros((size, 3 * count))
    for k in range(count):
        for way in range(3):
            np.add.at(load[:, 3 * k + way], 3 * nodes[k].ravel() + way, values[k].ravel() / values.shape[1])
    free = load[stage.state.free]
    response = (free.T @ inverse.solve(free)).reshape(count, 3, count, 3)
    static = response[np.arange(count), :, np.arange(count)]
    return np.asarray(0.5 * (static + np.swapaxes(static, 1, 2)))


def _modes(state: PartState, shape: FloatArray, residual: FloatArray, damping: str) -> Modes:
    """Return the modes (3, m) at a place that count there, and up to three stiff ones for all others.

    residual : (3, 3), m/N, static response of what lies above the modes.
    """
    peak = (shape**2).sum(axis=0) / (state.frequency**2 * state.damping_ratio)
    chosen = peak >= MIN_MODE_SHARE * peak.max()
    amplitude = shape / (2 * np.pi * state.frequency)
    static = residual + amplitude @ amplitude.T
    residual = residual + amplitude[:, ~chosen] @ amplitude[:, ~chosen].T
    shape = shape[:, chosen]
    values, vectors = np.linalg.eigh(residual)
    kept = values > _MIN_RESIDUAL_SHARE * np.trace(static)
    stiff = STIFF_FREQUENCY_RATIO * state.frequency[-1]
    frequency = np.concatenate([state.frequency[chosen], np.full(int(kept.sum()), stiff)])
    ratio = np.concatenate([state.damping_ratio[chosen], np.full(int(kept.sum()), state.damping_ratio[-1])])
    return Modes(frequency, ratio, np.hstack([shape, vectors[:, kept] * np.sqrt(values[kept]) * 2 * np.pi * stiff]),
                 WORK_LABELS, damping=damping)


def dynamics_of(modes: Modes, words: str) -> ToolDynamics:
    """Return the dynamics of the work at a place, along the program's x and y."""
    return ToolDynamics(modes, str(WORK_LABELS[0]), str(WORK_LABELS[1]), what=words)
