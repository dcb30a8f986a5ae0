"""Chatter limits over a grid of axis positions and feed directions: serial or on workers, resumable, the worst place named.

Neighbouring poses are computed in short chains, each chart warm from the one before. How the grid is cut into chains hangs
on the grid alone, so limits do not hang on workers or interruptions. A chain is finished, and kept, as a whole; where it
breaks, its poses run again one at a time, so that only the one to blame is a failure.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import Array, FloatArray, fail, floats
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.stability.method import StabilityMethod
from toolpoint.cutting.stability.result import StabilityChart
from toolpoint.machine.model import Machine
from toolpoint.studies.chatter_map import chatter_map
from toolpoint.studies.execute import Engine, Outcome, Progress, execute

CHAIN, CHAINS = 5, 8  # most poses of a chain, for it is lost when interrupted; least number of chains, for workers to share

@dataclass(frozen=True)
class WorstCut:
    """Where the stable depth is least: pose, feed angle (rad), speed (rev/min), depth (m), chatter frequency (Hz)."""

    pose: Mapping[str, float]
    feed_angle: float
    speed: float
    depth: float
    frequency: float


@dataclass(frozen=True, eq=False)
class ChatterGrid:
    """Limits over a grid.

    axes : axis name to its positions, m or rad; feed_angles : (n_directions,) rad from x towards y; speeds : (n_speeds,)
    rev/min; limit : (n_1, ..., n_directions, n_speeds) depth of the first loss of stability, m, infinite above `depth_max`, not
    a number where it failed; frequency : the same shape, chatter frequency there, Hz; depth_max : (n_1, ...) largest depth
    looked at, m; failures : grid index and direction to reason; notes : remarks of the method.
    """

    axes: Mapping[str, FloatArray]
    feed_angles: FloatArray
    speeds: FloatArray
    limit: FloatArray
    frequency: FloatArray
    depth_max: FloatArray
    cut: CuttingDescription
    failures: Mapping[tuple[int, ...], str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def lowest(self) -> FloatArray:
        """Depth that is stable at every speed, m, shape (n_1, ..., n_directions); not a number where it failed."""
        return np.asarray(self.limit.min(axis=-1))

    @property
    def everywhere(self) -> FloatArray:
        """Depth that is stable at every pose and in every direction that did not fail, m, shape (n_speeds,)."""
        flat = self.limit.reshape(-1, self.speeds.size)
        return np.asarray(flat[~np.isnan(flat).any(axis=1)].min(axis=0))

    def pose(self, index: Sequence[int]) -> dict[str, float]:
        """Return the axis positions of a grid index."""
        return {name: float(at[i]) for (name, at), i in zip(self.axes.items(), index)}

    def worst(self, direction: int | None = None) -> WorstCut:
        """Return the cut with the least stable depth, in one feed direction or in all."""
        limit = self.limit if direction is None else self.limit[..., direction:direction + 1, :]
        if np.isnan(limit).all():
            fail("worst", "every pose failed", f"the first because: {next(iter(self.failures.values()), '')}")
        *place, way, at = (int(i) for i in np.unravel_index(int(np.nanargmin(limit)), limit.shape))
        way = way if direction is None else direction
        index = (*place, way, at)
        return WorstCut(self.pose(place), float(self.feed_angles[way]), float(self.speeds[at]), float(self.limit[index]),
                        float(self.frequency[index]))

    def __repr__(self) -> str:
        grid = " x ".join(f"{name} {len(v)}" for name, v in self.axes.items())
        return (f"ChatterGrid({grid}, {self.feed_angles.size} feed directions, {self.speeds.size} speeds, "
                f"{len(self.failures)} failed)")


@dataclass(frozen=True)
class _Charts:
    """Charts of all feed directions at the poses of a chain, each warm from the one before; values have one row a pose."""

    machine: Machine
    names: tuple[str, ...]
    speeds: tuple[float, ...]
    feed_angles: tuple[float, ...]
    cut: CuttingDescription
    method: StabilityMethod | None

    @property
    def identity(self) -> str:
        """What tells this study from another one on the same grid."""
        return repr((self.machine.description, self.speeds, self.feed_angles, self.cut, str(self.method)))

    def __call__(self, chain: Sequence[Sequence[float]]) -> dict[str, Any]:
        poses = [dict(zip(self.names, position, strict=True)) for position in chain]
        found = chatter_map(self.machine, poses, np.array(self.speeds), np.array(self.feed_angles), self.cut, self.method,
                            chain=len(poses)).charts
        empty = np.full(len(self.speeds), np.nan)
        reasons = np.full((len(poses), len(self.feed_angles)), "", object)
        for at, way, reason in found.failures:
            reasons[at, way] = reason
        notes = ["\n".join(dict.fromkeys(note for c in row if c is not None for note in c.notes)) for row in found.charts]
        return {"limit": found.limit,
                "frequency": np.array([[empty if c is None else _chatter(c) for c in row] for row in found.charts]),
                "depth_max": np.full(len(poses), found.depth_max), "reasons": reasons.astype(str), "notes": np.array(notes)}


def _chatter(chart: StabilityChart) -> FloatArray:
    """Chatter frequency at the limit of every speed, not a number where there is no limit."""
    at = chart.limit_points()
    values = np.full(at.size, np.nan)
    values[at >= 0] = chart.frequency[at[at >= 0]]
    return values


def chatter_grid(
    machine: Machine, axes: Mapping[str, ArrayLike], cut: CuttingDescription | None = None, speeds: ArrayLike | None = None,
    feed_angles: ArrayLike = (0.0,), method: StabilityMethod | None = None, engine: Engine | None = None,
    folder: str | Path | None = None, progress: Progress | None = None,
) -> ChatterGrid:
    """Return the stable depths of a cut over all combinations of axis positions, and over feed directions.

    Parameters
    ----------
    machine : Machine
        Names its tool point, and the cut unless `cut` is given.
    axes : mapping of axis name to positions
        m or rad; axes left out stand at zero.
    cut : CuttingDescription, optional
    speeds : (n_speeds,) floats, optional
        rev/min; 60 over the range of the cut where left out.
    feed_angles : (n_directions,) floats
        rad from x towards y.
    method : stability method, optional
        Chosen to suit the cut where left out; `ZeroOrder` is quicker by far and says its usual error.
    engine, folder, progress
        See `execute.execute`; a point of the study is a chain of neighbouring poses, `progress` counts poses.
    """
    used = cut or machine.description.cutting
    if used is None:
        fail("cut", "none", "must be given, here or as 'cutting' in the machine file")
    if not axes:
        fail("axes", "none", "must be at least one axis with its positions")
    grid = {name: np.atleast_1d(floats(f"axes[{name!r}]", v)) for name, v in axes.items()}
    for name, values in grid.items():
        machine.chain.positions({name: float(values.min())})
        machine.chain.positions({name: float(values.max())})
    n = floats("speeds", np.linspace(*used.speeds, 60) if speeds is None else np.atleast_1d(speeds))
    angles = floats("feed_angles", np.atleast_1d(feed_angles))
    function = _Charts(machine, tuple(grid), tuple(map(float, n)), tuple(map(float, angles)), used, method)
    outcomes = _chained(function, list(grid.values()), engine, None if folder is None else Path(folder), progress)
    return _gathered(outcomes, grid, angles, n, used)


def _chained(function: _Charts, grid: Sequence[FloatArray], engine: Engine | None, folder: Path | None,
             progress: Progress | None) -> list[Outcome]:
    """The outcome of every pose, in the order of the grid."""
    shape = tuple(len(v) for v in grid)
    order = _snake(shape)
    length = min(CHAIN, -(-len(order) // CHAINS))
    chains = [order[i:i + length] for i in range(0, len(order), length)]

    def run(parts: Sequence[Sequence[tuple[int, ...]]], place: Path | None, before: int) -> dict[tuple[int, ...], Outcome]:
        total = sum(map(len, parts))
        told = (lambda done, every: progress(before + total * done // every, len(order))) if progress else None
        points = [[[float(v[i]) for v, i in zip(grid, index)] for index in part] for part in parts]
        found = execute(function, points, engine, place, told).outcomes
        return {index: _one(outcome, row) for part, outcome in zip(parts, found) for row, index in enumerate(part)}

    outcomes = run(chains, folder, 0)
    broken = [[index] for part in chains if len(part) > 1 and outcomes[part[0]].values is None for index in part]
    if broken:
        outcomes |= run(broken, folder and folder / "alone", len(order) - len(broken))
    return [outcomes[index] for index in itertools.product(*map(range, shape))]


def _snake(shape: tuple[int, ...]) -> list[tuple[int, ...]]:
    """Indices of a grid in an order in which each is a neighbour of the last."""
    if not shape:
        return [()]
    inner = _snake(shape[1:])
    return [(i, *rest) for i in range(shape[0]) for rest in (inner[::-1] if i % 2 else inner)]


def _one(outcome: Outcome, row: int) -> Outcome:
    """The outcome of one pose of a chain."""
    return outcome if outcome.values is None else Outcome({name: value[row] for name, value in outcome.values.items()})


def _gathered(outcomes: Sequence[Outcome], grid: Mapping[str, FloatArray], angles: FloatArray, speeds: FloatArray,
              cut: CuttingDescription) -> ChatterGrid:
    shape = tuple(len(v) for v in grid.values())
    lost = np.full((angles.size, speeds.size), np.nan)
    limit, frequency, depth, failures = list[Array](), list[Array](), list[float](), dict[tuple[int, ...], str]()
    notes: dict[str, None] = {}
    for number, outcome in enumerate(outcomes):
        place = tuple(int(k) for k in np.unravel_index(number, shape))
        values = outcome.values
        limit.append(lost if values is None else values["limit"])
        frequency.append(lost if values is None else values["frequency"])
        depth.append(np.nan if values is None else float(values["depth_max"]))
        reasons = [outcome.failure] * angles.size if values is None else map(str, values["reasons"])
        failures |= {(*place, way): reason for way, reason in enumerate(reasons) if reason}
        notes |= {} if values is None else dict.fromkeys(note for note in str(values["notes"]).split("\n") if note)
    full = (*shape, angles.size, speeds.size)
    return ChatterGrid(grid, angles, speeds, np.array(limit).reshape(full), np.array(frequency).reshape(full),
                       np.array(depth).reshape(shape), cut, failures, tuple(notes))
