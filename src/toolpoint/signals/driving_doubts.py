r"""Faults of a measured driving point: turned, conjugated, exchanged, of another quantity, late, or no driving point.

Every explanation is tried on the lines that can be believed, and the one that gives a passive structure is named. A delay
:math:`\tau` turns the phase of a response by :math:`e^{-i \omega \tau}`; a small one, hidden by damping, still turns the peaks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

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
from toolpoint.vibration.frf import DERIVATIVE_ORDER, Frf

MAX_ACTIVE_FRACTION, GRAVE_ACTIVE_FRACTION = 0.03, 0.08  # of loud lines that give off power: doubted, grave
QUANTITY_PENALTY = 0.5  # a turned sign or a delay is likelier than another quantity that explains the lines a little better
MAX_UNEXPLAINED_ACTIVE = 0.3  # of the active lines, after an explanation
MAX_DELAY_FRACTION, MAX_DELAY_COUNT = 0.05, 401  # of the record 1 / df; delays tried to each side
MIN_FILE_LINES = 100  # of a response that is judged even where few of its lines can be believed
MIN_LOUD_FRACTION = 0.05  # of the lines, above the noise
PHASE_ERROR = np.radians(2.0)  # standard deviation, of a residue with near neighbours or a complex shape
DELAY_DEVIATIONS, LONE_DEVIATIONS, OTHER_DEVIATIONS = 2.8, 4.0, 0.7  # of a delay at several peaks, at one, at all but one
ADVANCE_FACTOR = 1.7  # on the deviations of a response ahead of its force: overlapping modes turn a peak as much
# Peaks from which one delay may explain all their phases; significance; least error of a phase, of that assumed; least change
# of the least real part by a delay that is doubted for its significance.
MIN_DELAY_PEAKS, DELAY_SIGNIFICANCE, MIN_RELATIVE_TURN_ERROR, MIN_DELAY_CHANGE = 3, 2e-4, 0.02, 0.03
MAX_MISFIT_GROWTH = 1.05  # of the real part's misfit with the imaginary one, as a delay is taken out: beyond, it was none
MAX_UNEXPLAINED_TURN = 0.5  # of the weighted squared phases of the peaks, after a delay
MAX_CHANCE_TURN = 1e-3  # of them: less is no chance, as neighbours of two modes do not turn both in proportion to frequency
MAX_PEAK_TURN = np.radians(100)  # phase of a peak: beyond, response and force are at different points
# A mode of the opposite sign: its part that gives off power over the largest response, phase beyond the passive range, lines.
MIN_TURNED_RATIO, MIN_TURN, MIN_TURNED_LINES = 0.02, np.radians(20), 4
_NOT_ONE_POINT = "not a driving point (response and force are not at one point and direction) or very noisy"


@dataclass(frozen=True)
class DrivingPointCheck:
    """Fraction of the believed lines on which a driving point takes in power, and the doubts about it."""

    dof: Dof
    share: float
    doubts: tuple[Doubt, ...]


def driving_points(frf: Frf) -> list[DrivingPointCheck]:
    """Return the check of every Dof that is output and input, by the rule of `question_driving_point`.

    The share is NaN where too few lines can be believed.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.signals import driving_points
    >>> from toolpoint.vibration import Modes, frequency_response
    >>> modes = Modes([100.0], [0.02], np.array([[0.1]]), ["tool:+x"])
    >>> check = driving_points(frequency_response.modal(modes, np.arange(20.0, 400.0)))[0]
    >>> check.share, check.doubts
    (1.0, ())
    """
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
    above_zero = frf.between(float(np.nextafter(0, 1)), float(frf.frequency[-1]))
    return band_lines(above_zero.between(*find_compliant_band(above_zero, usable_band(above_zero)).ends))


def question_driving_point(frf: Frf, dof: Dof | str | None = None) -> list[Doubt]:
    """Return the doubts about a single response labelled as a driving point, judged on the lines that can be believed.

    dof : its name in the doubts; that of the response where left out. Grave doubts are those that change limits of cuts.
    """
    name = str(frf.outputs[0] if dof is None else dof)
    above_zero = frf.between(float(np.nextafter(0, 1)), float(frf.frequency[-1]))
    band = find_compliant_band(above_zero, usable_band(above_zero))
    lines = band_lines(above_zero.between(*band.ends))
    if lines is None and above_zero.frequency.size < MIN_FILE_LINES:
        return []
    if lines is None:
        return [Doubt(name, f"only the lines from {band.low:.4g} to {band.high:.4g} Hz stand out of noise: there is hardly a "
                      "response", "look at the sensor and its cable, strike harder, average more", grave=True)]
    if not np.abs(lines.receptance).any():
        return [Doubt(name, "the response is zero on every line: nothing was measured", "look at the channel and its cable",
                      grave=True)]
    if float(lines.is_loud.mean()) < MIN_LOUD_FRACTION:
        return [Doubt(name, f"only {100 * lines.is_loud.mean():.2g} % of the lines stand {SIGNAL_TO_NOISE:g} times out of the "
                      "noise: there is hardly a response", "look at the sensor and its cable, strike harder, average more",
                      figure=1 - float(lines.is_loud.mean()), grave=True)]
    share = active_share(lines)
    doubts = _doubt_peak_phases(name, lines) if share <= MAX_ACTIVE_FRACTION else [_doubt_active_lines(name, frf, lines, share)]
    return doubts if any(doubt.grave for doubt in doubts) else _doubt_turned_loss(name, lines) or doubts


def _doubt_turned_loss(name: str, lines: BandLines) -> list[Doubt]:
    """Return the doubt about a run of lines that give off as much power as a mode of the opposite sign.

    On the flank of a stronger mode it is of few lines: their share says nothing of how strong it is.
    """
    gain = lines.receptance.imag
    largest = float(np.abs(lines.receptance[lines.is_loud]).max())
    is_turned = (gain > MIN_TURNED_RATIO * largest) & (gain > SIGNAL_TO_NOISE * lines.noise) & (
        gain > np.sin(MIN_TURN) * np.abs(lines.receptance))
    runs = np.flatnonzero(np.convolve(is_turned, np.ones(MIN_TURNED_LINES), "valid") == MIN_TURNED_LINES)
    if not runs.size:
        return []
    place = int(np.argmax(np.where(is_turned, gain, 0.0)))
    return [Doubt(name, f"{_NOT_ONE_POINT}: near {lines.omega[place] / (2 * np.pi):.0f} Hz it gives off power as a mode of the "
                  f"opposite sign does, {100 * gain[place] / largest:.2g} % of its largest peak", "put sensor and hammer at "
                  "one point in one line", figure=float(gain[place] / largest), grave=True)]


def _doubt_active_lines(name: str, frf: Frf, lines: BandLines, share: float) -> Doubt:
    """Return the doubt about lines that give off power, with the explanation that leaves the least of it."""
    delay, sign, _ = best_delay(lines)
    delay_doubt = _doubt_delay(name, delay, sign, share)
    explanations = [*_explanations(name, frf, lines),
                    (delay_doubt.why, delay_doubt.remedy, lines.turned(sign * np.exp(1j * lines.omega * delay)))]
    remaining = [(active_share(turned), _causality_misfit(turned) + QUANTITY_PENALTY * ("passive as" in words))
            for words, _, turned in explanations]
    passive = [k for k, (active, _) in enumerate(remaining)
               if active <= min(MAX_UNEXPLAINED_ACTIVE * share, GRAVE_ACTIVE_FRACTION)]
    if passive:
        # Of what leaves a passive structure, that whose real part follows best from its imaginary part, in this band alone.
        words, remedy, _ = explanations[min(passive, key=lambda k: sum(remaining[k]))]
        return Doubt(name, words, remedy, figure=share, grave=True)
    return Doubt(name, f"{_NOT_ONE_POINT}: it gives off power at {100 * share:.0f} % of the lines", "put sensor and hammer at "
                 "one point in one line, and check signs, labels, `quantity` and the order of the columns", figure=share,
                 grave=share > GRAVE_ACTIVE_FRACTION)


def _causality_misfit(lines: BandLines) -> float:
    """Return the misfit of the real part with the imaginary one, and the relative size of what the band leaves out."""
    outside = look_outside(lines)
    return outside.misfit + (abs(outside.above) + abs(outside.below)) / max(float(np.abs(lines.receptance).max()), 1e-300)


def _doubt_delay(name: str, delay: float, sign: int, figure: float) -> Doubt:
    """Return the doubt about a delay between force and response."""
    return Doubt(name, f"the driving point fits a passive structure only with a delay of about {1e3 * delay:+.3g} ms taken out"
                 f"{' and its sign turned' if sign < 0 else ''}", "look for a filter or another amplifier in one channel",
                 figure=figure, grave=True)


def _explanations(name: str, frf: Frf, lines: BandLines) -> list[tuple[str, str, BandLines]]:
    """Return (words, remedy, corrected lines) of every fault that turns the phase of a whole response."""
    prefix = "the driving point gives off power at nearly all lines"
    explanations = [
        (f"{prefix}: the sign of one channel is wrong (sensor or force cell mounted the other way round)",
         f"check the mounting, then read it with its direction turned ({_opposite(frf.outputs[0])}); a receptance read as an "
         "accelerance turns its sign too: check `quantity`", lines.turned(-1)),
        (f"{prefix}: its phase is that of the other time factor, exp(-i w t)", "turn the sign of the imaginary part",
         lines.conjugated()),
        ("the driving point is passive only with real and imaginary part exchanged", "check the order of the columns",
         lines.conjugated().turned(1j))]
    for quantity, order in DERIVATIVE_ORDER.items():
        if quantity != frf.quantity:
            power = DERIVATIVE_ORDER[frf.quantity] - order
            explanations.append((f"the driving point is passive as {quantity}, not as {frf.quantity}",
                              f"check the quantity of the file (`quantity` {quantity})",
                              lines.turned((1j * lines.omega) ** power)))
    return explanations


def best_delay(lines: BandLines) -> tuple[float, int, float]:
    """Return the delay (s) and sign that leave the least share of active lines once taken out, and that share."""
    omega = lines.omega
    # A step turns the phase of the highest line by pi/10; beyond the longest delay the responses wrap round.
    step = 0.1 * np.pi / omega[-1]
    longest = MAX_DELAY_FRACTION * 2 * np.pi / float(np.median(np.diff(omega)))
    delays = step * np.arange(1 - MAX_DELAY_COUNT, MAX_DELAY_COUNT)
    delays = delays[np.abs(delays) <= longest]
    coarse_shares = _active_shares(lines, delays)
    coarse_places = [int(np.argmin(coarse_shares[0])), int(np.argmin(coarse_shares[1]))]
    sign_index = 0 if coarse_shares[0][coarse_places[0]] <= coarse_shares[1][coarse_places[1]] else 1
    fine = delays[coarse_places[sign_index]] + step * np.linspace(-1, 1, 41)
    fine_shares = _active_shares(lines, fine)[sign_index]
    # Several delays may leave no active line: the middle of them is taken.
    best_places = np.flatnonzero(fine_shares <= fine_shares.min() + 1e-9)
    best_place = int(best_places[best_places.size // 2])
    return float(fine[best_place]), 1 - 2 * sign_index, float(fine_shares[best_place])


def _active_shares(lines: BandLines, delays: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the active shares after each delay is taken out, for the sign as it is and for the opposite one."""
    is_loud: BoolArray = lines.is_loud
    loud_lines = BandLines(lines.omega[is_loud], lines.receptance[is_loud], lines.noise[is_loud])
    phase_factors: list[ComplexArray] = [np.exp(1j * loud_lines.omega * delay) for delay in delays]
    return (np.array([active_share(loud_lines.turned(turn)) for turn in phase_factors]),
            np.array([active_share(loud_lines.turned(-turn)) for turn in phase_factors]))


def _doubt_peak_phases(name: str, lines: BandLines) -> list[Doubt]:
    """Return the doubt from the phases of the peaks, where no line gives off power."""
    peaks = find_peaks(lines)
    if not peaks:
        return []
    omega, phase, error = _turns(peaks)
    if float(np.abs(phase[0])) > MAX_PEAK_TURN:
        return [Doubt(name, f"{_NOT_ONE_POINT}: its peak at {peaks[0].frequency:.0f} Hz is turned by "
                      f"{np.degrees(phase[0]):.0f} degrees", "put sensor and hammer at one point in one line", grave=True)]
    delay, deviations = _fit_delay(omega, phase, error)
    unexplained = float((((phase + omega * delay) / error) ** 2).sum() / max(float(((phase / error) ** 2).sum()), 1e-300))
    min_deviations = DELAY_DEVIATIONS if len(peaks) > 1 else LONE_DEVIATIONS
    if delay < 0 and not (len(peaks) > 1 and unexplained < MAX_CHANCE_TURN):
        min_deviations *= ADVANCE_FACTOR
    is_large = deviations >= min_deviations and unexplained <= MAX_UNEXPLAINED_TURN and _is_shared(omega, phase, error, delay)
    if not is_large and not _is_common_delay(omega, phase, error, delay):
        return []
    # Modes that overlap turn peaks as a delay does; taken out, a delay that is there brings real and imaginary part together.
    misfits = [look_outside(each).misfit for each in (lines, lines.turned(np.exp(1j * lines.omega * delay)))]
    if misfits[1] > MAX_MISFIT_GROWTH * misfits[0] or not (is_large or _changes_limits(lines, delay)):
        return []
    return [_doubt_delay(name, delay, 1, abs(float(phase[0])))]


def question_shared_delay(responses: Mapping[str, Frf]) -> list[Doubt]:
    """Return the doubt that one delay turns the peaks of several driving points, too little in each of them to be told there.

    responses : single driving points measured by the same channels, by the name of their direction.
    """
    parts = [lines for frf in responses.values() if (lines := select_lines(frf)) is not None]
    peaks = [peak for lines in parts for peak in find_peaks(lines)]
    if len(parts) < 2 or not peaks:
        return []
    omega, phase, error = _turns(peaks)
    delay, _ = _fit_delay(omega, phase, error)
    if not _is_common_delay(omega, phase, error, delay) or not any(_changes_limits(lines, delay) for lines in parts):
        return []
    return [_doubt_delay(" and ".join(responses), delay, 1, float(np.abs(phase).max()))]


def _turns(peaks: Sequence[ResonancePeak]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the frequencies (rad/s) of peaks, the phases of their residues (rad) and the errors of these.

    The error is of hysteretic damping (its ratio), of near neighbours or a complex shape, and of the peak's fit.
    """
    error = [np.sqrt(PHASE_ERROR**2 + peak.damping**2 + (2 * peak.deviation) ** 2) for peak in peaks]
    return (2 * np.pi * np.array([peak.frequency for peak in peaks]), np.array([peak.phase for peak in peaks]),
            np.array(error))


def _is_common_delay(omega: FloatArray, phase: FloatArray, error: FloatArray, delay: float) -> bool:
    """Whether one delay explains the phases of the peaks far better than chance, by what it leaves of them (Student's t).

    Neighbours turn one peak or another; phases that grow with frequency from peak to peak are those of a delay, however small.
    """
    freedom = omega.size - 1
    if freedom < MIN_DELAY_PEAKS - 1:
        return False
    residual = (phase + omega * delay) / error
    scale = max(float(np.sqrt((residual**2).sum() / freedom)), MIN_RELATIVE_TURN_ERROR)
    ratio = abs(delay) * float(np.sqrt(((omega / error) ** 2).sum())) / scale
    return float(2 * scipy.special.stdtr(freedom, -ratio)) < DELAY_SIGNIFICANCE


def _changes_limits(lines: BandLines, delay: float) -> bool:
    """Whether the least real part, which bounds depths of cut, is another once a delay is taken out."""
    loud = lines.receptance[lines.is_loud]
    true = loud * np.exp(1j * lines.omega[lines.is_loud] * delay)
    return abs(float(loud.real.min()) - float(true.real.min())) > MIN_DELAY_CHANGE * float(np.abs(true.real.min()))


def _fit_delay(omega: FloatArray, phase: FloatArray, error: FloatArray) -> tuple[float, float]:
    """Return the delay (s) that turns these peaks, by weighted least squares, and its size in standard deviations."""
    weight = (omega / error) ** 2
    delay = float(-(weight * phase / omega).sum() / weight.sum())
    return delay, abs(delay) * float(np.sqrt(weight.sum()))


def _is_shared(omega: FloatArray, phase: FloatArray, error: FloatArray, delay: float) -> bool:
    """Whether the other peaks show the delay without the strongest one: two near modes in one peak turn that alone."""
    if omega.size < 2:
        return True
    others = np.arange(omega.size) != int(np.argmax(np.abs(phase) / error))
    delay_of_others, deviations = _fit_delay(omega[others], phase[others], error[others])
    return 0.5 < delay_of_others / delay < 2 and deviations > OTHER_DEVIATIONS


def _opposite(dof: Dof) -> str:
    """Return the label of the opposite direction."""
    return str(Dof(dof.point, ("-" if dof.direction.startswith("+") else "+") + dof.direction[1:]))
