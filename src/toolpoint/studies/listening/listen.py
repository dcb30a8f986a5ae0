"""A cut judged by a record of its sound or vibration: the verdict, its probability, frequency, kind, onset, speeds to try."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, count, fail, floats, positive
from toolpoint._doubt import Doubt
from toolpoint.signals.orders.growth import Onset, PowerCourse, find_onset, follow_power
from toolpoint.signals.orders.spindle_comb import RIVAL_DISTANCE
from toolpoint.studies.listening.better_speeds import DEFAULT_HEADROOM, SpeedToTry, propose_lobes
from toolpoint.studies.listening.chatter_frequency import ChatterFrequency, name_frequency
from toolpoint.studies.listening.evidence import Evidence, gather_evidence
from toolpoint.studies.listening.kinds import BEARING, SERVO, VibrationKind, name_chatter, name_forced
from toolpoint.studies.listening.listened_cut import CANNOT_TELL, CHATTER, NO_CHATTER, ListenedCut
from toolpoint.studies.listening.probability import MAX_BROADBAND_RATIO, chatter_probability, temper_searched
from toolpoint.studies.listening.recording_doubts import question_flip, question_recording, question_teeth
from toolpoint.vibration import Modes, Record

PRIOR_PROBABILITY = 0.5  # of chatter before the record: either is taken as equally likely
NO_CUT_REASON = "no tooth passing stands out of the noise: no cut is heard; record nearer to it"
DECIDED_PROBABILITY = 0.9  # of chatter, or of none: less certain is "cannot tell"
MAX_JUDGED_CLIPPING = 0.05  # of the samples: beyond, lines of clipping are as strong as those of chatter
RIVAL_SCORE_MARGIN, MAX_RIVALS = 0.15, 3  # of the score of a searched speed; rivals whose verdict is asked
LONGER_RECORD_RATIO = 3.0  # times the cut: the record that is asked for where lines do not stand out


@dataclass(frozen=True)
class SpindleRange:
    """Lowest and highest spindle speed that the machine has, rev/min; `highest` None: a quarter above the present one.

    Examples
    --------
    >>> SpindleRange(highest=18_000.0, lowest=3_000.0).highest
    18000.0
    """

    highest: float | None = None
    lowest: float = 0.0

    def __post_init__(self) -> None:
        if self.highest is not None and not 0 <= self.lowest < self.highest:
            fail("SpindleRange.lowest and SpindleRange.highest", f"{self.lowest:g} and {self.highest:g} rev/min",
                 "must be 0 <= lowest < highest")


def listen(record: Record, teeth: int, speed: float | None = None, *, channel: int | None = None,
           modes: Modes | Sequence[float] | None = None, spindle: SpindleRange | None = None) -> ListenedCut:
    """Judge a cut by a record of its sound or vibration.

    Parameters
    ----------
    record : Record
        Sound (no unit needed), acceleration, velocity or displacement, of one cut, with some of the time before it if possible.
    teeth : int
        Teeth of the tool.
    speed : float, optional
        Programmed spindle speed, rev/min, within 2 %; searched from 900 to 30 000 rev/min where left out.
    channel : int, optional
        Channel to listen to, from 1; the one with the largest power where left out.
    modes : Modes or sequence of float, optional
        Modes of the tool point, or their natural frequencies, Hz: they name the line among its side bands.
    spindle : SpindleRange, optional
        Speeds that the machine has.

    Returns
    -------
    ListenedCut

    Raises
    ------
    ToolpointError
        For silence, a cut shorter than 0.5 s or 12 revolutions, a channel that is not there, teeth below one.

    >>> from toolpoint.vibration import Record
    >>> time = np.arange(2 * 16_000) / 16_000
    >>> cut = sum(np.cos(2 * np.pi * 533.6 * k * time + k) / k for k in range(1, 9))
    >>> cut += sum(0.4 ** abs(k) * np.cos(2 * np.pi * (1417.0 + 533.6 * k) * time + k) for k in range(-2, 3))
    >>> sound = cut + 0.05 * np.random.default_rng(0).standard_normal(time.size)
    >>> heard = listen(Record(sound[:, None], 16_000.0, ["microphone:+x"], ("",)), teeth=4, speed=8004.0)
    >>> round(heard.line.frequency)
    1417
    """
    teeth = count("teeth", teeth)
    if speed is not None:
        positive("speed", speed, 300_000.0)
    column, notes = _choose_channel(record, channel)
    evidence = gather_evidence(record.samples[:, column], record.sample_rate, teeth, speed=speed)
    doubts: list[Doubt] = [*question_recording(evidence, speed is not None), *question_teeth(evidence),
                           *question_flip(evidence)]
    probability = chatter_probability(evidence)
    if speed is None:
        probability = temper_searched(probability)
    kind = name_chatter(evidence)
    verdict, reason = _decide(evidence, probability, kind)
    if reason == NO_CUT_REASON:  # where no cut is heard the record says nothing: what was likely before it remains
        probability = PRIOR_PROBABILITY
    if speed is None and (other := _contradict(record, column, teeth, evidence, probability)) is not None:
        verdict, reason = CANNOT_TELL, (f"the sound fits {evidence.speed.speed:.0f} and {other:.0f} rev/min, and one of them "
                                        "means chatter, the other none; give `speed`")
    spindle = spindle or SpindleRange()
    if verdict == NO_CHATTER:
        forced = name_forced(evidence)
        return ListenedCut(verdict, probability, reason, forced or VibrationKind("", ""), None, None, None, (), evidence,
                           tuple(doubts), (*notes, *_notes(evidence, speed)))
    line = name_frequency(evidence, _frequencies(modes))
    if line is not None and verdict == CHATTER:
        doubts += line.doubts
        notes += [line.note] if line.note and line.others else []
    course, onset = _follow(evidence, line)
    speeds: tuple[SpeedToTry, ...] = ()
    if line is not None and verdict == CHATTER:
        highest = spindle.highest or DEFAULT_HEADROOM * evidence.speed.speed
        mode = None if np.isnan(line.mode) else line.mode
        speeds = propose_lobes(line.frequency, evidence.tooth, teeth, highest=highest, lowest=spindle.lowest, mode=mode)
        if spindle.highest is None:
            notes.append(f"Speeds to try end at {highest:.0f} rev/min, a quarter above the present one (`highest`).")
    return ListenedCut(verdict, probability, reason, kind, line, onset, course, speeds, evidence, tuple(doubts),
                       (*notes, *_notes(evidence, speed)))


def _choose_channel(record: Record, channel: int | None) -> tuple[int, list[str]]:
    columns = record.samples.shape[1]
    if channel is not None:
        if not 1 <= count("channel", channel) <= columns:
            fail("channel", str(channel), f"must be 1 to {columns}, the channels of the record")
        return channel - 1, []
    if columns == 1:
        return 0, []
    power = np.var(record.samples, axis=0)
    column = int(np.argmax(power))
    return column, [f"The record has {columns} channels; channel {column + 1}, the strongest, is judged (`channel`)."]


def _contradict(record: Record, column: int, teeth: int, evidence: Evidence, probability: float) -> float | None:
    """Return a rival of a searched speed, rev/min, at which the verdict would be the opposite; None where there is none."""
    best = evidence.rivals[0]
    rivals = [rival for rival in evidence.rivals[1:] if rival.score > (1 - RIVAL_SCORE_MARGIN) * best.score
              and abs(rival.frequency / best.frequency - 1) > RIVAL_DISTANCE]
    for rival in rivals[:MAX_RIVALS]:
        rival_evidence = gather_evidence(record.samples[:, column], record.sample_rate, teeth, speed=rival.speed)
        if (chatter_probability(rival_evidence) > 0.5) != (probability > 0.5):
            return rival.speed
    return None


def _decide(evidence: Evidence, probability: float, kind: VibrationKind) -> tuple[str, str]:
    """Return verdict and reason."""
    family, longer = evidence.family, f"a record of {LONGER_RECORD_RATIO * evidence.duration:.2g} s may tell"
    if evidence.clipped > MAX_JUDGED_CLIPPING:
        return CANNOT_TELL, "the record is clipped; record again with less gain"
    if probability >= DECIDED_PROBABILITY:
        if kind.name in (BEARING, SERVO):
            return CANNOT_TELL, f"the lines look like those of another cause: {kind.name} ({kind.reason})"
        if family is None:
            return CHATTER, kind.reason
        return CHATTER, (f"{family.members} lines that are no spindle orders, {_decibels(evidence.ratio)} against the orders, "
                         f"belong together: {kind.reason}")
    if probability > 1 - DECIDED_PROBABILITY:
        if evidence.broadband > MAX_BROADBAND_RATIO:
            return CANNOT_TELL, ("most of the power stands in no line: coolant or air that runs with the cut, or chatter "
                                 "without a period; record without coolant")
        if evidence.lines.hidden > 1 - DECIDED_PROBABILITY and not evidence.ratio > 0.01:
            return CANNOT_TELL, (f"{100 * evidence.lines.hidden:.0f} % of the frequencies are nearer to a spindle order than "
                                 f"{evidence.duration:.2g} s can tell; {longer}")
        return CANNOT_TELL, f"lines off the orders are neither strong nor weak ({_decibels(evidence.ratio)}); {longer}"
    if evidence.speed.harmonics == 0:
        return CANNOT_TELL, NO_CUT_REASON
    if family is None:
        return NO_CHATTER, "all lines of the cut are spindle orders"
    return NO_CHATTER, f"lines that are no spindle orders stay {_decibels(evidence.ratio)} against the orders"


def _decibels(ratio: float) -> str:
    return f"{10 * np.log10(max(ratio, 1e-12)):.0f} dB"


def _follow(evidence: Evidence, line: ChatterFrequency | None) -> tuple[PowerCourse | None, Onset | None]:
    """Return the power of the chatter lines over time and their onset, in time from the beginning of the record."""
    if line is None:
        return None, None
    frequencies = np.array([line.frequency, *line.others[:4]])
    spindle = evidence.speed.frequency
    distance = float(np.min(np.abs(frequencies - spindle * np.rint(frequencies / spindle))))
    course = follow_power(evidence.samples, evidence.rate, frequencies, spacing=max(distance, evidence.spectrum.cell))
    return course, find_onset(course)


def _frequencies(modes: Modes | Sequence[float] | None) -> FloatArray | None:
    if modes is None:
        return None
    return np.asarray(modes.frequency, float).ravel() if isinstance(modes, Modes) else floats("modes", modes, (None,))


def _notes(evidence: Evidence, speed: float | None) -> list[str]:
    difference = "" if speed is None else f" ({100 * (evidence.speed.speed / speed - 1):+.2f} % against the stated one)"
    notes = [f"Spindle speed by the comb of orders: {evidence.speed.speed:.1f} rev/min{difference}.",
             "The probability is calibrated on simulated cuts of one tool in random rooms; chatter and none are taken as "
             "equally likely before the record."]
    if speed is None:
        notes.append("The speed was searched: of simulated cuts without a stated speed one in four was given a wrong one, and "
                     "the probability is nearer to even for it.")
    if evidence.course.variation > 0:
        notes.append(f"The speed varied by {100 * evidence.course.variation:.2g} %; orders were tracked.")
    if evidence.background.frequency.size:
        listed = ", ".join(f"{f:.0f}" for f in evidence.background.frequency[:5])
        notes.append(f"Lines that are there without the cut were left out: {listed} Hz.")
    elif not evidence.part.is_told:
        notes.append("No time without cut stands out in the record: lines of other machines are told by their pattern alone.")
    return notes
