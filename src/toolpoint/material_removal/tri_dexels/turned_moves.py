"""Steps of a tool that moves and turns: ends of its tip and of its axis, and the axes along which its feed is seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail, floats

_UNIT_TOLERANCE = 1e-6  # of the length of an axis


@dataclass(frozen=True, eq=False)
class TurnedMoves:
    """Steps of a path in the axes of the work.

    Parameters
    ----------
    tips : (n, 2, 3) floats
        Tip of the tool at both ends of every step, m.
    axes : (n, 2, 3) floats
        Unit vectors from the tip upwards along the tool; over a step they turn along a great circle.
    frames : (n, 2, 3, 3) floats
        Columns are the tool's x, y and z at both ends: angles of feed are counted from its x.
    block : (n,) ints
        Index of the program's segment.
    shape : (n,) ints
        Index of the tool's shape.
    rapid : (n,) bools
    """

    tips: FloatArray
    axes: FloatArray
    frames: FloatArray
    block: np.ndarray
    shape: np.ndarray
    rapid: np.ndarray

    def __post_init__(self) -> None:
        floats("tips", self.tips, (None, 2, 3))
        size = np.linalg.norm(floats("axes", self.axes, (None, 2, 3)), axis=-1)
        if size.size and np.abs(size - 1).max() > _UNIT_TOLERANCE:
            fail("axes", f"a length of {size.flat[int(np.abs(size - 1).argmax())]:g}", "must be unit vectors")

    @property
    def count(self) -> int:
        """Number of steps."""
        return int(self.block.size)

    @property
    def rows(self) -> FloatArray:
        """Numbers that kernels read, (n, 13), see `tool_distance`."""
        return np.concatenate([self.tips.reshape(-1, 6), self.axes.reshape(-1, 6), self.shape[:, None].astype(float)], axis=1)

    @property
    def rates(self) -> FloatArray:
        """Ways of tip (m) and axis over every step, (n, 2, 3)."""
        return np.stack([self.tips[:, 1] - self.tips[:, 0], self.axes[:, 1] - self.axes[:, 0]], axis=1)
