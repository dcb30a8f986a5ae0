r"""What is wrong with a measured driving point: turned, conjugated, exchanged, of another quantity, late, or none at all.

Every explanation is tried on the lines that can be believed: the one that leaves a passive structure is named. A delay
:math:`\tau` turns a response by :math:`e^{-i \omega \tau}`; one that hides in damping still turns the peaks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import BoolArray, ComplexArray, FloatArray
from toolpoint._doubt import Doubt
from toolpoint.signals.passivity import (
    SIGNAL_TO_NOISE,
    BandLines,
    ResonancePeak,
    active_share,
    band_lines,
    find_peaks,
    look_outside,
)
from toolpoint.signals.usable_band import find_compliant_band, usable_band
from toolpoint.vibration.dof import Dof
from toolpoint.vibration.frf import Frf

MAX_ACTIVE, GRAVE_ACTIVE = 0.03, 0.08  # share of loud lines that give off power: doubted, grave
QUANTITY_PENALTY = 0.5  # a turned sign or a delay is likelier than another quantity that explains the lines a little better
REMAINING = 0.3  # share of the active lines that an explanation may leave
LONGEST_DELAY, MAX_DELAYS = 0.05, 401  # as a share of the record 1 / df; tried to each side
MIN_FILE_LINES = 100  # of a response that is judged even where few of its lines can be believed
MIN_LOUD = 0.05  # share of the lines that stand out of the noise
PHASE_ERROR = np.radians(2.0)  # of a peak's residue whose neighbours are near or whose shape is complex, one deviation
DELAY_DEVIATIONS, LONE_DEVIATIONS, OTHER_DEVIATIONS = 2.8, 4.0, 0.7  # of a delay seen at peaks, at one alone, at all but one
ADVANCE_FACTOR = 1.7  # on those of a response that is ahead of its force: near modes that overlap turn a peak as much
EXPLAINED = 0.5  # share of the peaks' turn that a delay may leave
REVERSED = np.radians(100)  # turn of a peak beyond which response and force are of different points
_NOT_ONE_POINT = "not a driving point (response and force are not at one point and direction) or very noisy"
_ORDERS = {"receptance": 0, "mobility": 1, "accelerance": 2}


@dataclass(frozen=True)
class DrivingPointCheck:
    """Share of the believed lines on which a driving point takes in power, and the doubts about it."""

    dof: Dof
    share: float
    doubts: tuple[Doubt, ...]


def driving_points(frf: Frf) -> list[DrivingPointCheck]:
    """Return the check of every Dof that is output and input, by the rule of `question_driving_point`; the share is not a
    number where too few lines can be believed."""
    checks = []
    for dof in frf.outputs:
        if dof in frf.inputs:
            direct = frf.selected([dof], [dof])
            lines = select_lines(direct)
            share = float("nan") if lines is None else 1 - active_share(lines)
            checks.append(DrivingPointCheck(dof, share, tuple(question_driving_point(direct))))
    return checks


def select_lines(frf: Frf) -> BandLines | None:
    """Return the lines of a single response in the band that can be believed, None where they are too few."""
    inside = frf.between(float(np.nextafter(0, 1)), float(frf.frequency[-1]))
    return band_lines(inside.between(*find_compliant_band(inside, usable_band(inside)).ends))


def question_driving_point(frf: Frf, dof: Dof | str | None = None) -> list[Doubt]:
    """Return the doubts about a single response that is said to be a driving point, judged on the lines to be believed.

    dof : its name in the doubts; that of the response where left out. Grave doubts are those that change limits.
    """
    name = str(frf.outputs[0] if dof is None else dof)
    inside = frf.between(float(np.nextafter(0, 1)), float(frf.frequency[-1]))
    band = find_compliant_band(inside, usable_band(inside))
    lines = band_lines(inside.between(*band.ends))
    if lines is None and inside.frequency.size < MIN_FILE_LINES:
        return []
    if lines is None:
        return [Doubt(name, f"only the lines from {band.low:.4g} to {band.high:.4g} Hz stand out of noise: there is hardly a "
                      "response", "look at the sensor and its cable, strike harder, average more", grave=True)]
    if not np.abs(lines.receptance).any():
        return [Doubt(name, "the response is zero on every line: nothing was measured", "look at the channel and its cable",
                      grave=True)]
    if float(lines.is_loud.mean()) < MIN_LOUD:
        return [Doubt(name, f"only {100 * lines.is_loud.mean():.2g} % of the lines stand {SIGNAL_TO_NOISE:g} times out of the "
                      "noise: there is hardly a response", "look at the sensor and its cable, strike harder, average more",
                      figure=1 - float(lines.is_loud.mean()), grave=True)]
    share = active_share(lines)
    if share <= MAX_ACTIVE:
        return _turned_peaks(name, find_peaks(lines))
    return [_active(name, frf, lines, share)]


def _active(name: str, frf: Frf, lines: BandLines, share: float) -> Doubt:
    """Return the doubt about lines that give off power, with the explanation that leaves least of it."""
    delay, sign, _ = best_delay(lines)
    late = _late(name, delay, sign, share)
    tried = [*_explanations(name, frf, lines), (late.why, late.remedy, lines.turned(sign * np.exp(1j * lines.omega * delay)))]
    left = [(active_share(turned), _strangeness(turned) + QUANTITY_PENALTY * ("passive as" in words))
            for words, _, turned in tried]
    passive = [k for k, (active, _) in enumerate(left) if active <= min(REMAINING * share, GRAVE_ACTIVE)]
    if passive:
        # Of what leaves a passive structure, that whose real part follows best from its imaginary part, in this band alone.
        words, remedy, _ = tried[min(passive, key=lambda k: sum(left[k]))]
        return Doubt(name, words, remedy, figure=share, grave=True)
    return Doubt(name, f"{_NOT_ONE_POINT}: it gives off power at {100 * share:.0f} % of the lines", "put sensor and hammer at "
                 "one point in one line, and check signs, labels, `quantity` and the order of the columns", figure=share,
                 grave=share > GRAVE_ACTIVE)


def _strangeness(lines: BandLines) -> float:
    """Return how much of the real part does not follow from the imaginary one, and how much the band would leave out."""
    outside = look_outside(lines)
    return outside.misfit + (abs(outside.above) + abs(outside.below)) / max(float(np.abs(lines.receptance).max()), 1e-300)


def _late(name: str, delay: float, sign: int, figure: float) -> Doubt:
    return Doubt(name, f"the driving point fits a passive structure only with a delay of about {1e3 * delay:+.3g} ms taken out"
                 f"{' and its sign turned' if sign < 0 else ''}", "look for a filter or another amplifier in one channel",
                 figure=figure, grave=True)


def _explanations(name: str, frf: Frf, lines: BandLines) -> list[tuple[str, str, BandLines]]:
    """Return (words, remedy, lines as they would be) of what turns a whole response."""
    away = "the driving point gives off power at nearly all lines"
    explained = [
        (f"{away}: the sign of one channel is wrong (sensor or force cell mounted the other way round)",
         f"check the mounting, then read it with its direction turned ({_opposite(frf.outputs[0])}); a receptance read as an "
         "accelerance turns its sign too: check `quantity`", lines.turned(-1)),
        (f"{away}: its phase is that of the other time factor, exp(-i w t)", "turn the sign of the imaginary part",
         lines.conjugated()),
        ("the driving point is passive only with real and imaginary part exchanged", "check the order of the columns",
         lines.conjugated().turned(1j))]
    for other, order in _ORDERS.items():
        if other != frf.quantity:
            power = _ORDERS[frf.quantity] - order
            explained.append((f"the driving point is passive as {other}, not as {frf.quantity}",
                              f"check the quantity of the file (`quantity` {other})",
                              lines.turned((1j * lines.omega) ** power)))
    return explained


def best_delay(lines: BandLines) -> tuple[float, int, float]:
    """Return the delay (s) and sign that leave the least share of active lines once taken out, and that share."""
    omega = lines.omega
    # A step turns the highest line by a tenth of a half turn; beyond the longest the responses wrap round.
    step = 0.1 * np.pi / omega[-1]
    longest = LONGEST_DELAY * 2 * np.pi / float(np.median(np.diff(omega)))
    delays = step * np.arange(1 - MAX_DELAYS, MAX_DELAYS)
    delays = delays[np.abs(delays) <= longest]
    active = _shares(lines, delays)
    places = [int(np.argmin(active[0])), int(np.argmin(active[1]))]
    way = 0 if active[0][places[0]] <= active[1][places[1]] else 1
    fine = delays[places[way]] + step * np.linspace(-1, 1, 41)
    finer = _shares(lines, fine)[way]
    # Several delays may leave none: the middle of them.
    least = np.flatnonzero(finer <= finer.min() + 1e-9)
    at = int(least[least.size // 2])
    return float(fine[at]), 1 - 2 * way, float(finer[at])


def _shares(lines: BandLines, delays: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the active shares with each delay taken out, for the sign as it is and turned."""
    loud: BoolArray = lines.is_loud
    part = BandLines(lines.omega[loud], lines.receptance[loud], lines.noise[loud])
    turns: list[ComplexArray] = [np.exp(1j * part.omega * delay) for delay in delays]
    return (np.array([active_share(part.turned(turn)) for turn in turns]),
            np.array([active_share(part.turned(-turn)) for turn in turns]))


def _turned_peaks(name: str, peaks: list[ResonancePeak]) -> list[Doubt]:
    """Return the doubt that the phases of the peaks give where no line gives off power."""
    if not peaks:
        return []
    omega = np.array([2 * np.pi * peak.frequency for peak in peaks])
    phase = np.array([peak.phase for peak in peaks])
    # Hysteretic damping turns a residue by its damping ratio; its own deviation and near neighbours do the rest.
    error = np.array([np.sqrt(PHASE_ERROR**2 + peak.damping**2 + (2 * peak.deviation) ** 2) for peak in peaks])
    if float(np.abs(phase[0])) > REVERSED:
        return [Doubt(name, f"{_NOT_ONE_POINT}: its peak at {peaks[0].frequency:.0f} Hz is turned by "
                      f"{np.degrees(phase[0]):.0f} degrees", "put sensor and hammer at one point in one line", grave=True)]
    delay, deviations = _delay_of(omega, phase, error)
    left = float((((phase + omega * delay) / error) ** 2).sum() / max(float(((phase / error) ** 2).sum()), 1e-300))
    least = DELAY_DEVIATIONS if len(peaks) > 1 else LONE_DEVIATIONS
    if delay < 0:
        least *= ADVANCE_FACTOR
    if deviations < least or left > EXPLAINED or not _is_shared(omega, phase, error, delay):
        return []
    return [_late(name, delay, 1, abs(float(phase[0])))]


def _delay_of(omega: FloatArray, phase: FloatArray, error: FloatArray) -> tuple[float, float]:
    """Return the delay (s) that turns these peaks, and by how many of its deviations it differs from none."""
    weight = (omega / error) ** 2
    delay = float(-(weight * phase / omega).sum() / weight.sum())
    return delay, abs(delay) * float(np.sqrt(weight.sum()))


def _is_shared(omega: FloatArray, phase: FloatArray, error: FloatArray, delay: float) -> bool:
    """Whether the other peaks show the delay without that which shows it most: two near modes in one peak turn that alone."""
    if omega.size < 2:
        return True
    others = np.arange(omega.size) != int(np.argmax(np.abs(phase) / error))
    rest, deviations = _delay_of(omega[others], phase[others], error[others])
    return 0.5 < rest / delay < 2 and deviations > OTHER_DEVIATIONS


def _opposite(dof: Dof) -> str:
    return str(Dof(dof.point, ("-" if dof.direction.startswith("+") else "+") + dof.direction[1:]))
