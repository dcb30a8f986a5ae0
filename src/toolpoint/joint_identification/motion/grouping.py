r"""Groups of points that move together: rigid clusters found from the shapes alone.

From every point and its neighbours a rigid motion is fitted in all modes, points that it predicts within their noise are
taken in step by step, the largest set wins, and the search goes on with the rest (consensus: Fischler, Bolles, Comm. ACM
24 (1981) 381). A point that the motions of two clusters explain is undecided: near a joint both move alike.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, fields
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats
from scipy.spatial import cKDTree

from toolpoint._check import BoolArray, FloatArray, IndexArray, ToolpointWarning, fail, positive
from toolpoint._deprecation import rename_argument
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint.joint_identification.motion.measured import Point, columns, find_positions
from toolpoint.spatial import transform as tf
from toolpoint.vibration import Modes

MIN_GROUPED_FRACTION = 0.9  # of the points in clusters, from which a grouping is one
MAX_NOISE_FACTOR = 25.0  # of the variance over the stated one: beyond, parts that move apart may count as one
_NOISE_STEP = 2.0  # of the variance, from one try to the next
_DRAWN_SEEDS = 60  # sets of neighbours tried around a point


@dataclass(frozen=True, eq=False)
class Grouping(NotebookText):
    """Clusters that move as rigid bodies in all modes.

    `components` maps ``part 1``, ``part 2`` ... (the one that moves least first) to their points; `undecided` maps points
    to all clusters that explain them (they are counted to the one that does it best); `left_out` are explained by none.

    >>> Grouping({"part 1": (1, 2, 3), "part 2": (4, 5)}, {}, (9,))
    Grouping(part 1: 3, part 2: 2 points; 0 undecided, 1 left out)
    """

    components: Mapping[str, tuple[Point, ...]]
    undecided: Mapping[Point, tuple[str, ...]]
    left_out: tuple[Point, ...]
    doubts: tuple[Doubt, ...] = ()

    def __repr__(self) -> str:
        sizes = ", ".join(f"{name}: {len(points)}" for name, points in self.components.items())
        return f"Grouping({sizes} points; {len(self.undecided)} undecided, {len(self.left_out)} left out)"


@dataclass(frozen=True, eq=False)
class _PointMotions:
    """Rows (p, 3, 6), values and weights (p, 3, k), normal matrices (p, k, 6, 6), right sides (p, k, 6) of all points."""

    at: FloatArray
    rows: FloatArray
    values: FloatArray
    weights: FloatArray
    normal: FloatArray
    right: FloatArray
    count: FloatArray

    def selected(self, members: IndexArray) -> _PointMotions:
        """Return the same of some points."""
        return _PointMotions(*(getattr(self, part.name)[members] for part in fields(self)))


@rename_argument("least", "min_points", since="0.2")
def group_points(modes: Modes, points: Mapping[Point, ArrayLike], noise: float | None = None, *, min_points: int = 5,
            significance: float = 1e-3) -> Grouping:
    """Return the rigid clusters of the measured points.

    Parameters
    ----------
    modes : Modes
        With `shape_variance`, unless `noise` is given.
    points : map from point to (3,) floats
        Positions, m.
    noise : float, optional
        Standard deviation of all shape entries as share of the rms of their mode.
    min_points : int
        Fewest points of a cluster (4 or more).
    significance : float
        Probability that noise alone makes any of all points be refused by its own part.

    Warns
    -----
    ToolpointWarning
        Where points stay undecided or left out, and where shapes scatter far more than is stated.

    Examples
    --------
    Two plates side by side, of which the second turns about an axis between them:

    >>> import numpy as np
    >>> from toolpoint.vibration import Modes
    >>> rng = np.random.default_rng(1)
    >>> places = rng.uniform(0, 1, (12, 3)) + np.repeat([[0, 0, 0], [2, 0, 0]], 6, axis=0)
    >>> move, turn, angle = rng.standard_normal((3, 3)), rng.standard_normal((3, 3)), np.array([1.0, -2.0, 0.5])
    >>> motion = move[:, None] + np.cross(turn[:, None], places)
    >>> motion[:, 6:] += angle[:, None, None] * np.cross([0, 0, 1], places[6:] - [1.5, 0.2, 0])
    >>> dofs = [f"{point}:+{way}" for point in range(12) for way in "xyz"]
    >>> modes = Modes([50.0, 80.0, 120.0], 0.02, motion.reshape(3, -1).T, dofs)
    >>> sorted(group_points(modes, dict(enumerate(places)), noise=1e-3).components.values())
    [(0, 1, 2, 3, 4, 5), (6, 7, 8, 9, 10, 11)]
    """
    if min_points < 4:
        fail("min_points", str(min_points), "must be at least 4", remedy="three points always move almost rigidly")
    names = [name for name in dict.fromkeys(dof.point for dof in modes.dofs) if name in points]
    if len(names) < 2 * min_points:
        fail("points", f"{len(names)} measured points", f"must be at least {2 * min_points} to be grouped")
    data = _prepare_motions(modes, points, names, noise)
    seeds = _seeds(data, min_points)
    limit = np.array([stats.chi2.isf(significance / len(names), freedom) for freedom in data.count])
    clusters, factor = _clusters(data, seeds, limit, min_points), 1.0
    if not _explain_most(clusters, len(names)):
        # Neighbours belong to several bodies, or shapes scatter more than is stated. The least noise that explains most points
        # is taken: a larger one would make one part of what moves apart.
        largest, seeds = _noise_factor(data, seeds), [*_consensus_seeds(data, min_points), *seeds]
        for factor in (*_NOISE_STEP ** np.arange(np.log(largest) / np.log(_NOISE_STEP)), largest):
            clusters = _clusters(data, seeds, factor * limit, min_points)
            if _explain_most(clusters, len(names)):
                break
    if not clusters:
        fail("modes", "no rigid cluster", f"must have some of at least {min_points} points",
             remedy="group the points by hand, or give the noise that the shapes have")
    return _result(data, clusters, factor * limit, names, modes.count, factor=float(factor))


def _prepare_motions(modes: Modes, points: Mapping[Point, ArrayLike], names: list[Point], noise: float | None) -> _PointMotions:
    """Return the rows, values and weights of all points."""
    positions = find_positions(points, names)
    local = (positions - positions.mean(axis=0)) / np.sqrt(((positions - positions.mean(axis=0)) ** 2).sum(axis=1).mean())
    values = columns(modes.shape)
    if noise is not None:
        spread = np.broadcast_to(positive("noise", noise) * np.sqrt((values**2).mean(axis=0)), values.shape)
    elif modes.shape_variance is not None:
        half = 0.5 if np.iscomplexobj(modes.shape) else 1.0
        spread = np.sqrt(half * np.tile(modes.shape_variance, (1, values.shape[1] // modes.count)))
    else:
        fail("noise", "none", "must be given for modes without shape_variance", remedy="give it as share of the rms, e.g. 0.02")
    index_of = {name: i for i, name in enumerate(names)}
    rows, values_by_point = np.zeros((len(names), 3, 6)), np.zeros((len(names), 3, values.shape[1]))
    weights, used = np.zeros_like(values_by_point), np.zeros(len(names), int)
    for i, dof in enumerate(modes.dofs):
        p = index_of.get(dof.point)
        if p is None or dof.is_rotation or used[p] == 3:
            continue
        rows[p, used[p]] = dof.unit[:3] @ tf.point_velocity(local[p])
        values_by_point[p, used[p]], weights[p, used[p]] = values[i], 1 / spread[i] ** 2
        used[p] += 1
    normal = np.einsum("pri,prk,prj->pkij", rows, weights, rows)
    right = np.einsum("pri,prk,prk->pki", rows, weights, values_by_point)
    return _PointMotions(local, rows, values_by_point, weights, normal, right, used * values.shape[1])


def _seeds(data: _PointMotions, min_points: int) -> list[IndexArray]:
    """Return the neighbourhoods that determine a rigid motion."""
    seeds = []
    _, neighbours = cKDTree(data.at).query(data.at, k=min_points)
    for members in np.asarray(neighbours):
        if _is_seed(data, members):
            seeds.append(members)
    if not seeds:
        fail("points", "no neighbourhood that spans a plane", "must have points off one line")
    return seeds


def _explain_most(clusters: list[IndexArray], count: int) -> bool:
    """Whether nearly all points belong to a cluster."""
    return sum(map(len, clusters)) >= MIN_GROUPED_FRACTION * count


def _consensus_seeds(data: _PointMotions, min_points: int) -> list[IndexArray]:
    """Return the set of four points about each point that moves most as one: bodies may reach into each other."""
    rng = np.random.default_rng(0)
    _, neighbours = cKDTree(data.at).query(data.at, k=min(2 * min_points, len(data.at)))
    seeds = []
    for members in np.asarray(neighbours):
        others = list(combinations(members[1:], 3))
        drawn = rng.permutation(len(others))[:_DRAWN_SEEDS]
        sets = [np.array([members[0], *others[k]]) for k in drawn]
        misfit = [_misfit(data.selected(chosen), np.arange(4))[0].sum() if _is_seed(data, chosen) else np.inf
                  for chosen in sets]
        if np.isfinite(min(misfit)):
            seeds.append(sets[int(np.argmin(misfit))])
    return seeds


def _is_seed(data: _PointMotions, members: IndexArray) -> bool:
    """Whether points determine a rigid motion: they span a plane, and their directions all of it."""
    spread = np.linalg.svd(data.at[members] - data.at[members].mean(axis=0), compute_uv=False)
    # Points on a line leave the turn about it free: no body can grow from them.
    return bool(spread[1] > 0.05 * spread[0] and np.linalg.cond(data.normal[members].sum(axis=0)).max() < 1e10)


def _noise_factor(data: _PointMotions, seeds: list[IndexArray]) -> float:
    """Return the factor of the noise over its stated variance, from the better half of the neighbourhoods, at least 1."""
    ratio = []
    for members in seeds:
        chi2 = _misfit(data, members)[0][members].sum()
        ratio.append(chi2 / max(data.count[members].sum() - 6 * data.values.shape[2], 1))
    # A low quantile: points of other bodies have large misfits, and only those of this one tell its noise.
    return max(1.0, float(np.quantile(ratio, 0.3)))


def _misfit(data: _PointMotions, members: IndexArray) -> tuple[FloatArray, FloatArray]:
    """Return for every point (chi2 against the motion of the members, variance of the prediction over its own)."""
    normal = data.normal[members].sum(axis=0)
    spread = np.linalg.pinv(normal, rcond=1e-13, hermitian=True)
    twist = np.einsum("kij,kj->ki", spread, data.right[members].sum(axis=0))
    error = data.values - np.einsum("pri,ki->prk", data.rows, twist)
    extra = np.einsum("pri,kij,prj->prk", data.rows, spread, data.rows) * data.weights
    inside = np.zeros(len(data.at), bool)
    inside[members] = True
    widened = np.where(inside[:, None, None], 1.0, 1 + extra)
    return (error**2 * data.weights / widened).sum(axis=(1, 2)), extra.max(axis=(1, 2))


def _grow_cluster(data: _PointMotions, seed: IndexArray, limit: FloatArray, free: BoolArray) -> IndexArray:
    """Return the points that move with a seed: step by step those predicted well enough to be tested."""
    members = np.asarray(seed)
    for _ in range(60):
        chi2, extra = _misfit(data, members)
        ready = (extra <= 3.0) | np.isin(np.arange(len(chi2)), members)
        if not (ready & ~np.isin(np.arange(len(chi2)), members)).any():
            ready = extra <= np.partition(extra, min(len(members) + 3, len(extra) - 1))[min(len(members) + 3, len(extra) - 1)]
        fitting = np.flatnonzero(free & ready & (chi2 < limit))
        if len(fitting) < 4:
            return fitting[:0]
        if np.array_equal(fitting, np.sort(members)):
            break
        members = fitting
    return np.sort(members)


def _clusters(data: _PointMotions, seeds: list[IndexArray], limit: FloatArray, min_points: int) -> list[IndexArray]:
    """Return the clusters, the largest first, each grown from the best seed among the points left."""
    free, clusters = np.ones(len(data.at), bool), []
    while free.sum() >= min_points:
        best = np.zeros(0, int)
        covered = np.zeros(len(data.at), bool)
        for seed in seeds:
            # A seed inside a set already grown would grow the same set again.
            if not free[seed].all() or covered[seed].all():
                continue
            grown = _grow_cluster(data, seed, limit, free)
            covered[grown] = True
            if len(grown) > len(best):
                best = grown
        if len(best) < min_points:
            break
        clusters.append(best)
        free[best] = False
    return clusters


def _result(data: _PointMotions, clusters: list[IndexArray], limit: FloatArray, names: list[Point], count: int, *,
            factor: float) -> Grouping:
    """Return the grouping, with doubts about points of several clusters or of none."""
    size = [float(np.sqrt((data.values[members] ** 2).mean())) for members in clusters]
    clusters = [clusters[i] for i in np.argsort(size)]
    labels = [f"part {i + 1}" for i in range(len(clusters))]
    chi2 = np.stack([_misfit(data, members)[0] for members in clusters])
    best, fits = chi2.argmin(axis=0), chi2 < limit
    components: dict[str, tuple[Point, ...]] = {
        label: tuple(names[p] for p in np.flatnonzero((best == i) & fits.any(axis=0))) for i, label in enumerate(labels)}
    undecided = {names[p]: tuple(labels[i] for i in np.flatnonzero(fits[:, p])) for p in np.flatnonzero(fits.sum(axis=0) > 1)}
    left = tuple(names[p] for p in np.flatnonzero(~fits.any(axis=0)))
    doubts = list[Doubt]()
    if undecided:
        doubts.append(Doubt(f"points {list(undecided)[:8]}", "move with more than one part", "decide by the drawing"))
    if left:
        doubts.append(Doubt(f"points {list(left)[:8]}", "move with no part: faulty channels or a bending component"))
    if factor > MAX_NOISE_FACTOR:
        doubts.append(Doubt("noise", f"neighbouring points scatter {np.sqrt(factor):.2g} times the stated noise about one "
                            "rigid motion, and so much is allowed: parts that move apart may count as one",
                            "group the points by hand, or give the noise that the shapes have", figure=float(factor)))
    if len(clusters) > 1 and count < 3:
        doubts.append(Doubt(f"{count} mode(s) only", "parts that move alike in them count as one"))
    if doubts:
        warnings.warn("grouping: " + "; ".join(doubts), ToolpointWarning, stacklevel=3)
    return Grouping({label: points for label, points in components.items() if points}, undecided, left, tuple(doubts))
