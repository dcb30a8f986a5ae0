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
    """Rigid registration of one set of points onto another.

    Parameters
    ----------
    transform : (4, 4) floats
        Transform that carries the source onto the target.
    residual : float
        Root mean square of the weighted distances left, m.
    matches : (n,) ints
        Index of the target point of every source point.
    iterations : int
    status : str
        ``converged``, or what to try next.

    Examples
    --------
    Three points moved by 0.1 m along x:

    >>> points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> found = rigid(points, points + [0.1, 0, 0])
    >>> found.status, found.transform[:3, 3].round(9).tolist()
    ('converged', [0.1, 0.0, 0.0])
    """

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

    Notes
    -----
    R is the rotation nearest to the weighted covariance of both sets about their centroids (Kabsch).

    Examples
    --------
    >>> from toolpoint.spatial import rigid
    >>> source = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    >>> target = [[1, 0, 0], [1, 1, 0], [0, 0, 0]]  # a quarter turn about z, then 1 m along x
    >>> rigid(source, target).transform[:3, 3].round(9) + 0.0
    array([1., 0., 0.])
    """
    a, b = floats("source", source, (None, 3)), floats("target", target, (None, 3))
    if a.shape != b.shape or a.ndim != 2:
        fail("target", f"shape {b.shape}", f"must be that of source, {a.shape}")
    weight = np.ones(len(a)) if weights is None else nonnegative("weights", floats("weights", weights, (len(a),)))
    _check_spread(a, weight)
    total_weight = weight.sum()
    centre_a, centre_b = weight @ a / total_weight, weight @ b / total_weight
    rotation = nearest((b - centre_b).T @ (weight[:, None] * (a - centre_a)))
    matrix = tf.transform(rotation, centre_b - rotation @ centre_a)
    deviation = b - tf.move(matrix, a)
    residual = float(np.sqrt((weight * (deviation**2).sum(axis=1)).sum() / total_weight))
    return Registration(matrix, residual, np.arange(len(a)), 1, "converged")


def _check_spread(points: FloatArray, weights: FloatArray) -> None:
    """Refuse points of positive weight that are fewer than three, or collinear: one singular value alone is not zero."""
    used = points[weights > 0]
    if len(used) < 3:
        fail("source", f"{len(used)} points with weight", "must be at least 3")
    singular = np.linalg.svd(used - used.mean(axis=0), compute_uv=False)
    # The second value: one of three is zero for every plane of points, which determines a rotation all the same.
    if singular[1] <= 1e-9 * max(singular[0], 1e-300):
        fail("source", "points on one line", "must span a plane", remedy="add a point off the line")


def iterative_closest_point(
    source: ArrayLike, target: ArrayLike, start: FloatArray | None = None, *, iterations: int = 100, tolerance: float = 1e-10
) -> Registration:
    """Return the registration of points without known correspondence (ICP, nearest neighbours).

    Each iteration pairs every source point with its nearest target point and solves `rigid`: the residual never grows, so the
    end is the local optimum nearest to the start.

    Parameters
    ----------
    source, target : (n, 3), (m, 3) floats
        Points, m.
    start : (4, 4) floats, optional
        First transform; the identity where left out. It should be near.
    iterations : int
        Limit; `status` says where it was reached.
    tolerance : float
        Relative change of the residual at which the iteration stops.

    Examples
    --------
    >>> from toolpoint.spatial import iterative_closest_point
    >>> source = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> target = [[0.1, 0, 1], [0.1, 0, 0], [1.1, 0, 0], [0.1, 1, 0]]  # another order, 0.1 m along x
    >>> result = iterative_closest_point(source, target)
    >>> float(result.transform[0, 3].round(9)), result.matches.tolist()
    (0.1, [1, 2, 3, 0])
    """
    a, b = floats("source", source, (None, 3)), floats("target", target, (None, 3))
    tree, matrix = scipy.spatial.cKDTree(b), np.eye(4) if start is None else floats("start", start, (4, 4))
    previous = np.inf
    for iteration in range(1, count("iterations", iterations) + 1):
        distance, match = (np.asarray(fit) for fit in tree.query(tf.move(matrix, a)))
        fit = rigid(a, b[match])
        matrix = fit.transform
        if previous - fit.residual <= tolerance * max(previous if np.isfinite(previous) else 1.0, 1e-300):
            return Registration(matrix, fit.residual, match, iteration, "converged")
        previous = fit.residual
    # The distances of the last query, before its fit: what is left is no more than they say.
    return Registration(matrix, float(np.sqrt((distance**2).mean())), match, iterations,
                        f"not converged in {iterations} iterations: give a nearer start or more iterations")
