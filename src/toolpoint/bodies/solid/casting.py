"""Casting: a body of boxes (walls, ribs, rails) and openings on planes, meshed with 20-node hexahedra without a mesher."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from toolpoint._check import FloatArray, IndexArray, fail, floats, positive
from toolpoint.bodies.solid.element_kinds import HEX_SIDES
from toolpoint.bodies.solid.material import Material
from toolpoint.bodies.solid.model import ElementBlock, SolidModel

# Cell centres (c, 3), m, to (c,) bools: whether there is material.
Predicate = Callable[[FloatArray], np.ndarray]

MAX_GRID_CELLS = 20_000_000  # cells of the grid over a casting's bounding box, empty ones included
MAX_MESH_ELEMENTS = 400_000  # elements, four to five million coordinates


@dataclass(frozen=True, eq=False)
class Cuboid:
    """Box along the axes: a wall, plate, rib, rail, or (`is_window`) an opening cut out of the boxes before it.

    Parameters
    ----------
    low, high : (3,) floats
        Opposite corners, m.
    name : str
        The set it belongs to.
    is_window : bool
        Whether it takes material away.

    Examples
    --------
    >>> from toolpoint.bodies.solid import Cuboid
    >>> Cuboid(low=(0, 0, 0), high=(0.6, 0.4, 0.03), name="bed").high.tolist()
    [0.6, 0.4, 0.03]
    """

    low: FloatArray
    high: FloatArray
    name: str = "body"
    is_window: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "low", floats("Cuboid.low", self.low, (3,)))
        object.__setattr__(self, "high", floats("Cuboid.high", self.high, (3,)))
        if (self.high <= self.low).any():
            fail("Cuboid.high", f"{self.high} with low {self.low}", "must be above low in every direction")


@dataclass(frozen=True, eq=False)
class Casting:
    """Parametric casting: boxes in order, later ones over earlier ones; windows take material away.

    Parameters
    ----------
    cuboids : sequence of Cuboid
    materials : mapping of set name to Material
    predicates : mapping of set name to a function, optional
        Further material (or, for the name ``window``, openings): maps cell centres (c, 3) to True where it is.

    Examples
    --------
    >>> from toolpoint.bodies.solid import CAST_IRON, Casting, Cuboid
    >>> plate = Casting([Cuboid((0, 0, 0), (0.2, 0.1, 0.02))], {"body": CAST_IRON})
    >>> plate.meshed(0.1)
    SolidModel(2 hexahedron elements, 32 nodes, 96 coordinates, sets body)
    """

    cuboids: tuple[Cuboid, ...]
    materials: Mapping[str, Material]
    predicates: Mapping[str, Predicate] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "cuboids", tuple(self.cuboids))
        if not any(not cuboid.is_window for cuboid in self.cuboids):
            fail("Casting.cuboids", "no material", "must hold at least one box")

    def planes(self, size: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the coordinates of mesh planes along x, y, z, m: every side of every box, no step above `size` (m)."""
        positive("size", size)
        sides = np.array([side for cuboid in self.cuboids for side in (cuboid.low, cuboid.high)])
        return _divide_sides(sides[:, 0], size), _divide_sides(sides[:, 1], size), _divide_sides(sides[:, 2], size)

    def meshed(self, size: float, *, planes: Sequence[FloatArray] | None = None) -> SolidModel:
        """Return the solid model with elements of at most `size` (m); a wall thinner than that is one element thick.

        planes : coordinates of mesh planes along x, y and z, m, in place of `planes(size)`; a cell belongs to the box that
        holds its centre. Raises ToolpointError for a casting that falls into several pieces.
        """
        grid = tuple(floats("planes", p, (None,)) for p in planes) if planes is not None else self.planes(size)
        check_mesh_size(size, float(np.prod([len(p) - 1.0 for p in grid])), MAX_GRID_CELLS)
        centres = [(p[1:] + p[:-1]) / 2 for p in grid]
        names, owner = self._owners(centres)
        cells = np.argwhere(owner >= 0)
        check_mesh_size(size, len(cells), MAX_MESH_ELEMENTS)
        _check_whole(owner >= 0)
        nodes, elements = _hexahedra(grid, cells)
        set_index = owner[tuple(cells.T)]
        blocks = tuple(ElementBlock(elements[set_index == i], name) for i, name in enumerate(names) if (set_index == i).any())
        return SolidModel(nodes, blocks, dict(self.materials))

    def _owners(self, centres: Sequence[FloatArray]) -> tuple[list[str], IndexArray]:
        """Return the names of sets, and the index of each cell's set (n_x, n_y, n_z), -1 where it is empty."""
        names = list(dict.fromkeys([c.name for c in self.cuboids if not c.is_window]
                                   + [name for name in self.predicates if name != "window"]))
        owner = np.full(tuple(len(c) for c in centres), -1)
        for cuboid in self.cuboids:
            within = [(c > cuboid.low[a]) & (c < cuboid.high[a]) for a, c in enumerate(centres)]
            owner[np.ix_(*within)] = -1 if cuboid.is_window else names.index(cuboid.name)
        places = np.stack(np.meshgrid(*centres, indexing="ij"), axis=-1)
        for name, predicate in self.predicates.items():
            inside = np.asarray(predicate(places.reshape(-1, 3)), dtype=bool).reshape(owner.shape)
            owner[inside] = -1 if name == "window" else names.index(name)
        return names, owner


def check_mesh_size(size: float, cells: float, max_cells: int) -> None:
    """Refuse a mesh with more than `max_cells` cells before memory runs out: often a size (m) in the wrong unit."""
    if cells > max_cells:
        fail("mesh_size", f"{1e3 * size:.4g} mm, which gives {cells:.2g} cells", f"must give {max_cells:.0e} at most",
             remedy="write a larger one; is its unit right?")


def _divide_sides(sides: FloatArray, size: float) -> FloatArray:
    """Return planes through all sides with no step above `size`; sides within 1e-9 of the extent are one."""
    sides = np.unique(sides)
    # Planes of a drawing that coincide may differ by rounding of sums; an element between them would have no thickness.
    tolerance = 1e-9 * (sides[-1] - sides[0])
    sides = sides[np.concatenate([[True], np.diff(sides) > tolerance])]
    # The factor keeps a side that is a whole multiple of the size, but for rounding, from one element more.
    steps = np.maximum(np.ceil(np.diff(sides) / size * (1 - 1e-12)), 1).astype(int)
    parts = [np.linspace(a, b, n + 1)[:-1] for a, b, n in zip(sides[:-1], sides[1:], steps, strict=True)]
    return np.concatenate([*parts, sides[-1:]])


def _check_whole(filled: np.ndarray) -> None:
    """Refuse filled cells, (n_x, n_y, n_z) bools, that are not one body joined by faces: edges and corners do not join."""
    number = np.full(filled.shape, -1)
    number[filled] = np.arange(int(filled.sum()))
    pairs = []
    for axis in range(3):
        a, b = (np.take(number, range(s, number.shape[axis] - 1 + s), axis=axis).ravel() for s in (0, 1))
        neighbours = (a >= 0) & (b >= 0)
        pairs.append(np.column_stack([a[neighbours], b[neighbours]]))
    edges = np.concatenate(pairs)
    count = int(filled.sum())
    graph = csr_array((np.ones(len(edges), dtype=np.int8), (edges[:, 0], edges[:, 1])), shape=(count, count))
    pieces, labels = connected_components(graph, directed=False)
    if pieces > 1:
        sizes = np.bincount(labels)
        fail("Casting.cuboids", f"{pieces} pieces of {', '.join(map(str, np.sort(sizes)[::-1][:4]))} elements",
             "must be one body, its boxes touching by faces",
             remedy="move or join the boxes that stand apart, or mesh them alone")


def _hexahedra(planes: Sequence[FloatArray], cells: IndexArray) -> tuple[FloatArray, IndexArray]:
    """Return nodes (n, 3) and elements (e, 20) of the filled cells; nodes lie on the grid of half steps.

    planes : coordinates along x, y, z, m; cells : (e, 3) indices of cells. Corners lie at even places of that grid, nodes in
    the middle of edges at one odd place.
    """
    corner = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [0, 0, 2], [2, 0, 2], [2, 2, 2], [0, 2, 2]])
    offsets = np.vstack([corner, corner[HEX_SIDES].sum(axis=1) // 2])
    shape = [2 * len(p) - 1 for p in planes]
    half_steps = [np.interp(np.arange(n) / 2, np.arange(len(p)), p) for n, p in zip(shape, planes, strict=True)]
    grid_index = 2 * cells[:, None, :] + offsets
    code = (grid_index[..., 0] * shape[1] + grid_index[..., 1]) * shape[2] + grid_index[..., 2]
    unique, elements = np.unique(code, return_inverse=True)
    x, y, z = np.unravel_index(unique, shape)
    return np.column_stack([half_steps[0][x], half_steps[1][y], half_steps[2][z]]), elements.reshape(len(cells), 20)
