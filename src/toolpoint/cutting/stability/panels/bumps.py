r"""Meetings of the leading multipliers on the real axis between two search levels, where one of them may leave the unit circle.

A pair :math:`\mu_{1,2}` has a geometric mean :math:`e^m` and a cosine :math:`c = (\mu_1 + \mu_2)/(2 e^m)` that pass smoothly
through such a meeting: :math:`|c| \le 1` while the pair is complex, beyond while it is two real ones, and the larger has
:math:`\log|\mu| = m + \operatorname{arcosh} |c|`. The spectral radius itself has a bump there with infinite slopes, which its
values at the levels do not announce; m and c do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray

INNER_FRACTIONS = np.array([0.25, 0.5, 0.75])  # of the stretch between two levels, where a continued pair is evaluated
Peak = tuple[float, float]  # growth towards the circle, depth
MEETING_GROWTH_FRACTION = 0.3  # of the smaller distance of the two levels from the circle: a predicted growth above it counts


@dataclass(frozen=True)
class Level:
    """A depth, m; the growth log |mu| of the leading multiplier there; mean m and cosine c of its pair, nan without one."""

    depth: float
    growth: float
    mean: float
    cosine: float

    @classmethod
    def of(cls, depth: float, values: ComplexArray) -> Level:
        """Return the level of these multipliers, largest first."""
        leading = complex(values[0])
        growth = float(np.log(max(abs(leading), 1e-300)))
        # Rounding gives real multipliers an imaginary part of 1e-15 or so, near a meeting its square root, 1e-8 of a pair:
        # what is below is real.
        if abs(leading.imag) > 1e-9 * abs(leading):
            return cls(depth, growth, growth, leading.real / abs(leading))
        # Only a real multiplier of the same sign can meet the leading one on the axis.
        others = values[1:]
        partners = np.abs(others[(np.abs(others.imag) <= 1e-9 * np.abs(others)) & (others.real * leading.real > 0)])
        if partners.size == 0:
            return cls(depth, growth, np.nan, np.nan)
        second = float(partners.max())
        mean = float(np.sqrt(abs(leading) * second))
        return cls(depth, growth, float(np.log(mean)), float(np.sign(leading.real)) * (abs(leading) + second) / (2 * mean))


def predict_meeting(window: tuple[Level | None, Level, Level, Level | None]) -> float | None:
    """Return the depth between the two middle levels, of one sign, where their continued pairs come near the circle.

    `window`: four levels by depth, the outer ones None at the ends; None where no pair comes near.
    """
    outer_below, a, b, outer_above = window
    if (a.growth > 0) != (b.growth > 0) or not np.isfinite(a.mean + b.mean):
        return None
    sign = -1.0 if a.growth > 0 else 1.0
    peaks = [peak for peak in (_continue_cosine(a, b, a, outer_below), _continue_cosine(a, b, b, outer_above),
                               _meeting_growth(a, b)) if peak is not None]
    if not peaks:
        return None
    growth_there, place = max(peaks)
    return place if growth_there > MEETING_GROWTH_FRACTION * sign * min(a.growth, b.growth, key=abs) else None


def _continue_cosine(a: Level, b: Level, anchor: Level, neighbour: Level | None) -> Peak | None:
    """Return the largest growth towards the circle between a and b, and its place, with the cosine continued from one side."""
    if neighbour is None or not np.isfinite(neighbour.cosine):
        return None
    sign = -1.0 if a.growth > 0 else 1.0
    w = a.depth + (b.depth - a.depth) * INNER_FRACTIONS
    mean = a.mean + (b.mean - a.mean) * INNER_FRACTIONS
    cosine = anchor.cosine + (anchor.cosine - neighbour.cosine) / (anchor.depth - neighbour.depth) * (w - anchor.depth)
    # From the stable side the danger is a pair that parts on the axis (the larger goes out); from the unstable side two
    # real ones that join, whose mean lies inside.
    met = (np.abs(cosine) > 1) if sign > 0 else (np.abs(cosine) < 1)
    growth = sign * (mean + np.arccosh(np.maximum(np.abs(cosine), 1.0)))
    growth[~met] = -np.inf
    best = int(np.argmax(growth))
    return float(growth[best]), float(w[best])


def _meeting_growth(a: Level, b: Level) -> Peak | None:
    """Return growth and depth where one pair, real at one end and complex at the other, meets on the axis: there the radius has
    its kink, and it is the mean."""
    if a.cosine * b.cosine < 0 or (abs(a.cosine) > 1) == (abs(b.cosine) > 1):
        return None
    share = (1 - abs(a.cosine)) / (abs(b.cosine) - abs(a.cosine))
    sign = -1.0 if a.growth > 0 else 1.0
    return sign * (a.mean + share * (b.mean - a.mean)), a.depth + share * (b.depth - a.depth)
