"""Scene: the geometry that a page draws, nodes with triangles and lines, each node on a named body."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from toolpoint._check import FloatArray, fail, floats, frozen

IntArray = NDArray[np.int64]
_CORNERS = np.array([[i, j, k] for k in (-0.5, 0.5) for j in (-0.5, 0.5) for i in (-0.5, 0.5)])
_BOX_TRIANGLES = np.array([
    [0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4],
    [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]])
_BOX_LINES = np.array([[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]])


@dataclass(frozen=True)
class Box:
    """A box on a body.

    Parameters
    ----------
    body : str
        Name of the body; several boxes may share one.
    centre : 3 floats
        Centre in the machine frame, m.
    size : 3 floats
        Edge lengths along the box's own axes, m.
    orientation : 3x3 rotation matrix, optional
        Columns are the box's axes in the machine frame; the identity where none is given.

    >>> table = Box("table", centre=[0, 0, 0.1], size=[0.6, 0.4, 0.2])
    >>> float(table.centre[2] + table.size[2] / 2)  # m, its upper face
    0.2
    """

    body: str
    centre: ArrayLike
    size: ArrayLike
    orientation: ArrayLike = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        centre, size = floats("Box.centre", self.centre, (3,)), floats("Box.size", self.size, (3,))
        turn = floats("Box.orientation", self.orientation, (3, 3))
        if size.min() <= 0:
            fail("Box.size", f"{size.tolist()} of {self.body!r}", "must be three lengths above zero, m")
        if not np.allclose(turn.T @ turn, np.eye(3), atol=1e-6):
            fail("Box.orientation", f"of {self.body!r} is not orthonormal", "must be a rotation matrix")
        for name, value in (("centre", centre), ("size", size), ("orientation", turn)):
            object.__setattr__(self, name, value)


@dataclass(frozen=True, eq=False)
class Scene:
    """Geometry that a page draws: nodes, faces and edges.

    Parameters
    ----------
    nodes : (n, 3) floats
        Undeformed positions in the machine frame, m.
    triangles : (t, 3) integers
        Node indices of the faces; none for a wire model.
    lines : (l, 2) integers
        Node indices of the edges.
    node_body : (n,) integers, optional
        Index into `body_names` of the body that each node belongs to; all 0 where none is given.
    body_names : sequence of str
        Names of the bodies, all different.

    Raises
    ------
    ToolpointError
        For indices outside the nodes or bodies, nodes that are not finite, repeated body names.

    >>> plate = Scene(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]), triangles=np.array([[0, 1, 2]]))
    >>> plate.triangles.shape, plate.body_names
    ((1, 3), ('body',))
    """

    nodes: FloatArray
    triangles: IntArray = field(default_factory=lambda: np.zeros((0, 3), int))
    lines: IntArray = field(default_factory=lambda: np.zeros((0, 2), int))
    node_body: IntArray | None = None
    body_names: tuple[str, ...] = ("body",)

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "nodes", floats("Scene.nodes", self.nodes, (None, 3)))
        count = self.nodes.shape[0]
        if self.nodes.ndim != 2 or count == 0:
            fail("Scene.nodes", f"shape {self.nodes.shape}", "must be (n, 3) with at least one node")
        put(self, "triangles", _indices("Scene.triangles", self.triangles, 3, count))
        put(self, "lines", _indices("Scene.lines", self.lines, 2, count))
        names = tuple(str(name) for name in self.body_names)
        if not names or len(set(names)) != len(names):
            fail("Scene.body_names", repr(names), "must be one or more different names")
        put(self, "body_names", names)
        body = np.zeros(count, int) if self.node_body is None else self.node_body
        put(self, "node_body", _indices("Scene.node_body", body, None, len(names)))
        if self.node_body is None or self.node_body.shape != (count,):
            fail("Scene.node_body", f"shape {np.shape(body)}", f"must be ({count},)", remedy="one body index for each node")

    @classmethod
    def of_boxes(cls, boxes: Iterable[Box]) -> Scene:
        """Return the boxes as a scene: eight nodes a box, in the order of the boxes; equal body names are one body."""
        parts = list(boxes)
        if not parts:
            fail("boxes", "none", "must be at least one Box")
        names = list(dict.fromkeys(box.body for box in parts))
        nodes = [np.asarray(b.centre) + _CORNERS * np.asarray(b.size) @ np.asarray(b.orientation).T for b in parts]
        shift = 8 * np.arange(len(parts))[:, None, None]
        return cls(
            np.concatenate(nodes), (_BOX_TRIANGLES + shift).reshape(-1, 3), (_BOX_LINES + shift).reshape(-1, 2),
            np.repeat([names.index(box.body) for box in parts], 8), tuple(names))

    @classmethod
    def of_mesh(cls, body: str, nodes: ArrayLike, triangles: ArrayLike, *, edge_angle: float = 30.0) -> Scene:
        """Return a triangle mesh as one body; edges at the rim and where faces meet above `edge_angle` (deg)."""
        points = floats("nodes", nodes, (None, 3))
        faces = _indices("triangles", triangles, 3, points.shape[0])
        return cls(points, faces, _feature_edges(points, faces, edge_angle), None, (body,))

    @classmethod
    def of_points(
        cls,
        points: Mapping[str | int, ArrayLike],
        lines: Iterable[tuple[str | int, str | int]] = (),
        triangles: Iterable[tuple[str | int, str | int, str | int]] = (),
        *, components: Mapping[str, Sequence[str | int]] | None = None,
    ) -> Scene:
        """Return measured points joined by lines (the geometry of a test).

        Parameters
        ----------
        points : mapping from point (name or number) to xyz, m
            Node i of the scene is the i-th point.
        lines, triangles : points joined, by name or number
        components : mapping from component name to its points, optional
            Points that no component names go to a body called ``other points``.

        Raises
        ------
        ToolpointError
            Where a line, triangle or component names a point that is not in `points`.
        """
        place = {point: i for i, point in enumerate(points)}
        names, body = _bodies(place, components)
        return cls(
            floats("points", np.array([np.asarray(xyz, float) for xyz in points.values()]), (None, 3)),
            _point_rows("triangles", triangles, place, 3), _point_rows("lines", lines, place, 2), body, names)

    @classmethod
    def joined(cls, scenes: Iterable[Scene]) -> Scene:
        """Return several scenes as one; bodies of equal name become one body. Node order is that of the scenes."""
        parts = list(scenes)
        if not parts:
            fail("scenes", "none", "must be at least one Scene")
        names = list(dict.fromkeys(name for part in parts for name in part.body_names))
        offsets = np.cumsum([0] + [part.nodes.shape[0] for part in parts])
        body = [np.array([names.index(name) for name in part.body_names])[part.node_body] for part in parts]
        return cls(
            np.concatenate([part.nodes for part in parts]),
            np.concatenate([part.triangles + offset for part, offset in zip(parts, offsets)]),
            np.concatenate([part.lines + offset for part, offset in zip(parts, offsets)]), np.concatenate(body), tuple(names))

    @property
    def size(self) -> float:
        """Diagonal of the bounding box, m."""
        return float(np.linalg.norm(np.ptp(self.nodes, axis=0)))

    def __repr__(self) -> str:
        bodies = f"{len(self.body_names)} bod{'y' if len(self.body_names) == 1 else 'ies'}"
        return (f"Scene({self.nodes.shape[0]} nodes, {self.triangles.shape[0]} triangles, {self.lines.shape[0]} lines, "
                f"{bodies}, {self.size:.4g} m across)")


def _indices(name: str, value: ArrayLike, width: int | None, limit: int) -> IntArray:
    """Return checked node or body indices, (n,) or (n, width)."""
    array = np.asarray(value)
    if array.size == 0:
        array = np.zeros((0,) if width is None else (0, width), int)
    if array.dtype.kind not in "iu":
        fail(name, f"{array.dtype} numbers", "must be whole numbers")
    if array.ndim != (1 if width is None else 2) or (width is not None and array.shape[1] != width):
        fail(name, f"shape {array.shape}", "must be (n,)" if width is None else f"must be (n, {width})")
    if array.size and (array.min() < 0 or array.max() >= limit):
        wrong_index = int(array.max() if array.max() >= limit else array.min())
        fail(name, f"index {wrong_index}", f"must be within 0 .. {limit - 1}")
    return frozen(array.astype(np.int64))


def _feature_edges(nodes: FloatArray, faces: IntArray, angle: float) -> IntArray:
    """Return the edges (k, 2) at the rim of a mesh and where its faces meet at more than an angle (deg)."""
    normal = np.cross(nodes[faces[:, 1]] - nodes[faces[:, 0]], nodes[faces[:, 2]] - nodes[faces[:, 0]])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(faces.shape[0]), 3)
    edges, inverse, counts = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(inverse.ravel(), kind="stable")
    start = np.concatenate([[0], np.cumsum(counts)[:-1]])
    first, last = owner[order[start]], owner[order[start + counts - 1]] if counts.size else owner[:0]
    bent = np.einsum("ij,ij->i", normal[first], normal[last]) < np.cos(np.radians(angle))
    return edges[(counts != 2) | bent]


def _bodies(
    place: Mapping[str | int, int], components: Mapping[str, Sequence[str | int]] | None
) -> tuple[tuple[str, ...], IntArray]:
    if components is None:
        return ("measured points",), np.zeros(len(place), int)
    body = np.full(len(place), -1)
    for number, (name, members) in enumerate(components.items()):
        body[[_place(f"components[{name!r}]", place, point) for point in members]] = number
    names = tuple(components)
    if (body < 0).any():
        names, body = (*names, "other points"), np.where(body < 0, len(names), body)
    return names, body


def _point_rows(what: str, rows: Iterable[Iterable[str | int]], place: Mapping[str | int, int], width: int) -> IntArray:
    return np.array([[_place(what, place, point) for point in row] for row in rows], np.int64).reshape(-1, width)


def _place(what: str, place: Mapping[str | int, int], point: Hashable) -> int:
    if not isinstance(point, (str, int)) or point not in place:
        known_points = ", ".join(map(str, list(place)[:6])) + (" ..." if len(place) > 6 else "")
        fail(what, f"point {point!r} has no coordinates", f"must be one of {known_points}")
    return place[point]
