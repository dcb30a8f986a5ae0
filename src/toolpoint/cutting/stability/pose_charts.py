"""PoseCharts: stability of one cut over many poses, feed directions and speeds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from toolpoint._check import Array, FloatArray, ToolpointError, count, fail, floats
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.stability.compute import chart
from toolpoint.cutting.stability.method import StabilityMethod
from toolpoint.cutting.stability.result import StabilityChart
from toolpoint.cutting.stability.warm_start import WarmStart
from toolpoint.vibration import Frf, Modes

CHAIN, CHAINS = 10, 8  # most poses that follow each other warm; least number of chains, for workers to share


@dataclass(frozen=True, eq=False)
class PoseCharts:
    """Charts of many poses and feed directions.

    Parameters
    ----------
    charts : (n_poses, n_directions) nested tuples of StabilityChart or None (a failed pose)
    speeds : (n,) floats
        rev/min.
    feed_angles : (n_directions,) floats
        rad.
    depth_max : float
        m.
    failures : sequence of (pose, direction, reason)
    """

    charts: tuple[tuple[StabilityChart | None, ...], ...]
    speeds: FloatArray
    feed_angles: FloatArray
    depth_max: float
    failures: tuple[tuple[int, int, str], ...] = ()

    @property
    def limit(self) -> FloatArray:
        """First loss of stability, m, shape (n_poses, n_directions, n_speeds); NaN for a failed pose."""
        empty = np.full(self.speeds.size, np.nan)
        return np.array([[empty if c is None else c.limit for c in row] for row in self.charts])

    def stable(self, depths: FloatArray) -> Array:
        """Whether stable, shape (n_poses, n_directions, n_speeds, n_depths); False for a failed pose."""
        none = np.zeros((self.speeds.size, np.size(depths)), bool)
        return np.array([[none if c is None else c.stable(depths) for c in row] for row in self.charts])

    def __repr__(self) -> str:
        return (f"PoseCharts({len(self.charts)} poses, {self.feed_angles.size} feed directions, {self.speeds.size} speeds, "
                f"{len(self.failures)} failed)")


def chart_poses(problem: MillingProblem, dynamics: Modes | Frf | Sequence[Modes | Frf], speeds: FloatArray,
                depth_max: float = 0.01, feed_angles: FloatArray | Sequence[float] = (0.0,),
                method: StabilityMethod | None = None, workers: int = 1, warm: bool = True,
                chain: int | None = None) -> PoseCharts:
    """Return the charts of one cut over poses and feed directions.

    Parameters
    ----------
    problem : MillingProblem
        The cut; its dynamics are replaced pose by pose, its labels `x`, `y` are kept.
    dynamics : Modes or Frf with one leading pose axis, or a sequence of single-pose ones
    speeds, depth_max, method
        As in `stability.chart`.
    feed_angles : (n_directions,) floats
        rad from x towards y.
    workers : int
        Threads; the kernels run without the interpreter's lock.
    warm : bool
        Let each chart begin with what the pose before left for the same feed direction (`WarmStart`). A chain of poses has an
        eighth of them, ten at most, whatever the number of workers, so that charts do not hang on it. List poses so that
        neighbours in the list are near in space.
    chain : int, optional
        Poses of a chain, instead of that rule.

    A pose that fails is kept as None with its reason in `failures`, and the others go on.
    """
    angles = floats("feed_angles", np.atleast_1d(feed_angles))
    every = list(poses_of(dynamics))
    length = max(1, min(CHAIN, -(-len(every) // CHAINS))) if chain is None else count("chain", chain)
    chains = [every[i:i + length] for i in range(0, len(every), length)]

    def follow(chain: list[Modes | Frf]) -> list[StabilityChart | str]:
        first = WarmStart()
        memories = [first, *(first.beside() for _ in angles[1:])] if warm else [None] * angles.size
        return [_charted(problem, pose, float(a), speeds, method, depth_max, memory)
                for pose in chain for a, memory in zip(angles, memories)]

    if count("workers", workers) == 1:
        found = [f for chain in chains for f in follow(chain)]
    else:
        with ThreadPoolExecutor(workers) as pool:
            found = [f for part in pool.map(follow, chains) for f in part]
    jobs = [(i, j) for i in range(len(every)) for j in range(angles.size)]
    failures = tuple((job[0], job[1], f) for job, f in zip(jobs, found) if isinstance(f, str))
    table = [None if isinstance(f, str) else f for f in found]
    rows = tuple(tuple(table[i * angles.size:(i + 1) * angles.size]) for i in range(len(every)))
    return PoseCharts(rows, floats("speeds", np.atleast_1d(speeds)), angles, depth_max, failures)


def _charted(problem: MillingProblem, dynamics: Modes | Frf, angle: float, speeds: FloatArray, method: StabilityMethod | None,
             depth_max: float, memory: WarmStart | None) -> StabilityChart | str:
    """The chart of one pose and direction, or why there is none."""
    try:
        return chart(problem.changed(dynamics=dynamics, feed_angle=angle), speeds, method, depth_max=depth_max, warm=memory)
    except ToolpointError as error:
        return str(error)


def poses_of(dynamics: Modes | Frf | Sequence[Modes | Frf]) -> Iterator[Modes | Frf]:
    """Yield single poses of a batch along its one leading axis, or of a sequence."""
    if isinstance(dynamics, (Modes, Frf)):
        array = dynamics.frequency if isinstance(dynamics, Modes) else dynamics.values[..., 0, 0, 0]
        lead = array.ndim - (1 if isinstance(dynamics, Modes) else 0)
        if lead == 0:
            yield dynamics
            return
        if lead > 1:
            fail("dynamics", f"{lead} leading axes", "must have one leading pose axis", "reshape the poses to one axis")
        for i in range(array.shape[0]):
            yield dynamics.at_pose(i)
        return
    yield from dynamics


