r"""Rigid registration: the rotation and translation that carry one set of points onto another, with weights.

Sources: Kabsch, Acta Cryst. A32 (1976); Umeyama, IEEE TPAMI 13 (1991); Besl, McKay, IEEE TPAMI 14 (1992) for ICP.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, count, fail, floats, nonnegative
from toolpoint._notebook import NotebookText
from toolpoint.spatial import transform as tf
from toolpoint.spatial.rotation import nearest


@dataclass(frozen=True, eq=False)
class Registration(NotebookText):
    """Result: `transform` (4, 4), root-mean-square `residual` (m, weighted), matched indices, iterations, status."""

    transform: FloatArray
    residual: float
    matches: np.ndarray
    iterations: int
    status: str

    def __repr__(self) -> str:
        return f"Registration(residual {self.residual:.3g} m, {self.iterations} iterations, {self.status})"


def rigid(source: ArrayLike, target: ArrayLike, weights: ArrayLike | None = None) -> Registration:
    """Return the transform with the least weighted squares of target - (R source + t).

    Parameters
    ----------
    source, target : (n, 3) floats
        Corresponding points, m.
    weights : (n,) floats, optional
        Not negative; 1 where left out.

    Raises
    ------
    ToolpointError
        For fewer than three points or points on one line: the rotation about that line is not determined.
    """
    a, b = floats("source", source, (None, 3)), floats("target", target, (None, 3))
    if a.shape != b.shape or a.ndim != 2:
        fail("target", f"shape {b.shape}", f"must be that of source, {a.shape}")
    w = np.ones(len(a)) if weights is None else nonnegative("weights", floats("weights", weights, (len(a),)))
    _spread(a, w)
    total = w.sum()
    centre_a, centre_b = w @ a / total, w @ b / total
    rotation = nearest((b - centre_b).T @ (w[:, None] * (a - centre_a)))
    matrix = tf.transform(rotation, centre_b - rotation @ centre_a)
    error = b - tf.move(matrix, a)
    residual = float(np.sqrt((w * (error**2).sum(axis=1)).sum() / total))
    return Registration(matrix, residual, np.arange(len(a)), 1, "converged")


def _spread(points: FloatArray, weights: FloatArray) -> None:
    used = points[weights > 0]
    if len(used) < 3:
        fail("source", f"{len(used)} points with weight", "must be at least 3")
    singular = np.linalg.svd(used - used.mean(axis=0), compute_uv=False)
    if singular[1] <= 1e-9 * max(singular[0], 1e-300):
        fail("source", "points on one line", "must span a plane", remedy="add a point off the line")


def iterative_closest_point(
    source: ArrayLike, target: ArrayLike, start: FloatArray | None = None, *, iterations: int = 100, tolerance: float = 1e-10
) -> Registration:
    """Return the registration of points without known correspondence (ICP, nearest neighbours).

    Converges to the nearest local optimum: `start` (4, 4) should be near. `tolerance` is the relative change of the
    residual at which it stops; `status` says when the limit of iterations was reached.
    """
    a, b = floats("source", source, (None, 3)), floats("target", target, (None, 3))
    tree, matrix = scipy.spatial.cKDTree(b), np.eye(4) if start is None else floats("start", start, (4, 4))
    last = np.inf
    for k in range(1, count("iterations", iterations) + 1):
        distance, match = (np.asarray(fit) for fit in tree.query(tf.move(matrix, a)))
        fit = rigid(a, b[match])
        matrix = fit.transform
        if last - fit.residual <= tolerance * max(last if np.isfinite(last) else 1.0, 1e-300):
            return Registration(matrix, fit.residual, match, k, "converged")
        last = fit.residual
    return Registration(matrix, float(np.sqrt((distance**2).mean())), match, iterations,
                        f"not converged in {iterations} iterations: give a nearer start or more iterations")
