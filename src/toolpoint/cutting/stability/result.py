"""StabilityChart: sets of stable depth intervals over spindle speed, with type, frequency and error of every boundary point."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from toolpoint._check import Array, FloatArray, fail, floats, frozen, nonnegative
from toolpoint._doubt import Doubt, status_of
from toolpoint._notebook import NotebookText

KINDS = ("Hopf", "flip", "fold")
DOUBTFUL_ERROR_FRACTION = 0.1  # stated error over limit above which a chart is doubtful
REAL_ANGLE_TOLERANCE = 1e-6  # rad from 0 or pi within which a computed multiplier is real: a fold or a flip


@dataclass(frozen=True, eq=False)
class StabilityChart(NotebookText):
    """Stability over spindle speed and depth of cut.

    Parameters
    ----------
    speeds : (n,) floats
        Spindle speeds, rev/min.
    depth_max : float
        Largest depth looked at, m.
    index : (m,) ints
        Which speed each boundary point belongs to; points are sorted by speed, then depth.
    depth : (m,) floats
        Depth of each boundary point, m.
    theta : (m,) floats
        Argument of the critical multiplier over one period, rad, 0 (fold) .. pi (flip).
    frequency : (m,) floats
        Chatter frequency, Hz: of all theta/2 pi T + k/T the one with the largest response.
    change : (m,) ints
        Number of multipliers that leave the unit circle when the depth grows through the point (negative: come back).
    error : (m,) floats
        Stated error of `depth`, m: numerical, and of what the response states of its own uncertainty (noise, draws).
    unstable_at_zero : (n,) ints
        Number of unstable multipliers at depth zero (0 for a stable structure).
    method, notes : str, sequence of str
    limit_draws : (n_draws, n) floats, optional
        Limits of equally likely responses over those of the chart, where the response came with draws. `error` holds them.
    search : str
        What became of the search for boundary points: ``complete``, or what it could not do. `status` says this and what the
        stated errors leave in doubt.

    >>> none = np.zeros(0, int)
    >>> empty = np.zeros(0)
    >>> chart = StabilityChart(np.array([6000.0]), 0.01, none, empty, empty, empty, none, empty, np.zeros(1, int))
    >>> chart.limit.tolist()  # stable at every depth that was looked at
    [inf]
    """

    speeds: FloatArray
    depth_max: float
    index: Array
    depth: FloatArray
    theta: FloatArray
    frequency: FloatArray
    change: Array
    error: FloatArray
    unstable_at_zero: Array
    method: str = ""
    notes: tuple[str, ...] = ()
    search: str = "complete"
    limit_draws: FloatArray | None = None

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """The doubt that the stated errors of the limits give, where they are more than a tenth of a limit."""
        share = np.where(self.limit > 0, self.limit_error / np.maximum(np.minimum(self.limit, self.depth_max), 1e-300), 0.0)
        rough = np.flatnonzero(share > DOUBTFUL_ERROR_FRACTION)
        if not rough.size:
            return ()
        largest = int(np.argmax(share))
        where = f"at {self.speeds[largest]:.0f} rev/min"
        if rough.size > 1:
            where += (f", and more than {100 * DOUBTFUL_ERROR_FRACTION:g} % at {rough.size} of {self.speeds.size} speeds from "
                      f"{self.speeds[rough].min():.0f} to {self.speeds[rough].max():.0f} rev/min")
        remedy = ("more averages or finer lines where the dynamics are measured, more intervals or another method where they "
                  "are modes" if self.limit_draws is None else "what the response rests on must be known better")
        return (Doubt("limits", f"the stated error is {100 * share[largest]:.0f} % of the limit {where}",
                      f"take the lower end, and make the error smaller: {remedy}", figure=float(share[largest])),)

    @property
    def status(self) -> str:
        """``complete``, what the search could not do, or ``doubtful`` with the reason, from the stated errors."""
        if self.search == "complete":
            return status_of(self.doubts, "complete")
        return "; ".join([self.search, *self.doubts])

    @property
    def kind(self) -> tuple[str, ...]:
        """Type of each boundary point: Hopf (pair), flip (-1) or fold (+1)."""
        return tuple("fold" if t < 1e-9 else "flip" if t > np.pi - 1e-9 else "Hopf" for t in self.theta)

    @property
    def multiplier(self) -> Array:
        """Critical multiplier of each boundary point, exp(i theta) (its conjugate belongs to it)."""
        return np.exp(1j * self.theta)

    @cached_property
    def limit(self) -> FloatArray:
        """Depth of the first loss of stability at each speed, m; infinite where none lies below `depth_max`."""
        result = np.full(self.speeds.size, np.inf)
        # Stable from depth zero: the first point at which multipliers leave the unit circle (points are sorted by depth).
        leaving = np.flatnonzero(self.change > 0)
        speeds, first = np.unique(self.index[leaving], return_index=True)
        result[speeds] = self.depth[leaving[first]]
        result[result >= self.depth_max] = np.inf
        for i in np.flatnonzero(self.unstable_at_zero > 0).tolist():
            result[i] = self._first(i)
        return frozen(result)

    @cached_property
    def limit_error(self) -> FloatArray:
        """Stated error of the limit at each speed, m; zero where there is none below `depth_max`."""
        points = self.limit_points()
        result = np.zeros(points.size)
        result[points >= 0] = self.error[points[points >= 0]]
        return frozen(result)

    @property
    def ratio_ends(self) -> tuple[FloatArray, FloatArray]:
        """Ends of the 95 % interval of `limit_draws` at each speed, (n,) each; ones where there are no draws."""
        if self.limit_draws is None:
            return np.ones(self.speeds.size), np.ones(self.speeds.size)
        # Plotting positions k/(n + 1): quantiles by linear interpolation of so few draws are too narrow.
        lower, upper = np.quantile(self.limit_draws, [0.025, 0.975], axis=0, method="weibull")
        return np.asarray(lower), np.asarray(upper)

    @property
    def least_limit_ends(self) -> tuple[float, float]:
        """Ends of the 95 % interval of the least charted limit, m, by draws of the response and the numerical error there."""
        limit = np.minimum(self.limit, self.depth_max)
        index = int(np.argmin(limit))
        if self.limit_draws is None:
            return float(limit[index] - self.limit_error[index]), float(limit[index] + self.limit_error[index])
        lower, upper = np.quantile((self.limit_draws * limit).min(axis=1), [0.025, 0.975], method="weibull")
        # What of the stated error is not of the draws.
        remainder = float(self.limit_error[index] - limit[index] * (self.ratio_ends[1] - self.ratio_ends[0])[index] / 2)
        return float(lower - max(remainder, 0.0)), float(upper + max(remainder, 0.0))

    def interval_rows(self) -> list[list[float] | None] | None:
        """Return both ends (m) of the 95 % interval of every limit by the draws, None where no limit is; None without draws."""
        if self.limit_draws is None:
            return None
        lower, upper = (self.limit * end for end in self.ratio_ends)
        return [[float(a), float(b)] if np.isfinite(a) and np.isfinite(b) else None for a, b in zip(lower, upper, strict=True)]

    @property
    def sure_limit(self) -> FloatArray:
        """Depth that is stable whatever the stated error: the limit (at most `depth_max`) less its error, m.

        Where no limit was found, equally likely responses may have one: the end of the search is lowered by them.
        """
        ended = np.where(np.isfinite(self.limit), 1.0, np.minimum(self.ratio_ends[0], 1.0))
        return np.maximum(np.minimum(self.limit, self.depth_max) * ended - self.limit_error, 0.0)

    def _first(self, i: int) -> float:
        spans = self.intervals(i)
        if spans.size == 0 or spans[0, 0] > 0:
            return 0.0
        return float("inf") if spans[0, 1] >= self.depth_max else float(spans[0, 1])

    def points(self, i: int) -> Array:
        """Return the places of the boundary points of speed i."""
        return np.flatnonzero(self.index == i)

    def intervals(self, i: int) -> FloatArray:
        """Return the stable depth intervals at speed i, m, shape (n_intervals, 2); the last may end at `depth_max`."""
        count, start, spans = int(self.unstable_at_zero[i]), 0.0, []
        for p in self.points(i):
            after = count + int(self.change[p])
            if count == 0 and after > 0:
                spans.append((start, float(self.depth[p])))
            elif count > 0 and after <= 0:
                start = float(self.depth[p])
            count = max(after, 0)
        if count == 0:
            spans.append((start, self.depth_max))
        return np.array(spans).reshape(-1, 2)

    def unstable_count(self, depths: FloatArray) -> Array:
        """Return the number of unstable multipliers, shape (n_speeds, n_depths)."""
        w = nonnegative("depths", floats("depths", np.atleast_1d(depths)))
        if w.max() > self.depth_max * (1 + 1e-12):
            fail("depths", f"{w.max():g} m", f"must be at most {self.depth_max:g} m",
                 remedy="make the chart with a larger depth_max")
        count = np.repeat(self.unstable_at_zero[:, None], w.size, axis=1).astype(int)
        np.add.at(count, self.index, np.where(w[None, :] > self.depth[:, None], self.change[:, None], 0))
        return count

    def stable(self, depths: FloatArray) -> Array:
        """Return whether each depth is stable at each speed, shape (n_speeds, n_depths)."""
        return self.unstable_count(depths) <= 0

    def uncertain(self, depths: FloatArray) -> Array:
        """Return whether a depth lies within the stated error of a boundary, shape (n_speeds, n_depths)."""
        w = floats("depths", np.atleast_1d(depths))
        is_near = np.zeros((self.speeds.size, w.size), bool)
        np.logical_or.at(is_near, self.index, np.abs(w[None, :] - self.depth[:, None]) <= self.error[:, None])
        return is_near

    def limit_points(self) -> Array:
        """Return for every speed the boundary point of its first loss of stability, -1 where there is none."""
        result = np.full(self.speeds.size, -1)
        points = np.flatnonzero(np.isfinite(self.limit[self.index]))
        distance = np.abs(self.depth[points] - self.limit[self.index[points]])
        by_distance = points[np.argsort(distance, kind="stable")]
        speeds, first = np.unique(self.index[by_distance], return_index=True)
        result[speeds] = by_distance[first]
        return result

    def noted(self, *notes: str) -> StabilityChart:
        """Return the same chart with more remarks."""
        return replace(self, notes=(*self.notes, *notes))

    def table(self) -> str:
        """Return the stable intervals of every speed as text."""
        lines = [" rev/min   stable depths, mm                            limit: type, chatter Hz, error mm"]
        first = self.limit_points()
        kinds = self.kind
        for i, speed in enumerate(self.speeds):
            bands = ", ".join(f"{1e3 * a:.6g}..{1e3 * b:.6g}" for a, b in self.intervals(i)) or "none"
            p = first[i]
            what = "" if p < 0 else f"{kinds[p]}, {self.frequency[p]:.2f}, {1e3 * self.error[p]:.1e}"
            lines.append(f"{speed:8.1f}   {bands:<44} {what}")
        return "\n".join(lines)

    def __repr__(self) -> str:
        return (f"StabilityChart({self.speeds.size} speeds {self.speeds[0]:g}..{self.speeds[-1]:g} rev/min, "
                f"0..{1e3 * self.depth_max:g} mm, {self.depth.size} boundary points, {self.method}, {self.status})")


def assemble_chart(
    speeds: FloatArray, depth_max: float, columns: Iterable[Array], *, unstable_at_zero: Array | None = None,
    method: str = "", notes: tuple[str, ...] = (), search: str = "complete",
) -> StabilityChart:
    """Return a chart from columns (index, depth, theta, frequency, change, error) in any order of points."""
    index, depth, theta, frequency, change, error = (np.asarray(c) for c in columns)
    order = np.lexsort((depth, index))
    at_zero = np.zeros(speeds.size, int) if unstable_at_zero is None else unstable_at_zero
    return StabilityChart(
        speeds, float(depth_max), index[order].astype(int), depth[order].astype(float), theta[order].astype(float),
        frequency[order].astype(float), change[order].astype(int), error[order].astype(float), at_zero, method, notes,
        search)
