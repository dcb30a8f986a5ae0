"""Hits in a long record: found by their force, judged one by one, the reasons of every rejection kept."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray, fail, positive
from toolpoint.vibration.record import Record

SWING = 0.5


@dataclass(frozen=True)
class HitRules:
    """What makes a hit good.

    Parameters
    ----------
    trigger : float
        Level that opens a hit, as share of the largest force of the record.
    pretrigger : float
        Part of the block before the hit, 0 .. 0.5.
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
        if it is also more than four times the median share.
    """

    trigger: float = 0.1
    pretrigger: float = 0.02
    double: float = 0.05
    weak: float = 0.2
    full_scale: float | None = None
    unquiet: float = 0.05
    undecayed: float = 0.05
    inconsistent: float = 0.05


@dataclass(frozen=True)
class Hit:
    """One hit: first sample of its block, sample of its peak, end of its pulse, peak force, and why it is rejected."""

    start: int
    peak: int
    pulse: int
    force: float
    reasons: tuple[str, ...] = ()

    @property
    def accepted(self) -> bool:
        """Whether nothing speaks against the hit."""
        return not self.reasons

    def rejected(self, reason: str) -> Hit:
        """Return the hit with one more reason against it."""
        return replace(self, reasons=(*self.reasons, reason))


def find_hits(force: FloatArray, block: int, rules: HitRules) -> list[Hit]:
    """Return all hits of one force channel, in time order; a second pulse within a block belongs to its hit."""
    size = np.abs(force - np.median(force))
    top = float(size.max())
    if top == 0:
        fail("force", "all samples are equal", "must hold hits", "check the channel assignment")
    noise = 1.4826 * float(np.median(size))
    level = max(rules.trigger * top, 6 * noise)
    above = size >= level
    if level >= top:
        fail("force", f"largest value {top:.3g} against a noise of {noise:.3g}", "must stand out of the noise",
             "the force channel may be wrong, or the hammer range too large")
    rises = np.flatnonzero(above[1:] & ~above[:-1]) + 1
    before = round(positive("pretrigger", rules.pretrigger + 1e-12, 0.5) * block)
    hits: list[Hit] = []
    free_from = 0
    for rise in rises.tolist():
        if rise < free_from:
            continue
        end = _pulse_end(size, rise, level)
        peak = rise + int(np.argmax(size[rise:end]))
        start = rise - before
        hits.append(Hit(start, peak, end, float(size[peak])))
        free_from = start + block
    return hits


def _pulse_end(size: FloatArray, rise: int, level: float) -> int:
    below = np.flatnonzero(size[rise:] < 0.5 * level)
    return rise + int(below[0]) if below.size else size.size


def judge_hits(hits: list[Hit], record: Record, forces: int, *, others: list[int], block: int, rules: HitRules,
           final: float) -> list[Hit]:
    """Return the hits with all reasons against them; `forces`, `others`: channel indices, `final`: the window's end."""
    typical = float(np.median([hit.force for hit in hits])) if hits else 0.0
    return [_judged(hit, record, forces, others, block, rules, final, typical) for hit in hits]


def _judged(hit: Hit, record: Record, force_at: int, others: list[int], block: int, rules: HitRules, final: float,
            typical: float) -> Hit:
    samples, rate = record.samples.shape[0], record.sample_rate
    rise = hit.start + round(rules.pretrigger * block)
    if hit.start < 0:
        fits = np.floor(1e5 * max(rise, 0) / block) / 1e5
        return hit.rejected(f"block begins {-hit.start / rate:.2g} s before the record: HitRules(pretrigger={fits:g}) fits")
    if hit.start + block > samples:
        fits = np.floor(1e3 * (samples - rise - 1) / (1 - rules.pretrigger) / rate) / 1e3
        return hit.rejected(f"block ends {(hit.start + block - samples) / rate:.2g} s behind the record: a duration of "
                            f"{fits:g} s fits")
    part = record.samples[hit.start:hit.start + block]
    force, peak = part[:, force_at], hit.peak - hit.start
    if _swing(force, peak) > SWING:
        return hit.rejected("wrong channel: the force swings to both sides instead of being one pulse; channels may be "
                            "swapped")
    if hit.force < rules.weak * typical:
        hit = hit.rejected(f"weak hit: {hit.force:.3g} against a median of {typical:.3g}")
    second = _second_peak(np.abs(force - np.median(force)), peak, hit.pulse - hit.start)
    if second > rules.double * hit.force and second > 8 * _noise(force):
        hit = hit.rejected(f"double hit: second peak of {100 * second / hit.force:.0f} %")
    for channel in (force_at, *others):
        if _clipped(part[:, channel], rules.full_scale):
            hit = hit.rejected(f"overload of channel {record.channels[channel]} ({record.quantities[channel]})")
    for channel in others:
        reason = _response_reason(part[:, channel], peak, hit.pulse - hit.start, rules, final)
        if reason:
            hit = hit.rejected(f"{reason} of channel {record.channels[channel]}")
    return hit


def _swing(force: FloatArray, peak: int) -> float:
    """Return the largest force against the sense of the pulse, as share of the pulse."""
    level = force - np.median(force)
    return float(np.max(-level * np.sign(level[peak]))) / max(abs(float(level[peak])), 1e-300)


def _noise(values: FloatArray) -> float:
    return 1.4826 * float(np.median(np.abs(values - np.median(values))))


def _second_peak(size: FloatArray, peak: int, pulse: int) -> float:
    gap = max(pulse - peak, 3)
    late = size[min(pulse + gap, size.size):]
    return float(late.max(initial=0.0))


def _clipped(values: FloatArray, full_scale: float | None) -> bool:
    top = float(np.abs(values).max())
    if full_scale is not None:
        return top >= 0.999 * full_scale
    at_top = np.abs(values) >= top * (1 - 1e-9)
    return bool(top > 0 and (at_top[2:] & at_top[1:-1] & at_top[:-2]).any())


def _response_reason(values: FloatArray, peak: int, pulse: int, rules: HitRules, final: float) -> str:
    centred = values - (np.mean(values[:max(peak // 2, 1)]))
    top = float(np.abs(centred).max())
    if top == 0:
        return "dead channel: no response"
    quiet = centred[:max(int(0.8 * peak), 1)]
    if np.sqrt((quiet**2).mean()) > rules.unquiet * top:
        return "ring-down of an earlier hit"
    last = centred[-max(values.size // 20, 1):]
    if final * np.sqrt((last**2).mean()) > rules.undecayed * top:
        return "ring-down not ended within the block (lengthen it or use an exponential window)"
    return ""
