"""Sound of a blow: the samples of its response as a tone, with the pulse of its force."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, fail, one_of
from toolpoint._notebook import NotebookText
from toolpoint.signals.hammer import locate_hits
from toolpoint.signals.record_set import RecordSet
from toolpoint.vibration import Record

MIN_SOUND_RATE, MAX_SOUND_RATE = 8000.0, 96_000.0  # Hz, that every browser plays as they are
RESAMPLED_RATE = 22_050.0  # Hz, of a tone whose record has another rate
PULSE_MARGIN = 4.0  # widths of the pulse that are shown before and behind its peak
MAX_TONE_SECONDS = 4.0  # s of the ring-down that are played
LEAD_SECONDS = 0.02  # s before the peak


@dataclass(frozen=True, eq=False)
class BlowTone(NotebookText):
    """Tone of a blow.

    name : of the blow; rate : samples a second of `tone`, Hz; tone : response over its largest value; peak : that value, SI;
    channel, quantity : of the response; pulse, pulse_rate : force about its peak (N) and its rate (Hz); is_resampled : whether
    the record's rate is none that a browser plays.

    >>> import numpy as np
    >>> tone = BlowTone("x#1", 8000.0, np.zeros(800), 12.0, "tip:+x", "acceleration", np.array([0.0, 250.0]), 25600.0, True)
    >>> tone.table().partition(";")[0]
    'x#1: acceleration at tip:+x, 0.10 s at 8000 Hz, resampled from 25600 Hz'
    """

    name: str
    rate: float
    tone: FloatArray
    peak: float
    channel: str
    quantity: str
    pulse: FloatArray
    pulse_rate: float
    is_resampled: bool

    def table(self) -> str:
        """Return what is heard in a sentence."""
        note = f", resampled from {self.pulse_rate:g} Hz" if self.is_resampled else ""
        return (f"{self.name}: {self.quantity} at {self.channel}, {self.tone.size / self.rate:.2f} s at {self.rate:g} Hz{note};"
                f" its loudest sample is {self.peak:.3g} in SI, and the peak of the force {np.abs(self.pulse).max():.3g} N")

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {**vars(self), "words": self.table()}


def sound_blow(records: RecordSet, name: str, duration: float | None = None) -> BlowTone:
    """Return the tone of a blow from the samples of its record.

    Parameters
    ----------
    records : RecordSet
        Of `io.read_hammer_test`.
    name : str
        Of the blow, as verdicts have it: that of its record, with ``#2`` where the record holds several.
    duration : float, optional
        Length of a block of the test, s.

    Raises
    ------
    ToolpointError
        For a blow that is not there.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.signals.record_set import RecordSet
    >>> from toolpoint.studies import BlowTone, sound_blow
    >>> from toolpoint.vibration import Dof, Record
    >>> samples = np.zeros((1000, 2))
    >>> samples[100:108, 0], samples[100:110, 1] = 200 * np.hanning(8), np.linspace(5, -5, 10)
    >>> record = Record(samples, 10_000.0, (Dof("tip", "+x"), Dof("tip", "+x")), ("force", "acceleration"))
    >>> tone = sound_blow(RecordSet((record,), ("first",)), "first", 0.05)
    >>> isinstance(tone, BlowTone), tone.rate, round(tone.peak, 1)
    (True, 10000.0, 5.0)
    """
    match = re.fullmatch(r"(.*)#(\d+)", name)
    base, number = (match[1], int(match[2])) if match and name not in records.names else (name, 1)
    record = records.records[records.names.index(one_of("blow", base, records.names))]
    force_at = record.quantities.index("force")
    hits = locate_hits([record], duration, None)
    if not 1 <= number <= len(hits):
        fail("blow", name, f"must be #1 to #{len(hits)} of {base}")
    hit, last = hits[number - 1], hits[number].start if number < len(hits) else record.samples.shape[0]
    width = max(hit.pulse - hit.peak, 2)
    first = max(hit.peak - round(LEAD_SECONDS * record.sample_rate), 0)
    last = min(last, first + round(MAX_TONE_SECONDS * record.sample_rate))
    place = next(k for k in range(len(record.quantities)) if k != force_at)
    margin = round(PULSE_MARGIN * width)
    pulse = record.samples[max(hit.peak - margin, 0):hit.peak + margin + 1, force_at]
    return _tone_of(record, place, (first, last), name=name, pulse=pulse)


def _tone_of(record: Record, place: int, span: tuple[int, int], *, name: str, pulse: FloatArray) -> BlowTone:
    """Return the tone of a channel between two samples, at a rate that a browser plays."""
    response = record.samples[span[0]:span[1], place]
    response = response - np.median(response)
    peak, rate = float(np.abs(response).max(initial=0.0)), record.sample_rate
    is_resampled = not MIN_SOUND_RATE <= rate <= MAX_SOUND_RATE
    if is_resampled:
        times = np.arange(0.0, (response.size - 1) / rate, 1 / RESAMPLED_RATE)
        response, rate = np.interp(times, np.arange(response.size) / record.sample_rate, response), RESAMPLED_RATE
    return BlowTone(name, rate, response / max(peak, 1e-300), peak, str(record.channels[place]), record.quantities[place],
                    np.asarray(pulse), record.sample_rate, is_resampled)
