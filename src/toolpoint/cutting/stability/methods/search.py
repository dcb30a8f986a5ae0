"""Depth search for methods that give multipliers at one speed and depth: levels, then bisection on the count."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.stability.levels import depth_levels, spacing_note
from toolpoint.cutting.stability.result import StabilityChart, assemble_chart

Multipliers = Callable[[MillingProblem, float, float], ComplexArray]


class MultiplierMethod(Protocol):
    """A method that computes multipliers, and how finely their passage through the unit circle is searched in depth."""

    @property
    def levels(self) -> int:
        """Depths before the root search."""
        ...

    @property
    def tolerance(self) -> float:
        """Relative error of depth."""
        ...

    def multipliers(self, problem: MillingProblem, speed: float, depth: float) -> ComplexArray:
        """Return the multipliers over one period, largest first."""
        ...


def search_depths(method: MultiplierMethod, problem: MillingProblem, speeds: FloatArray, *, depth_max: float,
                  notes: tuple[str, ...]) -> StabilityChart:
    """Return the chart of a method that computes multipliers; the depth error is that of the bisection only.

    notes : those of the dynamics as the method takes them, and its own.
    """
    grid = depth_levels(problem, depth_max, method.levels, power=1.5)
    rows = []
    for i, speed in enumerate(speeds):
        rows += [(i, *row) for row in _boundaries(problem, float(speed), grid, method.multipliers, method.tolerance)]
    columns = np.array(rows, float).reshape(-1, 6).T
    text = f"{spacing_note(grid)}; the stated error is that of the bisection"
    return assemble_chart(speeds, depth_max, columns, method=str(method),
                     notes=(*notes, text))


def unstable(values: ComplexArray) -> int:
    """Count the multipliers outside the unit circle."""
    return int(np.sum(np.abs(values) > 1))


def _boundaries(problem: MillingProblem, speed: float, grid: FloatArray, multipliers: Multipliers,
                tolerance: float) -> list[tuple[float, ...]]:
    counts = [unstable(multipliers(problem, speed, float(w))) for w in grid]
    lower_depth, count_below, rows = 0.0, 0, []
    for w, count_above in zip(grid, counts):
        if (count_above > 0) != (count_below > 0):
            rows.append(_boundary(problem, speed, (lower_depth, float(w)), count_above - count_below, multipliers, tolerance))
        lower_depth, count_below = float(w), count_above
    return rows


def _boundary(problem: MillingProblem, speed: float, bracket: tuple[float, float], change: int, multipliers: Multipliers,
              tolerance: float) -> tuple[float, ...]:
    """Solve log(spectral radius) = 0 in the bracket (Brent); return depth, theta, frequency, change and error."""
    from scipy.optimize import brentq

    a, b = bracket

    def growth(w: float) -> float:
        return float(np.log(np.abs(multipliers(problem, speed, w)).max()))

    a = max(a, 1e-6 * b)
    w = brentq(growth, a, b, xtol=tolerance * b * 0.1, rtol=max(tolerance * 0.1, 1e-14))
    mu = multipliers(problem, speed, w)
    critical = mu[np.argmax(np.abs(mu))]
    theta = abs(float(np.angle(critical)))
    if abs(critical.imag) < 1e-9 * abs(critical):
        theta = np.pi if critical.real < 0 else 0.0
    period = mean_period(problem, speed)
    k = np.arange(-400, 401)
    f = np.abs(theta / (2 * np.pi) + k) / period
    size = np.linalg.norm(problem.plane_at(speed).response(f), axis=(1, 2))
    single = 1 if theta in (0.0, np.pi) else 2
    return w, theta, float(f[np.argmax(size)]), single if change > 0 else -single, tolerance * w


def mean_period(problem: MillingProblem, speed: float) -> float:
    """Return the period of the multipliers, s: tooth period, revolution, or (mean) period of the speed variation."""
    if problem.speed_variation is not None:
        angle = 2 * np.pi * problem.speed_variation.revolutions
        return float(problem.speed_variation.clock(np.array(angle), 2 * np.pi * speed / 60))
    return float(problem.tooth_period(speed)) if problem.tool.is_regular else 60 / speed
