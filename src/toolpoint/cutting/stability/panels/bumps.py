r"""Where between two search levels the leading multipliers may meet on the real axis, one of them leaving the unit circle.

A pair :math:`\mu_{1,2}` has a geometric mean :math:`e^m` and a cosine :math:`c = (\mu_1 + \mu_2)/(2 e^m)` that pass smoothly
through such a meeting: :math:`|c| \le 1` while the pair is complex, beyond while it is two real ones, and the larger has
:math:`\log|\mu| = m + \operatorname{arcosh} |c|`. The spectral radius itself has a bump there with infinite slopes, which its
values at the levels do not announce; m and c do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray

PLACES = np.array([0.25, 0.5, 0.75])
Peak = tuple[float, float]  # growth towards the circle, depth
SHARE = 0.3  # of the smaller distance from the circle at the ends, below which a predicted growth is looked at


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
        top = complex(values[0])
        growth = float(np.log(max(abs(top), 1e-300)))
        if abs(top.imag) > 1e-9 * abs(top):
            return cls(depth, growth, growth, top.real / abs(top))
        rest = values[1:]
        partners = np.abs(rest[(np.abs(rest.imag) <= 1e-9 * np.abs(rest)) & (rest.real * top.real > 0)])
        if partners.size == 0:
            return cls(depth, growth, np.nan, np.nan)
        second = float(partners.max())
        mean = float(np.sqrt(abs(top) * second))
        return cls(depth, growth, float(np.log(mean)), float(np.sign(top.real)) * (abs(top) + second) / (2 * mean))


def bump(window: tuple[Level | None, Level, Level, Level | None]) -> float | None:
    """Return the depth between the two middle levels, of one sign, where their pairs, continued, come near the circle.

    `window`: four levels by depth, the outer ones None at the ends; None where no pair comes near.
    """
    before, a, b, beyond = window
    if (a.growth > 0) != (b.growth > 0) or not np.isfinite(a.mean + b.mean):
        return None
    away = -1.0 if a.growth > 0 else 1.0
    peaks = [peak for peak in (_continued(a, b, a, before), _continued(a, b, b, beyond), _meeting(a, b)) if peak is not None]
    if not peaks:
        return None
    growth_there, place = max(peaks)
    return place if growth_there > SHARE * away * min(a.growth, b.growth, key=abs) else None


def _continued(a: Level, b: Level, near: Level, far: Level | None) -> Peak | None:
    """Largest growth towards the circle between a and b, and its place, with the cosine continued from one side."""
    if far is None or not np.isfinite(far.cosine):
        return None
    away = -1.0 if a.growth > 0 else 1.0
    w = a.depth + (b.depth - a.depth) * PLACES
    mean = a.mean + (b.mean - a.mean) * PLACES
    cosine = near.cosine + (near.cosine - far.cosine) / (near.depth - far.depth) * (w - near.depth)
    met = (np.abs(cosine) > 1) if away > 0 else (np.abs(cosine) < 1)
    growth = away * (mean + np.arccosh(np.maximum(np.abs(cosine), 1.0)))
    growth[~met] = -np.inf
    at = int(np.argmax(growth))
    return float(growth[at]), float(w[at])


def _meeting(a: Level, b: Level) -> Peak | None:
    """The growth where one pair, real at one end and complex at the other, meets on the axis: there the radius has its kink,
    and it is the mean."""
    if a.cosine * b.cosine < 0 or (abs(a.cosine) > 1) == (abs(b.cosine) > 1):
        return None
    share = (1 - abs(a.cosine)) / (abs(b.cosine) - abs(a.cosine))
    away = -1.0 if a.growth > 0 else 1.0
    return away * (a.mean + share * (b.mean - a.mean)), a.depth + share * (b.depth - a.depth)
