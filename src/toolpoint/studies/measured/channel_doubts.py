"""What a model betrays of the channels of a test: turned signs, scales, delays and swapped labels; proposed, never repaired."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray
from toolpoint._doubt import Doubt
from toolpoint.vibration import Frf, Modes
from toolpoint.vibration.correlation import mac
from toolpoint.vibration.unit_factor import scale_words

ALIKE = 0.8  # correlation of a channel with the model below which nothing is said of its sign and scale
UNLIKE = 3.0  # factor from the scale of the other channels
DELAYED, CERTAIN = 0.5, 0.9  # FRAC of a response that is late, and without its delay
GAIN = 0.1  # of the mean MAC or FRAC that a proposal must bring
GROSS_UNITS = {1e3: "mm instead of m (or kN instead of N)", 1e-3: "m instead of mm", 1e6: "um instead of m",
               1e-6: "m instead of um"}
GROSS_RANGE = 4.0  # either way of a factor of units: what a machine's stiffnesses may be off beside it
MOST = 60  # Dofs among which swaps are searched


def question_shapes(measured: Modes, predicted: Modes) -> tuple[Doubt, ...]:
    """Return doubts about the channels of paired modes (equal count and Dofs, measured first): signs, scales, swaps."""
    if measured.count < 2 or len(measured.dofs) < 3:
        return ()
    a, b = np.asarray(measured.shape), np.asarray(predicted.shape)
    start = _mean_mac(a, b)
    flips, a = _flips(a, b)
    lines = [Doubt(str(measured.dofs[i]), f"turned, the shapes fit the model better (mean MAC {before:.3f} -> "
                                          f"{after:.3f}): the "
                   "sensor may point the other way than its label", "look at its mounting", figure=after - before)
             for i, before, after in flips]
    swap = _swap(a, b)
    if swap is not None:
        i, j, before, after = swap
        lines.append(Doubt(f"{measured.dofs[i]} and {measured.dofs[j]}", "with their labels exchanged the shapes fit the model "
                           f"better (mean MAC {before:.3f} -> {after:.3f}): two channels may be swapped",
                           "compare the labels with the test's notes", figure=after - before))
        a[[i, j]] = a[[j, i]]
    if start > 0.5 or lines:
        lines += _scales(measured, a, b)
    return tuple(lines)


def _mean_mac(a: Array, b: Array) -> float:
    return float(np.diagonal(mac(a, b)).mean())


def _flips(a: Array, b: Array) -> tuple[list[tuple[int, float, float]], Array]:
    """Return (row, mean MAC before, after) of the rows that fit turned round, best first, and the shapes with them turned."""
    a, result = a.copy(), []
    for _ in range(max(1, len(a) // 3)):
        before = _mean_mac(a, b)
        gains = []
        for i in range(len(a)):
            turned = a.copy()
            turned[i] *= -1
            gains.append(_mean_mac(turned, b))
        best = int(np.argmax(gains))
        if gains[best] < before + GAIN * (1 - before) or gains[best] < before + 0.02 or gains[best] < ALIKE:
            break
        result.append((best, before, gains[best]))
        a[best] *= -1
    return result, a


def _swap(a: Array, b: Array) -> tuple[int, int, float, float] | None:
    before = _mean_mac(a, b)
    best = (0, 0, before, before)
    for i, j in combinations(range(min(len(a), MOST)), 2):
        other = a.copy()
        other[[i, j]] = other[[j, i]]
        after = _mean_mac(other, b)
        if after > best[3]:
            best = (i, j, before, after)
    return best if best[3] > max(before + 0.05, ALIKE) and best[3] - before > GAIN * (1 - before) else None


def _scales(measured: Modes, a: Array, b: Array) -> list[Doubt]:
    """Return doubts about rows whose size beside the model's is far from that of the other rows."""
    lengths = np.array([np.median(np.abs(a[:, k])[np.abs(b[:, k]) > 0] / np.abs(b[:, k])[np.abs(b[:, k]) > 0])
                        if (np.abs(b[:, k]) > 0).any() else 1.0 for k in range(a.shape[1])])
    a = a / np.where(lengths > 0, lengths, 1.0)
    power = (np.abs(b) ** 2).sum(axis=1)
    product = np.real((b.conj() * a).sum(axis=1))
    alike = product / np.maximum(np.sqrt(power * (np.abs(a) ** 2).sum(axis=1)), 1e-300)
    loud = power > 1e-2 * power.max()
    lines = []
    for i in np.flatnonzero(loud & (alike > ALIKE)):
        factor = float(product[i] / power[i])
        if not 1 / UNLIKE < factor < UNLIKE:
            lines.append(Doubt(str(measured.dofs[i]), f"moves {factor:.3g} times as much beside the others as in the model"
                               f"{scale_words(factor)}", "check its calibration and unit", figure=factor))
    return lines


def question_responses(measured: Frf, predicted: Frf) -> tuple[Doubt, ...]:
    """Return doubts about signs, scale and delay of responses beside the model's (any quantity) at equal lines and Dofs."""
    a = measured.values.reshape(measured.frequency.size, -1)
    b = predicted.converted_to(measured.quantity).values.reshape(a.shape)
    names = [f"{o} to {i}" for o in measured.outputs for i in measured.inputs]
    factors, likeness = _factors(a, b)
    lines = []
    for name, column, factor, alike in zip(names, range(a.shape[1]), factors, likeness, strict=True):
        if alike > ALIKE:
            if factor.real < 0:
                lines.append(Doubt(name, "has the opposite sign of the model: sensor or force may point the other way than "
                                   "labelled", "look at the mounting of both"))
            if not 1 / UNLIKE < abs(factor) < UNLIKE:
                lines.append(Doubt(name, f"is {abs(factor):.3g} times the model's response{scale_words(abs(factor))}",
                                   "check calibration, unit and quantity", figure=abs(factor)))
            continue
        if alike > DELAYED:  # a resonance that is off by some per cent looks like a delay as well
            continue
        delay, better = _delay(a[:, column], b[:, column], measured.omega)
        if better > CERTAIN:
            lines.append(Doubt(name, f"agrees with the model only with a delay of {1e3 * delay:+.3g} ms taken out "
                               f"(FRAC {alike:.2f} -> {better:.2f})", "look for a filter or another amplifier in one channel",
                               figure=better - alike))
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
    words = next((text for scale, text in GROSS_UNITS.items() if 1 / GROSS_RANGE < factor / scale < GROSS_RANGE), None)
    return () if words is None else (
        Doubt("responses", f"they are {factor:.3g} times those of the machine before its update, as {words} makes them",
              "state the unit in the file, or give its `quantity`; an update makes up for it with wrong numbers",
              figure=factor),)


def _factors(a: ComplexArray, b: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    cross = (b.conj() * a).sum(axis=0)
    first, second = (np.abs(a) ** 2).sum(axis=0), (np.abs(b) ** 2).sum(axis=0)
    return cross / np.maximum(second, 1e-300), np.abs(cross) ** 2 / np.maximum(first * second, 1e-300)


def _delay(a: ComplexArray, b: ComplexArray, omega: FloatArray) -> tuple[float, float]:
    """Return the delay of a beside b (s) with the largest FRAC, and that FRAC."""
    step = 0.1 * np.pi / omega[-1]
    delays = step * np.arange(-300, 301)
    delays = delays[np.abs(delays) <= 0.05 * 2 * np.pi / float(np.median(np.diff(omega)))]
    cross = np.exp(1j * np.outer(delays, omega)) @ (b.conj() * a)
    values = np.abs(cross) ** 2 / max(float((np.abs(a) ** 2).sum() * (np.abs(b) ** 2).sum()), 1e-300)
    best = int(np.argmax(values))
    return float(delays[best]), float(values[best])
