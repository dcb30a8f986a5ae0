"""Chip along a side: as the path's feed gives it, or constant as the cut is described; doubts where the two contradict."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import fail, one_of
from toolpoint._doubt import Doubt
from toolpoint.cutting.description import CHIPS, CuttingDescription
from toolpoint.studies.accuracy.tool_paths import PathSide

# Of the described feed per tooth: forces are proportional to the chip, so errors would differ by about as much. Feeds of
# programs are rounded, by less than this.
MAX_CHIP_MISMATCH = 0.05
_FEED_SAMPLES = 2001  # of the motion law, in which its largest feed is looked up


@dataclass(frozen=True)
class Chip:
    """Feed per tooth along a side, m.

    kind : ``path``, the feed over speed and teeth, or ``constant``, as the cut is described; described : of the cut, 0 where
    it has none; largest : of the path.
    """

    kind: str
    described: float
    largest: float

    @property
    def largest_feed(self) -> float:
        """The largest feed per tooth that is cut, m."""
        return self.described if self.kind == "constant" else self.largest

    @property
    def words(self) -> str:
        """Chip that is cut, in words."""
        if self.kind == "constant":
            return f"the chip constant, {1e3 * self.described:.4g} mm a tooth as the cut's feed_per_tooth says"
        return f"the chip as the path gives it, up to {1e3 * self.largest:.4g} mm a tooth"

    def doubts(self, speed: float, teeth: int) -> tuple[Doubt, ...]:
        """Return the doubt that the path's feed and the described feed per tooth contradict, if they do."""
        if self.described <= 0 or abs(self.largest / self.described - 1) <= MAX_CHIP_MISMATCH:
            return ()
        feed = 60e3 * self.largest * teeth * speed / 60
        fitting = 60e3 * self.described * teeth * speed / 60
        used = "the path's is used" if self.kind == "path" else "the described one is used all along"
        other = "`chip` constant takes the described one" if self.kind == "path" else "`chip` path takes the path's"
        return (Doubt("chip", f"the path's feed of {feed:.5g} mm/min at {speed:g} rev/min with {teeth} teeth gives "
                              f"{1e3 * self.largest:.4g} mm a tooth, but the cut says feed_per_tooth "
                              f"{1e3 * self.described:.4g} mm: {used}",
                      f"a `feed` of {fitting:.5g} mm/min fits the described chip; {other}",
                      figure=abs(self.largest / self.described - 1)),)


def chip_kind(cut: CuttingDescription, requested: str = "") -> str:
    """Return the kind of chip, the requested one or that of the cut; a constant chip needs the cut's feed per tooth."""
    kind = one_of("chip", requested or cut.chip, CHIPS)
    if kind == "constant" and cut.feed_per_tooth <= 0:
        fail("chip", "constant", "needs the cut's `feed_per_tooth`",
             remedy="give it in the section cutting, or take path")
    return kind


def side_chip(cut: CuttingDescription, side: PathSide, *, tooth: float, requested: str = "") -> Chip:
    """Return the chip along a side with a tooth period `tooth` (s)."""
    speeds = side.law.sample(np.linspace(0, side.law.duration, _FEED_SAMPLES))[:, 1]
    return Chip(chip_kind(cut, requested), cut.feed_per_tooth, float(speeds.max()) * tooth)
