r"""Common course of a pole over all windows: a polynomial through short windows, each weighed by its own interval.

A window of seconds knows a frequency poorly; all windows together know its course well, if it is smooth. A parabola is always
taken: of courses with the lowest degree that fits, the 95 % intervals held 84 %. Where even a parabola misfits, its covariance
is inflated by the misfit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from toolpoint._check import FloatArray
from toolpoint._rounding import NORMAL_QUANTILE_95

COURSE_DEGREE = 2  # of a frequency over the value


@dataclass(frozen=True, eq=False)
class PoleCourse:
    """Polynomial over a value, centred and scaled to -1 .. 1 by `centre` and `half_range`.

    coefficients : (degree + 1,); covariance; misfit : chi-squared over degrees of freedom; change_probability : p-value of a
    course that is constant.
    """

    coefficients: FloatArray
    covariance: FloatArray
    centre: float
    half_range: float
    misfit: float
    change_probability: float

    @property
    def degree(self) -> int:
        """Degree of the polynomial."""
        return self.coefficients.size - 1

    def at_values(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the course (n,) and its 95 % half width."""
        basis = np.vander((np.asarray(values, float) - self.centre) / self.half_range, self.degree + 1, increasing=True)
        variance = np.einsum("ni,ij,nj->n", basis, self.covariance, basis)
        return basis @ self.coefficients, NORMAL_QUANTILE_95 * np.sqrt(np.maximum(variance, 0.0))

    def change(self, first: float, last: float) -> tuple[float, float]:
        """Return the difference of the course at two values and its 95 % half width."""
        basis = np.vander((np.array([first, last]) - self.centre) / self.half_range, self.degree + 1, increasing=True)
        step = basis[1] - basis[0]
        return float(step @ self.coefficients), NORMAL_QUANTILE_95 * float(np.sqrt(max(step @ self.covariance @ step, 0.0)))


def fit_course(values: FloatArray, observed: FloatArray, deviations: FloatArray, *, degree: int = COURSE_DEGREE) -> PoleCourse:
    """Return the course through observed values (n,) with their standard deviations; a lower degree where they are few."""
    centre, half_range = float(values.min() + values.max()) / 2, max(float(np.ptp(values)) / 2, 1e-300)
    scaled, weight = (values - centre) / half_range, 1 / np.maximum(deviations, 1e-300)
    degree = max(min(degree, observed.size - 2), 0)
    basis = np.vander(scaled, degree + 1, increasing=True) * weight[:, None]
    coefficients, *_ = np.linalg.lstsq(basis, observed * weight, rcond=None)
    squares = float(((observed * weight - basis @ coefficients) ** 2).sum())
    misfit = squares / (observed.size - degree - 1)
    mean = float((observed * weight**2).sum() / (weight**2).sum())
    # What the slope and the curvature explain, against what noise of the windows as they scatter would.
    explained = float(((observed - mean) ** 2 * weight**2).sum()) - squares
    probability = float(scipy.special.chdtrc(degree, max(explained, 0.0) / max(misfit, 1.0))) if degree else 1.0
    return PoleCourse(coefficients, np.linalg.inv(basis.T @ basis) * max(misfit, 1.0), centre, half_range, misfit, probability)
