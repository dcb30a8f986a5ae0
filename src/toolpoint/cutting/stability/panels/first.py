"""The first loss of stability alone, for maps of many speeds and poses: levels up to it, then the root, nothing above."""

from __future__ import annotations

import numpy as np

from toolpoint.cutting.stability.levels import depth_levels
from toolpoint.cutting.stability.panels.between import changes_of_sign, complete_levels
from toolpoint.cutting.stability.panels.bumps import Level
from toolpoint.cutting.stability.panels.search import EDGE, FLOOR, PanelSearch

SHARE = 2.0**0.25  # between the depths looked at: the same for all speeds and poses, which so share their panels
AHEAD = 1.02  # the first look is at least so far above the limit expected
BELOW = (1, 3, 6, 10)  # looks below the first unstable one, in steps of `SHARE`; more where the axial pitch asks for them
FINER = (3, 6)  # more nodes on a panel
NO_ROOT = 0.9  # of a bracket, as the stated error of a root
CURVED = 3.0  # on the square of the last step of a root: what one step from few nodes to more leaves


class FirstLimitSearch(PanelSearch):
    """The lowest boundary point of one speed beside all of them (`rows`)."""

    def lowest(self, expected: float) -> list[tuple[float, ...]]:
        """Row (depth, theta, frequency, change, error) of the first loss of stability, begun at the depth at which it is
        expected (m); none where all that is looked at is stable."""
        step = int(np.ceil(np.log(max(AHEAD * expected, 1e-6 * self.top) / self.top) / np.log(SHARE)))
        levels = [self._look(self._depth(step))]
        while levels[-1].growth <= 0 and step < 0:
            step += 1
            levels.append(self._look(self._depth(step)))
        known, top = {level.depth for level in levels}, levels[-1].depth
        pitch = depth_levels(self.problem, top, 1, power=1.0).tolist()
        below = {*(self._depth(step - less) for less in BELOW), *pitch} - known
        levels = sorted([*levels, *(self._look(w) for w in below)], key=lambda level: level.depth)
        rises = np.diff([level.growth for level in levels]) > 0
        if np.any(rises[:-1] & ~rises[1:]):  # growth that falls again announces a band; what only rises does not
            levels = complete_levels(levels, self._look)
        if levels[0].growth > 0:
            levels = [self._least(levels[0]), *levels]
        crossed = changes_of_sign(levels)
        rows = [self._first(*crossed[0])] if crossed else []
        return [row for row in rows if row[0] <= self.top]

    def _depth(self, step: int) -> float:
        """One of the depths that all speeds share, m."""
        depth = float(self.top * SHARE ** min(step, 0))
        self.store.levels.add(depth)
        return depth

    def _first(self, low: Level, high: Level) -> tuple[float, ...]:
        """Row of the root between two levels: by few nodes, then steps with more, whose difference states the error."""
        a, b = low.depth, high.depth
        depth, slope, before = self._crossed((a, low.growth), (b, high.growth))
        if not slope or self.map(0).balances:
            return self._surely(low, high)
        edge, error, mu = EDGE * (b - a), b - a, 0j
        for more in FINER:  # one step of Newton's with more nodes; how much the growth changed for them is the error
            growth, mu = self.growth(depth, more)
            step, change = growth / slope, abs(growth - before) / abs(slope)
            error = change + CURVED * step**2 / depth + FLOOR * depth
            depth, before = depth - step, 0.0
            if not a - edge < depth < b + edge or error <= self.tolerance * depth:
                break
        if not error <= self.tolerance * depth or not a - edge < depth < b + edge:
            return self._surely(low, high)
        theta = abs(float(np.angle(mu)))
        if abs(mu.imag) < 1e-7 * abs(mu):
            theta = np.pi if mu.real < 0 else 0.0
        return depth, theta, self._frequency(theta), 1 if theta in (0.0, np.pi) else 2, error

    def _surely(self, low: Level, high: Level) -> tuple[float, ...]:
        """Row of the root between two levels by the search of a bracket.

        Of a depth close to the limit few nodes may say that it is unstable and more that it is not: then the bracket holds no
        root, and the next depth above is its upper end."""
        row = self._boundary((low.depth, low.growth), (high.depth, high.growth))[0]
        if row[-1] < NO_ROOT * (high.depth - low.depth):
            return row
        above = SHARE * high.depth
        growth = self.growth(above, FINER[0])[0]
        if growth <= 0:
            return row
        return min(row, self._boundary((low.depth, low.growth), (above, growth))[0], key=lambda each: each[-1])
