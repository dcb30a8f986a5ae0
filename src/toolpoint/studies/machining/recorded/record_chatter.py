"""Lines of chatter in a record: those that no revolution of the spindle explains, in the longest blocks of a program."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.signals.orders.line_spectrum import MIN_SAMPLES, line_spectrum
from toolpoint.signals.orders.side_bands import find_families, separate_lines

MAX_HEARD_BLOCKS = 40  # the longest
MIN_HEARD_REVOLUTIONS = 40  # of a block: the lines of a shorter one are not told apart
MIN_FAMILY_RATIO = 0.1  # of the power of the tooth passings: weaker lines are of other sources
MIN_HEARD_RATIO = 2.5  # of the tooth passing frequency: a slower record does not show chatter


@dataclass(frozen=True)
class ChatterInRecord:
    """Lines of chatter in a block: frequency (Hz) of the strongest line, power over that of the tooth passings."""

    block: int
    frequency: float
    ratio: float


def find_chatter(block: np.ndarray, values: FloatArray, rate: float, *, speed: FloatArray, teeth: np.ndarray
                 ) -> tuple[list[ChatterInRecord], int]:
    """Return the blocks whose record holds lines beside the spindle's revolutions, and how many blocks were heard.

    block : (n,) segment of every sample; values : (n,); rate : samples per second; speed (rev/min), teeth : by segment.
    """
    edges = np.concatenate([[0], np.flatnonzero(np.diff(block)) + 1, [block.size]])
    spans = sorted(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True), key=lambda span: span[0] - span[1])
    block_count, lines = 0, list[ChatterInRecord]()
    for first, last in spans[:MAX_HEARD_BLOCKS]:
        k = int(block[first])
        spindle = float(speed[k]) / 60
        needed = MIN_HEARD_REVOLUTIONS / max(spindle, 1e-9) * rate
        if spindle <= 0 or last - first < max(MIN_SAMPLES, needed) or rate < MIN_HEARD_RATIO * spindle * teeth[k]:
            continue
        block_count += 1
        part = values[first:last] - values[first:last].mean()
        # Below a revolution is the course of the load itself.
        spectrum = line_spectrum(part, rate).between(spindle, 0.5 * rate)
        separated = separate_lines(spectrum, spindle, int(teeth[k]))
        families = find_families(separated.others, spindle, int(teeth[k]), cell=spectrum.cell)
        passing = float(separated.orders[int(teeth[k]) - 1::int(teeth[k])].sum())
        if families:
            loudest = max(families, key=lambda family: float(family.lines.power.sum()))
            ratio = float(loudest.lines.power.sum()) / max(passing, 1e-300)
            if ratio > MIN_FAMILY_RATIO:
                strongest = int(np.argmax(loudest.lines.power))
                lines.append(ChatterInRecord(k, float(loudest.lines.frequency[strongest]), ratio))
    return lines, block_count
