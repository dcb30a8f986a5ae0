r"""Finite-rotation methods of the source: registration of rest and displaced points, the axis by perpendicular bisectors.

The shape is enlarged until it moves by a stated share of the component's size, the displaced points are registered with
the points at rest, the rotation matrix gives axis and angle (eqs. 7-10), and the axis lies where the perpendicular
bisectors of the displacements, projected on a plane normal to the axis, are densest (eqs. 11, 12).
Source: Machines 2022, 10(11), 1102. The enlargement is a choice that the source leaves open: a straight displacement is
no arc, so a large one falsifies the rotation (by its square) and a small one drowns nothing but round-off.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from toolpoint._check import FloatArray, fail, positive
from toolpoint._notebook import NotebookText
from toolpoint.joint_identification.motion.measured import Component
from toolpoint.spatial import transform as tf
from toolpoint.spatial.registration import iterative_closest_point, rigid
from toolpoint.spatial.rotation import to_vector


@dataclass(frozen=True)
class FiniteRotation:
    """Registration of matched points (Kabsch) at a finite displacement of `amplitude` times the component's size.

    >>> from toolpoint.joint_identification.motion.measured import component
    >>> from toolpoint.vibration import Modes
    >>> points = {1: (0.0, 0.0, 0.0), 2: (1.0, 0.0, 0.0), 3: (0.0, 1.0, 0.0)}
    >>> dofs = [f"{name}:+{axis}" for name in points for axis in "xyz"]
    >>> turn = [np.cross((0.0, 0.0, 1.0), place) for place in points.values()]  # about z, through the origin
    >>> part = component("head", Modes([50.0], [0.02], np.ravel(turn)[:, None], dofs), points, labels=list(points))
    >>> FiniteRotation(amplitude=1e-4).twists(part)[5].round(6).tolist()
    [1.0]
    """

    amplitude: float = 0.01

    def twists(self, part: Component) -> FloatArray:
        """Return the twists (6, n_columns) about the origin, in the unit of the shapes."""
        return _register_columns(part, self.amplitude, lambda a, b: rigid(a, b).transform)


@dataclass(frozen=True)
class ClosestPoint:
    """ICP: the displaced points are not matched to those at rest; needs displacements below half the point spacing."""

    amplitude: float = 0.01
    iterations: int = 200

    def twists(self, part: Component) -> FloatArray:
        """Return the twists (6, n_columns) about the origin, in the unit of the shapes."""
        return _register_columns(part, self.amplitude,
                                 lambda a, b: iterative_closest_point(a, b, iterations=self.iterations).transform)


def _register_columns(part: Component, amplitude: float,
                      register: Callable[[FloatArray, FloatArray], FloatArray]) -> FloatArray:
    positive("amplitude", amplitude, 1.0)
    displacement = displacements(part)
    result = np.zeros((6, displacement.shape[2]))
    for i in range(displacement.shape[2]):
        size = float(np.sqrt((displacement[:, :, i] ** 2).sum(axis=1).max()))
        if size > 0:
            gain = amplitude * part.size / size
            result[:, i] = tf.logarithm(register(part.at, part.at + gain * displacement[:, :, i])) / gain
    return result


def displacements(part: Component) -> FloatArray:
    """Return the displacement vector of every point in every column, (n_points, 3, n_columns); all three must be measured."""
    result = np.empty((len(part.points), 3, part.values.shape[1]))
    for i, position in enumerate(part.at):
        rows = np.flatnonzero((part.places == position).all(axis=1))
        ways = part.ways[rows]
        # A smallest singular value of 1e-3 multiplies the noise across the directions by a thousand.
        if len(rows) < 3 or np.linalg.matrix_rank(ways, tol=1e-3) < 3:
            fail(f"components[{part.name!r}]", f"point {part.points[i]!r} is not measured in three directions",
                 "must be for a finite-motion method", remedy="use SmallMotion, which takes any directions")
        result[i] = np.linalg.lstsq(ways, part.values[rows], rcond=None)[0]
    return result


@dataclass(frozen=True, eq=False)
class BisectorAxis(NotebookText):
    """Axis by perpendicular bisectors: unit `direction`, a `point` of it (m), rotation `angle` (rad) as enlarged."""

    direction: FloatArray
    point: FloatArray
    angle: float

    def __repr__(self) -> str:
        return f"BisectorAxis(direction {np.round(self.direction, 4)}, through {np.round(self.point, 4)} m)"


def bisector_axis(points: FloatArray, displaced: FloatArray) -> BisectorAxis:
    """Return the axis of a finite motion of points (n, 3): direction by registration, position where bisectors are densest.

    Every pair of displacements gives one crossing of their perpendicular bisectors in the plane normal to the axis; the
    densest crossing is the one whose nearest tenth of all crossings lies nearest.
    """
    motion = rigid(points, displaced).transform
    rotation = to_vector(motion[:3, :3])
    angle = float(np.linalg.norm(rotation))
    if angle < 1e-12:
        fail("displaced", "no rotation", "must turn about an axis", remedy="the motion is a translation or none")
    direction = rotation / angle
    plane = np.linalg.svd(direction[None])[2][1:]
    middles, move = ((points + displaced) / 2) @ plane.T, (displaced - points) @ plane.T
    crossings = _crossings(middles, move)
    if not len(crossings):
        fail("displaced", "no two displacements with different directions", "must have some")
    # By density and not by a mean, which would follow the crossings of nearly parallel bisectors: these lie far off.
    n_nearest = max(2, len(crossings) // 10)
    distance = np.asarray(cKDTree(crossings).query(crossings, k=n_nearest)[0])
    densest = crossings[int(np.argmin(distance[:, -1]))]
    return BisectorAxis(direction, densest @ plane + direction * (direction @ points.mean(axis=0)), angle)


def _crossings(middles: FloatArray, move: FloatArray) -> FloatArray:
    """Return the points x with (x - m_a) . r_a = 0 and (x - m_b) . r_b = 0 for all pairs a, b."""
    a, b = np.triu_indices(len(middles), 1)
    determinant = move[a, 0] * move[b, 1] - move[a, 1] * move[b, 0]
    level = (middles * move).sum(axis=1)
    length = np.linalg.norm(move, axis=1)
    # Bisectors within 0.06 degrees of each other cross at their noise over the sine of that angle, a thousand times too far.
    is_distinct = np.abs(determinant) > 1e-3 * length[a] * length[b]
    a, b, determinant = a[is_distinct], b[is_distinct], determinant[is_distinct]
    x = (level[a] * move[b, 1] - level[b] * move[a, 1]) / determinant
    y = (move[a, 0] * level[b] - move[b, 0] * level[a]) / determinant
    return np.stack([x, y], axis=1)


def relative_bisector_axes(parent: Component | None, child: Component, amplitude: float = 0.01) -> tuple[BisectorAxis, ...]:
    """Return the axis of every column of a component relative to the one before it, wholly in the way of the source.

    Both components are displaced with one enlargement, the parent's finite motion is undone on the child's displaced
    points (eq. 5), and the axis of what is left is found by `bisector_axis`.
    """
    return tuple(bisector_axis(child.at, moved) for moved, _ in _compensated_places(parent, child, amplitude))


def displacements_beside_parent(parent: Component | None, child: Component, amplitude: float = 0.01) -> FloatArray:
    """Return the child's shapes with the parent's motion undone (eq. 5), (n_points, 3, n_columns), in the shapes' unit."""
    return np.stack([(moved - child.at) / gain for moved, gain in _compensated_places(parent, child, amplitude)], axis=2)


def _compensated_places(parent: Component | None, child: Component, amplitude: float) -> Iterator[tuple[FloatArray, float]]:
    """Yield the child's displaced points (n, 3) less the parent's motion, and the enlargement, of every column."""
    positive("amplitude", amplitude, 1.0)
    child_motion = displacements(child)
    other = None if parent is None else displacements(parent)
    for i in range(child_motion.shape[2]):
        # One enlargement for both: what is undone on the child is the finite motion of a parent displaced by the same
        # factor.
        size = np.sqrt((child_motion[:, :, i] ** 2).sum(axis=1).max())
        if other is not None:
            size = max(size, np.sqrt((other[:, :, i] ** 2).sum(axis=1).max()))
        gain = amplitude * child.size / size
        moved = child.at + gain * child_motion[:, :, i]
        if parent is not None and other is not None:
            parent_transform = rigid(parent.at, parent.at + gain * other[:, :, i]).transform
            moved = tf.move(tf.inverse(parent_transform), moved)
        yield moved, gain


def meeting_point(axes: tuple[BisectorAxis, ...]) -> FloatArray:
    """Return the point nearest to all axes: the average of the repeated axes of the source, unweighted."""
    across = np.array([np.eye(3) - np.outer(axis.direction, axis.direction) for axis in axes])
    points = np.array([axis.point for axis in axes])
    # Parallel axes leave the point along them open: the cut-off lets the least norm decide, where rounding would.
    return np.asarray(np.linalg.lstsq(across.sum(axis=0), np.einsum("nij,nj->i", across, points), rcond=1e-6)[0])
