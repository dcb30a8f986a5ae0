"""Check of a command stream against the limits of its axes, from the positions alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail, floats
from toolpoint._notebook import NotebookText
from toolpoint.drives.program.command import Command
from toolpoint.drives.program.jerk_profile import JerkLimits


@dataclass(frozen=True, eq=False)
class LimitReport(NotebookText):
    """Largest share of each limit that each axis uses, (n_axes, 3) for speed, acceleration, jerk, and the time of each."""

    share: FloatArray
    times: FloatArray
    tolerance: float

    @property
    def kept(self) -> bool:
        """Whether every limit is kept within the tolerance."""
        return bool((self.share <= 1 + self.tolerance).all())

    def __repr__(self) -> str:
        if self.kept:
            return f"LimitReport(kept; largest share {self.share.max():.4f})"
        axis, kind = np.unravel_index(int(np.argmax(self.share)), self.share.shape)
        word = ("speed", "acceleration", "jerk")[kind]
        return f"LimitReport(broken: axis {axis} {word} {self.share[axis, kind]:.4f} of the limit at " \
               f"{self.times[axis, kind]:.6g} s)"


def check_limits(command: Command, limits: JerkLimits | list[JerkLimits], tolerance: float = 1e-6) -> LimitReport:
    """Return the share of each limit that a command uses.

    First, second and third differences over the sample time are means of speed, acceleration and jerk over their samples,
    so a stream within the limits can never show more; nothing that the planner says is used.

    Examples
    --------
    >>> from toolpoint.drives import straight_move
    >>> limits = JerkLimits(speed=0.5, acceleration=3.0, jerk=100.0)
    >>> check_limits(straight_move([0, 0], [0.1, 0.05], [limits, limits], sample_time=1e-3), limits).kept
    True
    """
    axes = command.position.shape[1]
    each = [limits] * axes if isinstance(limits, JerkLimits) else list(limits)
    if len(each) != axes:
        fail("limits", f"{len(each)}", f"must be one, or one for each of {axes} axes")
    bound = np.array([[x.speed, x.acceleration, x.jerk] for x in each])
    share, times = np.zeros((axes, 3)), np.zeros((axes, 3))
    # Differences of positions lose digits by 1/dt a derivative: what rounding alone makes of them is allowed on top.
    noise = 8 * np.finfo(float).eps * max(float(np.abs(command.position).max()), 1e-12)
    for order in (1, 2, 3):
        change = np.abs(np.diff(floats("position", command.position), order, axis=0))
        if change.shape[0] == 0:
            continue
        value = np.maximum(change - noise * 2**order, 0.0) / command.sample_time**order
        where = value.argmax(axis=0)
        share[:, order - 1] = value[where, np.arange(axes)] / bound[:, order - 1]
        times[:, order - 1] = (where + order / 2) * command.sample_time
    return LimitReport(share, times, tolerance)
