"""Charts of one cut over a chain of neighbouring poses and over feed directions, each warm from the one before."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail, floats
from toolpoint.cutting.cut.problem import Dynamics, MillingProblem
from toolpoint.cutting.stability.compute import chart
from toolpoint.cutting.stability.method import StabilityMethod
from toolpoint.cutting.stability.result import StabilityChart
from toolpoint.cutting.stability.warm_start import WarmStart
from toolpoint.vibration import Frf, Modes

Poses = Modes | Frf | Sequence[Dynamics]
ChartRow = tuple[StabilityChart | str, ...]


def chart_poses(
    problem: MillingProblem, dynamics: Poses, speeds: FloatArray, *, feed_angles: FloatArray | Sequence[float] = (0.0,),
    method: StabilityMethod | None = None, depth_max: float = 0.01, warm: bool = True,
) -> tuple[ChartRow, ...]:
    """Return a row of charts for every pose, one for each feed direction; the reason as text where one failed.

    Parameters
    ----------
    problem : MillingProblem
        The cut; its own dynamics and feed angle are replaced.
    dynamics : Modes or Frf with one leading pose axis, or a sequence of single ones
        Neighbours in the list should be near in space.
    speeds : (n,) floats
        rev/min.
    feed_angles : (n_directions,) floats
        rad from x towards y.
    depth_max : float
        m.
    warm : bool
        Let each chart begin with what the pose before left for the same feed direction (`WarmStart`); the directions share
        the panels, which do not hang on the dynamics. One chain is one thread's work; for many poses see
        `studies.chatter_map`.

    >>> from toolpoint.vibration import Modes
    >>> poses = [Modes([f], [0.03], [[0.2]], ["tool:+x"]) for f in (400.0, 420.0)]
    >>> from toolpoint.cutting import CuttingCoefficients, Engagement, Tool
    >>> coefficients = CuttingCoefficients(6e8, 2e8)
    >>> problem = MillingProblem(Tool(0.012, 2), Engagement.slot(), coefficients, poses[0], "tool:+x", "same")
    >>> rows = chart_poses(problem, poses, [6000.0], depth_max=5e-3)
    >>> len(rows), len(rows[0])  # poses, feed directions
    (2, 1)
    """
    angles = floats("feed_angles", np.atleast_1d(feed_angles))
    first = WarmStart()
    memories = [first, *(first.share_panels() for _ in angles[1:])] if warm else [None] * angles.size

    def attempt(pose: Dynamics, angle: float, memory: WarmStart | None) -> StabilityChart | str:
        try:
            turned = problem.changed(dynamics=pose, feed_angle=angle)
            return chart(turned, speeds, method, depth_max=depth_max, warm=memory)
        except ToolpointError as error:
            return str(error)

    return tuple(
        tuple(attempt(pose, float(angle), memory) for angle, memory in zip(angles, memories)) for pose in poses_of(dynamics))


def limits_of(rows: Sequence[ChartRow], count: int) -> FloatArray:
    """Return the first loss of stability, m, shape (n_poses, n_directions, n_speeds); NaN where the chart failed."""
    empty = np.full(count, np.nan)
    return np.array([[empty if isinstance(cell, str) else cell.limit for cell in row] for row in rows])


def poses_of(dynamics: Poses) -> Iterator[Dynamics]:
    """Yield single poses of a batch along its one leading axis, or of a sequence."""
    if isinstance(dynamics, (Modes, Frf)):
        array = dynamics.frequency if isinstance(dynamics, Modes) else dynamics.values[..., 0, 0, 0]
        lead = array.ndim - (1 if isinstance(dynamics, Modes) else 0)
        if lead == 0:
            yield dynamics
            return
        if lead > 1:
            fail("dynamics", f"{lead} leading axes", "must have one leading pose axis", remedy="reshape the poses to one axis")
        for i in range(array.shape[0]):
            yield dynamics.at_pose(i)
        return
    yield from dynamics
