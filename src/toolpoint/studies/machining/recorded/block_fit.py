r"""Coefficient of the material from the means of a record over blocks, with its interval, and the blocks that do not fit.

The mean of a block is :math:`y_j = c_{s(j)} + q_t P_{t,j} + q_e P_{e,j} + d_j P_j + e_j`: the idle load c at each spindle
speed, the factors q on the shearing and edge parts, a share d_j of standard deviation tau by which the block itself differs,
and noise. tau is found from the misfit (restricted likelihood): the interval widens where blocks scatter more than the noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import norm, t

from toolpoint._check import FloatArray
from toolpoint.studies.machining.recorded.spindle_load import SpindleLoad

EDGE_PRIOR_DEVIATION = 0.5  # of the edge coefficients: as uncertain as those of a table are
MIN_WINDOW_SAMPLES = 8  # of a mean; shorter blocks are taken together
MAX_WINDOWS = 20_000
MAX_BLOCK_SCATTER = 1.0  # of tau: blocks that scatter by their whole load are not described at all
MIN_UNEXPECTED_RATIO = 0.1  # of the computed load, below which a difference is not named
UNEXPECTED_PROBABILITY = 0.01  # that a block of a good record is named, over all of them
_MAX_REFITS = 4  # without the blocks that do not fit
_TIMING_STEPS = 0.5  # time steps by which the place of a window is uncertain
_INTERVAL_PROBABILITY = 0.975  # below the upper end of a 95 % interval
_LINE_PARAMETERS = 2  # of the line that is taken off a window before its noise is judged


@dataclass(frozen=True, eq=False)
class RecordWindows:
    """Means of a record over pieces of blocks, (n,) each.

    block : segment index; measured, shearing, edges : means, of one unit; speed : rev/min; deviation : of the mean's noise.
    """

    block: np.ndarray
    measured: FloatArray
    shearing: FloatArray
    edges: FloatArray
    speed: FloatArray
    deviation: FloatArray

    @property
    def load(self) -> FloatArray:
        """Computed load."""
        return self.shearing + self.edges


@dataclass(frozen=True, eq=False)
class CoefficientFit:
    """Factor on K_t with its 95 % half width; edge factor; scatter tau; scores (n,) and expected means (n,) of the windows."""

    factor: float
    half_width: float
    edge_factor: float
    scatter: float
    expected: FloatArray
    score: FloatArray
    is_unexpected: np.ndarray
    degrees: int


def gather_windows(load: SpindleLoad, course: FloatArray, values: FloatArray, *, guard: float, pace: float) -> RecordWindows:
    """Return the means of a record over its blocks, by the time of the program at every sample (n,), s.

    guard : s at both ends of a block that are left out where it is long enough: alignment is not exact there; pace : of the
    program in the record: at an override the chips are thinner, and shearing takes less.
    """
    index = np.rint(course / load.step).astype(int)
    inside = (index >= 0) & (index < load.block.size)
    index, kept = index[inside], values[inside]
    ends = np.flatnonzero(np.diff(load.block[index])) + 1
    edges = np.concatenate([[0], ends, [index.size]])
    step = float(np.median(np.diff(course))) if course.size > 1 else load.step
    trim = int(np.ceil(guard / max(step, 1e-12)))
    rows, residuals = list[tuple[int, int, int]](), list[FloatArray]()
    for first, last in _pieces(edges):
        a, b = (first + trim, last - trim) if last - first > 4 * trim + MIN_WINDOW_SAMPLES else (first, last)
        rows.append((a, b, int(load.block[index[(a + b) // 2]])))
        model = load.total[index[a:b]]
        shape = np.stack([np.ones(b - a), model], axis=1)
        if b - a > MIN_WINDOW_SAMPLES // 2:
            residuals.append(kept[a:b] - shape @ np.linalg.lstsq(shape, kept[a:b], rcond=None)[0])
    sigma, memory = _noise(residuals)
    mean = [np.array([x[a:b].mean() for a, b, _ in rows])
            for x in (kept, load.shearing[index], load.edges[index], load.speed[index])]
    count = np.array([b - a for a, b, _ in rows])
    deviation = sigma * np.sqrt((1 + memory) / (1 - memory) / np.maximum(count, 1))
    # A window that lies off by a moment gains at one end what it loses at the other.
    ends = np.array([load.total[index[b - 1]] - load.total[index[a]] for a, b, _ in rows])
    misplaced = _TIMING_STEPS * load.step * ends / (np.maximum(count, 1) * max(step, 1e-12))
    return RecordWindows(np.array([row[2] for row in rows]), mean[0], pace * mean[1], mean[2], mean[3],
                         np.maximum(np.hypot(deviation, misplaced), 1e-12))


def _pieces(edges: np.ndarray) -> list[tuple[int, int]]:
    """Return spans of samples: blocks, short ones together."""
    pieces, first = list[tuple[int, int]](), int(edges[0])
    shortest = max(MIN_WINDOW_SAMPLES, int(edges[-1]) // MAX_WINDOWS)
    for last in edges[1:].tolist():
        if last - first >= shortest:
            pieces.append((first, last))
            first = last
    return pieces


def _noise(residuals: Sequence[FloatArray]) -> tuple[float, float]:
    """Return standard deviation and correlation from sample to sample of the noise within blocks."""
    if not residuals:
        return 0.0, 0.0
    squares, free = sum(float(r @ r) for r in residuals), sum(r.size - _LINE_PARAMETERS for r in residuals)
    lagged = sum(float(r[1:] @ r[:-1]) for r in residuals)
    memory = lagged / squares * free / sum(r.size - _LINE_PARAMETERS - 1 for r in residuals) if squares > 0 else 0.0
    # Short windows tell too little of a memory: its bias is -(1 + 3 memory)/n, and a line is taken off as well.
    length = free / len(residuals)
    memory = float(np.clip((memory + 1 / length) / (1 - 3 / length) if length > 6 else memory, 0.0, 0.98))
    return float(np.sqrt(squares / max(free, 1))), memory


def fit_coefficient(windows: RecordWindows, *, with_gain: bool = True) -> CoefficientFit:
    """Return the factor on K_t and the windows that do not fit; these are left out of the factor.

    with_gain : False where the record's unit is not that of the load: one factor on both parts, which says nothing of K_t.
    """
    kept = np.ones(windows.block.size, bool)
    fit = None
    for turn in range(_MAX_REFITS):
        fit = _fit(windows, kept, with_gain=with_gain, is_first=turn == 0)
        fresh = ~fit.is_unexpected
        if (fresh == kept).all() or fresh.sum() < 4:
            break
        kept = fresh
    assert fit is not None
    return fit


def _design(windows: RecordWindows, *, with_gain: bool) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return columns, means and precisions of the priors: idle loads of the speeds, shearing, edges (or both together)."""
    speeds = np.unique(np.rint(windows.speed))
    idle = (np.rint(windows.speed)[:, None] == speeds).astype(float) if speeds.size <= 6 else \
        np.stack([np.ones(windows.speed.size), windows.speed / windows.speed.max()], axis=1)
    loads = np.stack([windows.shearing, windows.edges], axis=1) if with_gain else windows.load[:, None]
    columns = np.concatenate([idle, loads], axis=1)
    mean, precision = np.zeros(columns.shape[1]), np.zeros(columns.shape[1])
    if with_gain:
        mean[-1], precision[-1] = 1.0, EDGE_PRIOR_DEVIATION**-2
    return columns, mean, precision


def _fit(windows: RecordWindows, kept: np.ndarray, *, with_gain: bool, is_first: bool) -> CoefficientFit:
    """Return the factor by the kept windows, and the scores of all."""
    columns, mean, precision = _design(windows, with_gain=with_gain)
    gain = 1.0
    for _ in range(2):  # the scatter is a share of the load as recorded
        scale = np.abs(windows.load) * gain

        def deviance(log_scatter: float, scale: FloatArray = scale) -> float:
            return _solve(windows, columns, kept, mean=mean, precision=precision, spread=np.exp(log_scatter) * scale)[2]

        search = minimize_scalar(deviance, bounds=(np.log(1e-4), np.log(MAX_BLOCK_SCATTER)), method="bounded")
        scatter = float(np.exp(search.x))
        beta, covariance, _ = _solve(windows, columns, kept, mean=mean, precision=precision, spread=scatter * scale)
        gain = abs(float(beta[-2] if with_gain else beta[-1]))
    expected = columns @ beta
    spread = np.sqrt(windows.deviation**2 + (scatter * scale)**2 + np.einsum("ij,jk,ik->i", columns, covariance, columns))
    score = (windows.measured - expected) / spread
    # At first the blocks that are looked for widen the scatter; the median does not follow them. Later they are left out.
    active = windows.load > 0.02 * windows.load.max(initial=1e-300)
    robust = float(np.median(np.abs(score[active]))) / 0.6745 if active.sum() > 4 else 1.0
    limit = float(norm.isf(UNEXPECTED_PROBABILITY / 2 / max(score.size, 1)))
    limit *= min(max(robust, 0.2), 1.0) if is_first else 1.0
    large = np.abs(windows.measured - expected) > MIN_UNEXPECTED_RATIO * np.maximum(gain * windows.load,
                                                                                   0.1 * gain * windows.load.max(initial=0.0))
    degrees = max(int((kept & active).sum()) - 2, 1)
    place = -2 if with_gain else -1
    half = float(t.ppf(_INTERVAL_PROBABILITY, degrees)) * float(np.sqrt(covariance[place, place]))
    return CoefficientFit(float(beta[place]), half, float(beta[-1]) if with_gain else float("nan"), scatter, expected, score,
                          (np.abs(score) > limit) & large, degrees)


def _solve(windows: RecordWindows, columns: FloatArray, kept: np.ndarray, *, mean: FloatArray, precision: FloatArray,
           spread: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return the factors, their covariance, and minus twice the restricted log likelihood at a scatter (n,)."""
    variance = (windows.deviation**2 + spread**2)[kept]
    x, y = columns[kept], windows.measured[kept]
    normal = (x / variance[:, None]).T @ x + np.diag(precision)
    covariance = np.linalg.pinv(normal, hermitian=True)
    beta = covariance @ (x.T @ (y / variance) + precision * mean)
    misfit = float(((y - x @ beta) ** 2 / variance).sum() + (precision * (beta - mean) ** 2).sum())
    eigenvalues = np.linalg.eigvalsh(normal / np.sqrt(np.outer(np.diag(normal), np.diag(normal)).clip(1e-300)))
    determinant = float(np.log(np.maximum(eigenvalues, 1e-12)).sum() + np.log(np.diag(normal).clip(1e-300)).sum())
    return beta, covariance, misfit + float(np.log(variance).sum()) + determinant
