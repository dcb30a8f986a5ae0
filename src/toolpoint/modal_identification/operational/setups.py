r"""Set-ups of roving sensors: identified one by one, joined by the channels that they share.

Modes of two set-ups are one where their frequencies are near and their shapes at the shared channels are alike. Shapes are
scaled to the first by least squares at these channels, frequencies and damping ratios are weighted by their covariance
(post-separate estimation re-scaling: Mevel, Basseville, Benveniste, Goursat, JSV 257 (2002) 1121; Reynders, Magalhaes, De
Roeck, Cunha, IMAC 27 (2009)).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, fail
from toolpoint._doubt import Doubt
from toolpoint.modal_identification.operational.record_doubts import question_setup_frequencies
from toolpoint.modal_identification.operational.result import OperationalIdentification
from toolpoint.vibration.dof import Dof
from toolpoint.vibration.modes import Modes
from toolpoint.vibration.record import Record

MAX_FREQUENCY_SHIFT = 0.03  # relative, of one mode between set-ups
MIN_SHARED_MAC = 0.8  # at the shared channels (of two or more)
MAX_SETUP_DEVIATIONS = 4.0  # of a frequency from the mean of the set-ups


@dataclass(frozen=True)
class Setup:
    """Records of the same channels, and the labels of their references."""

    records: tuple[Record, ...]
    references: tuple[str, ...]


def check_setups(records: Sequence[Record], references: Sequence[str] | None) -> list[Setup]:
    """Return the records by set-up, with the references: those asked for, else the channels that all set-ups share.

    Raises ToolpointError for no record, rates that differ within a set-up, an unknown reference, or set-ups that share no
    channel.
    """
    if not records:
        fail("records", "none", "must be at least one")
    groups: dict[tuple[str, ...], list[Record]] = {}
    for record in records:
        groups.setdefault(tuple(str(dof) for dof in record.channels), []).append(record)
    for members in groups.values():
        rates = {record.sample_rate for record in members}
        if len(rates) > 1:
            fail("records", f"sample rates {', '.join(f'{rate:g}' for rate in sorted(rates))} Hz",
                 "must be one for the same channels",
                 remedy="resample them first")
    shared = [name for name in next(iter(groups)) if all(name in names for names in groups)]
    if len(groups) > 1 and not shared:
        fail("records", f"{len(groups)} set-ups without a common channel", "must share at least one that stays (a reference)",
             remedy="a sensor must stay in place while the others are moved")
    chosen = list(references) if references is not None else (shared if len(groups) > 1 else [])
    for name in chosen:
        if not all(name in names for names in groups):
            fail("references", repr(name), "must be a channel of every record",
                 remedy=f"there are {', '.join(next(iter(groups)))}")
    return [Setup(tuple(members), tuple(chosen)) for members in groups.values()]


def join_setups(parts: Sequence[OperationalIdentification], setups: Sequence[Setup]) -> OperationalIdentification:
    """Return one identification of all set-ups: modes that every set-up has, with shapes over all channels.

    Modes that a set-up lacks are left out and named in the notes.
    """
    base = min(range(len(parts)), key=lambda i: -parts[i].modes.count)
    order = [base, *(i for i in range(len(parts)) if i != base)]
    shared = list(setups[0].references)
    chains = [_match(parts, order, i, shared) for i in range(parts[base].modes.count)]
    complete = [chain for chain in chains if None not in chain]
    incomplete = [float(parts[base].modes.frequency[i]) for i, chain in enumerate(chains) if None in chain]
    joined_modes = [_join_mode(parts, order, [int(k) for k in chain if k is not None], shared) for chain in complete]
    dofs = _all_dofs(parts, order)
    modes = Modes(np.array([item.frequency for item in joined_modes]), np.array([item.damping_ratio for item in joined_modes]),
                  np.stack([item.shape for item in joined_modes], axis=1) if joined_modes else np.zeros((len(dofs), 0),
                                                                                            complex), dofs, "unscaled",
                  covariance=np.array([item.covariance for item in joined_modes]).reshape(-1, 2, 2),
                  shape_variance=np.stack([item.variance for item in joined_modes],
                                          axis=1) if joined_modes else np.zeros((len(dofs), 0)))

    def fold(name: str, how: Callable[[list[Any]], Any]) -> np.ndarray:
        """Return one value a mode, folded over the set-ups."""
        return np.array([how([getattr(parts[order[j]], name)[k] for j, k in enumerate(chain)]) for chain in complete])

    notes = [note for part in parts for note in part.notes]
    if incomplete:
        names = ", ".join(f"{frequency:.4g}" for frequency in incomplete)
        notes.append(f"mode{'s' * (len(incomplete) > 1)} at {names} Hz not seen in every set-up, left out")
    doubts = [*(doubt.within(f"set-up {i + 1}") for i, part in enumerate(parts) for doubt in part.doubts),
              *(item.doubt for item in joined_modes if item.doubt is not None)]
    return OperationalIdentification(
        modes, tuple(line for part in parts for line in part.harmonics), fold("support", min), fold("power_share", max),
        fold("confirmed", all).astype(bool), parts[base].spectra, parts[base].diagrams, parts[base].method,
        sum(part.duration for part in parts), tuple(doubts), tuple(notes))


@dataclass(frozen=True, eq=False)
class _JoinedMode:
    frequency: float
    damping_ratio: float
    covariance: FloatArray
    shape: ComplexArray
    variance: FloatArray
    doubt: Doubt | None


def _all_dofs(parts: Sequence[OperationalIdentification], order: list[int]) -> tuple[Dof, ...]:
    return tuple(dict.fromkeys(dof for i in order for dof in parts[i].modes.dofs))


def _match(parts: Sequence[OperationalIdentification], order: list[int], mode: int, shared: list[str]) -> list[int | None]:
    """Return the number of a mode of the first set-up in every set-up, None where it is not seen."""
    base = parts[order[0]].modes
    chain: list[int | None] = [mode]
    for i in order[1:]:
        other = parts[i].modes
        shift = np.abs(other.frequency / base.frequency[mode] - 1)
        first, second = base.shape_at(shared)[:, mode], other.shape_at(shared)
        likeness = np.abs(first.conj() @ second) ** 2 / np.maximum(
            np.vdot(first, first).real * (np.abs(second) ** 2).sum(axis=0), 1e-300)
        candidates = np.flatnonzero((shift < MAX_FREQUENCY_SHIFT) & (likeness > MIN_SHARED_MAC))
        chain.append(int(candidates[np.argmin(shift[candidates])]) if candidates.size else None)
    return chain


def _join_mode(parts: Sequence[OperationalIdentification], order: list[int], chain: list[int],
               shared: list[str]) -> _JoinedMode:
    """Return one mode of all set-ups: covariance-weighted frequency and damping, shapes scaled to that of the first."""
    members = [parts[i].modes.selected([k]) for i, k in zip(order, chain, strict=True)]
    weights = [np.linalg.inv(member.covariance[0]) for member in members if member.covariance is not None]
    values = np.array([[member.frequency[0], member.damping_ratio[0]] for member in members])
    covariance = np.linalg.inv(np.sum(weights, axis=0))
    mean = covariance @ np.sum([w @ v for w, v in zip(weights, values, strict=True)], axis=0)
    reference = members[0].shape_at(shared)[:, 0]
    sums: dict[Dof, complex] = {}
    variances: dict[Dof, float] = {}
    for member in members:
        at_shared = member.shape_at(shared)[:, 0]
        power = np.vdot(at_shared, at_shared)
        scale = np.vdot(at_shared, reference) / power
        spread = member.shape_variance if member.shape_variance is not None else np.zeros(member.shape.shape)
        for dof, entry, variance in zip(member.dofs, member.shape[:, 0] * scale, spread[:, 0] * abs(scale) ** 2, strict=True):
            sums.setdefault(dof, complex(entry))
            variances.setdefault(dof, float(variance))
    deviation = np.sqrt([member.covariance[0, 0, 0] for member in members if member.covariance is not None])
    return _JoinedMode(float(mean[0]), float(mean[1]), covariance, np.array(list(sums.values())),
                       np.array(list(variances.values())),
                       question_setup_frequencies(values[:, 0], deviation, MAX_SETUP_DEVIATIONS))
