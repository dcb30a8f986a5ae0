r"""What responses alone betray of wrong signs, delays, scales and swapped channels; named and proposed, never repaired.

A driving point of a passive structure takes in power: the real part of its mobility is never negative. A flipped channel makes
it negative everywhere; a delay :math:`\tau` turns it by :math:`e^{-i \omega \tau}`, and the delay that leaves no negative
power is looked for. Reciprocity, :math:`H_{ab} = H_{ba}`, tells sign and scale of two points, and which channels are swapped.
Source: Ewins, Modal Testing, 2nd ed., sections 3.9 and 4.3 (checks of measured data).
"""

from __future__ import annotations

import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint._doubt import Doubt
from toolpoint.signals.checks import Reciprocity, reciprocity
from toolpoint.vibration.dof import Dof
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.line_noise import line_noise

PASSIVE, GAIN = 0.9, 0.05  # share of power taken in: a driving point below is questioned; what a delay must bring
LONGEST, DELAYS = 0.05, 401  # longest delay as a share of the record 1 / df, and how many are tried to each side
SCALES = {9.80665: "g instead of m/s2", 1e3: "mm instead of m", 25.4e-3: "inches instead of m", 4.448: "lbf instead of N"}
NEAR = 0.03
RECIPROCAL = 0.7  # agreement below which two points are not the same pair
UNLIKE = 2.0
_SURE = 3.0  # standard deviations of noise from which the sign of the power at a line is sure


def question(frf: Frf) -> tuple[Doubt, ...]:
    """Return the doubts about the channels of measured responses of one pose, each with what to look at; empty where none."""
    inside = frf.between(float(np.nextafter(0, 1)), float(frf.frequency[-1]))
    if inside.frequency.size < 3:
        return ()
    return (*_driving_doubts(inside), *_reciprocity_doubts(reciprocity(inside)))


def scale_words(factor: float) -> str:
    """Return the unit that a factor of measured over true hints at, in words; empty where none is near."""
    size = max(abs(factor), 1 / abs(factor))
    for scale, words in SCALES.items():
        if abs(size / max(scale, 1 / scale) - 1) < NEAR:
            is_large = (abs(factor) > 1) == (scale > 1)
            return f", as {words if is_large else ' for '.join(reversed(words.split(' instead of ')))} makes it"
    return ""


def _driving_doubts(frf: Frf) -> list[Doubt]:
    order = {"receptance": 1, "mobility": 0, "accelerance": -1}[frf.quantity]
    lines: list[Doubt] = []
    late = []
    for dof in frf.outputs:
        if dof not in frf.inputs:
            continue
        values, factor = frf.values[:, frf.outputs.index(dof), frf.inputs.index(dof)], (1j * frf.omega) ** order
        mobility = values * factor
        share = _share(mobility)
        if share > PASSIVE:
            continue
        delay, sign, best = _best_delay(mobility, frf.omega)
        if best < PASSIVE or best < share + GAIN:
            continue  # noise, or no driving point: `driving_points` of signals.checks has the words for that
        beyond = np.abs(mobility.real) > _SURE * line_noise(values) * np.abs(factor)
        if delay and (not beyond.any() or _share(mobility[beyond]) > PASSIVE):
            continue  # between resonances the power is small beside noise, which any turn of the phase would seem to mend
        if delay == 0:
            lines.append(Doubt(str(dof), "the driving point gives off power at nearly all lines: the sign of one channel "
                               "is wrong (sensor or force cell mounted the other way round)",
                               f"check the mounting, then read it with its direction turned ({_opposite(dof)})",
                               figure=1 - share))
        else:
            late.append((dof, delay, sign))
    return lines + [Doubt(str(dof), f"the driving point fits a passive structure only with a delay of about "
                                    f"{1e3 * delay:+.3g} ms "
                          f"taken out{' and its sign turned' if sign < 0 else ''}", "look for a filter or another amplifier in "
                          "one channel") for dof, delay, sign in late]


def _share(mobility: ComplexArray) -> float:
    power = mobility.real
    return float(power[power > 0].sum() / max(np.abs(power).sum(), 1e-300))


def _best_delay(mobility: ComplexArray, omega: FloatArray) -> tuple[float, int, float]:
    """Return the delay (s), sign and share of the power taken in after both are taken out; no delay where the sign does."""
    if _share(-mobility) > PASSIVE:
        return 0.0, -1, _share(-mobility)
    # A step turns the highest line by a tenth of a half turn; beyond the longest the responses wrap round.
    step = 0.1 * np.pi / omega[-1]
    longest = LONGEST * 2 * np.pi / float(np.median(np.diff(omega)))
    delays = step * np.arange(1 - DELAYS, DELAYS)
    delays = delays[np.abs(delays) <= longest]
    turned = (mobility * np.exp(1j * np.outer(delays, omega))).real
    shares = np.where(turned > 0, turned, 0.0).sum(axis=1) / np.maximum(np.abs(turned).sum(axis=1), 1e-300)
    at = int(np.argmax(np.maximum(shares, 1 - shares)))
    sign = 1 if shares[at] > 0.5 else -1
    return float(delays[at]), sign, float(max(shares[at], 1 - shares[at]))


def _opposite(dof: Dof) -> str:
    return str(Dof(dof.point, ("-" if dof.direction.startswith("+") else "+") + dof.direction[1:]))


def _reciprocity_doubts(pairs: list[Reciprocity]) -> list[Doubt]:
    lines: list[Doubt] = []
    for pair in pairs:
        both = f"{pair.first} struck at {pair.second} and {pair.second} struck at {pair.first}"
        if pair.agreement < RECIPROCAL:
            lines.append(Doubt(both, f"not alike (agreement {pair.agreement:.2f}, must be near 1): two channels or two labels "
                               "may be swapped", "compare the labels with the test's notes", figure=1 - pair.agreement))
        elif pair.agreement > PASSIVE and pair.ratio < 0:
            lines.append(Doubt(both, "have opposite signs: one sensor or one blow has the other direction than its label",
                               "compare the labels with the mounting"))
        elif pair.agreement > PASSIVE and not 1 / UNLIKE < abs(pair.ratio) < UNLIKE:
            lines.append(Doubt(both, f"differ by a factor {abs(pair.ratio):.4g}{scale_words(pair.ratio)}",
                               "check calibration and unit of both channels", figure=abs(pair.ratio)))
    return lines
