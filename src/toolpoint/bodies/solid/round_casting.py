"""Round casting: stepped cylinders and bores about one axis, meshed with 20-node hexahedra without a mesher.

Circles are polygons of the same area with straight sides: flat ends are meshed by flat faces, with any bore inside.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from toolpoint._check import FloatArray, IndexArray, fail, one_of, positive
from toolpoint.bodies.solid.casting import MAX_GRID_CELLS, MAX_MESH_ELEMENTS, check_mesh_size
from toolpoint.bodies.solid.element_kinds import HEX_SIDES
from toolpoint.bodies.solid.material import Material
from toolpoint.bodies.solid.model import ElementBlock, SolidModel

_CORE_FRACTION = 0.6  # of the smallest radius: half the diagonal of the square core
_AXES_ACROSS = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}


@dataclass(frozen=True)
class RoundPart:
    """Cylinder from `low` to `high` along the axis (m), or (`is_window`) a bore cut out of the parts before it.

    Examples
    --------
    >>> from toolpoint.bodies.solid import RoundPart
    >>> RoundPart(low=0.0, high=0.3, diameter=0.08).diameter
    0.08
    """

    low: float
    high: float
    diameter: float
    name: str = "body"
    is_window: bool = False

    def __post_init__(self) -> None:
        positive("RoundPart.diameter", self.diameter)
        if not self.high > self.low:
            fail("RoundPart.high", f"{self.high:g} with low {self.low:g}", "must be above low")


@dataclass(frozen=True, eq=False)
class RoundCasting:
    """Round parts in order, later ones over earlier ones, about the direction `axis` through a place (m) in the body's frame.

    Places of the parts along the axis are in the body's frame.

    Examples
    --------
    >>> from toolpoint.bodies.solid import STEEL, RoundCasting, RoundPart
    >>> parts = (RoundPart(0.0, 0.3, 0.08), RoundPart(0.0, 0.3, 0.03, is_window=True))
    >>> RoundCasting(parts, "z", (0.0, 0.0, 0.0), {"body": STEEL}).meshed(0.15)
    SolidModel(32 hexahedron elements, 304 nodes, 912 coordinates, sets body)
    """

    parts: tuple[RoundPart, ...]
    axis: str
    centre: tuple[float, float, float]
    materials: Mapping[str, Material]

    def __post_init__(self) -> None:
        one_of("RoundCasting.axis", self.axis, tuple(_AXES_ACROSS))
        if not any(not part.is_window for part in self.parts):
            fail("RoundCasting.parts", "no material", "must hold at least one part")

    def meshed(self, size: float) -> SolidModel:
        """Return the solid model with elements of about `size` (m) at most; a wall thinner than that is one element thick.

        Raises ToolpointError for a casting that falls into several pieces.
        """
        positive("size", size)
        radii = np.unique([part.diameter / 2 for part in self.parts])
        n_around = max(8 * int(np.ceil(2 * np.pi * radii[-1] / size / 8)), 16)
        lengths = sum(part.high - part.low for part in self.parts)
        check_mesh_size(size, n_around * max(float(radii[-1]), size) / size * lengths / size, MAX_GRID_CELLS)
        plane, quads, quad_radius = _section(radii, n_around, size)
        planes = _divide_heights(np.unique([end for part in self.parts for end in (part.low, part.high)]), size)
        names, owner = self._owners(quad_radius, (planes[1:] + planes[:-1]) / 2)
        layer, quad = np.nonzero(owner.T >= 0)
        check_mesh_size(size, len(layer), MAX_MESH_ELEMENTS)
        corners = np.concatenate([quads[quad] + layer[:, None] * len(plane), quads[quad] + (layer[:, None] + 1) * len(plane)],
                                 axis=1)
        places = np.empty((len(planes), len(plane), 3))
        first, second = _AXES_ACROSS[self.axis]
        places[..., first], places[..., second] = plane[:, 0] + self.centre[first], plane[:, 1] + self.centre[second]
        places[..., "xyz".index(self.axis)] = planes[:, None]
        nodes, elements = _add_mid_nodes(places.reshape(-1, 3), corners)
        _check_whole(elements, len(nodes))
        set_index = owner.T[layer, quad]
        blocks = tuple(ElementBlock(elements[set_index == i], name) for i, name in enumerate(names) if (set_index == i).any())
        return SolidModel(nodes, blocks, dict(self.materials))

    def _owners(self, radius: FloatArray, height: FloatArray) -> tuple[list[str], IndexArray]:
        """Return the names of sets and which one each cell (quad, layer) belongs to, -1 for none."""
        names = list(dict.fromkeys(part.name for part in self.parts if not part.is_window))
        owner = np.full((len(radius), len(height)), -1)
        for part in self.parts:
            within = np.ix_(radius < part.diameter / 2, (height > part.low) & (height < part.high))
            owner[within] = -1 if part.is_window else names.index(part.name)
        return names, owner


def _divide_heights(sides: FloatArray, size: float) -> FloatArray:
    """Return planes through all ends with no step above `size`."""
    # A height that is a whole number of sizes must not get one element more by the rounding of the quotient.
    steps = np.maximum(np.ceil(np.diff(sides) / size * (1 - 1e-12)), 1).astype(int)
    parts = [np.linspace(a, b, n + 1)[:-1] for a, b, n in zip(sides[:-1], sides[1:], steps, strict=True)]
    return np.concatenate([*parts, sides[-1:]])


def _section(radii: FloatArray, n_around: int, size: float) -> tuple[FloatArray, IndexArray, FloatArray]:
    """Return the places (n, 2), quadrilaterals (q, 4), counter-clockwise, and a radius inside each (q,).

    A square core, then rings with `n_around` elements to every radius.
    """
    side = n_around // 4
    steps = np.tan(np.linspace(-np.pi / 4, np.pi / 4, side + 1)) * _CORE_FRACTION * radii[0] / np.sqrt(2)
    core = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    number = np.arange((side + 1) ** 2).reshape(side + 1, side + 1)
    quads = [np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)]
    rim = np.concatenate([number[-1, :-1], number[:0:-1, -1], number[0, :0:-1], number[:-1, 0]])  # from -45 degrees on
    angle = -np.pi / 4 + 2 * np.pi * np.arange(n_around) / n_around
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    scale = np.sqrt(2 * np.pi / n_around / np.sin(2 * np.pi / n_around))  # the polygon's area is the circle's
    places, quad_radius = [core], [np.zeros(len(quads[0]))]
    inside_ring, count = core[rim], len(core)
    for k, radius in enumerate(radii):
        outside_ring = scale * radius * circle
        layers = max(int(np.ceil(float(np.linalg.norm(outside_ring - inside_ring, axis=1).max()) / size * (1 - 1e-12))), 1)
        for fraction in np.arange(1, layers + 1) / layers:
            new_rim = count + np.arange(n_around)
            quads.append(np.stack([rim, new_rim, np.roll(new_rim, -1), np.roll(rim, -1)], axis=-1))
            places.append(inside_ring + fraction * (outside_ring - inside_ring))
            quad_radius.append(np.full(n_around, radius - 1e-3 * (radius - (radii[k - 1] if k else 0.0))))
            rim, count = new_rim, count + n_around
        inside_ring = outside_ring
    return np.concatenate(places), np.concatenate(quads), np.concatenate(quad_radius)


def _add_mid_nodes(places: FloatArray, corners: IndexArray) -> tuple[FloatArray, IndexArray]:
    """Return nodes and 20-node elements of hexahedra by their corners, with nodes in the middle of every edge."""
    used, corners = np.unique(corners, return_inverse=True)
    corners = corners.reshape(-1, 8)
    edges = np.sort(corners[:, HEX_SIDES].reshape(-1, 2), axis=1)
    pairs, edge_number = np.unique(edges, axis=0, return_inverse=True)
    vertices = places[used]
    nodes = np.concatenate([vertices, vertices[pairs].mean(axis=1)])
    return nodes, np.concatenate([corners, len(vertices) + edge_number.reshape(len(corners), len(HEX_SIDES))], axis=1)


def _check_whole(elements: IndexArray, count: int) -> None:
    """Refuse elements that are not one body."""
    rows, columns = elements[:, 1:].ravel(), np.repeat(elements[:, 0], elements.shape[1] - 1)
    pieces, labels = connected_components(coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(count, count)),
                                          directed=False)
    if pieces > 1:
        sizes = np.sort(np.bincount(labels))[::-1]
        fail("RoundCasting.parts", f"{pieces} pieces of {', '.join(map(str, sizes[:4]))} nodes",
             "must be one body, its parts touching by faces", remedy="move or join the parts that stand apart")
