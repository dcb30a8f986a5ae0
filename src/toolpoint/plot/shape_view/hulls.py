"""Hulls of measured points: the faces and edges of each body, where the geometry of a test joins none of its points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from toolpoint._check import FloatArray
from toolpoint.plot.shape_view.scene import Scene
from toolpoint.vibration.geometry import Geometry

IntArray = NDArray[np.int64]
HULL_WORDS = "A body is the hull of its measured points: what lies between them was not measured."
_MIN_EXTENT_RATIO = 1e-6  # of a body's extent: a smaller one is none in its direction


def with_hulls(scene: Scene) -> Scene:
    """Return a scene whose bodies have the convex hull of their nodes as faces and edges, where they had no line and no face.

    Nodes and their order stay: a hull moves with the points that were measured. Points of a plane give a polygon, points of a
    line its edges, a single point nothing.
    """
    assert scene.node_body is not None  # filled when made
    triangles, lines = [scene.triangles], [scene.lines]
    drawn = set(scene.node_body[np.concatenate([scene.triangles.ravel(), scene.lines.ravel()])].tolist())
    for body in range(len(scene.body_names)):
        members = np.flatnonzero(scene.node_body == body)
        if body in drawn or members.size < 2:
            continue
        faces, edges = hull_of(scene.nodes[members])
        triangles.append(members[faces].reshape(-1, 3))
        lines.append(members[edges].reshape(-1, 2))
    return replace(scene, triangles=np.concatenate(triangles), lines=np.concatenate(lines))


def drawn_points(geometry: Geometry, components: Mapping[str, Sequence[str | int]] | None = None) -> Scene:
    """Return the points and lines of a geometry as a scene, with the hull of each component where components are given."""
    listed = None if components is None else {
        name: [point for point in points if point in geometry.points] for name, points in components.items()}
    scene = Scene.of_points(geometry.points, geometry.lines, components=listed)
    return scene if listed is None else with_hulls(scene)


def hull_of(points: FloatArray) -> tuple[IntArray, IntArray]:
    """Return faces (t, 3) and edges (k, 2) of the convex hull of points (n, 3) as indices; flat where the points are."""
    none = np.zeros((0, 3), np.int64), np.zeros((0, 2), np.int64)
    _, extent, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    rank = int(np.sum(extent > _MIN_EXTENT_RATIO * max(float(extent[0]), 1e-300)))
    flat = (points - points.mean(axis=0)) @ axes[:rank].T
    try:
        if rank == 3:
            return _solid_hull(points)
        if rank == 2:
            ring = ConvexHull(flat).vertices
            fan = np.column_stack([np.full(len(ring) - 2, ring[0]), ring[1:-1], ring[2:]])
            return fan.astype(np.int64), np.column_stack([ring, np.roll(ring, -1)]).astype(np.int64)
    except QhullError:  # points that are flat but for rounding
        return none
    order = np.argsort(flat[:, 0]) if rank == 1 else np.zeros(0, np.int64)
    return none[0], np.column_stack([order[:-1], order[1:]]).astype(np.int64)


def _solid_hull(points: FloatArray) -> tuple[IntArray, IntArray]:
    """Return faces turned outwards, and the edges at which they meet at an angle."""
    hull = ConvexHull(points)
    faces = hull.simplices.astype(np.int64)
    corners = points[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    is_inward = np.einsum("ij,ij->i", normal, hull.equations[:, :3]) < 0
    faces[is_inward] = faces[is_inward][:, ::-1]
    # Only edges between faces that turn by more than ten degrees: those of the triangulation would fill the picture.
    return faces, Scene.of_mesh("hull", points, faces, edge_angle=10.0).lines
