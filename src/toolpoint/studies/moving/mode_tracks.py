"""Modes followed from window to window of a record during which the machine changes slowly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.vibration import Modes, Record
from toolpoint.vibration.correlation import assign_modes

MIN_TRACK_MAC = 0.8  # of a mode and its neighbour in the next window
MAX_TRACK_JUMP = 0.08  # relative, of its frequency from window to window
MIN_TRACK_WINDOWS = 4  # in which a mode must be seen to be followed


@dataclass(frozen=True, eq=False)
class TraverseWindow:
    """Part of a record with what changed during it: the value in its middle and how far it went (m, rad, m/s ..).

    >>> from toolpoint.vibration import Record
    >>> window = TraverseWindow(Record(np.zeros((1000, 1)), 100.0, ["tip:+x"], "acceleration"), value=-0.2, extent=0.05)
    >>> window.record.duration
    10.0
    """

    record: Record
    value: float
    extent: float = 0.0


@dataclass(frozen=True, eq=False)
class ModeTrack:
    """A mode over windows.

    windows : (n,) numbers of the windows in which it was seen; frequency, damping_ratio : (n,); deviations : (n, 2), standard
    deviations of both; shapes : (n_dofs, n), of displacement.
    """

    windows: FloatArray
    frequency: FloatArray
    damping_ratio: FloatArray
    deviations: FloatArray
    shapes: FloatArray


def cut_windows(record: Record, ends: tuple[float, float], number: int) -> list[TraverseWindow]:
    """Return the equal parts of a record during which an axis moved steadily from one of the ends to the other.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.studies import cut_windows
    >>> from toolpoint.vibration import Record
    >>> record = Record(np.zeros((1000, 1)), 100.0, ["tool:+x"], "acceleration")
    >>> [(round(window.value, 6), window.record.duration) for window in cut_windows(record, (-0.2, 0.2), 2)]
    [(-0.1, 5.0), (0.1, 5.0)]
    """
    if number < MIN_TRACK_WINDOWS - 2:
        fail("number", str(number), f"must be at least {MIN_TRACK_WINDOWS - 2} windows")
    size = record.samples.shape[0] // number
    extent = (ends[1] - ends[0]) / number
    return [TraverseWindow(record.between((k * size - 0.5) / record.sample_rate + record.start,
                                          ((k + 1) * size - 0.5) / record.sample_rate + record.start),
                           ends[0] + (k + 0.5) * extent, abs(extent)) for k in range(number)]


def track_modes(modes: Sequence[Modes]) -> list[ModeTrack]:
    """Return the modes that are seen in most of the windows, each followed by its shape and its frequency, lowest first."""
    chains: list[list[tuple[int, int]]] = []
    for window, current in enumerate(modes):
        is_free = np.ones(current.count, bool)
        last = [chain for chain in chains if window - chain[-1][0] <= 2]
        for chain, partner in _continue_chains(last, modes, current):
            chain.append((window, partner))
            is_free[partner] = False
        chains += [[(window, k)] for k in np.flatnonzero(is_free).tolist()]
    needed = max(MIN_TRACK_WINDOWS, (len(modes) + 1) // 2)
    tracks = [_track(chain, modes) for chain in chains if len(chain) >= min(needed, len(modes))]
    return sorted(tracks, key=lambda track: float(np.median(track.frequency)))


def _continue_chains(chains: list[list[tuple[int, int]]], modes: Sequence[Modes], current: Modes
                     ) -> list[tuple[list[tuple[int, int]], int]]:
    """Return the chains that go on in a window, each with its mode there."""
    if not chains or not current.count:
        return []
    ends = [modes[chain[-1][0]].selected([chain[-1][1]]) for chain in chains]
    previous = Modes(np.array([end.frequency[0] for end in ends]), np.zeros(len(ends)),
                     np.concatenate([end.shape for end in ends], axis=1), current.dofs, "unscaled")
    rows, columns, values = assign_modes(previous, current)
    jumps = np.abs(np.log(current.frequency[columns] / previous.frequency[rows]))
    return [(chains[row], int(column)) for row, column, value, jump in zip(rows, columns, values, jumps, strict=True)
            if value >= MIN_TRACK_MAC and jump <= MAX_TRACK_JUMP]


def _track(chain: Sequence[tuple[int, int]], modes: Sequence[Modes]) -> ModeTrack:
    parts = [modes[window].selected([place]) for window, place in chain]
    covariance = [np.zeros((2, 2)) if part.covariance is None else part.covariance[0] for part in parts]
    return ModeTrack(np.array([window for window, _ in chain]), np.array([float(part.frequency[0]) for part in parts]),
                     np.array([float(part.damping_ratio[0]) for part in parts]),
                     np.sqrt(np.array([np.diag(each) for each in covariance])),
                     np.concatenate([part.shape for part in parts], axis=1))
