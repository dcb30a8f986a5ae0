"""Rival spindle speeds of an unknown spindle, ranked by how many lines a comb and its side bands explain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.signals.orders.line_spectrum import LineSpectrum
from toolpoint.signals.orders.side_bands import MATCH_CELLS, find_families
from toolpoint.signals.orders.spindle_comb import SpindleSpeed, refine_speed

MAX_LINES = 60  # strongest lines that are to be explained
FAMILY_WEIGHT = 0.6  # of a side band beside a line of the comb: twice the speed has every second order as a "side band"
SINGLE_ORDER_WEIGHT = 0.9  # of an order between tooth passings
MIN_MEMBERS = 3  # lines of a family that explain each other
MAX_WEIGHT = 7.0  # log of power over floor of a line
TOOTH_LEVEL_WEIGHT = 0.1  # of the mean log excess at tooth passings beside the explained share
MIN_DISTINCTION = 1e-4  # relative: nearer candidates are one
MAX_SPACED_LINES = 40  # strongest lines whose distances are looked at
MAX_SPACING_NUMBER = 6  # tooth passings between two lines
SPACING_BIN_CELLS = 0.25  # resolution cells
SPACING_COUNT = 4  # candidates by distances
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
    extended += [SpindleSpeed(frequency, SPACING_BIN_CELLS * spectrum.cell / teeth, 0.0, 0)
                 for frequency in search_spacings(spectrum, teeth, spindle_limits)]
    scored = [replace(speed, score=_explained(spectrum, speed.frequency, teeth)) for speed in _distinct(extended)]
    return tuple(sorted(scored, key=lambda speed: -speed.score))


def search_spacings(spectrum: LineSpectrum, teeth: int, limits: tuple[float, float]) -> list[float]:
    """Search spindle frequencies (Hz) by the distances between lines: side bands of chatter are whole tooth passings apart, and
    tell the speed where no forced line stands out.

    Distances between all pairs of the strongest lines, over 1 to 6, are counted in bins of a quarter of a resolution cell.
    """
    lines = spectrum.lines()
    lines = lines.selected(np.arange(lines.power.size) < MAX_SPACED_LINES)
    if lines.power.size < MIN_MEMBERS:
        return []
    first, second = np.triu_indices(lines.power.size, 1)
    distance = np.abs(lines.frequency[first] - lines.frequency[second])
    weight = np.sqrt(np.log(lines.excess[first]) * np.log(lines.excess[second]))
    width = SPACING_BIN_CELLS * spectrum.cell
    edges = np.arange(teeth * limits[0] - width, teeth * limits[1] + 2 * width, width)
    counts = np.zeros(edges.size - 1)
    for number in range(1, MAX_SPACING_NUMBER + 1):
        counts += np.histogram(distance / number, edges, weights=weight)[0]
    smooth = np.convolve(counts, [0.5, 1.0, 0.5], mode="same")
    tooth = []
    for _ in range(SPACING_COUNT):
        peak = int(np.argmax(smooth))
        if smooth[peak] == 0:
            break
        centre = 0.5 * (edges[peak] + edges[peak + 1])
        smooth[max(peak - 4, 0):peak + 5] = 0
        tooth.append(_fit_spacing(distance, weight, float(centre), width))
    return [value / teeth for value in tooth if teeth * limits[0] <= value <= teeth * limits[1]]


def _fit_spacing(distance: FloatArray, weight: FloatArray, tooth: float, width: float) -> float:
    """Return the tooth passing by weighted least squares through the distances near its multiples."""
    number = np.rint(distance / tooth)
    is_near = (number >= 1) & (number <= MAX_SPACING_NUMBER) & (np.abs(distance - number * tooth) < 1.5 * width * number)
    k, d, w = number[is_near], distance[is_near], weight[is_near]
    return float(np.sum(w * k * d) / np.sum(w * k * k)) if k.size else tooth


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
    for family in find_families(others, spindle, teeth, cell=spectrum.cell)[:2]:
        if family.members >= MIN_MEMBERS + 2 * family.chance:
            value[np.isin(lines.frequency, family.lines.frequency)] = FAMILY_WEIGHT
    coverage = min(2 * tolerance / spindle, 1.0)
    share = float(np.sum(weight * value) / np.sum(weight)) - SINGLE_ORDER_WEIGHT * coverage - coverage / teeth
    return share + TOOTH_LEVEL_WEIGHT * _tooth_level(spectrum, spindle * teeth)


def _distinct(candidates: list[SpindleSpeed]) -> list[SpindleSpeed]:
    """Return the candidates that differ; of those that converged to one speed the first."""
    result: list[SpindleSpeed] = []
    for speed in candidates:
        if all(abs(speed.frequency / other.frequency - 1) > MIN_DISTINCTION for other in result):
            result.append(speed)
    return result


def _tooth_level(spectrum: LineSpectrum, tooth: float) -> float:
    """Mean log of power over floor at the first tooth passings; noise, and what lies beyond the band, counts as zero."""
    passing = tooth * np.arange(1, LEVEL_ORDERS + 1)
    level = spectrum.highest_near(passing, 1.5 * spectrum.cell) / np.interp(passing, spectrum.frequency, spectrum.floor)
    return float(np.mean(np.log(np.maximum(level / 6, 1.0))))
