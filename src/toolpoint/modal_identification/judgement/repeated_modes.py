r"""Modes that one structure shows once in every set-up of sensors, because their mass moves its frequencies.

A roving accelerometer of mass m changes a mode of unit modal mass by :math:`\Delta f / f = -m \sum_p \phi_p^2 / 2` over the
points p that carry one. Responses of several set-ups then hold every mode at several frequencies: each is seen at the points
of its own set-up alone, and all with the same share of the reference (Ewins, Modal Testing, 2nd ed., section 3.11).

No structure has such modes of its own. Modes of two bodies that hardly feel each other answer a reference each, so their
participation differs; bending in two planes parts directions, not points; and a mode that answers a reference moves there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import BoolArray, FloatArray
from toolpoint._doubt import Doubt
from toolpoint.vibration.driving_point import driving_points
from toolpoint.vibration.modes import Modes

MAX_RATIO = 1.12  # of the frequencies at which one mode is seen: heavier sensors make another structure
MAX_OVERLAP = 0.02  # of the power of two modes that are seen at points apart: what noise and the fit leave
MIN_ALIKE = 0.9  # correlation of the participation of one mode seen twice
MIN_SHARE = 0.02  # of the power of a mode at its points, below which a response does not say whose it is
MIN_POINTS = 2  # of each set-up, in several modes; three where one mode alone is seen twice
MIN_AGREEMENT = 0.95  # of the responses that two repeated modes put into the same set-ups
MAX_AT_REFERENCE = 0.1  # of its largest residue that a mode may have at a driving point of another set-up


@dataclass(frozen=True, eq=False)
class RepeatedModes:
    """Modes seen once in every set-up of sensors.

    Parameters
    ----------
    members : tuple of tuples of int
        Indices of the modes that are one, lowest first; one a set-up, fewer where a set-up does not show it.
    strongest : tuple of int
        Of each, the one that moves its responses most.
    setup : (n_outputs,) ints
        Set-up of every output; -1 where no mode shows it.
    setup_of_mode : (n_modes,) ints
        Set-up in which each mode is seen; -1 for one that several show.
    """

    members: tuple[tuple[int, ...], ...]
    strongest: tuple[int, ...]
    setup: np.ndarray
    setup_of_mode: np.ndarray

    def doubt(self, modes: Modes) -> Doubt:
        """Return what was seen, with frequencies, points and the remedy."""
        pairs = ", ".join(" and ".join(str(k + 1) for k in member) for member in self.members[:6])
        continuation = f" (and {len(self.members) - 6} more)" if len(self.members) > 6 else ""
        ratios = [float(modes.frequency[member[-1]] / modes.frequency[member[0]]) for member in self.members]
        spread = f"{100 * (min(ratios) - 1):.2g}" + (f" to {100 * (max(ratios) - 1):.2g}" if
                                                     max(ratios) - min(ratios) > 0.1 * (max(ratios) - 1) else "")
        points = _points(modes, self.setup == self.setup[self.setup >= 0].min())
        return Doubt(f"modes {pairs}{continuation}",
                     f"each is seen {spread} % apart at points that differ (one set-up: {points}) and "
                     "with the same share of the reference: one mode under another mass of sensors, or a structure that has "
                     "changed between the set-ups", "count them once; give the sensor's mass (`sensor_mass`) to join them, "
                     "measure with a lighter sensor, or put a dummy of its mass at every other point", figure=max(ratios) - 1)


def find_repeated_modes(modes: Modes) -> RepeatedModes | None:
    """Return the modes that are seen once in every set-up; None where there are none.

    modes : shapes (n_outputs, n_modes) with their participation (n_inputs, n_modes).
    """
    if modes.count < 2 or modes.participation is None or len(modes.dofs) < 2 * MIN_POINTS:
        return None
    residue = np.abs(modes.shape) * np.linalg.norm(modes.participation, axis=0)
    size = residue / np.maximum(np.abs(modes.damping_ratio) * modes.frequency, 1e-300)
    candidates = _candidates(modes, size)
    groups = _largest_agreement(candidates, size)
    if not groups:
        return None
    setup = _setups(groups, size, modes)
    counts = np.unique(setup[setup >= 0], return_counts=True)[1]
    min_points = MIN_POINTS if len(groups) > 1 else MIN_POINTS + 1
    if (counts.size < 2 or counts.min() < min_points or not _separates_points(modes, setup)
            or _moves_at_reference(modes, groups, setup)):
        return None
    of_mode = _setups_of_modes(size, setup)
    members = _members(modes, of_mode)
    return RepeatedModes(tuple(members), tuple(max(member, key=lambda k: float(size[:, k].max())) for member in members), setup,
                         of_mode)


def _candidates(modes: Modes, size: FloatArray) -> list[tuple[int, ...]]:
    """Return runs of neighbouring modes that are seen apart from each other, with the same participation."""
    runs, k = list[tuple[int, ...]](), 0
    while k < modes.count:
        run = [k]
        while run[-1] + 1 < modes.count and all(_is_repetition(modes, size, i, run[-1] + 1) for i in run):
            run.append(run[-1] + 1)
        if len(run) > 1:
            runs.append(tuple(run))
        k = run[-1] + 1
    return runs


def _is_repetition(modes: Modes, size: FloatArray, i: int, j: int) -> bool:
    """Whether two modes of close frequency and equal participation are seen at different points."""
    if modes.frequency[j] > MAX_RATIO * modes.frequency[i]:
        return False
    if not _has_same_participation(modes, i, j):
        return False
    pair = size[:, [i, j]] ** 2
    powers = pair.sum(axis=0)
    overlap = float(pair.min(axis=1).sum() / max(float(powers.min()), 1e-300))
    return overlap < MAX_OVERLAP


def _largest_agreement(candidates: list[tuple[int, ...]], size: FloatArray) -> list[tuple[int, ...]]:
    """Return the largest set of candidates that part the responses alike."""
    best: list[tuple[int, ...]] = []
    for first in candidates:
        group = [other for other in candidates if len(other) == len(first) and _agree(first, other, size)]
        if len(group) > len(best):
            best = group
    return best


def _agree(first: Sequence[int], second: Sequence[int], size: FloatArray) -> bool:
    """Whether two candidates separate the responses into the same groups."""
    labels_first, labels_second = _labels(first, size), _labels(second, size)
    is_labelled = (labels_first >= 0) & (labels_second >= 0)
    if is_labelled.sum() < 2 * MIN_POINTS:
        return False
    labels_first, labels_second = labels_first[is_labelled], labels_second[is_labelled]
    # The set-up of the lower frequency may change from mode to mode: only the grouping is compared.
    pairs_first, pairs_second = labels_first[:, None] == labels_first, labels_second[:, None] == labels_second
    return bool((pairs_first == pairs_second).mean() >= MIN_AGREEMENT)


def _labels(member: Sequence[int], size: FloatArray) -> np.ndarray:
    """Return the member that shows each response, -1 where none stands out."""
    sizes = size[:, list(member)]
    strongest = sizes.argmax(axis=1)
    level = sizes.max(axis=1) ** 2
    typical = (sizes**2).sum(axis=0) / np.maximum((sizes**2 > MIN_SHARE * (sizes**2).max(axis=0)).sum(axis=0), 1)
    runner_up = np.sort(sizes, axis=1)[:, -2] ** 2
    return np.where((level > MIN_SHARE * typical[strongest]) & (runner_up < 0.25 * level), strongest, -1)


def _setups(members: list[tuple[int, ...]], size: FloatArray, modes: Modes) -> np.ndarray:
    """Return the set-up of every response by the votes of all repeated modes, -1 where nothing says it."""
    reference = _labels(members[0], size)
    number = len(members[0])
    votes = np.zeros((size.shape[0], number))
    for member in members:
        labels = _labels(member, size)
        table = np.array([[((labels == a) & (reference == b)).sum() for b in range(number)] for a in range(number)])
        for place in range(number):
            votes[labels == place, int(table[place].argmax())] += 1
    setup = np.where(votes.max(axis=1) > 0, votes.argmax(axis=1), -1)
    by_point: dict[int | str, int] = {dof.point: int(k) for dof, k in zip(modes.dofs, setup, strict=True) if k >= 0}
    return np.array([k if k >= 0 else by_point.get(dof.point, -1) for dof, k in zip(modes.dofs, setup, strict=True)])


def _setups_of_modes(size: FloatArray, setup: np.ndarray) -> np.ndarray:
    """Return the set-up whose responses hold each mode; -1 where several do."""
    power = np.array([(size[setup == k] ** 2).sum(axis=0) for k in range(int(setup.max()) + 1)])
    share = power / np.maximum(power.sum(axis=0), 1e-300)
    return np.where(share.max(axis=0) > 1 - 2 * MAX_OVERLAP, share.argmax(axis=0), -1)


def _members(modes: Modes, setup_of_mode: np.ndarray) -> list[tuple[int, ...]]:
    """Return runs of neighbouring modes of different set-ups that are near enough to be one."""
    members, k = list[tuple[int, ...]](), 0
    while k < modes.count:
        run = [k]
        while (other := run[-1] + 1) < modes.count and setup_of_mode[other] >= 0 <= setup_of_mode[k] and (
                setup_of_mode[other] not in setup_of_mode[run]) and (
                modes.frequency[other] < MAX_RATIO * modes.frequency[k]) and _has_same_participation(modes, k, other):
            run.append(other)
        if len(run) > 1:
            members.append(tuple(run))
        k = run[-1] + 1
    return members


def _has_same_participation(modes: Modes, i: int, j: int) -> bool:
    """Whether two modes have the same participation up to a factor."""
    assert modes.participation is not None
    first, second = modes.participation[:, i], modes.participation[:, j]
    return bool(abs(np.vdot(first, second)) >= MIN_ALIKE * float(np.linalg.norm(first) * np.linalg.norm(second)))


def _separates_points(modes: Modes, setup: np.ndarray) -> bool:
    """Whether the set-ups part points that are measured in the same direction: bending in two planes parts directions."""
    axes = [{dof.direction[1:] for dof, k in zip(modes.dofs, setup, strict=True) if k == place}
            for place in np.unique(setup[setup >= 0])]
    return bool(set.intersection(*axes))


def _moves_at_reference(modes: Modes, members: list[tuple[int, ...]], setup: np.ndarray) -> bool:
    """Whether a mode moves at a driving point of another set-up, as modes of a structure do that answer it."""
    assert modes.participation is not None
    size = np.abs(modes.shape)
    for point in driving_points(modes.dofs, modes.input_dofs):
        for member in members:
            relative_size = size[point.row, list(member)] / size[:, list(member)].max(axis=0)
            if np.sort(relative_size)[-2] > MAX_AT_REFERENCE:
                return True
    return False


def _points(modes: Modes, chosen: BoolArray) -> str:
    """Return the names of some points."""
    names = list(dict.fromkeys(str(dof.point) for dof, inside in zip(modes.dofs, chosen, strict=True) if inside))
    return ", ".join(names[:8]) + (f" and {len(names) - 8} more" if len(names) > 8 else "")
