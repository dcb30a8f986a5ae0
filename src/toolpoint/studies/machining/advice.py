"""Advice on a program: a spindle speed for each tool at which every block is stable, and feeds within limits."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.material_removal import RemovedMaterial
from toolpoint.studies.machining.engagement_classes import EngagementClasses, PlaceArcs, group_places
from toolpoint.studies.machining.loads import CutLoads, largest_of_blocks, place_loads
from toolpoint.studies.machining.margins import PlaceMargins, place_margins
from toolpoint.studies.machining.program_path import ProgramPath
from toolpoint.studies.machining.setup import MachiningSetup
from toolpoint.studies.machining.solver import StabilitySolver

HAND_MARGIN = 0.1  # of the depth: stable speeds are those with so much in hand
SPEED_RANGE = (0.4, 1.3)  # of the programmed speed, unless the spindle turns less
SPEED_COUNT = 37  # speeds looked at first: steps of 2.5 % of the programmed one
FINE_STEPS = 5  # of such a step: the fastest that holds between its neighbours at 0.5 % is advised
MAX_JUDGED_CLASSES = 30  # by depth; the chosen speed is then checked on all
LIMIT_FRACTION = 0.9  # of a limit of power, torque or bending that a feed may use
MAX_FEED_FACTOR, MIN_FEED_FACTOR = 2.0, 0.2  # of the feed per tooth
MIN_FEED_RISE = 0.02  # of a block's feed, below which it stays as it is
MAX_CHECKED_SPEEDS = 6  # checked on all engagements, the fastest first


@dataclass(frozen=True)
class ToolAdvice:
    """Advice for a tool: speeds (rev/min), blocks that chatter before and after, least limit over depth after.

    speed is that of the program where none is better.
    """

    tool: int
    programmed: float
    speed: float
    chatter_before: int
    chatter_after: int
    ratio: float
    depth_factor: float

    @property
    def words(self) -> str:
        """Advice in words."""
        name = f"tool {self.tool}" if self.tool else "the tool"
        if self.chatter_before == 0 and self.speed == self.programmed:
            return f"Advice for {name}: {self.programmed:.0f} rev/min stays; no block chatters."
        hand = f"at least {100 * (self.ratio - 1):.0f} % of depth in hand" if np.isfinite(self.ratio) else \
            "no limit within four times the depth"
        if self.chatter_before == 0:
            return (f"Advice for {name}: {self.speed:.0f} rev/min in place of {self.programmed:.0f} is quicker, and no block "
                    f"chatters, {hand}; the cutting speed rises by {100 * (self.speed / self.programmed - 1):.0f} %, which the "
                    "edges must bear.")
        if self.chatter_after == 0:
            return (f"Advice for {name}: {self.speed:.0f} rev/min in place of {self.programmed:.0f}: no block chatters "
                    f"({self.chatter_before} do now), "
                    f"{hand}.")
        return (f"Advice for {name}: no speed from {SPEED_RANGE[0]:g} to {SPEED_RANGE[1]:g} times {self.programmed:.0f} "
                f"rev/min keeps all blocks "
                f"stable; at {self.speed:.0f} rev/min {self.chatter_after} chatter ({self.chatter_before} do now): depths "
                f"there must fall to "
                f"{100 * self.depth_factor:.0f} %, or the tool be stiffer.")

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers."""
        return {"tool": self.tool, "programmed_rpm": self.programmed, "advised_rpm": self.speed,
                "chatter_blocks_before": self.chatter_before,
                "chatter_blocks_after": self.chatter_after, "depth_factor": self.depth_factor,
                "least_limit_over_depth": self.ratio if np.isfinite(self.ratio) else None}


@dataclass(frozen=True, eq=False)
class ProgramAdvice:
    """Advice for a whole program: factors on the words S and F by line; time before and after, s; largest loads after."""

    tools: tuple[ToolAdvice, ...]
    speed: dict[int, float]
    feed: dict[int, float]
    time_before: float
    time_after: float
    power_after: float
    force_after: float
    unmet: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """Advice in words, a line a tool, and the time."""
        lines = [tool.words for tool in self.tools]
        return "\n".join([*lines, f"With these speeds and feeds the program takes {self.time_after:.1f} s in place of "
                                  f"{self.time_before:.1f} s; "
                          f"largest force {self.force_after:.0f} N, largest power {self.power_after:.0f} W.", *self.unmet])

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers."""
        return {"tools": [tool.to_dict() for tool in self.tools], "time_before_s": self.time_before,
                "time_after_s": self.time_after,
                "power_after_w": self.power_after, "force_after_n": self.force_after, "unmet": list(self.unmet)}


@dataclass(frozen=True, eq=False)
class AdviceCase:
    """A program that was run: what advice is made from."""

    setup: MachiningSetup
    laid: ProgramPath
    removed: RemovedMaterial
    arcs: PlaceArcs
    loads: CutLoads
    margins: PlaceMargins
    solver: StabilitySolver
    pose: np.ndarray
    isotropic: bool

    def groups(self, laid: ProgramPath) -> EngagementClasses:
        """Return the distinct engagements at the speeds of a path."""
        return group_places(self.arcs, laid, self.removed.piece, pose=self.pose, isotropic=self.isotropic)

    def chatters(self, margins: PlaceMargins, tool: int) -> tuple[int, float, float]:
        """Return how many blocks of a tool chatter, the least limit over depth of the stable places, and of all."""
        block = self.laid.moves.block[self.removed.piece[self.arcs.place]]
        mine = self.laid.tool[block] == tool
        bad = mine & ~margins.stable
        ratio = margins.limit / self.arcs.depth
        hand = float(np.nanmin(np.where(mine & margins.stable, np.maximum(ratio, 1.0), np.inf), initial=np.inf))
        return len(set(block[bad].tolist())), hand, float(np.nanmin(np.where(bad, ratio, np.inf), initial=1.0))


def advise(case: AdviceCase, speed_lines: dict[int, list[int]], progress: Callable[[int, int], None]) -> ProgramAdvice:
    """Return speeds and feeds for a program that was run; what is promised was computed with them on all engagements.

    speed_lines : lines that hold a word S, by the number of the tool that turns then.
    """
    laid, tools = case.laid, list[ToolAdvice]()
    speed = laid.speed.copy()
    for k, number in enumerate(case.laid.numbers):
        progress(k, len(laid.numbers))
        advice, ratio = _advise_tool(case, number)
        tools.append(advice)
        speed = np.where(laid.tool == number, speed * ratio, speed)
    progress(len(laid.numbers), len(laid.numbers))
    factor = np.where(laid.speed > 0, speed / np.where(laid.speed > 0, laid.speed, 1.0), 1.0)
    feed_factor, loads = _feed_factors(case, replace(laid, speed=speed, feed=laid.feed * factor), factor)
    cutting = ~laid.path.rapid
    of_line: dict[int, float] = {}
    for line, value in zip(laid.path.line[cutting].tolist(), feed_factor[cutting].tolist(), strict=True):
        of_line[line] = min(of_line.get(line, np.inf), value)
    written = np.array([of_line.get(int(n), 1.0) for n in laid.path.line])
    moving = laid.time - laid.path.dwell
    new_time = np.where(cutting, moving / written, moving) + laid.path.dwell
    by_line = {line: t.speed / t.programmed for t in tools for line in speed_lines.get(t.tool, []) if t.speed != t.programmed}
    return ProgramAdvice(tuple(tools), by_line, of_line, float(laid.time.sum()), float(new_time.sum()),
                         float(loads.power.max(initial=0.0)),
                         float(loads.lateral.max(initial=0.0)), _unmet(case, loads, speed))


def _unmet(case: AdviceCase, loads: CutLoads, speed: FloatArray) -> tuple[str, ...]:
    """Return the limits that no feed keeps: edge forces do not fall with it."""
    limits = case.setup.limits
    place_speed = speed[case.laid.moves.block[case.removed.piece]]
    lines = []
    for what, values, limit, unit in (("power", loads.power, limits.power_at(place_speed), "W"),
                                      ("torque", loads.peak_torque, limits.torque_at(place_speed), "N m"),
                                      ("bending", loads.bending, np.full(place_speed.size, limits.bending), "N m")):
        excess = values / np.where(values > 0, limit, 1.0)
        if excess.max(initial=0.0) > 1:
            k = int(excess.argmax())
            lines.append(f"No feed keeps the limit of {what}: {values[k]:.4g} {unit} stay of {limit[k]:.4g} {unit}; "
                         "take less depth.")
    return tuple(lines)


def _advise_tool(case: AdviceCase, number: int) -> tuple[ToolAdvice, float]:
    """Return the advice for a tool, and the factor on its speeds; a tool that holds keeps its speed unless it may be raised."""
    laid = case.laid
    block = laid.moves.block[case.removed.piece[case.arcs.place]]
    mine = laid.tool[block] == number
    programmed = float(np.max(laid.speed[block[mine]], initial=0.0))
    count_before, hand_before, depth_before = case.chatters(case.margins, number)
    if programmed == 0 or (count_before == 0 and not case.setup.raises_speed):
        return ToolAdvice(number, programmed, programmed, count_before, count_before, hand_before, 1.0), 1.0
    ratios = np.linspace(*SPEED_RANGE, SPEED_COUNT)
    ratios = ratios[ratios * programmed <= case.setup.limits.speed]
    if not ratios.size:
        return ToolAdvice(number, programmed, programmed, count_before, count_before, hand_before, depth_before), 1.0
    hand = _least_hand(case, number, ratios)
    safe = np.flatnonzero((hand >= 1 + HAND_MARGIN) & ((ratios > 1) | (count_before > 0)))[::-1]
    tried: Iterator[float] = (ratio for k in safe[:MAX_CHECKED_SPEEDS].tolist()
                              if (ratio := _fastest_beside(case, number, float(ratios[k]))) is not None
                              and (ratio > 1 or count_before > 0))
    if not safe.size and count_before:
        neighbours = np.minimum(np.append(hand[1:], hand[-1]), np.insert(hand[:-1], 0, hand[0]))
        tried = iter([float(ratios[int(np.argmax(np.minimum(hand, neighbours)))])])
    best: tuple[ToolAdvice, float] | None = None
    for ratio in tried:
        changed = replace(laid, speed=np.where(laid.tool == number, laid.speed * ratio, laid.speed))
        margins = place_margins(case.arcs, case.groups(changed), changed, piece=case.removed.piece, solver=case.solver,
                                pose=case.pose)
        count_after, hand_after, depth = case.chatters(margins, number)
        advice = ToolAdvice(number, programmed, round(programmed * ratio), count_before, count_after, hand_after, min(depth,
                1.0))
        if best is None or count_after < best[0].chatter_after:
            best = advice, advice.speed / programmed
        if count_after == 0:
            break
    if best is None or (best[0].chatter_after > 0 and best[0].chatter_after >= count_before):  # no speed is better
        return ToolAdvice(number, programmed, programmed, count_before, count_before, hand_before, depth_before), 1.0
    return best


def _fastest_beside(case: AdviceCase, number: int, ratio: float) -> float | None:
    """Return the fastest speed, from one of those looked at to the next, that holds with both neighbours half a percent away;
    none where none does: a speed counts with its neighbours, as no spindle keeps it exactly."""
    step = (SPEED_RANGE[1] - SPEED_RANGE[0]) / (SPEED_COUNT - 1) / FINE_STEPS
    fine = ratio + step * np.arange(-1, FINE_STEPS + 1)
    programmed = float(np.max(case.laid.speed[case.laid.tool == number], initial=0.0))
    holds = _least_hand(case, number, fine) >= 1 + HAND_MARGIN
    middle = np.flatnonzero(holds[:-2] & holds[1:-1] & holds[2:]) + 1
    fastest = min(SPEED_RANGE[1], case.setup.limits.speed / programmed) * (1 + 1e-9)
    middle = middle[fine[middle] <= fastest]
    return float(fine[middle[-1]]) if middle.size else None


def _least_hand(case: AdviceCase, number: int, ratios: FloatArray) -> FloatArray:
    """Return the least limit over depth at each speed, over the deepest engagements of a tool."""
    groups = case.groups(case.laid)
    members = np.flatnonzero(groups.tool == number)
    members = members[np.argsort(-groups.depth[members] * (groups.exit - groups.entry)[members])][:MAX_JUDGED_CLASSES]
    hand = np.full(ratios.size, np.inf)
    for k in members.tolist():
        depth = float(groups.depth[k])
        try:
            chart = case.solver.chart(number, int(groups.pose[k]), (float(groups.entry[k]), float(groups.exit[k])),
                                      angle=float(groups.angle[k]), speeds=groups.speed[k] * ratios, depth=depth)
        except ToolpointError:
            continue
        hand = np.minimum(hand, chart.sure_limit / depth)
    return hand


def _feed_factors(case: AdviceCase, laid: ProgramPath, speed_factor: FloatArray) -> tuple[FloatArray, CutLoads]:
    """Return the factor on the feed of every segment, and the loads with it.

    First the feed per tooth stays; then each block's chip is brought to the largest chip of the program, its power, torque and
    bending below a share of their limits. Loads are computed anew with each factor: edge forces do not fall with the feed.
    """
    n, block, limits = laid.path.count, laid.moves.block[case.removed.piece], case.setup.limits
    # No block is loaded more than the worst of the program as it is.
    bounds = (("power", LIMIT_FRACTION * limits.power_at(laid.speed)),
              ("peak_torque", LIMIT_FRACTION * limits.torque_at(laid.speed)),
              ("bending", LIMIT_FRACTION * limits.bending), ("lateral", float(case.loads.lateral.max(initial=0.0))))
    chip = largest_of_blocks(case.loads.chip, block, n)
    factor = speed_factor.copy()
    cuts = chip > 0
    factor[cuts] *= np.clip(chip.max() / chip[cuts], 1.0, MAX_FEED_FACTOR)
    loads = case.loads
    for _ in range(4):
        loads = place_loads(case.removed, replace(laid, feed=case.laid.feed * factor), case.setup)
        over = np.ones(n)
        for column, bound in bounds:
            values = largest_of_blocks(getattr(loads, column), block, n)
            over = np.maximum(over, values / np.where(values > 0, bound, 1.0))
        if over.max() <= 1 + 1e-3:
            break
        factor = np.maximum(factor / over, MIN_FEED_FACTOR * speed_factor)
    # A feed that hardly rises is no advice: it would only touch the program. One that falls keeps a limit.
    is_slight = (factor > speed_factor) & (factor < (1 + MIN_FEED_RISE) * speed_factor)
    return np.where(is_slight, speed_factor, factor), loads
