"""Hammer tests: records with hits -> frequency responses; every hit judged, the window's damping carried along."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, ToolpointWarning, fail, positive
from toolpoint.signals.estimators import average, multiple_coherence, responses, variance
from toolpoint.signals.hits import Hit, HitRules, find_hits, judge_hits
from toolpoint.signals.windows import exponential, force
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.record import Record

# Anti-aliasing filters ring for tens of samples around a pulse: cut off, that biases damping by some tenths of a per mille.
RINGING = 40
STANDS_OUT = 5.0
QUANTITY = {"displacement": "receptance", "velocity": "mobility", "acceleration": "accelerance"}


@dataclass(frozen=True, eq=False)
class HammerTest:
    """Result of a hammer test: the responses, and all hits with what was decided about each.

    Parameters
    ----------
    frf : Frf
        One column (the struck Dof), with coherence, variance and the decay of the exponential window.
    hits : tuple of Hit
        All hits of all records in order; `reasons` says why one is not used.
    force_spectrum : (n_f,) floats
        Root mean square of the force spectrum of the hits used, N s; lines where it is 20 dB down carry a note.
    """

    frf: Frf
    hits: tuple[Hit, ...]
    force_spectrum: FloatArray

    @property
    def used(self) -> int:
        """Number of hits used."""
        return sum(hit.accepted for hit in self.hits)

    @property
    def status(self) -> str:
        """Which hits were used and why others were not."""
        lines = [f"{self.used} of {len(self.hits)} hits used"]
        lines += [f"- hit {i} rejected: {'; '.join(hit.reasons)}" for i, hit in enumerate(self.hits, 1) if hit.reasons]
        return "\n".join([*lines, *(f"- {note}" for note in self.frf.notes)])

    def __repr__(self) -> str:
        return f"HammerTest({self.frf!r}, {self.used} of {len(self.hits)} hits used)"


def hammer_test(
    records: Record | Sequence[Record], duration: float, *, estimator: str = "H1", final: float = 1.0,
    force_window: bool = True, highest: float | None = None, rules: HitRules | None = None,
) -> HammerTest:
    """Return the frequency responses of one struck Dof from records with one force channel.

    Parameters
    ----------
    records : Record or several
        SI; exactly one channel of quantity ``force``, the others of one quantity (``acceleration`` ..). Several records
        of the same channels are taken together.
    duration : float
        Length of a block, s: one over the line spacing.
    estimator : str
        ``H1``, ``H2`` or ``Hv``.
    final : float
        End value of the exponential window on both channels; 1 is no window. Its decay is kept in the Frf and taken out
        of the poles by identification.
    force_window : bool
        Whether the force after its pulse is set to zero (its noise would be taken for excitation).
    highest : float, optional
        Last line, Hz; the sample rate over 2.56 where left out.
    rules : HitRules, optional
        What makes a hit good.

    Raises
    ------
    ToolpointError
        Without hits, where all are rejected (with the reasons of each), or where channels do not fit together.
    """
    every = [records] if isinstance(records, Record) else list(records)
    force_at, others, quantity = _channels(every)
    others, dead = _alive(every, others)
    rules = HitRules() if rules is None else rules
    block = round(positive("duration", duration) * every[0].sample_rate)
    blocks = [pair for record in every for pair in _blocks(record, force_at, others, block, rules, final, force_window)]
    hits = [hit for hit, _, _ in blocks]
    if not any(hit.accepted for hit in hits):
        reasons = "; ".join(f"hit {i}: {', '.join(hit.reasons)}" for i, hit in enumerate(hits, 1))
        fail("records", f"none of {len(hits)} hits is usable ({reasons})", "must hold at least one good hit",
             "measure again, or relax the rules (HitRules)")
    lines = _lines(every[0].sample_rate, block, highest)
    frequency = np.arange(lines) * every[0].sample_rate / block
    # The spectrum of a transient is its transform times the sampling interval: N s and m/s^2 s.
    spectra: list[tuple[ComplexArray, ComplexArray]] = [
        (np.fft.rfft(f, axis=0)[:lines] / every[0].sample_rate, np.fft.rfft(x, axis=0)[:lines] / every[0].sample_rate)
        for _, f, x in blocks]
    hits = _consistent(hits, spectra, rules)
    good = [i for i, hit in enumerate(hits) if hit.accepted]
    force_lines = np.array([spectra[i][0] for i in good])[:, :, None]
    averages = average(frequency, force_lines, np.array([spectra[i][1] for i in good]))
    level = np.sqrt(averages.force[:, 0, 0].real)
    decay = exponential(block, every[0].sample_rate, final)[1]
    values = responses(averages, estimator)
    record = every[0]
    notes = (*dead, *_notes(frequency, level, len(good), decay))
    coherence = multiple_coherence(averages)[:, :, None] if len(good) > 1 else None
    frf = Frf(frequency, values, tuple(record.channels[i] for i in others), (record.channels[force_at],), quantity,
              coherence=coherence, variance=variance(averages), decay=decay, notes=notes)
    return HammerTest(frf, tuple(hits), level)


def _blocks(record: Record, force_at: int, others: list[int], block: int, rules: HitRules, final: float,
            force_window: bool) -> list[tuple[Hit, FloatArray, FloatArray]]:
    if record.samples.shape[0] < block:
        fail("duration", f"{block / record.sample_rate:g} s", f"must not exceed the record of {record.duration:g} s")
    hits = find_hits(record.samples[:, force_at], block, rules)
    pulse = max((hit.pulse - hit.start for hit in hits), default=0)
    if pulse >= block:
        fail("duration", f"{block / record.sample_rate:.2g} s", f"must exceed the {pulse / record.sample_rate:.2g} s of the "
             "force pulse by far", "take one over the line spacing that is wanted")
    hits = judge_hits(hits, record, force_at, others=others, block=block, rules=rules, final=final)
    decaying = exponential(block, record.sample_rate, final)[0]
    result: list[tuple[Hit, FloatArray, FloatArray]] = []
    for hit in hits:
        part = np.zeros((block, record.samples.shape[1]))
        have = record.samples[max(hit.start, 0):hit.start + block]
        part[:have.shape[0]] = have
        part = part - _offsets(part, force_at, hit)
        struck = part[:, force_at]
        if force_window:
            struck = struck * force(block, *_ringing(struck, hit))
        result.append((hit, struck * decaying, part[:, others] * decaying[:, None]))
    return result


def _offsets(part: FloatArray, force_at: int, hit: Hit) -> FloatArray:
    """Return the offset of every sensor: the level before the filters ring, and of the force also that long after."""
    before = hit.peak - hit.start
    offsets = part[:max(before - RINGING, before // 4, 1)].mean(axis=0)
    after = part[hit.pulse - hit.start + RINGING:, force_at]
    if after.size >= RINGING:
        offsets[force_at] = np.median(after)
    return np.asarray(offsets, float)


def _ringing(struck: FloatArray, hit: Hit) -> tuple[int, int]:
    """Return first and last sample of the pulse with the ringing of the filters, as far as it stands out of the noise."""
    peak, pulse, width = hit.peak - hit.start, hit.pulse - hit.start, max(hit.pulse - hit.peak, 2)
    noise = 1.4826 * float(np.median(np.abs(struck[pulse + RINGING:]))) if pulse + RINGING < struck.size else 0.0
    loud = np.flatnonzero(np.abs(struck) > STANDS_OUT * noise)
    first, last = min(peak - 4 * width, peak - RINGING, int(loud[0])), max(pulse + width, pulse + RINGING, int(loud[-1]) + 1)
    return max(first, 0), min(last, struck.size)


def _channels(records: Sequence[Record]) -> tuple[int, list[int], str]:
    if not records:
        fail("records", "none", "must be at least one Record")
    first = records[0]
    for record in records[1:]:
        if (record.channels, record.quantities, record.sample_rate) != (
                first.channels, first.quantities, first.sample_rate):
            fail("records", f"{record!r} beside {first!r}", "must share channels, quantities and sample rate",
                 "assemble different set-ups with signals.setups")
    forces = [i for i, quantity in enumerate(first.quantities) if quantity == "force"]
    others = [i for i in range(len(first.quantities)) if i not in forces]
    if len(forces) != 1 or not others:
        fail("records", f"{len(forces)} force channels and {len(others)} others", "must have one force and some "
             "responses", "select channels with record.selected, or name their quantities")
    kinds = {first.quantities[i] for i in others}
    if len(kinds) > 1 or not kinds <= QUANTITY.keys():
        fail("records", f"responses of quantity {', '.join(sorted(kinds))}", f"must be one of {', '.join(QUANTITY)}")
    return forces[0], others, QUANTITY[kinds.pop()]


def _alive(records: Sequence[Record], others: list[int]) -> tuple[list[int], list[str]]:
    """Return the response channels that show anything, and a note on each that does not."""
    dead = [i for i in others if all(np.ptp(record.samples[:, i]) == 0 for record in records)]
    if len(dead) == len(others):
        fail("records", "all response channels are dead (constant)", "must show a response", "check cables and sensors")
    names = records[0].channels
    return [i for i in others if i not in dead], [f"dead channel {names[i]} left out: its samples never change"
                                                  for i in dead]


def _lines(sample_rate: float, block: int, highest: float | None) -> int:
    top = sample_rate / 2.56 if highest is None else positive("highest", highest, sample_rate / 2)
    return int(np.floor(top * block / sample_rate + 1e-9)) + 1


def _consistent(hits: list[Hit], spectra: list[tuple[ComplexArray, ComplexArray]], rules: HitRules) -> list[Hit]:
    """Return the hits with those marked that the others contradict, the worst first, as long as three remain."""
    hits = list(hits)
    while True:
        good = [i for i, hit in enumerate(hits) if hit.accepted]
        if len(good) < 3:
            return hits
        share = np.array([_unexplained(i, [j for j in good if j != i], spectra) for i in good])
        worst = int(np.argmax(share))
        if share[worst] < max(rules.inconsistent, 4 * float(np.median(share))):
            return hits
        hits[good[worst]] = hits[good[worst]].rejected(
            f"contradicts the other hits ({100 * share[worst]:.0f} % of its response is not explained by theirs)")


def _unexplained(i: int, rest: list[int], spectra: list[tuple[ComplexArray, ComplexArray]]) -> float:
    force_power = sum((np.abs(spectra[j][0]) ** 2 for j in rest), np.zeros(spectra[i][0].shape))
    cross = sum((spectra[j][1] * spectra[j][0].conj()[:, None] for j in rest), np.zeros_like(spectra[i][1]))
    lines = force_power > 1e-2 * force_power.max()
    model = cross[lines] / force_power[lines, None] * spectra[i][0][lines, None]
    actual = spectra[i][1][lines]
    scale = (np.abs(actual) ** 2).sum(axis=0)
    left = (np.abs(actual - model) ** 2).sum(axis=0)
    return float(np.mean(left / np.maximum(scale, 1e-300)))


def _notes(frequency: FloatArray, level: FloatArray, used: int, decay: float) -> tuple[str, ...]:
    notes = []
    if used == 1:
        notes.append("one hit only: no coherence and no variance; strike at least three times")
        warnings.warn(notes[-1], ToolpointWarning, stacklevel=3)
    weak = np.flatnonzero(level < 0.1 * level.max())
    if weak.size and frequency[weak[0]] < frequency[-1]:
        notes.append(f"the force spectrum is 20 dB down above {frequency[weak[0]]:g} Hz: use a harder tip for more")
    if decay:
        notes.append(f"exponential window with a decay of {decay:.4g} 1/s, to be taken out of the poles")
    return tuple(notes)
