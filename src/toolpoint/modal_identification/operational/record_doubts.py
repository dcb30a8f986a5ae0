"""Doubts about records of a machine at work, and about the modes that they give."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._doubt import Doubt
from toolpoint.modal_identification.operational.result import OperationalIdentification
from toolpoint.vibration.record import Record

MOTION_QUANTITIES = ("acceleration", "velocity", "displacement")
MIN_CLIPPED_SAMPLES = 10  # at one extreme value, of a record whose other values repeat less
MAX_LEVEL_RATIO = 4.0  # of the rms of tenths of a record, highest over lowest
LEVEL_PARTS = 10
HEAVY_DAMPING = 0.10  # ratio, above which a pole may be that of the load
MAX_DAMPING_DEVIATION = 0.25  # standard deviation over the value
WANTED_DAMPING_DEVIATION = 0.10


def usable_channels(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Return the records without channels that do not measure motion or are dead, and notes on these.

    Raises ToolpointError where no channel of motion is left.
    """
    first = records[0]
    is_motion = np.array([quantity in MOTION_QUANTITIES for quantity in first.quantities])
    is_alive = np.array([all(np.ptp(record.samples[:, k]) > 0 for record in records) for k in range(len(first.channels))])
    kept = np.flatnonzero(is_motion & is_alive).tolist()
    if not kept:
        fail("records", f"{len(first.channels)} channels of {', '.join(sorted(set(first.quantities)))}",
             f"must hold at least one that measures motion ({', '.join(MOTION_QUANTITIES)}) and is not dead")
    notes = [f"channel{'s' * (len(names) > 1)} {', '.join(names)} left out: {why}"
             for names, why in (([str(d) for d, ok in zip(first.channels, is_motion, strict=True) if not ok],
                                 "no motion is measured"),
                                ([str(d) for d, ok, moving in zip(first.channels, is_alive, is_motion, strict=True)
                                  if moving and not ok], "every sample is the same")) if names]
    if "force" in first.quantities:
        notes.append("a force was measured: responses to it (`toolpoint frf`, then `identify`) give modes with their scale")
    return [record.selected(kept) for record in records], notes


def question_records(records: Sequence[Record]) -> tuple[Doubt, ...]:
    """Return doubts about clipped channels and about loads whose level changes much within a record."""
    doubts = []
    for record in records:
        name = record.name or "the record"
        clipped = [str(dof) for dof, values in zip(record.channels, record.samples.T, strict=True) if _is_clipped(values)]
        if clipped:
            doubts.append(Doubt(f"{name}, channel {', '.join(clipped)}",
                                "many samples stand at its largest value: it is clipped",
                                "lower the gain and record again: clipping adds lines that are no modes"))
        parts = [part for part in np.array_split(record.samples, LEVEL_PARTS) if part.shape[0] > 1]
        levels = np.array([part.std(axis=0).mean() for part in parts])
        if levels.max() > MAX_LEVEL_RATIO * levels.min():
            doubts.append(Doubt(name,
                                f"its level changes {levels.max() / levels.min():.2g} times from tenth to tenth: the loudest "
                                "parts decide alone", "identify parts of one level, or take off single bumps",
                                figure=float(levels.max() / levels.min())))
    return tuple(doubts)


def _is_clipped(values: FloatArray) -> bool:
    """Whether an extreme value repeats as no value near it does: at a step of the converter all values repeat."""
    for sign in (1.0, -1.0):
        ordered = np.sort(sign * values)[::-1]
        n_extreme = int((ordered == ordered[0]).sum())
        if n_extreme >= MIN_CLIPPED_SAMPLES:
            following = ordered[n_extreme:]
            n_following = int((following == following[0]).sum()) if following.size else 0
            if n_extreme > 5 * n_following:
                return True
    return False


def question_modes(result: OperationalIdentification) -> tuple[Doubt, ...]:
    """Return doubts about single modes: harmonics that could not be told, heavy damping, wide intervals, no second method."""
    modes = result.modes
    doubts = [Doubt(f"narrow line at {line.frequency:.4g} Hz",
                    "a harmonic of a rotating part and a mode of very light damping look "
                    f"alike in {result.duration:.3g} s", "record longer, or at another speed")
              for line in result.harmonics if not line.is_removed]
    if modes.count == 0:
        return tuple(doubts)
    deviation = np.sqrt(modes.covariance[:, 1, 1]) if modes.covariance is not None else np.zeros(modes.count)
    for i in range(modes.count):
        name, ratio = f"mode at {modes.frequency[i]:.4g} Hz", float(modes.damping_ratio[i])
        if ratio > HEAVY_DAMPING:
            doubts.append(Doubt(name,
                                f"its damping is {100 * ratio:.3g} % of critical: loads that are not white have such poles too",
                                "compare with another working condition: a mode stays", figure=ratio))
        if deviation[i] > MAX_DAMPING_DEVIATION * ratio:
            needed = result.duration * (deviation[i] / (WANTED_DAMPING_DEVIATION * ratio)) ** 2
            doubts.append(Doubt(name, f"its damping is known within {196 * deviation[i] / ratio:.2g} % (95 %)",
                                f"about {_in_words(needed)} of records would bring it to 20 %",
                                figure=float(deviation[i] / ratio)))
        if not result.confirmed[i]:
            doubts.append(Doubt(name, "a second method (pLSCF on half spectra) does not find it",
                                "look at its shape and at the singular values; record longer"))
    return tuple(doubts)


def _in_words(seconds: float) -> str:
    return f"{seconds:.2g} s" if seconds < 100 else f"{seconds / 60:.2g} min"


def question_setup_frequencies(frequency: FloatArray, deviation: FloatArray, limit: float) -> Doubt | None:
    """Return the doubt about one mode whose frequency differs between set-ups by more than its intervals explain."""
    weight = 1 / deviation**2
    mean = float((weight * frequency).sum() / weight.sum())
    largest_deviation = float((np.abs(frequency - mean) / deviation).max())
    if largest_deviation <= limit:
        return None
    spread = float(np.ptp(frequency) / mean)
    return Doubt(f"mode at {mean:.4g} Hz",
                 f"its frequency differs by {100 * spread:.2g} % between set-ups ({largest_deviation:.1f} standard "
                 "deviations)", "sensors that are moved carry mass, or the machine changed in between", figure=spread)
