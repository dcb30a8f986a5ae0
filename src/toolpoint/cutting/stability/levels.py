"""Search levels of depth: denser near zero, and as dense as the axial pitch requires."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.cutting.cut.problem import MillingProblem

LEVELS_PER_AXIAL_PITCH = 6  # of an axial pitch between two levels
MAX_ADDED_LEVELS = 120  # levels that the axial pitch may add
# Places of a second look between the neighbour below a boundary point and it, and between it and the neighbour above, as
# fractions of that stretch: a band may open and close beside a boundary point.
FRACTIONS_BELOW_ROOT = (1 / 3, 2 / 3)
FRACTIONS_ABOVE_ROOT = (1 / 8, 1 / 2)


def axial_pitch(problem: MillingProblem) -> float:
    r"""Return the depth after which the next edge is where this one was, :math:`\pi D/(N \tan\beta)`, m; inf without helix.

    At its multiples the sum of the chips is constant over a turn: bands of stable depths come back there however deep the cut.
    Of edges with different helices the steepest counts. Source: Zatarain, Munoa, Peigne, Insperger, CIRP Annals 55 (2006) 365.
    """
    steep = float(np.tan(np.abs(problem.tool.helix).max()))
    return np.pi * problem.tool.diameter / (problem.tool.teeth * steep) if steep > 0 else np.inf


def depth_levels(problem: MillingProblem, depth_max: float, number: int, *, power: float) -> FloatArray:
    """Return `number` depths to depth_max, m, (k/number)^power of it, and others between them: the multiples of the axial
    pitch, and so many that no two lie further apart than a sixth of it (at most 120 are added)."""
    grid = depth_max * (np.arange(1, number + 1) / number) ** power
    pitch = axial_pitch(problem)
    if pitch > LEVELS_PER_AXIAL_PITCH * np.diff(grid, prepend=0.0).max():
        return grid
    step = max(pitch / LEVELS_PER_AXIAL_PITCH, depth_max / MAX_ADDED_LEVELS)
    ends = np.concatenate([[0.0], grid])
    parts = np.ceil(np.diff(ends) / step - 1e-9).astype(int)
    filled = [a + (b - a) * np.arange(1, n + 1) / n for a, b, n in zip(ends[:-1], ends[1:], parts)]
    multiples = pitch * np.arange(1, int(depth_max / max(pitch, step)) + 1)
    levels = np.unique(np.concatenate([*filled, multiples[multiples < depth_max]]))
    return levels[np.diff(levels, append=np.inf) > 1e-3 * step]


def spacing_note(levels: FloatArray) -> str:
    """Return the remark on bands that the spacing of the levels may hide."""
    return (f"bands of depths narrower than the spacing of {levels.size} search levels "
            f"(at most {1e3 * np.diff(levels, prepend=0.0).max():.2g} mm) can be missed")
