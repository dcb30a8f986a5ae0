"""PanelStore: panels of cuts that speeds and near problems share."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.stability.panels.layout import CutPanels, is_plain

RESOLUTION_RATIO = 2 ** (1 / 8)  # between resolutions of panels: coarse enough that near speeds and problems have the same
MAX_STORED_BASES = 32  # of different sizes kept
Key = tuple[float, float, int, int]


@dataclass
class PanelStore:
    """Panels by depth and resolution; those of search levels are kept, the longest unused go beyond `room` bytes.

    Panels hang on the cut and the resolution alone, so what is found does not depend on what is in the store.
    """

    room: int = 2**28
    levels: set[float] = field(default_factory=set)
    kept: OrderedDict[Key, CutPanels] = field(default_factory=OrderedDict)
    size: int = 0
    cut: tuple[object, ...] = ()
    basis: dict[tuple[int, int], tuple[FloatArray, FloatArray]] = field(default_factory=dict)

    def room_for(self, vectors_max: int, size: int) -> tuple[FloatArray, FloatArray]:
        """Return room for a basis of `vectors_max` vectors and its Hessenberg matrix, uninitialised: (vectors_max + 1, size)
        and (vectors_max + 1, vectors_max)."""
        if (vectors_max, size) not in self.basis:
            if len(self.basis) > MAX_STORED_BASES:
                self.basis.clear()
            self.basis[vectors_max, size] = np.zeros((vectors_max + 1, size)), np.zeros((vectors_max + 1, vectors_max))
        return self.basis[vectors_max, size]

    def fit(self, cut: tuple[object, ...]) -> None:
        """Forget everything if this is another cut."""
        if cut != self.cut:
            self.kept.clear()
            self.levels.clear()
            self.size, self.cut = 0, cut

    def panels(self, problem: MillingProblem, depth: float, waves: float, *, nodes_min: int, points: int) -> CutPanels:
        """Return the panels of a cut at this depth with `waves` nodes a radian or a little more."""
        is_linear = is_plain(problem)
        # Rounded upwards to a ladder; the small term keeps a resolution that lies on a rung from being lifted by rounding.
        waves = RESOLUTION_RATIO ** float(np.ceil(np.log(waves) / np.log(RESOLUTION_RATIO) - 1e-9))
        key = (0.0 if is_linear else depth, waves, nodes_min, points)
        if key in self.kept:
            self.kept.move_to_end(key)
            return self.kept[key]
        panels = CutPanels(problem, depth, waves, nodes_min, points)
        # Depths of a root search come once: keeping them would push out the levels, to which every speed comes back.
        if is_linear or depth in self.levels:
            self.kept[key] = panels
            self.size += panels.nbytes
            while self.size > self.room and len(self.kept) > 1:
                self.size -= self.kept.popitem(last=False)[1].nbytes
        return panels
