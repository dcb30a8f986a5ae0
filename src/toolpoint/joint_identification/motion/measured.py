"""The measured motion of one component: rows of the mode shapes, their places and directions, their variance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import Array, FloatArray, fail, floats
from toolpoint._notebook import NotebookText
from toolpoint.spatial import transform as tf
from toolpoint.vibration import Modes

Point = str | int
# Least standard deviation of a displacement, of the rms motion of its component in the mode, or of a thousandth of that in the
# mode where it moves most: no test is better, and with less the normal equations of exact shapes are singular by rounding.
MIN_NOISE_RATIO, MIN_MODE_SIZE_RATIO = 1e-6, 1e-3
MIN_RIGID_SINGULAR_RATIO = 1e-3  # least over largest singular value of the displacements by the six motions


@dataclass(frozen=True, eq=False)
class Component(NotebookText):
    """Points that move together.

    Parameters
    ----------
    name : str
    points : tuple
        Names of the points.
    at : (n_points, 3) floats
        Their positions, m.
    rows : (n_rows, 6) floats
        Map from a twist (v, w) about the origin to the measured displacements.
    places : (n_rows, 3), ways : (n_rows, 3) floats
        Position (m) and unit direction of every measured displacement.
    owner : (n_rows,) ints
        Index of the point of every measured displacement.
    values : (n_rows, n_columns) floats
        Shapes; complex shapes as their real parts followed by their imaginary parts.
    variance : (n_rows, n_columns) floats or None
        Of the values.
    """

    name: str
    points: tuple[Point, ...]
    at: FloatArray
    rows: FloatArray
    places: FloatArray
    ways: FloatArray
    owner: FloatArray
    values: FloatArray
    variance: FloatArray | None

    @property
    def centre(self) -> FloatArray:
        """Mean of the points, m."""
        return self.at.mean(axis=0)

    @property
    def size(self) -> float:
        """Root-mean-square distance of the points from their centre, m."""
        return float(np.sqrt(((self.at - self.centre) ** 2).sum(axis=1).mean()))

    @property
    def motion(self) -> FloatArray:
        """Root-mean-square displacement of every column, shape (n_columns,)."""
        return np.sqrt((self.values**2).mean(axis=0))

    @property
    def min_variance(self) -> FloatArray:
        """Least variance of the displacements of every column, shape (n_columns,)."""
        motion = self.motion
        return np.asarray((MIN_NOISE_RATIO * np.maximum(motion, MIN_MODE_SIZE_RATIO * motion.max(initial=0.0))) ** 2)

    def __repr__(self) -> str:
        return f"Component({self.name!r}, {len(self.points)} points, {len(self.rows)} displacements)"


def find_positions(points: Mapping[Point, ArrayLike], labels: Sequence[Point]) -> FloatArray:
    """Return the positions (n, 3) of points, m; an unknown point is an error."""
    without_position = [name for name in labels if name not in points]
    if without_position:
        fail("points", f"no position for {without_position[:5]}", "must have a position for every point of a component")
    return floats("points", np.array([np.asarray(points[name], float) for name in labels]).reshape(-1, 3), (None, 3))


def columns(shape: Array) -> FloatArray:
    """Return real columns: a complex shape as its real parts followed by its imaginary parts."""
    return np.concatenate([shape.real, shape.imag], axis=1) if np.iscomplexobj(shape) else np.asarray(shape, float)


def about(centre: FloatArray, size: float) -> FloatArray:
    """Return the map from (velocity at the centre, size times rotation) to the twist about the origin."""
    x, y, z = centre / size
    result = np.eye(6)
    # v about the origin is v at the centre plus centre x w.
    result[:3, 3:] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    result[3:, 3:] /= size
    return result


def component(name: str, modes: Modes, points: Mapping[Point, ArrayLike], *, labels: Sequence[Point]) -> Component:
    """Return the measured motion of the points `labels`, after checking that it determines a rigid motion.

    Raises
    ------
    ToolpointError
        For fewer than three points, points on one line, or directions that leave a motion unseen.
    """
    if modes.frequency.ndim > 1:
        fail("modes", f"{modes.frequency.shape[0]} poses", "must be one pose", remedy="use at_pose(i)")
    positions = find_positions(points, labels)
    _check_points(name, labels, positions)
    index_of = {point: i for i, point in enumerate(labels)}
    kept = [i for i, dof in enumerate(modes.dofs) if dof.point in index_of and not dof.is_rotation]
    owner = np.array([index_of[modes.dofs[i].point] for i in kept], int)
    places = positions[owner].reshape(-1, 3)
    ways = np.array([modes.dofs[i].unit[:3] for i in kept]).reshape(-1, 3)
    rows = np.einsum("ni,nij->nj", ways, tf.point_velocity(places))
    _check_rows(name, rows, ways, places, positions)
    shape = modes.shape[kept]
    variance = None
    if modes.shape_variance is not None:
        real_fraction = 0.5 if np.iscomplexobj(shape) else 1.0
        spread = modes.shape_variance[kept] * real_fraction
        variance = np.concatenate([spread, spread], axis=1) if np.iscomplexobj(shape) else spread
        if (variance <= 0).any():
            fail("modes.shape_variance", "a value of zero", "must be above zero", remedy="leave it out if it is not known")
    part = Component(name, tuple(labels), positions, rows, places, ways, owner, columns(shape), variance)
    return part if variance is None else replace(part, variance=np.maximum(variance, part.min_variance))


def _check_points(name: str, labels: Sequence[Point], positions: FloatArray) -> None:
    """Refuse repeated points, fewer than three, and points on one line."""
    if len(set(labels)) != len(labels):
        fail(f"components[{name!r}]", "a point appears twice", "points must differ")
    if len(labels) < 3:
        fail(f"components[{name!r}]", f"{len(labels)} points", "must have at least 3 points not on one line",
             remedy="measure more points on it, or make it part of its neighbour")
    singular = np.linalg.svd(positions - positions.mean(axis=0), compute_uv=False)
    if singular[1] <= 1e-3 * singular[0]:
        fail(f"components[{name!r}]", "its points are on one line (within 0.1 % of its length)", "must span a plane",
             remedy="a rotation about that line cannot be seen; add a point off the line")


def determines_motion(ways: FloatArray, places: FloatArray, positions: FloatArray) -> bool:
    """Whether displacements along `ways` (n_rows, 3) at `places` (n_rows, 3) determine all six rigid motions of points
    (n_points, 3).
    """
    centre = positions.mean(axis=0)
    size = np.sqrt(((positions - centre) ** 2).sum(axis=1).mean())
    singular = np.linalg.svd(np.einsum("ni,nij->nj", ways, tf.point_velocity((places - centre) / size)), compute_uv=False)
    return len(ways) >= 6 and bool(singular[-1] > MIN_RIGID_SINGULAR_RATIO * singular[0])


def _check_rows(name: str, rows: FloatArray, ways: FloatArray, places: FloatArray, positions: FloatArray) -> None:
    """Refuse too few displacements, and directions that leave a motion undetermined."""
    if len(rows) < 7:
        fail(f"components[{name!r}]", f"{len(rows)} measured displacements", "must have at least 7",
             remedy="six tell the motion; only more can tell whether the component is rigid")
    if not determines_motion(ways, places, positions):
        fail(f"components[{name!r}]", "the measured directions leave a motion unseen", "must see all six",
             remedy="measure x, y and z at three points that are not on one line")
