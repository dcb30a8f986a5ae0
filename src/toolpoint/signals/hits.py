"""Hits in a long record: found by their force, judged one by one, the reasons of every rejection kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import BoolArray, FloatArray, fail, positive
from toolpoint.vibration.record import Record

SWING = 0.5
LONG = 6  # samples above half of a pulse from which a rise within it is a second blow
FINE = 1000.0  # steps of the samples in a jump, from which two samples are not equal by chance
STEEP = 0.02  # of the top: a larger jump into a flat top is no rounding
STEPS = 4.0  # smallest steps of the samples that a smooth top may be below its neighbours
BRIEF = 0.05  # of the record that a pulse may take above a quarter of its height
SHORT = 8  # samples before the peak from which they tell the offset and the quiet
CUT_FRONT = "the record begins within the pulse: its front is missing (set a longer pretrigger in the acquisition)"


@dataclass(frozen=True)
class HitRules:
    """What makes a hit good.

    Parameters
    ----------
    trigger : float
        Level that opens a hit, as share of the largest force of the record.
    pretrigger : float
        Part of the block before the hit, 0 .. 0.5; less of it where the record begins sooner.
    double : float
        Second force peak in a block, as share of the first, that makes a double hit.
    weak : float
        Peak force, as share of the median of all hits, below which a hit is weak.
    full_scale : float, optional
        Largest value that the acquisition can show, in the unit of the channel; without it flat tops are searched.
    unquiet : float
        Response before the hit (rms, as share of its peak) above which an earlier hit still rings.
    undecayed : float
        Response at the end of the windowed block (rms, as share of its peak) above which the ring-down is cut off.
    inconsistent : float
        Share of a hit's response energy that the other hits' response cannot explain, above which it is left out; only
        if it is also more than six times the median share.
    """

    trigger: float = 0.1
    pretrigger: float = 0.02
    double: float = 0.05
    weak: float = 0.2
    full_scale: float | None = None
    unquiet: float = 0.05
    undecayed: float = 0.05
    inconsistent: float = 0.02


@dataclass(frozen=True)
class Hit:
    """One hit: first sample of its block, sample of its peak, end of its pulse, peak force, why it is rejected, its record."""

    start: int
    peak: int
    pulse: int
    force: float
    reasons: tuple[str, ...] = ()
    record: int = 0

    @property
    def accepted(self) -> bool:
        """Whether nothing speaks against the hit."""
        return not self.reasons

    def rejected(self, reason: str) -> Hit:
        """Return the hit with one more reason against it."""
        return replace(self, reasons=(*self.reasons, reason))


def find_hits(force: FloatArray, block: int, rules: HitRules, *, record: int = 0) -> list[Hit]:
    """Return all hits of one force channel, in time order; a second pulse within a block belongs to its hit.

    A block begins before its hit by the pretrigger, or where the record begins. `record`: its number, kept in the hits.
    """
    size = np.abs(force - _quiet_level(force))
    top = float(size.max())
    if top == 0:
        fail("force", "all samples are equal", "must hold hits", remedy="check the channel assignment")
    noise = 1.4826 * float(np.median(size))
    level = max(rules.trigger * top, 6 * noise)
    if level >= top:
        fail("force", f"largest value {top:.3g} against a noise of {noise:.3g}", "must stand out of the noise",
             remedy="the force channel may be wrong, or the hammer range too large")
    before = round(positive("pretrigger", rules.pretrigger + 1e-12, 0.5) * block)
    hits: list[Hit] = []
    free_from = 0
    for rise in _rises(size >= level):
        if rise < free_from:
            continue
        end = _pulse_end(size, rise, level)
        start = max(rise - before, 0)
        hit = Hit(start, rise + int(np.argmax(size[rise:end])), end, 0.0, record=record)
        hits.append(replace(hit, force=float(size[hit.peak]), reasons=(CUT_FRONT,) if rise == 0 else ()))
        free_from = start + block
    return hits


def find_pulses(force: FloatArray, rules: HitRules) -> list[int]:
    """Return the first sample of every pulse of a force channel, second ones of double hits among them."""
    size = np.abs(force - _quiet_level(force))
    level = max(rules.trigger * float(size.max()), 6 * 1.4826 * float(np.median(size)))
    return _rises(size >= level) if level < size.max() else []


def _rises(above: BoolArray) -> list[int]:
    return [0] * bool(above[0]) + (np.flatnonzero(above[1:] & ~above[:-1]) + 1).tolist()


def _quiet_level(force: FloatArray) -> float:
    return float(np.median(force))


def _pulse_end(size: FloatArray, rise: int, level: float) -> int:
    below = np.flatnonzero(size[rise:] < 0.5 * level)
    return rise + int(below[0]) if below.size else size.size


def judge_hits(hits: Sequence[Hit], records: Sequence[Record], forces: int, *, others: list[int], block: int, rules: HitRules,
               final: float) -> list[Hit]:
    """Return the hits of all records with the reasons against each; `forces`, `others`: channel indices, `final`: the window's
    end. A hit is weak beside the hits of all records."""
    typical = float(np.median([hit.force for hit in hits])) if hits else 0.0
    return [_judged(hit, records[hit.record], forces, others, block, rules, final, typical) for hit in hits]


def _judged(hit: Hit, record: Record, force_at: int, others: list[int], block: int, rules: HitRules, final: float,
            typical: float) -> Hit:
    if hit.reasons:
        return hit
    samples, rate = record.samples.shape[0], record.sample_rate
    if hit.start + block > samples:
        fits = np.floor(1e3 * min((samples - hit.peak - 1) / (1 - rules.pretrigger), samples) / rate) / 1e3
        return hit.rejected(f"block ends {(hit.start + block - samples) / rate:.2g} s behind the record: a duration of "
                            f"{fits:g} s fits")
    part = record.samples[hit.start:hit.start + block]
    force, peak = part[:, force_at], hit.peak - hit.start
    if _swing(force, peak) > SWING:
        return hit.rejected("wrong channel: the force swings to both sides instead of being one pulse; "
                            + _pulse_words(record, force_at))
    if hit.force < rules.weak * typical:
        hit = hit.rejected(f"weak hit: {hit.force:.3g} against a median of {typical:.3g}")
    second = second_peak(force, peak, hit.pulse - hit.start)
    if second > rules.double * hit.force and second > 8 * _noise(force):
        hit = hit.rejected(f"double hit: second peak of {100 * second / hit.force:.0f} %")
    for channel in (force_at, *others):
        if is_clipped(part[:, channel], rules.full_scale):
            hit = hit.rejected(f"overload of channel {record.channels[channel]} ({record.quantities[channel]})")
    for channel in others:
        reason = _response_reason(part[:, channel], peak, rules, final)
        if reason:
            hit = hit.rejected(f"{reason} of channel {record.channels[channel]}")
    return hit


def _pulse_words(record: Record, force_at: int) -> str:
    """Return which channel looks like the force, where one does."""
    like = [f"channel {i + 1} ({record.quantities[i]} at {record.channels[i]})" for i in range(record.samples.shape[1])
            if i != force_at and is_pulse(record.samples[:, i])]
    return f"{like[0]} looks like the force: channels are swapped" if len(like) == 1 else "channels may be swapped"


def is_pulse(values: FloatArray) -> bool:
    """Return whether a channel is one-sided and short, as the force of a hammer is."""
    level = values - np.median(values)
    peak = int(np.argmax(np.abs(level)))
    brief = (np.abs(level) > 0.25 * abs(level[peak])).mean() < BRIEF
    return bool(level[peak] != 0 and _swing(values, peak) < SWING / 2 and brief)


def _swing(force: FloatArray, peak: int) -> float:
    """Return the largest force against the sense of the pulse, as share of the pulse."""
    level = force - np.median(force)
    return float(np.max(-level * np.sign(level[peak]))) / max(abs(float(level[peak])), 1e-300)


def _noise(values: FloatArray) -> float:
    return 1.4826 * float(np.median(np.abs(values - np.median(values))))


def second_peak(force: FloatArray, peak: int, pulse: int) -> float:
    """Return the height of a second blow: a peak after the pulse, or a rise within a pulse that is long in samples."""
    level = (force - np.median(force)) * np.sign(force[peak] - np.median(force))
    gap = max(pulse - peak, 3)
    late = float(np.abs(level[min(pulse + gap, level.size):]).max(initial=0.0))
    inside = level[peak:min(pulse + gap, level.size)]
    if np.count_nonzero(level[:pulse + gap] > 0.5 * level[peak]) < LONG:
        return late  # the ringing of anti-aliasing filters rises as well
    return max(late, float((inside - np.minimum.accumulate(inside)).max(initial=0.0)))


def is_clipped(values: FloatArray, full_scale: float | None = None) -> bool:
    """Return whether a channel shows a flat top: equal samples at its largest value, run into steeply.

    Coarsely stored signals have equal samples at a smooth top as well; there the samples beside them are a step away. Two equal
    samples are enough where the steps of the samples are so fine that chance does not make them equal.
    """
    size = np.abs(values)
    top = float(size.max())
    if full_scale is not None:
        return top >= 0.999 * full_scale
    at_top = size >= top * (1 - 1e-9)
    if top == 0 or at_top.sum() < 2:
        return False
    steps = np.diff(np.unique(size))
    step = float(steps[steps > 1e-12 * top].min(initial=top))
    edges = np.flatnonzero(at_top[1:] != at_top[:-1])
    jump = float(np.abs(size[edges + 1] - size[edges]).max()) if edges.size else top
    if (at_top[2:] & at_top[1:-1] & at_top[:-2]).any():
        return jump > min(STEPS * step, STEEP * top)
    return jump > FINE * step


def _response_reason(values: FloatArray, peak: int, rules: HitRules, final: float) -> str:
    quiet = values[:max(int(0.8 * peak), 1)]
    centred = values - (np.mean(values[:max(peak // 2, 1)]) if peak >= SHORT else np.mean(values))
    top = float(np.abs(centred).max())
    if top == 0:
        return "dead channel: no response"
    if peak >= SHORT and np.sqrt(((quiet - quiet.mean())**2).mean()) > rules.unquiet * top:
        return "ring-down of an earlier hit"
    last = centred[-max(values.size // 20, 1):]
    if final * np.sqrt((last**2).mean()) > rules.undecayed * top:
        return "ring-down not ended within the block (lengthen it or use an exponential window)"
    return ""
