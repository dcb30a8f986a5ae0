"""Hammer tests: records with hits to frequency responses; every hit is judged, the window's decay is kept in the result."""

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
from toolpoint.signals.estimators import Spectra, average, multiple_coherence, responses, scatter_of_hits, with_choice
from toolpoint.signals.hits import MIN_PRETRIGGER_SAMPLES, Hit, HitRules, find_hits, judge_hits
from toolpoint.signals.ringing import choose_final, find_ringing
from toolpoint.signals.windows import FILTER_RINGING_SAMPLES, doubt_window, exponential, force
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.record import Record

MIN_PULSE_NOISE_RATIO = 6.0  # of the force over its noise, in samples of the pulse and of the filters' ringing
TRIMMED_FRACTION = 0.02  # of the samples, at either end of their values, that may be ringing or a bounce
MAX_WINDOW_HITS = 5  # the strongest, whose ring-down decides the window
MAX_LISTED_HITS = 12  # whose reasons an error lists
CIRCLE_PROBABILITY = 0.95  # of the circles about responses
RESPONSE_QUANTITIES = {"displacement": "receptance", "velocity": "mobility", "acceleration": "accelerance"}


@dataclass(frozen=True, eq=False)
class HammerTest(NotebookText):
    """Result of a hammer test: the responses, and all hits with the verdict on each.

    Parameters
    ----------
    frf : Frf
        One column (the struck Dof), with coherence, variance and the decay of the exponential window.
    hits : tuple of Hit
        All hits of all records in order, with the reasons against those that are not used.
    force_spectrum : (n_f,) floats
        Root mean square of the force spectrum of the hits used, N s; lines where it is 20 dB down carry a note.
    duration : float
        Length of a block, s.
    freedom : like the values, optional
        Degrees of freedom of the error of every response, 1 (one phase) .. 2 (any phase).
    averages : Spectra, optional
        Averaged spectra of the hits used, for other estimators.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.signals import HammerTest
    >>> from toolpoint.vibration import Frf
    >>> frf = Frf([0.0, 1.0, 2.0], np.zeros((3, 1, 1)), ["tool:+x"], ["tool:+x"])
    >>> HammerTest(frf, (), np.array([1.0, 0.9, 0.05])).excited  # Hz
    2.0
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
        values, h1 = responses(self.averages, estimator), responses(self.averages)
        scatter = None if self.frf.variance is None else np.maximum(
            self.frf.variance - np.abs(self.frf.values - h1) ** 2, 0.0)
        return replace(self.frf, values=values, variance=with_choice(values, h1, scatter))

    @property
    def excited(self) -> float:
        """Frequency (Hz) above which the force is 20 dB down; the last line where it is not."""
        weak_lines = np.flatnonzero(self.force_spectrum < 0.1 * self.force_spectrum.max())
        return float(self.frf.frequency[weak_lines[0] if weak_lines.size else -1])

    def radius(self, level: float = CIRCLE_PROBABILITY) -> FloatArray | None:
        r"""Return the radius of the circle about every response in which the true one lies with probability `level`.

        With n hits the squared error over the estimated variance is F-distributed with :math:`\nu` and :math:`\nu (n - 1)`
        degrees of freedom, where :math:`\nu` is 2 for noise of any phase and 1 for errors of one phase, as a missed spot makes
        them (Satterthwaite). None with one hit. It covers scatter from hit to hit, not errors that all hits share: calibration,
        the mass of the sensor, a window that is too short, noise of the force where it excites little.
        """
        if self.frf.variance is None or self.freedom is None:
            return None
        return np.sqrt(self.frf.variance * scipy.special.fdtri(self.freedom, self.freedom * (self.used - 1), level))

    @property
    def status(self) -> str:
        """Number of hits used, reasons against the others, and notes, one a line."""
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
        of the poles by identification. None: as much as the slowest mode needs to decay within the block.
    force_window : bool
        Whether the force after its pulse is set to zero (its noise would be taken for excitation).
    highest : float, optional
        Last line, Hz; the sample rate over 2.56 where left out.
    rules : HitRules, optional
        Limits that a good hit keeps.
    decisions : mapping of hit number (from 0, over all records) to bool, optional
        Hits that a person accepts or refuses, against or with the verdict.

    Raises
    ------
    ToolpointError
        Without hits, where all are rejected (with the reasons of each), or where channels do not fit together.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.signals import hammer_test
    >>> from toolpoint.vibration import Record
    >>> time = np.arange(2048) / 2048.0
    >>> force = np.where((time >= 0.1) & (time < 0.104), np.sin(np.pi * (time - 0.1) / 0.004), 0.0)  # a pulse of 4 ms
    >>> free = np.where(time > 0.1, np.exp(-20 * (time - 0.1)) * np.sin(2 * np.pi * 60 * (time - 0.1)), 0.0)
    >>> records = [Record(np.column_stack([scale * force, scale * free]), 2048.0, ["1:+z", "1:+z"], ["force", "acceleration"])
    ...            for scale in (100.0, 90.0)]
    >>> test = hammer_test(records)
    >>> test.used, round(float(test.frf.frequency[np.abs(test.frf.values[:, 0, 0]).argmax()]))
    (2, 60)
    """
    all_records = [records] if isinstance(records, Record) else list(records)
    force_at, outputs, quantity = _assign_channels(all_records)
    outputs, dead_notes = _select_live_channels(all_records, outputs)
    rules = HitRules() if rules is None else rules
    rate = all_records[0].sample_rate
    block, decision_notes = (fit_block(all_records, force_at, rules) if duration is None
                   else (round(positive("duration", duration) * rate), ()))
    hits = _find_hits(all_records, force_at, block, rules)
    if final is None:
        final, window_notes = _choose_window(hits, all_records, outputs, block, rules)
        decision_notes = (*decision_notes, *window_notes)
    hits = judge_hits(hits, all_records, force_at, others=outputs, block=block, rules=rules, final=final)
    hits = _apply_decisions(hits, decisions or {})
    _check_any_hit(hits)
    lines = _line_count(rate, block, highest)
    block_spectra = _BlockSpectra(force_at, tuple(outputs), block, final, force_window, lines)
    # The spectrum of a transient is its transform times the sampling interval: N s and m/s^2 s.
    spectra = [block_spectra.spectra(hit, all_records[hit.record]) for hit in hits]
    hits, doubts = compare_hits(hits, spectra, rules)
    hits = _apply_decisions(hits, decisions or {})
    accepted = [i for i, hit in enumerate(hits) if hit.accepted]
    averages = average(np.arange(lines) * rate / block, np.array([spectra[i][0] for i in accepted])[:, :, None],
                       np.array([spectra[i][1] for i in accepted]))
    level = np.sqrt(averages.force[:, 0, 0].real)
    decay = exponential(block, rate, final)[1]
    notes = (*doubts, *doubt_window(hits, all_records, block), *dead_notes, *_note_short_pretriggers(hits, block, rate, rules),
             *decision_notes,
             *_result_notes(averages.frequency, level, len(accepted), decay))
    scatter = scatter_of_hits([spectra[i] for i in accepted])
    coherence = multiple_coherence(averages)[:, :, None] if len(accepted) > 1 else None
    values = responses(averages, estimator)
    frf = Frf(averages.frequency, values, tuple(all_records[0].channels[i] for i in outputs),
              (all_records[0].channels[force_at],), quantity, coherence=coherence,
              variance=with_choice(values, responses(averages), scatter[0]), decay=decay, notes=notes)
    return HammerTest(frf, tuple(hits), level, block / rate, scatter[1], averages)


def locate_hits(records: Sequence[Record], duration: float | None = None, rules: HitRules | None = None) -> list[Hit]:
    """Return the hits of records in their order, unjudged."""
    force_at, _, _ = _assign_channels(records)
    rules = rules or HitRules()
    block = (fit_block(records, force_at, rules)[0] if duration is None
             else round(positive("duration", duration) * records[0].sample_rate))
    return _find_hits(records, force_at, block, rules)


def _find_hits(records: Sequence[Record], force_at: int, block: int, rules: HitRules) -> list[Hit]:
    """Return all hits of the records, unjudged; blocks longer than every record, or shorter than the pulse, are refused."""
    shortest = min(records, key=lambda record: record.samples.shape[0])
    if all(record.samples.shape[0] < block for record in records):
        fail("duration", f"{block / shortest.sample_rate:g} s", f"must not exceed the record of {shortest.duration:g} s")
    hits = [hit for k, record in enumerate(records) for hit in find_hits(record.samples[:, force_at], block, rules, record=k)]
    pulse = max((hit.pulse - hit.start for hit in hits), default=0)
    if pulse >= block:
        sample_rate = records[0].sample_rate
        fail("duration", f"{block / sample_rate:.2g} s",
             f"must exceed the {pulse / sample_rate:.2g} s of the force pulse by far",
             remedy="take one over the line spacing that is wanted")
    return hits


def _choose_window(hits: Sequence[Hit], records: Sequence[Record], others: list[int], block: int, rules: HitRules
               ) -> tuple[float, tuple[str, ...]]:
    """Return the end value of the window that the ring-down needs in the median over hits, and this decision in words."""
    strongest = sorted((hit for hit in hits if hit.accepted and hit.start + block <= records[hit.record].samples.shape[0]),
                     key=lambda hit: -hit.force)[:MAX_WINDOW_HITS]
    rings = [find_ringing(records[hit.record].samples[hit.pulse:hit.start + block][:, others], records[hit.record].sample_rate)
             for hit in strongest]
    if not rings:
        return 1.0, ()
    by_share = sorted(rings, key=lambda ring: 0.0 if ring is None else ring.share)
    return choose_final(by_share[len(by_share) // 2], rules.undecayed)


def _apply_decisions(hits: Sequence[Hit], decisions: Mapping[int, bool]) -> list[Hit]:
    """Return the hits with the decisions of a person in place of their verdicts."""
    unknown_hits = [number for number in decisions if not 0 <= number < len(hits)]
    if unknown_hits:
        fail("decisions", f"hit {unknown_hits[0]}", f"must be within 0 .. {len(hits) - 1}")
    result = list(hits)
    for number, accept in decisions.items():
        hit = hits[number]
        if accept:
            result[number] = replace(hit, reasons=())
        elif hit.accepted:
            result[number] = hit.rejected("refused by hand")
    return result


def _check_any_hit(hits: Sequence[Hit]) -> None:
    """Refuse a test without an accepted hit, with the reasons of each."""
    if not any(hit.accepted for hit in hits):
        reasons = "; ".join(f"hit {i}: {', '.join(hit.reasons)}" for i, hit in enumerate(hits, 1) if i <= MAX_LISTED_HITS)
        continuation = f"; and {len(hits) - MAX_LISTED_HITS} more" if len(hits) > MAX_LISTED_HITS else ""
        fail("records", f"none of {len(hits)} hits is usable ({reasons}{continuation})", "must hold at least one good hit",
             remedy="measure again, or relax the rules (HitRules)")


@dataclass(frozen=True)
class _BlockSpectra:
    """Spectra of the block of a hit: taken out of its record, windowed and transformed."""

    force_at: int
    others: tuple[int, ...]
    block: int
    final: float
    force_window: bool
    lines: int

    def spectra(self, hit: Hit, record: Record) -> tuple[ComplexArray, ComplexArray]:
        """Return the spectra of force (n_f,) and responses (n_f, n_outputs)."""
        block = np.zeros((self.block, record.samples.shape[1]))
        samples = record.samples[hit.start:hit.start + self.block]
        block[:samples.shape[0]] = samples
        block = block - _offsets(block, self.force_at, hit)
        struck = block[:, self.force_at]
        if self.force_window:
            struck = struck * force(self.block, *_pulse_ends(struck, hit))
        window = exponential(self.block, record.sample_rate, self.final)[0]
        windowed = (struck * window, block[:, list(self.others)] * window[:, None])
        f, x = (np.fft.rfft(values, axis=0)[:self.lines] / record.sample_rate for values in windowed)
        return f, x


def _note_short_pretriggers(hits: Sequence[Hit], block: int, rate: float, rules: HitRules) -> list[str]:
    """Return a note on records that begin too late before their hits for the pretrigger."""
    pretrigger = round(rules.pretrigger * block)
    times = [(hit.peak - hit.start) / rate for hit in hits if hit.start == 0 and hit.peak < pretrigger]
    if not times:
        return []
    return [f"the records of {len(times)} of {len(hits)} hits begin {1e3 * min(times):.3g} ms before the peak of the force: "
            "the pretrigger is what is there" + ("; sensors' offsets are told by the rest of the block"
                                                 if min(times) * rate < MIN_PRETRIGGER_SAMPLES else "")]


def _offsets(block: FloatArray, force_at: int, hit: Hit) -> FloatArray:
    """Return the offset of every sensor: its level before the filters ring, and of the force also after they have."""
    before_peak = hit.peak - hit.start
    quiet = block[:max(before_peak - FILTER_RINGING_SAMPLES, before_peak // 4, 1)]
    offsets = quiet.mean(axis=0) if before_peak >= MIN_PRETRIGGER_SAMPLES else block.mean(axis=0)
    after_pulse = block[hit.pulse - hit.start + FILTER_RINGING_SAMPLES:, force_at]
    if after_pulse.size >= FILTER_RINGING_SAMPLES:
        offsets[force_at] = _trim_outliers(after_pulse).mean()
    return np.asarray(offsets, float)


def _trim_outliers(values: FloatArray) -> FloatArray:
    """Return the values without the outermost ones.

    Of a force stored in steps coarser than its noise the median is a step, and the mean lies between two.
    """
    lower_limit, upper_limit = np.quantile(values, [TRIMMED_FRACTION, 1 - TRIMMED_FRACTION])
    return values[(values >= lower_limit) & (values <= upper_limit)]


def _pulse_ends(struck: FloatArray, hit: Hit) -> tuple[int, int]:
    """Return first and last sample of the pulse with the ringing of the filters, as far as it is above the noise."""
    peak, pulse, width = hit.peak - hit.start, hit.pulse - hit.start, max(hit.pulse - hit.peak, 2)
    noise = (float(_trim_outliers(struck[pulse + FILTER_RINGING_SAMPLES:]).std())
             if pulse + FILTER_RINGING_SAMPLES < struck.size else 0.0)
    above_noise = np.flatnonzero(np.abs(struck) > MIN_PULSE_NOISE_RATIO * noise)
    first, last = min(peak - 4 * width, peak - FILTER_RINGING_SAMPLES,
                      int(above_noise[0])), max(pulse + width, pulse + FILTER_RINGING_SAMPLES, int(above_noise[-1]) + 1)
    return max(first, 0), min(last, struck.size)


def _assign_channels(records: Sequence[Record]) -> tuple[int, list[int], str]:
    """Return the force channel, the response channels and the quantity of the responses, after checking all records."""
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
    if len(kinds) > 1 or not kinds <= RESPONSE_QUANTITIES.keys():
        fail("records", f"responses of quantity {', '.join(sorted(kinds))}", f"must be one of {', '.join(RESPONSE_QUANTITIES)}")
    return forces[0], others, RESPONSE_QUANTITIES[kinds.pop()]


def _select_live_channels(records: Sequence[Record], others: list[int]) -> tuple[list[int], list[str]]:
    """Return the response channels that change at all, and a note on each that does not."""
    dead = [i for i in others if all(np.ptp(record.samples[:, i]) == 0 for record in records)]
    if len(dead) == len(others):
        fail("records", "all response channels are dead (constant)", "must show a response", remedy="check cables and sensors")
    names = records[0].channels
    return [i for i in others if i not in dead], [f"dead channel {names[i]} left out: its samples never change"
                                                  for i in dead]


def _line_count(sample_rate: float, block: int, highest: float | None) -> int:
    """Return the number of lines up to the highest frequency."""
    highest_frequency = sample_rate / 2.56 if highest is None else positive("highest", highest, sample_rate / 2)
    # The product is a whole number in theory, and rounding must not take the last line away.
    return int(np.floor(highest_frequency * block / sample_rate + 1e-9)) + 1


def _result_notes(frequency: FloatArray, level: FloatArray, used: int, decay: float) -> tuple[str, ...]:
    """Return the notes on few hits, the band of the force and the exponential window."""
    notes: list[str] = []
    if used == 1:
        notes.append(Doubt("one hit only", "no coherence and no variance", "strike at least three times"))
        warnings.warn(notes[-1], ToolpointWarning, stacklevel=3)
    weak_lines = np.flatnonzero(level < 0.1 * level.max())
    if weak_lines.size and frequency[weak_lines[0]] < frequency[-1]:
        # Two digits: every struck record has an end of its own, and they are one remark.
        highest = float(f"{frequency[weak_lines[0]]:.2g}")
        notes.append(f"the force spectrum is 20 dB down above {highest:g} Hz: use a harder tip for more")
    if decay:
        notes.append(f"exponential window with a decay of {decay:.4g} 1/s, to be taken out of the poles")
    return tuple(notes)
