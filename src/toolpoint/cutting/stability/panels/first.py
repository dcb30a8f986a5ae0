"""First loss of stability alone, for maps of many speeds and poses: levels up to it, then the root, nothing above."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from toolpoint.cutting.stability.levels import FRACTIONS_BELOW_ROOT, depth_levels
from toolpoint.cutting.stability.panels.between import Look, changes_of_sign, refine_levels
from toolpoint.cutting.stability.panels.bumps import Level
from toolpoint.cutting.stability.panels.search import BRACKET_MARGIN_FRACTION, ROOT_ERROR_FLOOR, PanelSearch

DEPTH_RATIO = 2.0**0.25  # between search depths: the same for all speeds and poses, which so share their panels
FIRST_DEPTH_RATIO = 1.02  # of the expected limit: the first search depth lies at or above it
# Depths below the first unstable one, in steps of `DEPTH_RATIO`; the axial pitch may add more. A flip lobe spans few steps.
STEPS_BELOW = (1, 2, 4, 6, 9)
SAME_BRANCH_COSINE = 0.05  # largest change of a leading multiplier's cosine between neighbours that take it for the same
# Halvings of the stretch in which the lead changes; on the difference of growth there: what lies further below the circle.
MAX_LEAD_HALVINGS, LEAD_GROWTH_FACTOR = 5, 2.0
ROOT_DISTANCE = 1e-6  # relative, from a root to the level just below it
MAX_FIRST_ROUNDS = 6  # of looking below a root for one that lies lower
EXTRA_NODES = (3, 6)  # nodes added to a panel, tried in turn
NO_ROOT_ERROR_FRACTION = 0.9  # of a bracket: a larger stated error says that the bracket holds no root
NEWTON_CURVATURE_FACTOR = 3.0  # on the square of the last step over the depth: the error of one Newton step with more nodes


def _look_for_bands(levels: list[Level], look: Look) -> list[Level]:
    """Return the levels by depth, and others where a band is announced.

    It is where the growth falls again, which is looked for the closer where another multiplier takes the lead: the one may have
    come to the circle and left it before. One that only rises needs no look.
    """
    taken = [level for a, b in pairwise(levels) for level in _look_where_lead_changes(a, b, look)]
    levels = sorted([*levels, *taken], key=lambda level: level.depth)
    rises = np.diff([level.growth for level in levels]) > 0
    return refine_levels(levels, look) if np.any(rises[:-1] & ~rises[1:]) else levels


def _look_where_lead_changes(a: Level, b: Level, look: Look) -> list[Level]:
    """Return levels about the depth between two others at which another multiplier takes the lead, () where none does."""
    between = list[Level]()
    while not _is_same_branch(a, b) and len(between) < MAX_LEAD_HALVINGS:
        if min(-a.growth, -b.growth) > LEAD_GROWTH_FACTOR * abs(a.growth - b.growth):
            break
        middle = look((a.depth + b.depth) / 2)
        between.append(middle)
        a, b = (a, middle) if _is_same_branch(middle, b) else (middle, b)
    return between


def _is_same_branch(a: Level, b: Level) -> bool:
    """Whether one multiplier leads at both: both complex or both real, with nearly the same cosine.

    Unstable levels say nothing. A real one beside a complex one is two that met on the axis between: there lie the flip lobes.
    """
    if a.growth > 0 or b.growth > 0:
        return True
    return (abs(a.cosine) > 1) == (abs(b.cosine) > 1) and abs(a.cosine - b.cosine) < SAME_BRANCH_COSINE


class FirstLimitSearch(PanelSearch):
    """The lowest boundary point of one speed beside all of them (`rows`)."""

    def lowest(self, expected: float) -> list[tuple[float, ...]]:
        """Solve for the first loss of stability, begun at the depth at which it is expected (m); return its row (depth, theta,
        frequency, change, error), none where all levels are stable."""
        step = self._step(max(FIRST_DEPTH_RATIO * expected, 1e-6 * self.depth_max))
        levels = [self._look(self._depth(step))]
        # Upwards one step at a time: each look begins with the Ritz vector of the one before, and the panels are those of
        # other speeds.
        while levels[-1].growth <= 0 and step < 0:
            step += 1
            levels.append(self._look(self._depth(step)))
        # Stable bands of a helical edge come back at the axial pitch (`levels.axial_pitch`), wherever the steps lie: its
        # sixths are levels too.
        pitch = depth_levels(self.problem, levels[-1].depth, 1, power=1.0).tolist()
        levels = _look_for_bands(self._look_below(step, levels, pitch), self._look)
        # A bracket needs a stable end below.
        if levels[0].growth > 0:
            levels = [self._stable_level(levels[0]), *levels]
        row = self._lowest_row(levels)
        # The last step is rounded upwards, so a root may lie above what was asked for.
        return [row] if row and row[0] <= self.depth_max else []

    def _step(self, depth: float) -> int:
        """Return the step of the shared depth at or above one."""
        return int(np.ceil(np.log(depth / self.depth_max) / np.log(DEPTH_RATIO)))

    def _look_below(self, step: int, levels: list[Level], others: list[float]) -> list[Level]:
        """Return the levels by depth, with those of `STEPS_BELOW` a step and of other depths."""
        depths = {*(self._depth(step - steps_down) for steps_down in STEPS_BELOW), *others} - {level.depth for level in levels}
        return sorted([*levels, *(self._look(w) for w in depths)], key=lambda level: level.depth)

    def _lowest_row(self, levels: list[Level]) -> tuple[float, ...]:
        """Return the row of the lowest root, () where all levels are stable.

        Below every root it is looked for a lower one: a flip lobe may open and close between the root and the level below."""
        row: tuple[float, ...] = ()
        for _ in range(MAX_FIRST_ROUNDS):
            crossed = changes_of_sign(levels)
            if not crossed:
                break
            lower, upper = crossed[0]
            row = self._first_row(lower, upper)
            if not lower.depth < row[0] < upper.depth:
                break
            between = [lower.depth + (row[0] - lower.depth) * place for place in FRACTIONS_BELOW_ROOT]
            stable = self._look_below(self._step(row[0]), [level for level in levels if level.depth <= lower.depth], between)
            levels = _look_for_bands([*stable, self._level_at_root(row)], self._look)
        return row

    def _level_at_root(self, row: tuple[float, ...]) -> Level:
        """Return the level just below a root, stable as it is known to be."""
        # Below the root by more than its error, so that rounding cannot have made it unstable: the root was bracketed from
        # there.
        return replace(self._look(row[0] - ROOT_DISTANCE * row[0] - 2 * row[-1]), growth=-1e-12)

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
            # The root with few nodes has growth near nought there: what more nodes say instead is the error of the few, as
            # a depth.
            step, change = growth / slope, abs(growth - growth_before) / abs(slope)
            error = change + NEWTON_CURVATURE_FACTOR * step**2 / depth + ROOT_ERROR_FLOOR * depth
            depth, growth_before = depth - step, 0.0
            if not a - edge < depth < b + edge or error <= self.tolerance * depth:
                break
        if not error <= self.tolerance * depth or not a - edge < depth < b + edge:
            return self._bracketed_row(lower, upper)
        theta = abs(float(np.angle(mu)))
        # At a double real multiplier rounding of 1e-14 parts the pair by its root, 1e-7: flip and fold are real all the
        # same.
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
