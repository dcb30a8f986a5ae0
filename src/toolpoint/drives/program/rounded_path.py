r"""Path of many axes whose joints of steps are rounded, so that speed and acceleration of every axis are continuous along it.

The steps give straight pieces over a nominal time :math:`\sigma`. At a joint the rate :math:`q' = dq/d\sigma` jumps by J;
within w on both sides the path leaves its corner by :math:`J (w - |x|)^3 / (6 w^2)`: q'' is then a triangle of area J, q''' is
+-J/w^2, and the corner is left by at most J w/6. Of even steps with w their length this is the cubic B-spline of the joints.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, IndexArray

_CORNER_RATIO = 6.0  # of the deviation at a corner: J w/6
_MIN_BLEND = 1e-9  # of a step: narrower roundings are those of no jump


@dataclass(frozen=True, eq=False)
class RoundedPath:
    """Path of the axes over its nominal time.

    sigma : (n + 1,) nominal time at the joints, s; position : (n, axes) at the start of each step, m or rad; rate : (n,
    axes) of each step; jump : (n + 1, axes) of the rate at the joints, 0 where the path is not rounded; width : (n + 1,) s.
    """

    sigma: FloatArray
    position: FloatArray
    rate: FloatArray
    jump: FloatArray
    width: FloatArray

    @classmethod
    def of(cls, position: FloatArray, nominal: FloatArray, *, stops: np.ndarray, tolerance: FloatArray) -> RoundedPath:
        """Return the path of steps (n, 2, axes) of nominal times (n,), rounded at joints that are no stop by at most
        `tolerance` (axes,)."""
        sigma = np.concatenate([[0.0], np.cumsum(nominal)])
        rate = (position[:, 1] - position[:, 0]) / nominal[:, None]
        jump, width = np.zeros((len(nominal) + 1, rate.shape[1])), np.zeros(len(nominal) + 1)
        is_passed = stops[1:-1] < 2
        jump[1:-1][is_passed] = np.diff(rate, axis=0)[is_passed]
        with np.errstate(divide="ignore"):
            by_tolerance = np.where(jump != 0, _CORNER_RATIO * tolerance / np.abs(jump), np.inf).min(axis=1)[1:-1]
        narrow = np.minimum(nominal[1:], nominal[:-1])
        width[1:-1] = np.where(is_passed, np.maximum(np.minimum(narrow, by_tolerance), _MIN_BLEND * narrow), 0.0)
        return cls(sigma, np.ascontiguousarray(position[:, 0]), rate, jump, width)

    @property
    def deviation(self) -> FloatArray:
        """Largest distance of every axis from its programmed corners, (axes,), m or rad."""
        return np.asarray((np.abs(self.jump) * self.width[:, None]).max(axis=0) / _CORNER_RATIO)

    def derivatives(self, sigma: FloatArray, step: IndexArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return q, q', q'' and q''' (k, axes) at nominal times (k,) within steps (k,)."""
        x, y = sigma - self.sigma[step], self.sigma[step + 1] - sigma
        q, first = self.position[step] + self.rate[step] * x[:, None], self.rate[step].copy()
        second, third = np.zeros_like(first), np.zeros_like(first)
        for joint, gap, way in ((step, x, -1.0), (step + 1, y, 1.0)):
            width = self.width[joint]
            inside = np.maximum(width - gap, 0.0)
            with np.errstate(divide="ignore", invalid="ignore"):
                square = np.where(width > 0, 1 / width**2, 0.0)
            jump = self.jump[joint]
            q += jump * (inside**3 * square / 6)[:, None]
            first += way * jump * (inside**2 * square / 2)[:, None]
            second += jump * (inside * square)[:, None]
            third += way * jump * (square * (inside > 0))[:, None]
        return q, first, second, third
