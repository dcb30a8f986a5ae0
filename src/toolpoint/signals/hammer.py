"""Hammer tests: records with hits -> frequency responses; every hit judged, the window's damping carried along."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from toolpoint._check import ComplexArray, FloatArray, ToolpointWarning, fail, positive
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint.signals.blocks import fit_block
from toolpoint.signals.consistency import compare_hits
from toolpoint.signals.estimators import Spectra, average, multiple_coherence, responses, scatter_of_hits
from toolpoint.signals.hits import SHORT, Hit, HitRules, find_hits, judge_hits
from toolpoint.signals.ringing import choose_final, find_ringing
from toolpoint.signals.windows import doubt_window, exponential, force
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.record import Record

# Anti-aliasing filters ring for tens of samples around a pulse: cut off, that biases damping by some tenths of a per mille.
RINGING = 40
STANDS_OUT = 6.0
OUTERMOST = 0.02  # of the samples, at either end, that may be ringing or a bounce
MOST_LOOKED_AT = 5  # hits whose ring-down decides about the window
MOST_LISTED = 12  # hits whose reasons an error lists
LEVEL = 0.95
QUANTITY = {"displacement": "receptance", "velocity": "mobility", "acceleration": "accelerance"}


@dataclass(frozen=True, eq=False)
class HammerTest(NotebookText):
    """Result of a hammer test: the responses, and all hits with what was decided about each.

    Parameters
    ----------
    frf : Frf
        One column (the struck Dof), with coherence, variance and the decay of the exponential window.
    hits : tuple of Hit
        All hits of all records in order; `reasons` says why one is not used.
    force_spectrum : (n_f,) floats
        Root mean square of the force spectrum of the hits used, N s; lines where it is 20 dB down carry a note.
    duration : float
        Length of a block, s.
    freedom : like the values, optional
        Degrees of freedom of the error of every response, 1 (one phase) .. 2 (any phase).
    averages : Spectra, optional
        Averaged spectra of the hits used, for other estimators.
    """

    frf: Frf
    hits: tuple[Hit, ...]
    force_spectrum: FloatArray
    duration: float = 0.0
    freedom: FloatArray | None = None
    averages: Spectra | None = None

    @property
    def used(self) -> int:
        """Number of hits used."""
        return sum(hit.accepted for hit in self.hits)

    def estimated_by(self, estimator: str) -> Frf:
        """Return the responses by another estimator, ``H1``, ``H2`` or ``Hv``, of the same hits."""
        if self.averages is None:
            return self.frf
        return replace(self.frf, values=responses(self.averages, estimator))

    @property
    def excited(self) -> float:
        """Frequency (Hz) above which the force is 20 dB down; the last line where it is not."""
        weak = np.flatnonzero(self.force_spectrum < 0.1 * self.force_spectrum.max())
        return float(self.frf.frequency[weak[0] if weak.size else -1])

    def radius(self, level: float = LEVEL) -> FloatArray | None:
        r"""Return the radius of the circle about every response in which the true one lies with probability `level`.

        With n hits the squared error over the estimated variance is F-distributed with :math:`\nu` and :math:`\nu (n - 1)`
        degrees of freedom, where :math:`\nu` is 2 for noise of any phase and 1 for errors of one phase, as a missed spot makes
        them (Satterthwaite). None with one hit. It holds scatter from hit to hit, not what all hits share: calibration, the
        mass of the sensor, a window that is too short, noise of the force where it excites little.
        """
        if self.frf.variance is None or self.freedom is None:
            return None
        return np.sqrt(self.frf.variance * scipy.special.fdtri(self.freedom, self.freedom * (self.used - 1), level))

    @property
    def status(self) -> str:
        """Which hits were used and why others were not."""
        lines = [f"{self.used} of {len(self.hits)} hits used"]
        lines += [f"- hit {i} rejected: {'; '.join(hit.reasons)}" for i, hit in enumerate(self.hits, 1) if hit.reasons]
        return "\n".join([*lines, *(f"- {note}" for note in self.frf.notes)])

    def __repr__(self) -> str:
        return f"HammerTest({self.frf!r}, {self.used} of {len(self.hits)} hits used)"


def hammer_test(
    records: Record | Sequence[Record], duration: float | None = None, *, estimator: str = "H1", final: float | None = 1.0,
    force_window: bool = True, highest: float | None = None, rules: HitRules | None = None,
    decisions: Mapping[int, bool] | None = None,
) -> HammerTest:
    """Return the frequency responses of one struck Dof from records with one force channel.

    Parameters
    ----------
    records : Record or several
        SI; exactly one channel of quantity ``force``, the others of one quantity (``acceleration`` ..). Several records
        of the same channels are taken together, whether they hold one hit or many.
    duration : float, optional
        Length of a block, s: one over the line spacing. Where left out the longest that fits behind the hits.
    estimator : str
        ``H1``, ``H2`` or ``Hv``.
    final : float, optional
        End value of the exponential window on both channels; 1 is no window. Its decay is kept in the Frf and taken out
        of the poles by identification. None: what the slowest mode needs to end within the block.
    force_window : bool
        Whether the force after its pulse is set to zero (its noise would be taken for excitation).
    highest : float, optional
        Last line, Hz; the sample rate over 2.56 where left out.
    rules : HitRules, optional
        What makes a hit good.
    decisions : mapping of hit number (from 0, over all records) to bool, optional
        Hits that a person accepts or refuses, whatever is judged of them.

    Raises
    ------
    ToolpointError
        Without hits, where all are rejected (with the reasons of each), or where channels do not fit together.
    """
    every = [records] if isinstance(records, Record) else list(records)
    force_at, others, quantity = _channels(every)
    others, dead = _alive(every, others)
    rules = HitRules() if rules is None else rules
    rate = every[0].sample_rate
    block, said = (fit_block(every, force_at, rules) if duration is None
                   else (round(positive("duration", duration) * rate), ()))
    hits = _found(every, force_at, block, rules)
    if final is None:
        final, more = _window_of(hits, every, others, block, rules)
        said = (*said, *more)
    hits = judge_hits(hits, every, force_at, others=others, block=block, rules=rules, final=final)
    hits = _decided(hits, decisions or {})
    _check_any(hits)
    lines = _lines(rate, block, highest)
    cutter = _Cutter(force_at, tuple(others), block, final, force_window, lines)
    # The spectrum of a transient is its transform times the sampling interval: N s and m/s^2 s.
    spectra = [cutter.spectra(hit, every[hit.record]) for hit in hits]
    hits, doubts = compare_hits(hits, spectra, rules)
    hits = _decided(hits, decisions or {})
    good = [i for i, hit in enumerate(hits) if hit.accepted]
    averages = average(np.arange(lines) * rate / block, np.array([spectra[i][0] for i in good])[:, :, None],
                       np.array([spectra[i][1] for i in good]))
    level = np.sqrt(averages.force[:, 0, 0].real)
    decay = exponential(block, rate, final)[1]
    notes = (*doubts, *doubt_window(hits, every, block), *dead, *_shortened(hits, block, rate, rules), *said,
             *_notes(averages.frequency, level, len(good), decay))
    scatter = scatter_of_hits([spectra[i] for i in good])
    coherence = multiple_coherence(averages)[:, :, None] if len(good) > 1 else None
    frf = Frf(averages.frequency, responses(averages, estimator), tuple(every[0].channels[i] for i in others),
              (every[0].channels[force_at],), quantity, coherence=coherence, variance=scatter[0], decay=decay,
              notes=notes)
    return HammerTest(frf, tuple(hits), level, block / rate, scatter[1], averages)


def locate_hits(records: Sequence[Record], duration: float | None = None, rules: HitRules | None = None) -> list[Hit]:
    """Return the hits of records in their order, found but not judged."""
    force_at, _, _ = _channels(records)
    rules = rules or HitRules()
    block = (fit_block(records, force_at, rules)[0] if duration is None
             else round(positive("duration", duration) * records[0].sample_rate))
    return _found(records, force_at, block, rules)


def _found(records: Sequence[Record], force_at: int, block: int, rules: HitRules) -> list[Hit]:
    shortest = min(records, key=lambda record: record.samples.shape[0])
    if all(record.samples.shape[0] < block for record in records):
        fail("duration", f"{block / shortest.sample_rate:g} s", f"must not exceed the record of {shortest.duration:g} s")
    hits = [hit for k, record in enumerate(records) for hit in find_hits(record.samples[:, force_at], block, rules, record=k)]
    pulse = max((hit.pulse - hit.start for hit in hits), default=0)
    if pulse >= block:
        rate = records[0].sample_rate
        fail("duration", f"{block / rate:.2g} s", f"must exceed the {pulse / rate:.2g} s of the force pulse by far",
             remedy="take one over the line spacing that is wanted")
    return hits


def _window_of(hits: Sequence[Hit], records: Sequence[Record], others: list[int], block: int, rules: HitRules
               ) -> tuple[float, tuple[str, ...]]:
    """Return the end value of the window that the ring-down needs in the median over hits, and what was decided."""
    loudest = sorted((hit for hit in hits if hit.accepted and hit.start + block <= records[hit.record].samples.shape[0]),
                     key=lambda hit: -hit.force)[:MOST_LOOKED_AT]
    rings = [find_ringing(records[hit.record].samples[hit.pulse:hit.start + block][:, others], records[hit.record].sample_rate)
             for hit in loudest]
    if not rings:
        return 1.0, ()
    ordered = sorted(rings, key=lambda ring: 0.0 if ring is None else ring.share)
    return choose_final(ordered[len(ordered) // 2], rules.undecayed)


def _decided(hits: Sequence[Hit], decisions: Mapping[int, bool]) -> list[Hit]:
    """Return the hits as a person decided, where one did."""
    unknown = [number for number in decisions if not 0 <= number < len(hits)]
    if unknown:
        fail("decisions", f"hit {unknown[0]}", f"must be within 0 .. {len(hits) - 1}")
    result = list(hits)
    for number, accept in decisions.items():
        hit = hits[number]
        if accept:
            result[number] = replace(hit, reasons=())
        elif hit.accepted:
            result[number] = hit.rejected("refused by hand")
    return result


def _check_any(hits: Sequence[Hit]) -> None:
    if not any(hit.accepted for hit in hits):
        reasons = "; ".join(f"hit {i}: {', '.join(hit.reasons)}" for i, hit in enumerate(hits, 1) if i <= MOST_LISTED)
        more = f"; and {len(hits) - MOST_LISTED} more" if len(hits) > MOST_LISTED else ""
        fail("records", f"none of {len(hits)} hits is usable ({reasons}{more})", "must hold at least one good hit",
             remedy="measure again, or relax the rules (HitRules)")


@dataclass(frozen=True)
class _Cutter:
    """Takes the block of a hit out of its record, windows it, and transforms it."""

    force_at: int
    others: tuple[int, ...]
    block: int
    final: float
    force_window: bool
    lines: int

    def spectra(self, hit: Hit, record: Record) -> tuple[ComplexArray, ComplexArray]:
        """Return the spectra of force (n_f,) and responses (n_f, n_outputs)."""
        part = np.zeros((self.block, record.samples.shape[1]))
        have = record.samples[hit.start:hit.start + self.block]
        part[:have.shape[0]] = have
        part = part - _offsets(part, self.force_at, hit)
        struck = part[:, self.force_at]
        if self.force_window:
            struck = struck * force(self.block, *_ringing(struck, hit))
        decaying = exponential(self.block, record.sample_rate, self.final)[0]
        both = (struck * decaying, part[:, list(self.others)] * decaying[:, None])
        f, x = (np.fft.rfft(values, axis=0)[:self.lines] / record.sample_rate for values in both)
        return f, x


def _shortened(hits: Sequence[Hit], block: int, rate: float, rules: HitRules) -> list[str]:
    """Return a note where records begin sooner before their hits than the pretrigger asks for."""
    asked = round(rules.pretrigger * block)
    short = [(hit.peak - hit.start) / rate for hit in hits if hit.start == 0 and hit.peak < asked]
    if not short:
        return []
    return [f"the records of {len(short)} of {len(hits)} hits begin {1e3 * min(short):.3g} ms before the peak of the force: "
            "the pretrigger is what is there" + ("; sensors' offsets are told by the rest of the block"
                                                 if min(short) * rate < SHORT else "")]


def _offsets(part: FloatArray, force_at: int, hit: Hit) -> FloatArray:
    """Return the offset of every sensor: the level before the filters ring, and of the force also that long after."""
    before = hit.peak - hit.start
    quiet = part[:max(before - RINGING, before // 4, 1)]
    offsets = quiet.mean(axis=0) if before >= SHORT else part.mean(axis=0)
    after = part[hit.pulse - hit.start + RINGING:, force_at]
    if after.size >= RINGING:
        offsets[force_at] = _usual(after).mean()
    return np.asarray(offsets, float)


def _usual(values: FloatArray) -> FloatArray:
    """Return the values without the outermost: of a force stored in steps coarser than its noise the median is a step, its mean
    lies between."""
    low, high = np.quantile(values, [OUTERMOST, 1 - OUTERMOST])
    return values[(values >= low) & (values <= high)]


def _ringing(struck: FloatArray, hit: Hit) -> tuple[int, int]:
    """Return first and last sample of the pulse with the ringing of the filters, as far as it stands out of the noise."""
    peak, pulse, width = hit.peak - hit.start, hit.pulse - hit.start, max(hit.pulse - hit.peak, 2)
    noise = float(_usual(struck[pulse + RINGING:]).std()) if pulse + RINGING < struck.size else 0.0
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
                 remedy="assemble different set-ups with signals.setups")
    forces = [i for i, quantity in enumerate(first.quantities) if quantity == "force"]
    others = [i for i in range(len(first.quantities)) if i not in forces]
    if len(forces) != 1 or not others:
        fail("records", f"{len(forces)} force channels and {len(others)} others", "must have one force and some "
             "responses", remedy="select channels with record.selected, or name their quantities")
    kinds = {first.quantities[i] for i in others}
    if len(kinds) > 1 or not kinds <= QUANTITY.keys():
        fail("records", f"responses of quantity {', '.join(sorted(kinds))}", f"must be one of {', '.join(QUANTITY)}")
    return forces[0], others, QUANTITY[kinds.pop()]


def _alive(records: Sequence[Record], others: list[int]) -> tuple[list[int], list[str]]:
    """Return the response channels that show anything, and a note on each that does not."""
    dead = [i for i in others if all(np.ptp(record.samples[:, i]) == 0 for record in records)]
    if len(dead) == len(others):
        fail("records", "all response channels are dead (constant)", "must show a response", remedy="check cables and sensors")
    names = records[0].channels
    return [i for i in others if i not in dead], [f"dead channel {names[i]} left out: its samples never change"
                                                  for i in dead]


def _lines(sample_rate: float, block: int, highest: float | None) -> int:
    top = sample_rate / 2.56 if highest is None else positive("highest", highest, sample_rate / 2)
    return int(np.floor(top * block / sample_rate + 1e-9)) + 1


def _notes(frequency: FloatArray, level: FloatArray, used: int, decay: float) -> tuple[str, ...]:
    notes: list[str] = []
    if used == 1:
        notes.append(Doubt("one hit only", "no coherence and no variance", "strike at least three times"))
        warnings.warn(notes[-1], ToolpointWarning, stacklevel=3)
    weak = np.flatnonzero(level < 0.1 * level.max())
    if weak.size and frequency[weak[0]] < frequency[-1]:
        notes.append(f"the force spectrum is 20 dB down above {frequency[weak[0]]:g} Hz: use a harder tip for more")
    if decay:
        notes.append(f"exponential window with a decay of {decay:.4g} 1/s, to be taken out of the poles")
    return tuple(notes)
