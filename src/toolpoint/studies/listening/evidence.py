"""Evidence for and against chatter in a record: speed, orders, lines off the orders, their families, background."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import BoolArray, FloatArray, ToolpointError
from toolpoint.signals.orders.cutting_part import CuttingPart, find_cutting_part, measure_clipping
from toolpoint.signals.orders.line_spectrum import LineSpectrum, SpectralLines, line_spectrum
from toolpoint.signals.orders.order_tracking import SpeedCourse, resample_by_angle, track_speed
from toolpoint.signals.orders.side_bands import Family, SeparatedLines, find_families, separate_lines
from toolpoint.signals.orders.speed_rivals import rank_speeds
from toolpoint.signals.orders.spindle_comb import SpindleSpeed, search_speed

HIGHEST_FREQUENCY = 6000.0  # Hz: chatter of milling tools lies below
MIN_ANALYSIS_RATE = 13_000.0  # samples a second that such a band needs
SPEED_TOLERANCE = 0.02  # relative: of the programmed speed
SPINDLE_LIMITS = (15.0, 500.0)  # Hz: 900 to 30 000 rev/min, searched where no speed is given
REFINEMENT_RANGE = 0.003  # relative: about the speed, once it has been tracked
MIN_IDLE_SECONDS = 0.2  # of the record beside the cut, to know lines that are there without it
REVERBERATION_SECONDS = 0.3  # after the cut, left out: the room still rings
MIN_IDLE_POWER_RATIO = 0.2  # of a line without the cut, over the same with it, that makes it background
MIN_SECONDS = 0.5  # of a cut
MIN_TURNS = 12.0  # revolutions of a cut
COMPARED_PASSINGS = 8  # tooth passings that are looked for beside the loud part
MIN_PASSING_RATIO = 0.2  # of their power there over that within, that makes it cutting too
MIN_PASSING_EXCESS = 25.0  # of a tooth passing over the floor
MIN_PASSINGS = 2
MIN_COMB_SCORE = 6.0  # standard deviations of chance: of a comb that tells the speed by itself
MIN_SHARPENING = 0.5  # of the comb's score, standard deviations of chance
MIN_TELLING_BANDS = 4  # side bands a tooth passing apart, which tell the speed as well
MIN_HARMONICS = 2  # tooth passings that stand out
SKIRT_CELLS = (1.8, 3.0)  # resolution cells from an order: where a line too near to it to be told would show


@dataclass(frozen=True, eq=False)
class Evidence:
    """Lines, speed and families of a record at one spindle speed.

    samples, rate : of the cut, at constant angle steps; spectrum : of them; speed, rivals : the spindle and what else fits;
    course : speed over time; part : where the cut lies; lines : by what they are; families : of lines off the comb, those of
    the background left out; background : lines that are there without the cut; skirt : power beside the orders, nearer than
    can be told, over their power; broadband : power in no line over that of the orders; clipped : fraction of samples.
    """

    samples: FloatArray
    rate: float
    spectrum: LineSpectrum
    speed: SpindleSpeed
    rivals: tuple[SpindleSpeed, ...]
    course: SpeedCourse
    part: CuttingPart
    lines: SeparatedLines
    families: tuple[Family, ...]
    background: SpectralLines
    skirt: float
    broadband: float
    clipped: float
    teeth: int

    @property
    def tooth(self) -> float:
        """Tooth-passing frequency, Hz."""
        return self.speed.frequency * self.teeth

    @property
    def duration(self) -> float:
        """Length of the cut, s."""
        return self.samples.size / self.rate

    @property
    def family(self) -> Family | None:
        """The most powerful family."""
        return self.families[0] if self.families else None

    @property
    def tells_speed(self) -> bool:
        """Whether tooth passings that stand out, or enough side bands a tooth passing apart, tell the spindle speed."""
        family = self.family
        by_bands = family is not None and family.tooth_members - family.tooth_chance >= MIN_TELLING_BANDS
        return self.speed.harmonics >= MIN_HARMONICS or by_bands

    @property
    def ratio(self) -> float:
        """Power of the family over that of the orders."""
        return self.family.power / max(self.lines.order_power, 1e-300) if self.family else 0.0


def gather_evidence(samples: FloatArray, rate: float, teeth: int, *, speed: float | None) -> Evidence:
    """Gather what a record shows.

    Parameters
    ----------
    samples : (n,) floats
        One channel.
    rate : float
        Samples per second.
    teeth : int
    speed : float or None
        Programmed spindle speed, rev/min, within 2 %; searched from 900 to 30 000 rev/min where None.

    Raises
    ------
    ToolpointError
        For silence, a cut shorter than 0.5 s or 12 revolutions, or a rate too low for one tooth passing.
    """
    clipped = measure_clipping(samples)
    samples, rate = _decimate(samples - samples.mean(), rate)
    if float(np.std(samples)) == 0:
        raise ToolpointError("record: silent, all samples are alike; record the cut with the microphone switched on")
    part = find_cutting_part(samples, rate)
    cut = samples[part.first:part.last]
    _check_length(cut.size / rate, speed)
    spectrum = line_spectrum(cut, rate, highest=HIGHEST_FREQUENCY)
    rivals = _search(spectrum, teeth, speed)
    if (longer := _extend(samples, rate, part, rivals[0].frequency * teeth, spectrum)) != part:
        part = longer
        cut = samples[part.first:part.last]
        spectrum = line_spectrum(cut, rate, highest=HIGHEST_FREQUENCY)
        rivals = _search(spectrum, teeth, speed)
    followed, spectrum, refined, course = _follow(cut, rate, spectrum, rivals[0], teeth)
    lines = separate_lines(spectrum, refined.frequency, teeth)
    is_background = _background(samples, rate, part, lines.others)
    families = find_families(lines.others.selected(~is_background), refined.frequency, teeth, cell=spectrum.cell)
    return Evidence(followed, rate, spectrum, replace(refined, score=rivals[0].score), rivals, course, part, lines,
                    tuple(families), lines.others.selected(is_background), _skirt(spectrum, lines, refined.frequency),
                    _broadband(samples, rate, part, lines), clipped, teeth)


def _extend(samples: FloatArray, rate: float, part: CuttingPart, tooth: float, spectrum: LineSpectrum) -> CuttingPart:
    """Return the part with what lies before and after it where teeth pass there too: chatter that sets in is louder than
    the cut before it, and must not be taken for its beginning."""
    first, last = part.first, part.last
    passings = tooth * np.arange(1, COMPARED_PASSINGS + 1)
    power = spectrum.highest_near(passings, 1.5 * spectrum.cell)
    for piece in ("head", "tail"):
        outside = samples[:first] if piece == "head" else samples[last:]
        if outside.size < MIN_IDLE_SECONDS * rate:
            continue
        quieter = line_spectrum(outside, rate, highest=HIGHEST_FREQUENCY)
        level = quieter.highest_near(passings, quieter.cell)
        is_line = level > MIN_PASSING_EXCESS * np.interp(passings, quieter.frequency, quieter.floor)
        if np.sum(np.where(is_line, level, 0.0)) > MIN_PASSING_RATIO * power.sum() and is_line.sum() >= MIN_PASSINGS:
            first, last = (0, last) if piece == "head" else (first, samples.size)
    return CuttingPart(first, last, part.is_told and (first > 0 or last < samples.size))


def _follow(cut: FloatArray, rate: float, spectrum: LineSpectrum, speed: SpindleSpeed, teeth: int
            ) -> tuple[FloatArray, LineSpectrum, SpindleSpeed, SpeedCourse]:
    """Return the cut at even steps of angle with its spectrum, speed and course; as it was where tracking sharpens no comb."""
    limits = (speed.frequency * (1 - REFINEMENT_RANGE), speed.frequency * (1 + REFINEMENT_RANGE))
    steady = SpeedCourse(np.full(cut.size, speed.frequency), 0.0)
    untracked = search_speed(spectrum, teeth, limits)[0]
    if untracked.score < MIN_COMB_SCORE:  # few forced lines stand out: the distances of side bands tell more
        return cut, spectrum, speed, steady
    course = track_speed(cut, rate, speed.frequency, teeth=teeth)
    if course.variation > 0:
        resampled = resample_by_angle(cut, rate, course)
        sharper = line_spectrum(resampled, rate, highest=HIGHEST_FREQUENCY)
        tracked = search_speed(sharper, teeth, limits)[0]
        if tracked.score > untracked.score + MIN_SHARPENING:
            return resampled, sharper, tracked, course
    return cut, spectrum, untracked, steady


def _search(spectrum: LineSpectrum, teeth: int, speed: float | None) -> tuple[SpindleSpeed, ...]:
    if speed is not None:
        limits = (speed / 60 * (1 - SPEED_TOLERANCE), speed / 60 * (1 + SPEED_TOLERANCE))
        return rank_speeds(spectrum, search_speed(spectrum, teeth, limits), teeth, spindle_limits=limits)
    candidates = search_speed(spectrum, teeth, SPINDLE_LIMITS)
    return rank_speeds(spectrum, candidates, teeth, spindle_limits=SPINDLE_LIMITS)


def _decimate(samples: FloatArray, rate: float) -> tuple[FloatArray, float]:
    """Return samples at a rate that the band needs, by a whole factor."""
    factor = int(rate // MIN_ANALYSIS_RATE)
    if factor < 2:
        return samples, rate
    from scipy.signal import resample_poly

    return np.asarray(resample_poly(samples, 1, factor)), rate / factor


def _check_length(seconds: float, speed: float | None) -> None:
    turns = MIN_TURNS * 60 / speed if speed else 0.0
    needed = max(MIN_SECONDS, turns)
    if seconds < needed:
        raise ToolpointError(f"record: {seconds:.3g} s of cut; must be at least {needed:.3g} s "
                             f"({MIN_TURNS:g} revolutions, {MIN_SECONDS:g} s); record a longer cut")


def _background(samples: FloatArray, rate: float, part: CuttingPart, lines: SpectralLines) -> BoolArray:
    """Whether each line is there without the cut: before it, or after it when the room has gone quiet."""
    is_background = np.zeros(lines.frequency.size, bool)
    if not part.is_told or not lines.frequency.size:
        return is_background
    head, tail = samples[:part.first], samples[part.last + int(REVERBERATION_SECONDS * rate):]
    # The last tenth of a second before the cut is left out: the tool may touch before its entry is noticed.
    for idle in (head[:int(head.size - 0.1 * rate)] if head.size > 0.1 * rate else head[:0], tail):
        if idle.size >= MIN_IDLE_SECONDS * rate:
            spectrum = line_spectrum(idle, rate, highest=HIGHEST_FREQUENCY)
            idle_lines = spectrum.lines()
            is_same = np.abs(lines.frequency[:, None] - idle_lines.frequency[None, :]) < spectrum.cell
            is_background |= (is_same & (idle_lines.power[None, :] > MIN_IDLE_POWER_RATIO * lines.power[:, None])).any(axis=1)
    return is_background


def _broadband(samples: FloatArray, rate: float, part: CuttingPart, lines: SeparatedLines) -> float:
    """Power of the cut that stands in no line, over that of the orders; what is there before the cut is subtracted, and where
    nothing was recorded before it the answer is zero."""
    cut, idle = samples[part.first:part.last], samples[:max(part.first - int(0.1 * rate), 0)]
    residual = float(np.var(cut)) - lines.order_power - float(lines.others.power.sum())
    if not part.is_told or idle.size < MIN_IDLE_SECONDS * rate:
        return 0.0  # noise of the surroundings cannot be told
    return max(residual - float(np.var(idle)), 0.0) / max(lines.order_power, 1e-300)


def _skirt(spectrum: LineSpectrum, lines: SeparatedLines, spindle: float) -> float:
    """Power beside the orders, nearer than can be told, over the power of the orders."""
    order = np.arange(1, lines.orders.size + 1)[lines.orders > 0] * spindle
    if order.size == 0:
        return 0.0
    cell = spectrum.cell
    middle, half = 0.5 * sum(SKIRT_CELLS) * cell, 0.5 * (SKIRT_CELLS[1] - SKIRT_CELLS[0]) * cell
    skirts = np.maximum(spectrum.highest_near(order - middle, half), spectrum.highest_near(order + middle, half))
    floor = np.interp(order, spectrum.frequency, spectrum.floor)
    return float(np.sum(np.where(skirts > 10 * floor, skirts, 0.0)) / max(lines.order_power, 1e-300))
