"""First loss of stability alone, for maps of many speeds and poses: levels up to it, then the root, nothing above."""

from __future__ import annotations

import numpy as np

from toolpoint.cutting.stability.levels import depth_levels
from toolpoint.cutting.stability.panels.between import changes_of_sign, refine_levels
from toolpoint.cutting.stability.panels.bumps import Level
from toolpoint.cutting.stability.panels.search import BRACKET_MARGIN_FRACTION, ROOT_ERROR_FLOOR, PanelSearch

DEPTH_RATIO = 2.0**0.25  # between search depths: the same for all speeds and poses, which so share their panels
FIRST_DEPTH_RATIO = 1.02  # of the expected limit: the first search depth lies at or above it
STEPS_BELOW = (1, 3, 6, 10)  # depths below the first unstable one, in steps of `DEPTH_RATIO`; the axial pitch may add more
EXTRA_NODES = (3, 6)  # nodes added to a panel, tried in turn
NO_ROOT_ERROR_FRACTION = 0.9  # of a bracket: a larger stated error says that the bracket holds no root
NEWTON_CURVATURE_FACTOR = 3.0  # on the square of the last step over the depth: the error of one Newton step with more nodes


class FirstLimitSearch(PanelSearch):
    """The lowest boundary point of one speed beside all of them (`rows`)."""

    def lowest(self, expected: float) -> list[tuple[float, ...]]:
        """Solve for the first loss of stability, begun at the depth at which it is expected (m); return its row (depth, theta,
        frequency, change, error), none where all levels are stable."""
        step = int(np.ceil(np.log(max(FIRST_DEPTH_RATIO * expected, 1e-6 * self.depth_max) / self.depth_max)
                           / np.log(DEPTH_RATIO)))
        levels = [self._look(self._depth(step))]
        while levels[-1].growth <= 0 and step < 0:
            step += 1
            levels.append(self._look(self._depth(step)))
        depths_seen, unstable_depth = {level.depth for level in levels}, levels[-1].depth
        pitch = depth_levels(self.problem, unstable_depth, 1, power=1.0).tolist()
        below = {*(self._depth(step - steps_down) for steps_down in STEPS_BELOW), *pitch} - depths_seen
        levels = sorted([*levels, *(self._look(w) for w in below)], key=lambda level: level.depth)
        rises = np.diff([level.growth for level in levels]) > 0
        if np.any(rises[:-1] & ~rises[1:]):  # growth that falls again announces a band; what only rises does not
            levels = refine_levels(levels, self._look)
        if levels[0].growth > 0:
            levels = [self._stable_level(levels[0]), *levels]
        crossed = changes_of_sign(levels)
        rows = [self._first_row(*crossed[0])] if crossed else []
        return [row for row in rows if row[0] <= self.depth_max]

    def _depth(self, step: int) -> float:
        """Return one of the depths that all speeds share, m."""
        depth = float(self.depth_max * DEPTH_RATIO ** min(step, 0))
        self.store.levels.add(depth)
        return depth

    def _first_row(self, lower: Level, upper: Level) -> tuple[float, ...]:
        """Return the row of the root between two levels: with few nodes, then steps with more, whose difference states the
        error."""
        a, b = lower.depth, upper.depth
        depth, slope, growth_before = self._coarse_root((a, lower.growth), (b, upper.growth))
        if not slope or self.map(0).balances:
            return self._bracketed_row(lower, upper)
        edge, error, mu = BRACKET_MARGIN_FRACTION * (b - a), b - a, 0j
        for extra in EXTRA_NODES:  # one step of Newton's with more nodes; how much the growth changed for them is the error
            growth, mu = self.growth(depth, extra)
            step, change = growth / slope, abs(growth - growth_before) / abs(slope)
            error = change + NEWTON_CURVATURE_FACTOR * step**2 / depth + ROOT_ERROR_FLOOR * depth
            depth, growth_before = depth - step, 0.0
            if not a - edge < depth < b + edge or error <= self.tolerance * depth:
                break
        if not error <= self.tolerance * depth or not a - edge < depth < b + edge:
            return self._bracketed_row(lower, upper)
        theta = abs(float(np.angle(mu)))
        if abs(mu.imag) < 1e-7 * abs(mu):
            theta = np.pi if mu.real < 0 else 0.0
        return depth, theta, self._frequency(theta), 1 if theta in (0.0, np.pi) else 2, error

    def _bracketed_row(self, lower: Level, upper: Level) -> tuple[float, ...]:
        """Return the row of the root between two levels by the search of a bracket.

        Of a depth close to the limit few nodes may say that it is unstable and more that it is not: then the bracket holds no
        root, and the next depth above is its upper end."""
        row = self._boundary((lower.depth, lower.growth), (upper.depth, upper.growth))[0]
        if row[-1] < NO_ROOT_ERROR_FRACTION * (upper.depth - lower.depth):
            return row
        above = DEPTH_RATIO * upper.depth
        growth = self.growth(above, EXTRA_NODES[0])[0]
        if growth <= 0:
            return row
        return min(row, self._boundary((lower.depth, lower.growth), (above, growth))[0], key=lambda each: each[-1])
