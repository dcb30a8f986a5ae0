"""Hits in a long record: found by their force, judged one by one, with the reasons of every rejection."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import BoolArray, FloatArray, fail, positive
from toolpoint.vibration.record import Record

MAX_SWING = 0.5  # force against the sense of the pulse, over its peak
MIN_LONG_PULSE = 6  # samples above half of the peak, from which a rise within the pulse is a second blow
MIN_CLIPPING_STEPS = 1000.0  # of the samples in a jump, from which two samples are not equal by chance
MAX_SMOOTH_STEPS = 4.0  # of the samples, from three equal ones at a smooth top to their neighbours: a parabola's
MIN_CLIPPING_JUMP = 0.02  # of the peak: a larger jump into a flat top is no rounding, where numbers lie on no grid
MIN_LARGE_LEVELS = 20  # above half of the peak, whose differences then tell the steps of numbers of so many digits
MIN_GRID_LEVELS, GRID_TOLERANCE = 4, 0.05  # levels on a grid, and how far from it, of its step: fewer lie on one by chance
MAX_PULSE_FRACTION = 0.05  # of the record, above a quarter of the peak
MIN_PRETRIGGER_SAMPLES = 8  # before the peak, from which offset and quiet are computed
CUT_FRONT = "the record begins within the pulse: its front is missing (set a longer pretrigger in the acquisition)"


@dataclass(frozen=True)
class HitRules:
    """Limits that a good hit keeps.

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

    Examples
    --------
    >>> from toolpoint.signals import HitRules
    >>> HitRules(double=0.1).pretrigger
    0.02
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
    """One hit of a hammer test.

    start, peak, pulse : first sample of its block, sample of its peak, end of its pulse; force : peak force, N; reasons :
    against the hit, empty where it is accepted; record : number of its record.

    Examples
    --------
    >>> from toolpoint.signals import Hit
    >>> hit = Hit(start=10, peak=60, pulse=70, force=250.0)
    >>> hit.accepted, hit.rejected("double hit").reasons
    (True, ('double hit',))
    """

    start: int
    peak: int
    pulse: int
    force: float
    reasons: tuple[str, ...] = ()
    record: int = 0

    @property
    def accepted(self) -> bool:
        """Whether there is no reason against the hit."""
        return not self.reasons

    def rejected(self, reason: str) -> Hit:
        """Return the hit with one more reason against it."""
        return replace(self, reasons=(*self.reasons, reason))


def find_hits(force: FloatArray, block: int, rules: HitRules, *, record: int = 0) -> list[Hit]:
    """Return all hits of one force channel, in time order; a second pulse within a block belongs to its hit.

    A block begins before its hit by the pretrigger, or where the record begins. `record`: its number, kept in the hits.
    """
    force_size = np.abs(force - _quiet_level(force))
    largest = float(force_size.max())
    if largest == 0:
        fail("force", "all samples are equal", "must hold hits", remedy="check the channel assignment")
    noise = 1.4826 * float(np.median(force_size))
    trigger_level = max(rules.trigger * largest, 6 * noise)
    if trigger_level >= largest:
        fail("force", f"largest value {largest:.3g} against a noise of {noise:.3g}", "must stand out of the noise",
             remedy="the force channel may be wrong, or the hammer range too large")
    pretrigger = round(positive("pretrigger", rules.pretrigger + 1e-12, 0.5) * block)
    hits: list[Hit] = []
    block_end = 0
    for rise in _rises(force_size >= trigger_level):
        if rise < block_end:
            continue
        end = _pulse_end(force_size, rise, trigger_level)
        start = max(rise - pretrigger, 0)
        hit = Hit(start, rise + int(np.argmax(force_size[rise:end])), end, 0.0, record=record)
        hits.append(replace(hit, force=float(force_size[hit.peak]), reasons=(CUT_FRONT,) if rise == 0 else ()))
        block_end = start + block
    return hits


def find_pulses(force: FloatArray, rules: HitRules) -> list[int]:
    """Return the first sample of every pulse of a force channel, second ones of double hits among them."""
    force_size = np.abs(force - _quiet_level(force))
    # Six deviations above the noise, by the median, which the blows themselves do not move.
    trigger_level = max(rules.trigger * float(force_size.max()), 6 * 1.4826 * float(np.median(force_size)))
    return _rises(force_size >= trigger_level) if trigger_level < force_size.max() else []


def _rises(is_above: BoolArray) -> list[int]:
    """Return the first samples of stretches above the level."""
    return [0] * bool(is_above[0]) + (np.flatnonzero(is_above[1:] & ~is_above[:-1]) + 1).tolist()


def _quiet_level(force: FloatArray) -> float:
    """Return the offset of the force, its median."""
    return float(np.median(force))


def _pulse_end(force_size: FloatArray, rise: int, level: float) -> int:
    """Return the first sample of a pulse below half of the trigger level."""
    below_level = np.flatnonzero(force_size[rise:] < 0.5 * level)
    return rise + int(below_level[0]) if below_level.size else force_size.size


def judge_hits(hits: Sequence[Hit], records: Sequence[Record], forces: int, *, others: list[int], block: int, rules: HitRules,
               final: float) -> list[Hit]:
    """Return the hits of all records with the reasons against each.

    `forces`, `others` : channel indices; `final` : end value of the window. A hit is weak relative to the hits of all records.
    """
    typical = float(np.median([hit.force for hit in hits])) if hits else 0.0
    return [_judge_hit(hit, records[hit.record], forces, others, block, rules, final, typical) for hit in hits]


def _judge_hit(hit: Hit, record: Record, force_at: int, others: list[int], block: int, rules: HitRules, final: float,
            typical: float) -> Hit:
    """Return the hit with the reasons against it: cut off, wrong channel, weak, double, clipped, or a bad ring-down."""
    if hit.reasons:
        return hit
    samples, rate = record.samples.shape[0], record.sample_rate
    if hit.start + block > samples:
        fitting_duration = np.floor(1e3 * min((samples - hit.peak - 1) / (1 - rules.pretrigger), samples) / rate) / 1e3
        return hit.rejected(f"block ends {(hit.start + block - samples) / rate:.2g} s behind the record: a duration of "
                            f"{fitting_duration:g} s fits")
    block_samples = record.samples[hit.start:hit.start + block]
    force, peak = block_samples[:, force_at], hit.peak - hit.start
    if _swing(force, peak) > MAX_SWING:
        return hit.rejected("wrong channel: the force swings to both sides instead of being one pulse; "
                            + _pulse_words(record, force_at))
    if hit.force < rules.weak * typical:
        hit = hit.rejected(f"weak hit: {hit.force:.3g} against a median of {typical:.3g}")
    second_force = second_peak(force, peak, hit.pulse - hit.start)
    if second_force > rules.double * hit.force and second_force > 8 * _noise(force):
        hit = hit.rejected(f"double hit: second peak of {100 * second_force / hit.force:.0f} %")
    for channel in (force_at, *others):
        if is_clipped(block_samples[:, channel], rules.full_scale):
            hit = hit.rejected(f"overload of channel {record.channels[channel]} ({record.quantities[channel]})")
    for channel in others:
        reason = _response_reason(block_samples[:, channel], peak, rules, final)
        if reason:
            hit = hit.rejected(f"{reason} of channel {record.channels[channel]}")
    return hit


def _pulse_words(record: Record, force_at: int) -> str:
    """Return the channel that looks like the force, in words, where one does."""
    candidates = [f"channel {i + 1} ({record.quantities[i]} at {record.channels[i]})" for i in range(record.samples.shape[1])
            if i != force_at and is_pulse(record.samples[:, i])]
    return f"{candidates[0]} looks like the force: channels are swapped" if len(candidates) == 1 else "channels may be swapped"


def is_pulse(values: FloatArray) -> bool:
    """Whether a channel is one-sided and short, as the force of a hammer is."""
    level = values - np.median(values)
    peak = int(np.argmax(np.abs(level)))
    is_brief = (np.abs(level) > 0.25 * abs(level[peak])).mean() < MAX_PULSE_FRACTION
    return bool(level[peak] != 0 and _swing(values, peak) < MAX_SWING / 2 and is_brief)


def _swing(force: FloatArray, peak: int) -> float:
    """Return the largest force against the sense of the pulse, as share of the pulse."""
    level = force - np.median(force)
    return float(np.max(-level * np.sign(level[peak]))) / max(abs(float(level[peak])), 1e-300)


def _noise(values: FloatArray) -> float:
    """Return the standard deviation from the median of absolute deviations."""
    return 1.4826 * float(np.median(np.abs(values - np.median(values))))


def second_peak(force: FloatArray, peak: int, pulse: int) -> float:
    """Return the height of a second blow: a peak after the pulse, or a rise within a pulse that is long in samples."""
    signed_force = (force - np.median(force)) * np.sign(force[peak] - np.median(force))
    gap = max(pulse - peak, 3)
    later_peak = float(np.abs(signed_force[min(pulse + gap, signed_force.size):]).max(initial=0.0))
    pulse_part = signed_force[peak:min(pulse + gap, signed_force.size)]
    if np.count_nonzero(signed_force[:pulse + gap] > 0.5 * signed_force[peak]) < MIN_LONG_PULSE:
        return later_peak  # the ringing of anti-aliasing filters rises as well
    return max(later_peak, float((pulse_part - np.minimum.accumulate(pulse_part)).max(initial=0.0)))


def is_clipped(values: FloatArray, full_scale: float | None = None) -> bool:
    """Whether a channel has a flat top: equal samples at its largest value, after a steep rise.

    Coarsely stored signals have equal samples at a smooth top as well. A parabola that stays within a step over three samples
    has fallen by four at the next: a larger jump is clipping. Two equal samples are enough where the steps of the samples are
    so fine that chance does not make them equal.
    """
    magnitude = np.abs(values)
    largest = float(magnitude.max())
    if full_scale is not None:
        # Converters clip at the last code, which their own gain and offset put a little below the stated range.
        return largest >= 0.999 * full_scale
    is_largest = magnitude >= largest * (1 - 1e-9)
    if largest == 0 or is_largest.sum() < 2:
        return False
    step, is_grid = _step_at_top(magnitude, largest)
    edges = np.flatnonzero(is_largest[1:] != is_largest[:-1])
    jump = float(np.abs(magnitude[edges + 1] - magnitude[edges]).max()) if edges.size else largest
    if (is_largest[2:] & is_largest[1:-1] & is_largest[:-2]).any():
        # Numbers on no grid are not rounded, or so few that their steps are not known.
        return jump > (MAX_SMOOTH_STEPS + GRID_TOLERANCE) * step or (not is_grid and jump > MIN_CLIPPING_JUMP * largest)
    return jump > MIN_CLIPPING_STEPS * step


def _step_at_top(magnitude: FloatArray, largest: float) -> tuple[float, bool]:
    """Return the step between neighbouring numbers at the largest sample, and whether all are multiples of it apart.

    Text with so many digits is coarser at the top than below.
    """
    levels = np.unique(magnitude)
    large_levels = levels[levels > 0.5 * largest]
    levels = large_levels if large_levels.size >= MIN_LARGE_LEVELS else levels
    steps = np.diff(levels)
    step = float(steps[steps > 1e-12 * largest].min(initial=largest))
    multiples = (levels - levels[0]) / step
    is_grid = levels.size >= MIN_GRID_LEVELS and float(np.abs(multiples - np.round(multiples)).max()) < GRID_TOLERANCE
    return step, is_grid


def _response_reason(values: FloatArray, peak: int, rules: HitRules, final: float) -> str:
    """Return the reason against a response: dead, still ringing before the hit, or cut off at the end; empty where none."""
    # Up to four fifths of the way: the rise of the blow itself is no noise.
    quiet = values[:max(int(0.8 * peak), 1)]
    centred = values - (np.mean(values[:max(peak // 2, 1)]) if peak >= MIN_PRETRIGGER_SAMPLES else np.mean(values))
    largest = float(np.abs(centred).max())
    if largest == 0:
        return "dead channel: no response"
    if peak >= MIN_PRETRIGGER_SAMPLES and np.sqrt(((quiet - quiet.mean())**2).mean()) > rules.unquiet * largest:
        return "ring-down of an earlier hit"
    block_end = centred[-max(values.size // 20, 1):]
    if final * np.sqrt((block_end**2).mean()) > rules.undecayed * largest:
        return "ring-down not ended within the block (lengthen it or use an exponential window)"
    return ""
