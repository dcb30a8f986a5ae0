"""Round casting: stepped cylinders and bores about one axis, meshed with 20-node hexahedra without a mesher.

Circles are polygons of the same area with straight sides, so flat ends are meshed by flat faces whatever is bored inside.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from toolpoint._check import FloatArray, IndexArray, fail, one_of, positive
from toolpoint.bodies.solid.casting import MOST_CELLS, MOST_FILLED, check_mesh_size
from toolpoint.bodies.solid.element_kinds import HEX_SIDES
from toolpoint.bodies.solid.material import Material
from toolpoint.bodies.solid.model import ElementBlock, SolidModel

_CORE = 0.6  # of the smallest radius: half the diagonal of the square in the middle
_ACROSS = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}


@dataclass(frozen=True)
class RoundPart:
    """A cylinder from `low` to `high` along the axis (m), or (`is_window`) a bore cut out of what came before."""

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
    """

    parts: tuple[RoundPart, ...]
    axis: str
    centre: tuple[float, float, float]
    materials: Mapping[str, Material]

    def __post_init__(self) -> None:
        one_of("RoundCasting.axis", self.axis, tuple(_ACROSS))
        if not any(not part.is_window for part in self.parts):
            fail("RoundCasting.parts", "no material", "must hold at least one part")

    def meshed(self, size: float) -> SolidModel:
        """Return the solid model with elements of about `size` (m) at most; a wall thinner than that is one element thick.

        Raises ToolpointError for a casting that falls into several pieces.
        """
        positive("size", size)
        radii = np.unique([part.diameter / 2 for part in self.parts])
        around = max(8 * int(np.ceil(2 * np.pi * radii[-1] / size / 8)), 16)
        lengths = sum(part.high - part.low for part in self.parts)
        check_mesh_size(size, around * max(float(radii[-1]), size) / size * lengths / size, MOST_CELLS)
        plane, quads, middle = _section(radii, around, size)
        planes = _levels(np.unique([end for part in self.parts for end in (part.low, part.high)]), size)
        names, owner = self._owners(middle, (planes[1:] + planes[:-1]) / 2)
        layer, quad = np.nonzero(owner.T >= 0)
        check_mesh_size(size, len(layer), MOST_FILLED)
        corners = np.concatenate([quads[quad] + layer[:, None] * len(plane), quads[quad] + (layer[:, None] + 1) * len(plane)],
                                 axis=1)
        places = np.empty((len(planes), len(plane), 3))
        first, second = _ACROSS[self.axis]
        places[..., first], places[..., second] = plane[:, 0] + self.centre[first], plane[:, 1] + self.centre[second]
        places[..., "xyz".index(self.axis)] = planes[:, None]
        nodes, elements = _quadratic(places.reshape(-1, 3), corners)
        _check_whole(elements, len(nodes))
        belongs = owner.T[layer, quad]
        blocks = tuple(ElementBlock(elements[belongs == i], name) for i, name in enumerate(names) if (belongs == i).any())
        return SolidModel(nodes, blocks, dict(self.materials))

    def _owners(self, radius: FloatArray, height: FloatArray) -> tuple[list[str], IndexArray]:
        """Return the names of sets and which one each cell (quad, layer) belongs to, -1 for none."""
        names = list(dict.fromkeys(part.name for part in self.parts if not part.is_window))
        owner = np.full((len(radius), len(height)), -1)
        for part in self.parts:
            within = np.ix_(radius < part.diameter / 2, (height > part.low) & (height < part.high))
            owner[within] = -1 if part.is_window else names.index(part.name)
        return names, owner


def _levels(sides: FloatArray, size: float) -> FloatArray:
    steps = np.maximum(np.ceil(np.diff(sides) / size * (1 - 1e-12)), 1).astype(int)
    parts = [np.linspace(a, b, n + 1)[:-1] for a, b, n in zip(sides[:-1], sides[1:], steps, strict=True)]
    return np.concatenate([*parts, sides[-1:]])


def _section(radii: FloatArray, around: int, size: float) -> tuple[FloatArray, IndexArray, FloatArray]:
    """Return the places (n, 2), quadrilaterals (q, 4, turning left) and their radius in the middle (q,): a square core, then
    rings with so many elements around to every radius."""
    side = around // 4
    steps = np.tan(np.linspace(-np.pi / 4, np.pi / 4, side + 1)) * _CORE * radii[0] / np.sqrt(2)
    core = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    number = np.arange((side + 1) ** 2).reshape(side + 1, side + 1)
    quads = [np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)]
    rim = np.concatenate([number[-1, :-1], number[:0:-1, -1], number[0, :0:-1], number[:-1, 0]])  # from -45 degrees on
    angle = -np.pi / 4 + 2 * np.pi * np.arange(around) / around
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    scale = np.sqrt(2 * np.pi / around / np.sin(2 * np.pi / around))  # the polygon's area is the circle's
    places, middle = [core], [np.zeros(len(quads[0]))]
    inner, count = core[rim], len(core)
    for k, radius in enumerate(radii):
        outer = scale * radius * circle
        layers = max(int(np.ceil(float(np.linalg.norm(outer - inner, axis=1).max()) / size * (1 - 1e-12))), 1)
        for share in np.arange(1, layers + 1) / layers:
            new = count + np.arange(around)
            quads.append(np.stack([rim, new, np.roll(new, -1), np.roll(rim, -1)], axis=-1))
            places.append(inner + share * (outer - inner))
            middle.append(np.full(around, radius - 1e-3 * (radius - (radii[k - 1] if k else 0.0))))
            rim, count = new, count + around
        inner = outer
    return np.concatenate(places), np.concatenate(quads), np.concatenate(middle)


def _quadratic(places: FloatArray, corners: IndexArray) -> tuple[FloatArray, IndexArray]:
    """Return nodes and 20-node elements of hexahedra by their corners, with nodes in the middle of every edge."""
    used, corners = np.unique(corners, return_inverse=True)
    corners = corners.reshape(-1, 8)
    edges = np.sort(corners[:, HEX_SIDES].reshape(-1, 2), axis=1)
    pairs, number = np.unique(edges, axis=0, return_inverse=True)
    at = places[used]
    nodes = np.concatenate([at, at[pairs].mean(axis=1)])
    return nodes, np.concatenate([corners, len(at) + number.reshape(len(corners), len(HEX_SIDES))], axis=1)


def _check_whole(elements: IndexArray, count: int) -> None:
    rows, columns = elements[:, 1:].ravel(), np.repeat(elements[:, 0], elements.shape[1] - 1)
    pieces, labels = connected_components(coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(count, count)),
                                          directed=False)
    if pieces > 1:
        sizes = np.sort(np.bincount(labels))[::-1]
        fail("RoundCasting.parts", f"{pieces} pieces of {', '.join(map(str, sizes[:4]))} nodes",
             "must be one body, its parts touching by faces", remedy="move or join the parts that stand apart")
