"""Doubts about the channels of a test by a model: turned signs, scales, delays, swapped labels; proposed, never repaired."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray
from toolpoint._doubt import Doubt
from toolpoint.vibration import Frf, Modes
from toolpoint.vibration.correlation import mac
from toolpoint.vibration.unit_factor import scale_words

MIN_MODEL_CORRELATION = 0.8  # of a channel with the model, below which its sign and scale are not judged
MAX_CHANNEL_SCALE_RATIO = 3.0  # scale of a channel beside the other channels
MAX_DELAYED_FRAC, MIN_UNDELAYED_FRAC = 0.5, 0.9  # FRAC of a response that is late, and without its delay
MIN_RELATIVE_GAIN = 0.1  # of the distance of the mean MAC or FRAC from 1, that a proposal must bring
UNIT_WORDS_BY_FACTOR = {1e3: "mm instead of m (or kN instead of N)", 1e-3: "m instead of mm", 1e6: "um instead of m",
                        1e-6: "m instead of um"}
MAX_UNIT_FACTOR_RATIO = 4.0  # around a factor of units: errors of a machine's stiffnesses beside it
MAX_SWAPPED_DOFS = 60  # Dofs among which swaps are searched


def question_shapes(measured: Modes, predicted: Modes) -> tuple[Doubt, ...]:
    """Return doubts about the channels of paired modes (equal count and Dofs, measured first): signs, scales, swaps."""
    if measured.count < 2 or len(measured.dofs) < 3:
        return ()
    a, b = np.asarray(measured.shape), np.asarray(predicted.shape)
    start = _mean_mac(a, b)
    flips, a = _find_flips(a, b)
    lines = [Doubt(str(measured.dofs[i]), f"turned, the shapes fit the model better (mean MAC {mac_before:.3f} -> "
                                          f"{mac_after:.3f}): the "
                   "sensor may point the other way than its label", "look at its mounting", figure=mac_after - mac_before)
             for i, mac_before, mac_after in flips]
    swap = _find_swap(a, b)
    if swap is not None:
        i, j, mac_before, mac_after = swap
        lines.append(Doubt(f"{measured.dofs[i]} and {measured.dofs[j]}", "with their labels exchanged the shapes fit the model "
                           f"better (mean MAC {mac_before:.3f} -> {mac_after:.3f}): two channels may be swapped",
                           "compare the labels with the test's notes", figure=mac_after - mac_before))
        a[[i, j]] = a[[j, i]]
    if start > 0.5 or lines:
        lines += _question_scales(measured, a, b)
    return tuple(lines)


def _mean_mac(a: Array, b: Array) -> float:
    return float(np.diagonal(mac(a, b)).mean())


def _find_flips(a: Array, b: Array) -> tuple[list[tuple[int, float, float]], Array]:
    """Return (row, mean MAC before, after) of the rows that fit turned round, best first, and the shapes with them turned."""
    a, result = a.copy(), []
    for _ in range(max(1, len(a) // 3)):
        start_mac = _mean_mac(a, b)
        gains = []
        for i in range(len(a)):
            turned = a.copy()
            turned[i] *= -1
            gains.append(_mean_mac(turned, b))
        best = int(np.argmax(gains))
        if (gains[best] < start_mac + MIN_RELATIVE_GAIN * (1 - start_mac) or gains[best] < start_mac + 0.02
            or gains[best] < MIN_MODEL_CORRELATION):
            break
        result.append((best, start_mac, gains[best]))
        a[best] *= -1
    return result, a


def _find_swap(a: Array, b: Array) -> tuple[int, int, float, float] | None:
    start_mac = _mean_mac(a, b)
    best = (0, 0, start_mac, start_mac)
    for i, j in combinations(range(min(len(a), MAX_SWAPPED_DOFS)), 2):
        other = a.copy()
        other[[i, j]] = other[[j, i]]
        swapped_mac = _mean_mac(other, b)
        if swapped_mac > best[3]:
            best = (i, j, start_mac, swapped_mac)
    return best if best[3] > max(start_mac + 0.05,
                                 MIN_MODEL_CORRELATION) and best[3] - start_mac > MIN_RELATIVE_GAIN * (1 - start_mac) else None


def _question_scales(measured: Modes, a: Array, b: Array) -> list[Doubt]:
    """Return doubts about rows whose size beside the model's is far from that of the other rows."""
    lengths = np.array([np.median(np.abs(a[:, k])[np.abs(b[:, k]) > 0] / np.abs(b[:, k])[np.abs(b[:, k]) > 0])
                        if (np.abs(b[:, k]) > 0).any() else 1.0 for k in range(a.shape[1])])
    a = a / np.where(lengths > 0, lengths, 1.0)
    power = (np.abs(b) ** 2).sum(axis=1)
    product = np.real((b.conj() * a).sum(axis=1))
    correlation = product / np.maximum(np.sqrt(power * (np.abs(a) ** 2).sum(axis=1)), 1e-300)
    loud = power > 1e-2 * power.max()
    lines = []
    for i in np.flatnonzero(loud & (correlation > MIN_MODEL_CORRELATION)):
        factor = float(product[i] / power[i])
        if not 1 / MAX_CHANNEL_SCALE_RATIO < factor < MAX_CHANNEL_SCALE_RATIO:
            lines.append(Doubt(str(measured.dofs[i]), f"moves {factor:.3g} times as much beside the others as in the model"
                               f"{scale_words(factor)}", "check its calibration and unit", figure=factor))
    return lines


def question_responses(measured: Frf, predicted: Frf) -> tuple[Doubt, ...]:
    """Return doubts about signs, scale and delay of responses beside the model's (any quantity) at equal lines and Dofs."""
    a = measured.values.reshape(measured.frequency.size, -1)
    b = predicted.converted_to(measured.quantity).values.reshape(a.shape)
    names = [f"{o} to {i}" for o in measured.outputs for i in measured.inputs]
    factors, fracs = _scale_factors(a, b)
    lines = []
    for name, column, factor, frac in zip(names, range(a.shape[1]), factors, fracs, strict=True):
        if frac > MIN_MODEL_CORRELATION:
            if factor.real < 0:
                lines.append(Doubt(name, "has the opposite sign of the model: sensor or force may point the other way than "
                                   "labelled", "look at the mounting of both"))
            if not 1 / MAX_CHANNEL_SCALE_RATIO < abs(factor) < MAX_CHANNEL_SCALE_RATIO:
                lines.append(Doubt(name, f"is {abs(factor):.3g} times the model's response{scale_words(abs(factor))}",
                                   "check calibration, unit and quantity", figure=abs(factor)))
            continue
        if frac > MAX_DELAYED_FRAC:  # a resonance that is off by some per cent looks like a delay as well
            continue
        delay, best_frac = _find_delay(a[:, column], b[:, column], measured.omega)
        if best_frac > MIN_UNDELAYED_FRAC:
            lines.append(Doubt(name, f"agrees with the model only with a delay of {1e3 * delay:+.3g} ms taken out "
                               f"(FRAC {frac:.2f} -> {best_frac:.2f})", "look for a filter or another amplifier in one channel",
                               figure=best_frac - frac))
    return tuple(lines)


def question_unit(measured: Frf, predicted: Frf) -> tuple[Doubt, ...]:
    """Return a doubt where all responses together are as many times those of a model as another unit makes them.

    The median over lines and responses of the logarithm of their ratio: resonances elsewhere leave it within a factor of few,
    as stiffnesses that are a thousand times off would move every frequency thirty times.
    """
    a = np.abs(measured.values)
    b = np.abs(predicted.converted_to(measured.quantity).values)
    both = (a > 0) & (b > 0)
    if not both.any():
        return ()
    factor = float(np.exp(np.median(np.log(a[both] / b[both]))))
    words = next((text for scale, text in UNIT_WORDS_BY_FACTOR.items()
                  if 1 / MAX_UNIT_FACTOR_RATIO < factor / scale < MAX_UNIT_FACTOR_RATIO), None)
    return () if words is None else (
        Doubt("responses", f"they are {factor:.3g} times those of the machine before its update, as {words} makes them",
              "state the unit in the file, or give its `quantity`; an update makes up for it with wrong numbers",
              figure=factor),)


def _scale_factors(a: ComplexArray, b: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    cross = (b.conj() * a).sum(axis=0)
    first, second = (np.abs(a) ** 2).sum(axis=0), (np.abs(b) ** 2).sum(axis=0)
    return cross / np.maximum(second, 1e-300), np.abs(cross) ** 2 / np.maximum(first * second, 1e-300)


def _find_delay(a: ComplexArray, b: ComplexArray, omega: FloatArray) -> tuple[float, float]:
    """Return the delay of a beside b (s) with the largest FRAC, and that FRAC."""
    step = 0.1 * np.pi / omega[-1]
    delays = step * np.arange(-300, 301)
    delays = delays[np.abs(delays) <= 0.05 * 2 * np.pi / float(np.median(np.diff(omega)))]
    cross = np.exp(1j * np.outer(delays, omega)) @ (b.conj() * a)
    values = np.abs(cross) ** 2 / max(float((np.abs(a) ** 2).sum() * (np.abs(b) ** 2).sum()), 1e-300)
    best = int(np.argmax(values))
    return float(delays[best]), float(values[best])
