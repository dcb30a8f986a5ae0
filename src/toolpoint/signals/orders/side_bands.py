r"""Lines that are no spindle orders, and the families among them: side bands a tooth passing apart.

One multiplier of a periodic cut gives the lines :math:`|k f_z \pm f_c|`; a machine beside it gives one line, or harmonics of a
frequency of its own. Sources: Insperger and others, International Journal of Machine Tools and Manufacture 43 (2003) 25 (which
lines); Delio, Tlusty, Smith, Journal of Engineering for Industry 114 (1992) 146 (the rest beside the comb).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import BoolArray, FloatArray
from toolpoint.signals.orders.line_spectrum import LineSpectrum, SpectralLines

GUARD_CELLS = 3.0  # resolution cells about every order that belong to it: the skirt of a line that begins and ends
RESOLVED_CELLS = 0.4  # resolution cells from an order at which the strongest line about it is no order
HIDDEN_CELLS = 1.5  # resolution cells about an order of a tight comb in which a line weaker than the order is not seen
MAX_COMB_SCATTER = 0.12  # resolution cells, median over tooth passings: a looser comb tells no line from an order so near
STRONG_EXCESS = 100.0  # of a line over the floor that measures how the comb scatters
MAX_SMEAR, MAX_SCATTER_TURNS = 2e-3, 0.1  # relative; orders: a line farther from a tooth passing is not one that wanders
SMEAR_FACTOR = 3.0  # of the median relative scatter of tooth passings: what the speed's wandering may shift an order by
MATCH_CELLS = 1.0  # resolution cells within which a line is a side band
MIN_FUNDAMENTAL_RATIO = 0.01  # of the power of a second harmonic: a line at half its frequency is what it is of
MAX_SEEDS = 12  # strongest lines that a family is built on
MAX_TOOTH_PASSINGS = 60  # from a side band to the line that it is counted from


@dataclass(frozen=True, eq=False)
class Family:
    """Lines a whole number of tooth passings from plus or minus one frequency.

    frequency : its strongest line, Hz; base : its least frequency, f mod f_z folded into 0 .. f_z/2, Hz; power : sum of its
    lines; members, chance : lines, and how many of all lines chance would put there; tooth_members,
    tooth_chance : the same for those whole tooth passings from the strongest; share : power without the strongest line
    over the power.
    """

    frequency: float
    deviation: float
    base: float
    power: float
    members: int
    chance: float
    tooth_members: int
    tooth_chance: float
    share: float
    lines: SpectralLines


@dataclass(frozen=True, eq=False)
class SeparatedLines:
    """Lines of a spectrum by what they are: on the spindle's comb, off it, and how much of the axis the comb hides.

    orders : (n,) powers at the orders 1 .. n; half_tooth : power at odd multiples of half the tooth passing;
    between : power at the orders that are neither; others : lines off
    the comb; hidden : fraction of frequencies nearer to an order than can be told.
    """

    orders: FloatArray
    half_tooth: float
    between: float
    others: SpectralLines
    hidden: float
    guard: float

    @property
    def order_power(self) -> float:
        """Sum of the powers of all orders."""
        return float(self.orders.sum())


def separate_lines(spectrum: LineSpectrum, spindle: float, teeth: int) -> SeparatedLines:
    """Separate the lines of a spectrum into spindle orders and others.

    Parameters
    ----------
    spectrum : LineSpectrum
    spindle : float
        Spindle frequency, Hz.
    teeth : int
    """
    lines = spectrum.lines()
    scatter, smear = _comb_scatter(lines, spindle, teeth)
    guard = min(GUARD_CELLS * spectrum.cell, 0.25 * spindle)
    order = np.arange(1, int(spectrum.frequency[-1] / spindle) + 1)
    power = spectrum.highest_near(order * spindle, guard)
    is_line = power > 3 * np.interp(order * spindle, spectrum.frequency, spectrum.floor)
    orders = np.where(is_line, power, 0.0)
    distance = _distance(lines.frequency, spindle)
    width = np.minimum(np.maximum(guard, SMEAR_FACTOR * smear * lines.frequency), 0.25 * spindle)
    others, hidden = lines.selected(distance > width), guard
    if scatter < MAX_COMB_SCATTER * spectrum.cell:
        is_off = (distance > RESOLVED_CELLS * spectrum.cell) & _is_strongest_near(lines, spindle, guard)
        others, hidden = lines.selected((distance > width) | is_off), min(HIDDEN_CELLS * spectrum.cell, guard)
    half = np.abs(np.mod(order / teeth, 1) - 0.5) < 1e-9
    between = (np.mod(order, teeth) != 0) & ~half
    return SeparatedLines(orders, float(orders[half].sum()), float(orders[between].sum()), others,
                          min(2 * hidden / spindle, 1.0), guard)


def _comb_scatter(lines: SpectralLines, spindle: float, teeth: int) -> tuple[float, float]:
    """Median distance of strong lines from the nearest tooth passing, Hz, and relative to their frequency."""
    distance = _distance(lines.frequency, spindle * teeth)
    is_passing = (lines.excess > STRONG_EXCESS) & (distance < np.minimum(MAX_SMEAR * lines.frequency,
                                                                              MAX_SCATTER_TURNS * spindle))
    if not is_passing.any():
        return np.inf, 0.0
    return float(np.median(distance[is_passing])), float(np.median(distance[is_passing] / lines.frequency[is_passing]))


def _is_strongest_near(lines: SpectralLines, spindle: float, guard: float) -> BoolArray:
    """Whether each line is the strongest within a guard of its order: the skirts of an order are not."""
    order = spindle * np.rint(lines.frequency / spindle)
    return np.array([power >= lines.power[np.abs(lines.frequency - order_frequency) <= guard].max(initial=0.0)
                     for order_frequency, power in zip(order, lines.power, strict=True)], bool)


def _distance(frequency: FloatArray, spacing: float) -> FloatArray:
    return np.asarray(np.abs(frequency - spacing * np.rint(frequency / spacing)))


def find_families(lines: SpectralLines, spindle: float, teeth: int, *, cell: float) -> list[Family]:
    """Return families of lines, the most powerful first, each line in one of them: side bands whole revolutions apart (a tool
    with run-out repeats after a revolution), of the seed and of twice its frequency.

    Parameters
    ----------
    lines : SpectralLines
        SpectralLines off the spindle's comb.
    spindle : float
        Spindle frequency, Hz.
    teeth : int
    cell : float
        Resolution cell, Hz.
    """
    families: list[Family] = []
    free = np.ones(lines.frequency.size, bool)
    for _ in range(MAX_SEEDS):
        if not free.any():
            break
        seed = _fundamental(lines, free, int(np.flatnonzero(free)[0]), MATCH_CELLS * cell)
        is_member = free & _belongs(lines.frequency, float(lines.frequency[seed]), spindle, teeth, MATCH_CELLS * cell)
        is_member[seed] = True
        families.append(_family(lines, is_member, seed, spindle, teeth, cell))
        free &= ~is_member
    return sorted(families, key=lambda family: -family.power)


def _fundamental(lines: SpectralLines, free: BoolArray, seed: int, tolerance: float) -> int:
    """Return the line at half the frequency of a seed where there is one: a chatter line has a second harmonic."""
    is_half = free & (np.abs(lines.frequency - 0.5 * lines.frequency[seed]) < tolerance)
    is_half &= lines.power > MIN_FUNDAMENTAL_RATIO * lines.power[seed]
    return int(np.flatnonzero(is_half)[0]) if is_half.any() else seed


def _belongs(frequency: FloatArray, seed: float, spindle: float, teeth: int, tolerance: float) -> BoolArray:
    """Whether each line lies whole revolutions from plus or minus the seed, or whole tooth passings from twice it."""
    result = np.zeros(frequency.size, bool)
    for centre, spacing in ((seed, spindle), (-seed, spindle), (2 * seed, teeth * spindle), (-2 * seed, teeth * spindle)):
        number = np.rint((frequency - centre) / spacing)
        result |= (np.abs(frequency - centre - number * spacing) < tolerance) & (np.abs(number) * spacing
                                                                                <= MAX_TOOTH_PASSINGS * teeth * spindle)
    return result


def _family(lines: SpectralLines, is_member: BoolArray, seed: int, spindle: float, teeth: int, cell: float) -> Family:
    power, tooth = lines.power[is_member], teeth * spindle
    folded = float(np.mod(lines.frequency[seed], tooth))
    chance = (lines.frequency.size - 1) * min(4 * MATCH_CELLS * cell / spindle, 1.0)
    inside, frequency = lines.selected(is_member), float(lines.frequency[seed])
    by_tooth = _is_spaced(inside.frequency, frequency, tooth, MATCH_CELLS * cell)
    return Family(frequency, float(lines.deviation[seed]), min(folded, tooth - folded), float(power.sum()),
                  int(is_member.sum()), chance, int(by_tooth.sum()), chance / teeth,
                  float(1 - power.max() / power.sum()), inside)


def _is_spaced(frequency: FloatArray, seed: float, spacing: float, tolerance: float) -> BoolArray:
    """Whether each line lies whole spacings from plus or minus the seed."""
    above, below = (frequency - centre - spacing * np.rint((frequency - centre) / spacing) for centre in (seed, -seed))
    return np.asarray(np.minimum(np.abs(above), np.abs(below)) < tolerance)
