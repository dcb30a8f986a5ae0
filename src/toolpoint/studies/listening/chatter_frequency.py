"""Chatter frequency out of a family of side bands: with modes the member that a mode explains, else the largest motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint._rounding import NORMAL_QUANTILE_95
from toolpoint.studies.listening.evidence import Evidence
from toolpoint.studies.listening.probability import has_hidden_flip

MODE_BAND = (-0.03, 0.15)  # relative distance of a chatter line from the natural frequency of the mode that chatters
MIN_LINE_SHARE = 1e-3  # of the family's power: a weaker line is not named
# A mode that regenerates has its line more than half a wave beyond a whole number between teeth (4 of 5 of random cuts).
UPPER_HALF_WEIGHT = 5.0
# Motion of another line of the family over that of the named one, from which it may as well be the chatter. Of 41 heard random
# cuts (`benchmarks/listening/heard_cuts.py`) 32 were named rightly, 4 of them with a rival above this; of the 9 named
# wrongly 7 had one.
MIN_RIVAL_MOTION = 0.3
NAMED_RIGHTLY = "about four of five"  # of random cuts, by the sound alone


@dataclass(frozen=True)
class ChatterFrequency:
    """Named chatter line, its 95 % half width, its family and the mode that explains it, Hz (NaN: no mode at hand).

    rivals : those of the family, Hz, that may as well be the chatter; none where a mode explains the named one.
    """

    frequency: float
    half_width: float
    others: tuple[float, ...]
    mode: float
    rivals: tuple[float, ...] = ()

    @property
    def note(self) -> str:
        """Remark that a line is named by the sound alone; empty where a mode names it or a doubt says more."""
        if self.rivals or not np.isnan(self.mode):
            return ""
        return (f"The chatter is named among its side bands by the sound alone, rightly in {NAMED_RIGHTLY} random cuts; the "
                "speeds to try rest on it. The modes of the tool (`modes`) tell more.")

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """The doubt about which line of the family is the chatter, where another moves the tool about as much."""
        if not self.rivals:
            return ()
        listed = ", ".join(f"{frequency:.0f} Hz" for frequency in self.rivals)
        return (Doubt("chatter frequency", f"by the sound {listed} of the same family may be the chatter as well as "
                      f"{self.frequency:.0f} Hz, and the speeds to try are those of {self.frequency:.0f} Hz",
                      "give the modes of the tool (`modes`), or strike its tip (toolpoint tap)"),)


def name_frequency(evidence: Evidence, modes: FloatArray | None) -> ChatterFrequency | None:
    """Return the chatter frequency, None where there is no line.

    A spectrum of sound follows the velocity of what sounds, so the largest motion is the line with the largest power over
    frequency squared. The other lines of the family remain possible: they are named too.
    """
    frequency, power, deviation = _lines(evidence)
    if frequency.size == 0:
        return None
    kept = power > MIN_LINE_SHARE * power.max()
    frequency, power, deviation = frequency[kept], power[kept], deviation[kept]
    motion = power / frequency**2 * np.where(np.mod(frequency / evidence.tooth, 1) > 0.5, UPPER_HALF_WEIGHT, 1.0)
    index, mode = int(np.argmax(motion)), float("nan")
    if modes is not None and modes.size:
        distance = frequency[:, None] / modes[None, :] - 1
        fits = (distance > MODE_BAND[0]) & (distance < MODE_BAND[1])
        if fits.any():
            weight = np.where(fits, motion[:, None], 0.0)
            index = int(np.argmax(weight.max(axis=1)))
            mode = float(modes[int(np.argmax(weight[index]))])
    wander = evidence.course.variation * float(frequency[index])
    half = NORMAL_QUANTILE_95 * float(np.hypot(deviation[index], 0.1 * evidence.spectrum.cell)) + wander
    order = np.argsort(-power)
    others = tuple(float(f) for f in frequency[order] if f != frequency[index])
    is_rival = (motion >= MIN_RIVAL_MOTION * motion[index]) & (np.arange(motion.size) != index) & np.isnan(mode)
    return ChatterFrequency(float(frequency[index]), half, others[:6], mode, tuple(frequency[is_rival].tolist()))


def _lines(evidence: Evidence) -> tuple[FloatArray, FloatArray, FloatArray]:
    family = evidence.family
    if has_hidden_flip(evidence):
        order = np.arange(1, evidence.lines.orders.size + 1)
        half = (np.abs(np.mod(order / evidence.teeth, 1) - 0.5) < 1e-9) & (evidence.lines.orders > 0)
        return (order[half] * evidence.speed.frequency, evidence.lines.orders[half],
                order[half] * evidence.speed.deviation)
    if family is None:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    return family.lines.frequency, family.lines.power, family.lines.deviation
