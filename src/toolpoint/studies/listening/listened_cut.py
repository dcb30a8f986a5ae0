"""Result of listening to a cut: one sentence first, then numbers, lines and doubts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint._rounding import NORMAL_QUANTILE_95, probability_text, with_uncertainty
from toolpoint.signals.orders.growth import Onset, PowerCourse
from toolpoint.studies.listening.better_speeds import SpeedToTry
from toolpoint.studies.listening.chatter_frequency import ChatterFrequency
from toolpoint.studies.listening.evidence import Evidence
from toolpoint.studies.listening.kinds import VibrationKind
from toolpoint.studies.text_table import text_table

CHATTER, NO_CHATTER, CANNOT_TELL = "chatter", "no chatter", "cannot tell"
# The probability is calibrated on about a hundred cuts: nearer to certainty than one in a hundred it cannot be.
PROBABILITY_RESOLUTION = 0.01
RECORDER_CLOCK_DEVIATION = 2.5e-5  # relative: quartz clocks of recorders are sold as right within 50 ppm
_SHOWN_LINES = 12  # rows of the table of lines


@dataclass(frozen=True, eq=False)
class ListenedCut(NotebookText):
    """Verdict on a cut by its sound or vibration.

    Parameters
    ----------
    verdict : str
        ``chatter``, ``no chatter`` or ``cannot tell``.
    probability : float
        Of chatter.
    reason : str
    kind : VibrationKind
        Of the chatter, or a forced resonance of a stable cut; empty where nothing stands out.
    line : ChatterFrequency or None
        Chatter frequency with its interval and the side bands that could be it.
    onset : Onset or None
    course : PowerCourse or None
        Power of the chatter lines over time.
    speeds : tuple of SpeedToTry
        Fastest first.
    evidence : Evidence
    doubts, notes : tuples
    """

    verdict: str
    probability: float
    reason: str
    kind: VibrationKind
    line: ChatterFrequency | None
    onset: Onset | None
    course: PowerCourse | None
    speeds: tuple[SpeedToTry, ...]
    evidence: Evidence
    doubts: tuple[Doubt, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def chatters(self) -> bool | None:
        """True, False, or None where the record cannot tell."""
        return None if self.verdict == CANNOT_TELL else self.verdict == CHATTER

    @property
    def chatter_words(self) -> str | None:
        """Chatter frequency in Hz with the digits that its interval leaves, None where there is none."""
        if self.line is None or self.verdict != CHATTER:
            return None
        return with_uncertainty(self.line.frequency, self.line.half_width, "").split()[0]

    @property
    def onset_time(self) -> float | None:
        """Time of the onset from the beginning of the record, s; None where chatter is there from the start of the cut."""
        if self.onset is None or self.onset.time is None:
            return None
        # The onset is counted from the beginning of the cut, which is a part of the record.
        return self.evidence.part.first / self.evidence.rate + self.onset.time

    @property
    def probability_words(self) -> str:
        """Probability of chatter in per cent, no nearer to certainty than its calibration tells."""
        return probability_text(self.probability, PROBABILITY_RESOLUTION)

    def answer(self) -> str:
        """Return the result in one sentence."""
        speed = f"at {self.evidence.speed.speed:.0f} rev/min"
        if self.verdict == NO_CHATTER:
            forced = f"; {self.kind.name}: {self.kind.reason}" if self.kind.name else ""
            return f"No chatter {speed} (probability of chatter {self.probability_words}): {self.reason}{forced}."
        if self.verdict == CANNOT_TELL:
            if not self.evidence.tells_speed:
                return f"Cannot tell whether the cut chatters, nor at which speed it runs: {self.reason}."
            return (f"Cannot tell whether the cut chatters {speed} (probability of chatter {self.probability_words}): "
                    f"{self.reason}.")
        place = "" if self.line is None else f" at {with_uncertainty(self.line.frequency, self.line.half_width, 'Hz')}"
        onset = "from the start of the cut" if self.onset_time is None else f"from {self.onset_time:.2f} s on"
        return (f"Chatter{place} {speed} (probability {self.probability_words}), {self.kind.name}, {onset}"
                f"{self._speed_words()}.")

    def _speed_words(self) -> str:
        if self.line is None:
            return ""
        if not self.speeds:
            return "; no other lobe lies within the spindle's speeds: cut less deep"
        return "; try " + " or ".join(f"{each.speed:.0f}" for each in self.speeds[:3]) + " rev/min"

    def rows(self) -> list[tuple[str, str]]:
        """Return rows (quantity, value) with the reasons and the speeds to try."""
        reasons = [("because", self.reason)] + [("kind, because", self.kind.reason)] * bool(self.kind.reason)
        speeds = [(f"speed to try, lobe {each.lobe}", f"{each.speed:.0f} rev/min ({each.lower:.0f} to {each.upper:.0f})")
                  for each in self.speeds]
        return [*self.numbers(), *speeds, *reasons]

    def numbers(self) -> list[tuple[str, str]]:
        """Return rows (quantity, value)."""
        e, rows = self.evidence, [("verdict", self.verdict), ("probability of chatter", self.probability_words)]
        if self.line is not None:
            rows.append(("chatter frequency",
                         f"{with_uncertainty(self.line.frequency, self.line.half_width, 'Hz')} (95 %)"))
            if self.line.others:
                rows.append(("its side bands", ", ".join(f"{f:.0f}" for f in self.line.others) + " Hz"))
            if not np.isnan(self.line.mode):
                rows.append(("mode that it belongs to", f"{self.line.mode:.1f} Hz"))
        if self.kind.name:
            rows.append(("kind", self.kind.name))
        if self.onset is not None:
            rows.append(("onset", "from the start of the cut" if self.onset_time is None else
                         f"{self.onset_time:.2f} ± {self.onset.uncertainty:.2f} s"))
            if not np.isnan(self.onset.growth):
                rows.append(("growth of the amplitude", f"{self.onset.growth:.3g} 1/s"))
        half_width = self.speed_half_width
        speed = f"not heard; {e.speed.speed:.0f} rev/min fits best" if half_width is None else (
            with_uncertainty(e.speed.speed, half_width, "rev/min"))
        passing = [("tooth passing", f"{e.tooth:.2f} Hz")] if e.tells_speed else []
        return [*rows, ("spindle speed", speed), *passing, ("length of the cut", f"{e.duration:.2f} s"),
                ("resolution", f"{e.spectrum.cell:.2f} Hz"),
                ("hidden by spindle orders", f"{100 * e.lines.hidden:.1f} % of the frequencies")]

    @property
    def speed_half_width(self) -> float | None:
        """Half width of the 95 % interval of the spindle speed, rev/min, with the clock of the recorder; None where no tooth
        passing stands out, so that the record does not tell the speed."""
        speed = self.evidence.speed
        if not self.evidence.tells_speed:
            return None
        return NORMAL_QUANTILE_95 * float(np.hypot(60 * speed.deviation, RECORDER_CLOCK_DEVIATION * speed.speed))

    def line_rows(self) -> list[list[str]]:
        """Return rows (Hz, spindle order, dB against the strongest, what it is) of the strongest lines."""
        e, lines = self.evidence, self.evidence.spectrum.lines()
        family = np.zeros(0) if e.family is None else e.family.lines.frequency
        rows = []
        for f, power in list(zip(lines.frequency, lines.power, strict=True))[:_SHOWN_LINES]:
            rows.append([f"{f:.2f}", f"{f / e.speed.frequency:.3f}", f"{10 * np.log10(power / lines.power.max()):.1f}",
                         self._line_name(float(f), family)])
        return rows

    def _line_name(self, frequency: float, family: Any) -> str:
        e = self.evidence
        if np.any(np.isclose(frequency, family, rtol=0, atol=1e-9)):
            return "chatter or its side band" if self.verdict == CHATTER else "off the orders, with side bands"
        if np.any(np.isclose(frequency, e.background.frequency, rtol=0, atol=1e-9)):
            return "there without the cut"
        order = round(frequency / e.speed.frequency)
        if abs(frequency - order * e.speed.frequency) > e.lines.guard:
            return "off the orders"
        return f"tooth passing {order // e.teeth}" if order % e.teeth == 0 else f"spindle order {order}"

    def table(self) -> str:
        """Return the answer, the numbers and the strongest lines as text."""
        rows = "\n".join(f"{name:26s} {value}" for name, value in self.rows())
        lines = text_table("Strongest lines", ["Hz", "order", "dB", "what"], self.line_rows())
        return f"{self.answer()}\n\n{rows}\n\n{lines}"

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain data; frequencies in Hz, times in s, speeds in rev/min, None where not known."""
        line, onset = self.line, self.onset
        return {"doubts": list(self.doubts), "answer": self.answer(), "verdict": self.verdict, "chatter": self.chatters,
                "probability": self.probability, "reason": self.reason, "kind": self.kind.name or None,
                "kind_reason": self.kind.reason or None,
                "frequency_hz": line and line.frequency, "frequency_half_width_hz": line and line.half_width,
                "side_bands_hz": [] if line is None else list(line.others),
                "mode_hz": None if line is None or np.isnan(line.mode) else line.mode,
                "onset_s": self.onset_time, "onset_half_width_s": None if onset is None else onset.uncertainty,
                "growth_per_s": None if onset is None or np.isnan(onset.growth) else onset.growth,
                "speeds": [{"speed_rpm": s.speed, "lower_rpm": s.lower, "upper_rpm": s.upper, "lobe": s.lobe}
                           for s in self.speeds],
                "speed_rpm": self.evidence.speed.speed, "speed_half_width_rpm": self.speed_half_width,
                "resolution_hz": self.evidence.spectrum.cell, "hidden_fraction": self.evidence.lines.hidden,
                "notes": list(self.notes)}
