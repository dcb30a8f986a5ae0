"""Kind of a vibration from where its lines lie: regenerative Hopf or flip, spindle bearing, servo, forced resonance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint.signals.orders.side_bands import Family
from toolpoint.studies.listening.evidence import Evidence
from toolpoint.studies.listening.probability import has_hidden_flip

HOPF, FLIP, BEARING = "regenerative (Hopf)", "regenerative (flip, period two)", "spindle bearing"
SERVO, FORCED, UNKNOWN = "servo or structure at low frequency", "forced resonance of a harmonic", "not known"
MAX_FLIP_CELLS = 2.0  # resolution cells from half a tooth passing
MAX_SERVO_FREQUENCY = 150.0  # Hz: feed drives oscillate below
MIN_SIDE_BANDS = 3  # lines of a family that say how it is modulated
FORCED_RATIO = 4.0  # power of an order over the larger of its neighbours, both at tooth passings, that names it a resonance
MIN_FORCED_FRACTION = 0.5  # of the power of all orders


@dataclass(frozen=True)
class VibrationKind:
    """Name of a vibration, and the reason for it."""

    name: str
    reason: str


def name_chatter(evidence: Evidence) -> VibrationKind:
    """Return the kind of a vibration that is taken for chatter."""
    family = evidence.family
    if has_hidden_flip(evidence):
        return VibrationKind(FLIP, "lines at odd multiples of half the tooth passing, stronger than the other orders of "
                                   "run-out")
    if family is None:
        return VibrationKind(UNKNOWN, "power in no line: vibration without a period")
    if abs(family.base - 0.5 * evidence.tooth) < MAX_FLIP_CELLS * evidence.spectrum.cell:
        return VibrationKind(FLIP, f"lines at odd multiples of half the tooth passing, {0.5 * evidence.tooth:.1f} Hz")
    tooth_bands, turn_bands = side_band_powers(family, evidence)
    if family.members >= MIN_SIDE_BANDS and turn_bands > 2 * tooth_bands:
        return VibrationKind(BEARING, "side bands a revolution apart, stronger than those a tooth passing apart: it is "
                                      "modulated by the spindle's turning, not by the teeth")
    if family.frequency < MAX_SERVO_FREQUENCY and family.members < MIN_SIDE_BANDS:
        return VibrationKind(SERVO, f"below {MAX_SERVO_FREQUENCY:g} Hz and without side bands of the tooth passing")
    if family.members < MIN_SIDE_BANDS:
        return VibrationKind(HOPF, "by its power alone: no side bands a tooth passing apart were seen")
    return VibrationKind(HOPF, f"{family.members} lines at k f_z ± {family.base:.1f} Hz, f_z = {evidence.tooth:.1f} Hz")


def name_forced(evidence: Evidence) -> VibrationKind | None:
    """Return the forced resonance that most of the sound of a stable cut is, if one is."""
    tooth = evidence.lines.orders[evidence.teeth - 1::evidence.teeth]
    if tooth.size < 3 or evidence.lines.order_power == 0:
        return None
    k = int(np.argmax(tooth))
    neighbours = max(tooth[k - 1] if k > 0 else 0.0, tooth[k + 1] if k + 1 < tooth.size else 0.0)
    if k > 0 and tooth[k] > FORCED_RATIO * neighbours and tooth[k] > MIN_FORCED_FRACTION * evidence.lines.order_power:
        return VibrationKind(FORCED, f"harmonic {k + 1} of the tooth passing, {(k + 1) * evidence.tooth:.1f} Hz, holds "
                            f"{100 * tooth[k] / evidence.lines.order_power:.0f} % of the power of all orders")
    return None


def side_band_powers(family: Family, evidence: Evidence) -> tuple[float, float]:
    """Return the power of side bands a tooth passing apart from the strongest line, and of those other revolutions apart."""
    lines, cell = family.lines, evidence.spectrum.cell
    is_tooth = np.zeros(lines.frequency.size, bool)
    for centre in (family.frequency, -family.frequency, 2 * family.frequency, -2 * family.frequency):
        number = np.rint((lines.frequency - centre) / evidence.tooth)
        is_tooth |= np.abs(lines.frequency - centre - number * evidence.tooth) < 1.5 * cell
    is_seed = np.abs(lines.frequency - family.frequency) < 0.1 * cell
    return float(lines.power[is_tooth & ~is_seed].sum()), float(lines.power[~is_tooth].sum())
