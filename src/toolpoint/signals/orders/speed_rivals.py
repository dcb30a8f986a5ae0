"""Rival spindle speeds of an unknown spindle, ranked by how many lines a comb and its side bands explain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint.signals.orders.line_spectrum import LineSpectrum
from toolpoint.signals.orders.side_bands import MATCH_CELLS, find_families
from toolpoint.signals.orders.spindle_comb import RIVAL_DISTANCE, SpindleSpeed, refine_speed

MAX_LINES = 60  # strongest lines that are to be explained
FAMILY_WEIGHT = 0.6  # of a side band beside a line of the comb: twice the speed has every second order as a "side band"
SINGLE_ORDER_WEIGHT = 0.9  # of an order between tooth passings
MIN_MEMBERS = 3  # lines of a family that explain each other
MAX_WEIGHT = 7.0  # log of power over floor of a line
TOOTH_LEVEL_WEIGHT = 0.1  # of the mean log excess at tooth passings beside the explained share
LEVEL_ORDERS = 8  # first tooth passings whose level counts


def rank_speeds(spectrum: LineSpectrum, candidates: tuple[SpindleSpeed, ...], teeth: int, *,
                spindle_limits: tuple[float, float]) -> tuple[SpindleSpeed, ...]:
    """Return candidates scored by the share of the lines that each explains and the level of its tooth passings, best first.

    A comb of chatter lines explains those alone; the spindle's explains the forced lines by its orders and the chatter lines as
    side bands a tooth passing apart. A half or a fourth of the speed explains as much, and its tooth passings are weak or
    missing: so their mean level counts too.
    """
    extended = [*candidates, *(refine_speed(spectrum, teeth, speed.frequency * factor) for speed in candidates
                            for factor in (2.0, 3.0, float(teeth), 0.5, 1 / 3, 1 / teeth)
                            if spindle_limits[0] <= speed.frequency * factor <= spindle_limits[1])]
    scored = [replace(speed, score=_explained(spectrum, speed.frequency, teeth)) for speed in _distinct(extended)]
    return tuple(sorted(scored, key=lambda speed: -speed.score))


def _explained(spectrum: LineSpectrum, spindle: float, teeth: int) -> float:
    lines = spectrum.lines()
    lines = lines.selected(np.arange(lines.power.size) < MAX_LINES)
    if lines.power.size == 0:
        return 0.0
    tolerance = MATCH_CELLS * spectrum.cell
    order = np.rint(lines.frequency / spindle)
    is_order = (np.abs(lines.frequency - order * spindle) < tolerance + 3e-5 * lines.frequency) & (order >= 1)
    is_tooth = is_order & (np.mod(order, teeth) == 0)
    weight = np.minimum(np.log(lines.excess), MAX_WEIGHT)
    value = np.where(is_tooth, 1.0, np.where(is_order, SINGLE_ORDER_WEIGHT, 0.0))
    others = lines.selected(~is_order)
    for family in find_families(others, spindle, teeth, spectrum.cell)[:2]:
        if family.members >= MIN_MEMBERS + 2 * family.chance:
            value[np.isin(lines.frequency, family.lines.frequency)] = FAMILY_WEIGHT
    coverage = min(2 * tolerance / spindle, 1.0)
    share = float(np.sum(weight * value) / np.sum(weight)) - SINGLE_ORDER_WEIGHT * coverage - coverage / teeth
    return share + TOOTH_LEVEL_WEIGHT * _tooth_level(spectrum, spindle * teeth)


def _distinct(candidates: list[SpindleSpeed]) -> list[SpindleSpeed]:
    """Return the candidates that differ; of those that converged to one speed the first."""
    result: list[SpindleSpeed] = []
    for speed in candidates:
        if all(abs(speed.frequency / other.frequency - 1) > RIVAL_DISTANCE for other in result):
            result.append(speed)
    return result


def _tooth_level(spectrum: LineSpectrum, tooth: float) -> float:
    """Mean log of power over floor at the first tooth passings; noise, and what lies beyond the band, counts as zero."""
    passing = tooth * np.arange(1, LEVEL_ORDERS + 1)
    level = spectrum.highest_near(passing, 1.5 * spectrum.cell) / np.interp(passing, spectrum.frequency, spectrum.floor)
    return float(np.mean(np.log(np.maximum(level / 6, 1.0))))
