"""Noise of two tests of one state: what it leaves of MAC and FRAC, and how far shapes differ at a point by it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import Array, FloatArray
from toolpoint.vibration import Frf, Modes, correlation

_NOISE_DRAWS = 400  # of two tests of one shape
_NOISE_QUANTILE = 0.05  # of the MAC (or FRAC) that noise leaves: below it, one in twenty unchanged shapes would lie
_MIN_MOVING_RATIO = 2.0  # of the difference at a point to its noise, from which it stands out


@dataclass(frozen=True, eq=False)
class PointChange:
    """Difference of the paired shapes at a point, as a share of their largest entry, and what noise gives there."""

    point: str | int
    size: float
    noise: float

    @property
    def stands_out(self) -> bool:
        """Whether the difference is larger than noise makes it; never where the noise is not known."""
        return bool(self.size > _MIN_MOVING_RATIO * self.noise)


def _scaled(first: Modes, second: Modes, pair: tuple[int, int]) -> tuple[Array, Array, float]:
    """Return both shapes of a pair (real ones), the second scaled to the first, and the scale.

    The scale has the least sum of differences, not of their squares: a change at one point would pull that and show everywhere.
    """
    a, b = (np.asarray(modes.shape[:, k], float) for modes, k in zip((first, second), pair, strict=True))
    weight = np.abs(b)
    ratio = np.divide(a, b, out=np.zeros_like(a), where=weight > 0)
    order = np.argsort(ratio)
    share = np.cumsum(weight[order])
    scale = float(ratio[order[int(np.searchsorted(share, share[-1] / 2))]])
    return a, scale * b, abs(scale)


def _deviation(first: Modes, second: Modes, pair: tuple[int, int], scale: float) -> tuple[FloatArray, FloatArray] | None:
    """Return the standard deviations of both shapes of a pair; None where one is not known."""
    if first.shape_variance is None or second.shape_variance is None:
        return None
    return np.sqrt(first.shape_variance[:, pair[0]]), scale * np.sqrt(second.shape_variance[:, pair[1]])


def mac_of_noise(first: Modes, second: Modes, pair: tuple[int, int], *, rng: np.random.Generator) -> float:
    """Return the MAC below which one in twenty pairs of tests of one shape would lie; not a number without variances."""
    a, b, scale = _scaled(first, second, pair)
    deviations = _deviation(first, second, pair, scale)
    if deviations is None:
        return float("nan")
    middle = (a + b) / 2
    one, other = (middle + s * rng.standard_normal((_NOISE_DRAWS, len(middle))) for s in deviations)
    power = (one**2).sum(axis=1) * (other**2).sum(axis=1)
    return float(np.quantile((one * other).sum(axis=1) ** 2 / power, _NOISE_QUANTILE))


def point_changes(first: Modes, second: Modes, pairs: correlation.Pairing) -> tuple[PointChange, ...]:
    """Return the changes of all points, the largest first."""
    if not len(pairs.pairs):
        return ()
    square, noise = np.zeros(len(first.dofs)), np.zeros(len(first.dofs))
    for pair in pairs.pairs:
        a, b, scale = _scaled(first, second, (pair[0], pair[1]))
        largest = float(np.abs(a).max())
        square += np.abs(a - b) ** 2 / largest**2
        deviations = _deviation(first, second, (pair[0], pair[1]), scale)
        noise += np.nan if deviations is None else (deviations[0] ** 2 + deviations[1] ** 2) / largest**2
    changes = []
    for point in dict.fromkeys(dof.point for dof in first.dofs):
        rows = [k for k, dof in enumerate(first.dofs) if dof.point == point]
        size, spread = (float(np.sqrt(part[rows].sum() / len(pairs.pairs))) for part in (square, noise))
        changes.append(PointChange(point, size, spread))
    return tuple(sorted(changes, key=lambda entry: -entry.size))


def compare_responses(first: Frf | None, second: Frf | None, rng: np.random.Generator
                       ) -> tuple[FloatArray | None, FloatArray | None]:
    """Return FRAC of the responses that both states have, over the lines of the first, and what noise leaves of it."""
    if first is None or second is None:
        return None, None
    outputs = [dof for dof in first.outputs if dof in second.outputs]
    inputs = [dof for dof in first.inputs if dof in second.inputs]
    lower, upper = max(first.frequency[0], second.frequency[0]), min(first.frequency[-1], second.frequency[-1])
    if not outputs or not inputs or lower >= upper:
        return None, None
    a = first.selected(outputs, inputs).between(lower, upper)
    unfitted = second.selected(outputs, inputs).converted_to(first.quantity)
    b = unfitted.interpolated(a.frequency)
    if a.variance is None or unfitted.variance is None:
        return correlation.frac(a, b), None
    columns = unfitted.variance.reshape(len(unfitted.frequency), -1).T
    spread = np.stack([np.interp(a.frequency, unfitted.frequency, part) for part in columns], axis=1).reshape(b.values.shape)
    draws = [_frac_of_noise((a.values + b.values) / 2, (a.variance, spread), rng) for _ in range(_NOISE_DRAWS // 4)]
    return correlation.frac(a, b), np.quantile(draws, _NOISE_QUANTILE, axis=0)


def _frac_of_noise(values: Array, variances: tuple[FloatArray, FloatArray], rng: np.random.Generator) -> FloatArray:
    """Return FRAC of two noisy copies of a response."""
    one, other = (values + np.sqrt(v / 2) * (rng.standard_normal(values.shape) + 1j * rng.standard_normal(values.shape))
                  for v in variances)
    cross = np.abs((one.conj() * other).sum(axis=0)) ** 2
    return np.asarray(cross / ((np.abs(one) ** 2).sum(axis=0) * (np.abs(other) ** 2).sum(axis=0)))
