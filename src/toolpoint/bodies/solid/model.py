"""SolidModel: nodes, solid elements in named sets, and stiffness and mass in parts that scale with E and density."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np
from scipy.sparse import csc_array

from toolpoint._check import FloatArray, IndexArray, fail, floats, frozen, positive
from toolpoint._notebook import NotebookText
from toolpoint.bodies.inertia import MassProperties
from toolpoint.bodies.solid import matrices
from toolpoint.bodies.solid.assembly import add_pairs, chunks
from toolpoint.bodies.solid.element_kinds import ElementKind, kind_of
from toolpoint.bodies.solid.material import Material
from toolpoint.vibration import Dof
from toolpoint.vibration.sparse.node_matrix import NodeMatrix, NodePattern, pattern_of


@dataclass(frozen=True, eq=False)
class ElementBlock:
    """Elements of one kind and one named set.

    Parameters
    ----------
    nodes : (e, 20) or (e, 10) ints
        Node numbers of each element from 0; order in `element_kinds`.
    name : str
        Set of the elements: they scale together.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.bodies.solid import ElementBlock
    >>> ElementBlock(np.arange(10)[None]).kind.name
    'tetrahedron'
    """

    nodes: IndexArray
    name: str = "body"

    def __post_init__(self) -> None:
        nodes = np.asarray(self.nodes)
        if nodes.ndim != 2 or len(nodes) == 0 or not np.issubdtype(nodes.dtype, np.integer):
            fail("ElementBlock.nodes", f"shape {nodes.shape}, {nodes.dtype}", "must be rows of node numbers")
        kind_of(nodes.shape[1])
        object.__setattr__(self, "nodes", frozen(nodes.astype(np.int64)))

    @property
    def kind(self) -> ElementKind:
        """Kind of its elements."""
        return kind_of(self.nodes.shape[1])

    def __len__(self) -> int:
        return len(self.nodes)


@dataclass(frozen=True, eq=False)
class SolidModel(NotebookText):
    """Solid body by finite elements, three coordinates (x y z, m) a node, in the body's frame.

    Parameters
    ----------
    nodes : (n, 3) floats
        m.
    blocks : sequence of ElementBlock
        Several blocks may share a set's name.
    materials : mapping of set name to Material
    node_sets : mapping of name to node numbers
        Places for interfaces.
    surfaces : mapping of name to arrays (f, 8) or (f, 6) of node numbers
        Outer faces, in the order of `outer_faces`: places for interfaces.

    Raises
    ------
    ToolpointError
        For node numbers out of range, nodes in no element, sets without a material, elements inside out.

    Examples
    --------
    >>> from toolpoint.bodies.solid import STEEL, Casting, Cuboid
    >>> model = Casting([Cuboid((0, 0, 0), (0.1, 0.1, 0.1))], {"body": STEEL}).meshed(0.1)
    >>> model.element_count, round(model.mass_properties.mass, 6)
    (1, 7.85)
    """

    nodes: FloatArray
    blocks: tuple[ElementBlock, ...]
    materials: Mapping[str, Material]
    node_sets: Mapping[str, IndexArray] = field(default_factory=dict)
    surfaces: Mapping[str, tuple[IndexArray, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "nodes", floats("SolidModel.nodes", self.nodes, (None, 3)))
        put(self, "blocks", tuple(self.blocks))
        put(self, "node_sets", {name: frozen(np.asarray(numbers, dtype=np.int64)) for name, numbers in self.node_sets.items()})
        if not self.blocks:
            fail("SolidModel.blocks", "none", "must hold elements")
        self._check_numbers()
        without_material = [name for name in self.set_names if name not in self.materials]
        if without_material:
            fail("SolidModel.materials", f"none for {', '.join(without_material)}", "every set needs a material")

    def _check_numbers(self) -> None:
        """Refuse node numbers out of range, and nodes in no element."""
        count = len(self.nodes)
        is_used = np.zeros(count, dtype=bool)
        for block in self.blocks:
            if block.nodes.min() < 0 or block.nodes.max() >= count:
                fail("SolidModel.blocks", f"node number {int(block.nodes.max())}", f"must be within 0 .. {count - 1}")
            is_used[block.nodes] = True
        if not is_used.all():
            fail("SolidModel.nodes", f"{int((~is_used).sum())} nodes in no element, the first {int(np.argmin(is_used))}",
                 "every node must belong to an element", remedy="leave them out: they would have no stiffness")

    @property
    def set_names(self) -> tuple[str, ...]:
        """Names of the sets, in the order of their first elements."""
        return tuple(dict.fromkeys(block.name for block in self.blocks))

    @property
    def size(self) -> int:
        """Number of coordinates, three a node."""
        return 3 * len(self.nodes)

    @property
    def element_count(self) -> int:
        """Number of elements."""
        return sum(len(block) for block in self.blocks)

    @cached_property
    def stiffness_parts(self) -> dict[str, csc_array]:
        """Stiffness of each set with its own material, N/m; proportional to the set's Young's modulus."""
        return {name: self._sum(self._blocks_of(name), 3).columns() for name in self.set_names}

    @cached_property
    def mass_parts(self) -> dict[str, csc_array]:
        """Consistent mass of each set with its own density, kg; proportional to the density."""
        return {name: self._sum(self._blocks_of(name), 1).columns() for name in self.set_names}

    def _blocks_of(self, name: str) -> list[ElementBlock]:
        """Return the blocks of a set."""
        return [block for block in self.blocks if block.name == name]

    def _sum(self, blocks: Sequence[ElementBlock], width: int, pattern: NodePattern | None = None) -> NodeMatrix:
        """Return the stiffness (width 3) or mass (width 1) of some elements, each of its set's material, by node pairs."""
        pairs = pattern_of([block.nodes for block in blocks], len(self.nodes)) if pattern is None else pattern
        values = np.zeros((pairs.block_count, width, width))
        for block in blocks:
            matrices_of = _stiffness if width == 3 else _scalar_mass
            add_pairs(self.nodes, block.nodes, pairs, blocks=values,
                      matrices=partial(matrices_of, self.materials[block.name], block.kind))
        return NodeMatrix(pairs, values if width == 3 else values.ravel())

    def node_matrices(self) -> tuple[NodeMatrix, NodeMatrix]:
        """Return stiffness (N/m) and mass (kg) by node pairs, half of them stored: for a large body that is solved once."""
        # Stiffness and mass share one pattern, so that one order of elimination serves all their sums.
        pattern = pattern_of([block.nodes for block in self.blocks], len(self.nodes))
        return self._sum(self.blocks, 3, pattern), self._sum(self.blocks, 1, pattern)

    def assembled(self) -> tuple[csc_array, csc_array]:
        """Return stiffness (N/m) and mass (kg) without keeping their parts, as compressed columns."""
        stiffness, mass = self.node_matrices()
        return stiffness.columns(), mass.columns()

    def projected(self, name: str, motion: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return stiffness and mass (m, m) of a set in the shapes `motion` (size, m), summed by elements."""
        material, width = self.materials[name], motion.shape[1]
        by_node = motion.reshape(len(self.nodes), 3, width)
        total = np.zeros((2, width, width))
        for block in self.blocks:
            for part in chunks(len(block) if block.name == name else 0):
                places = self.nodes[block.nodes[part]]
                shapes = by_node[block.nodes[part]]
                flat = shapes.reshape(len(shapes), -1, width)
                total[0] += np.tensordot(flat, matrices.stiffness(block.kind, places, material) @ flat, ((0, 1), (0, 1)))
                masses = matrices.scalar_mass(block.kind, places, material.density)
                # A scalar mass serves all three directions: its product is a third of the work of the whole matrix.
                inertia = (masses @ shapes.reshape(len(shapes), block.nodes.shape[1], -1)).reshape(flat.shape)
                total[1] += np.tensordot(flat, inertia, ((0, 1), (0, 1)))
        return total[0], total[1]

    def stiffness(self, scales: Mapping[str, float] | None = None) -> csc_array:
        """Return the stiffness, N/m, each set's Young's modulus times its scale (1 where left out)."""
        return self._scaled(self.stiffness_parts, scales)

    def mass(self, scales: Mapping[str, float] | None = None) -> csc_array:
        """Return the mass, kg, each set's density times its scale (1 where left out)."""
        return self._scaled(self.mass_parts, scales)

    def _scaled(self, parts: Mapping[str, csc_array], scales: Mapping[str, float] | None) -> csc_array:
        """Return the sum of parts, each times its scale; an unknown set is refused."""
        factors = dict(scales or {})
        unknown_sets = sorted(set(factors) - set(parts))
        if unknown_sets:
            fail("scales", f"no set {unknown_sets[0]!r}", f"must be among {', '.join(parts)}")
        total = None
        for name, part in parts.items():
            factor = positive(f"scales[{name!r}]", factors.get(name, 1.0))
            # Most scales are one: a copy of a part of a large body would take as long as the sum itself.
            term = part if factor == 1 else csc_array(part * factor)
            total = term if total is None else csc_array(total + term)
        assert total is not None
        return total

    @cached_property
    def mass_properties(self) -> MassProperties:
        """Mass, centre and inertia by the elements' own integrals."""
        total, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
        # About the nodes' own middle: far from the origin, moments would be small differences of large sums.
        origin = self.nodes.mean(axis=0)
        for block in self.blocks:
            density = self.materials[block.name].density
            for part in chunks(len(block)):
                x = self.nodes[block.nodes[part]] - origin
                mass = matrices.scalar_mass(block.kind, x, density)
                total += float(mass.sum())
                first += np.einsum("eij,ejc->c", mass, x)
                second += np.einsum("eia,eij,ejb->ab", x, mass, x, optimize=True)
        centre = first / total
        second = second - total * np.outer(centre, centre)
        inertia = np.trace(second) * np.eye(3) - second
        return MassProperties(total, origin + centre, (inertia + inertia.T) / 2)

    def rigid_motion(self, about: FloatArray | tuple[float, float, float] = (0.0, 0.0, 0.0)) -> FloatArray:
        """Return the displacement of all coordinates per twist (v, w) about a point, shape (size, 6)."""
        arms = self.nodes - floats("about", about, (3,))
        motion = np.zeros((len(arms), 3, 6))
        motion[:, :, :3] = np.eye(3)
        for axis in range(3):
            motion[:, :, 3 + axis] = np.cross(np.eye(3)[axis], arms)
        return motion.reshape(-1, 6)

    def nodes_in(self, lower_corner: FloatArray | tuple[float, ...],
                 upper_corner: FloatArray | tuple[float, ...]) -> IndexArray:
        """Return the numbers of the nodes inside a box (m), its surface included."""
        a, b = floats("lower_corner", lower_corner, (3,)), floats("upper_corner", upper_corner, (3,))
        # Faces of a box fall on nodes, whose coordinates a file may have rounded.
        tolerance = 1e-9 * float(np.ptp(self.nodes, axis=0).max())
        return np.flatnonzero(((self.nodes >= a - tolerance) & (self.nodes <= b + tolerance)).all(axis=1))

    def coordinates_of(self, nodes: IndexArray) -> IndexArray:
        """Return the rows (x, y, z of each) of nodes."""
        return (3 * np.asarray(nodes)[:, None] + np.arange(3)).ravel()

    def free_coordinates(self, held: IndexArray) -> IndexArray:
        """Return the rows that are left where these nodes are held."""
        free = np.ones(self.size, dtype=bool)
        free[self.coordinates_of(held)] = False
        return np.flatnonzero(free)

    @property
    def dof_places(self) -> FloatArray:
        """Coordinates of the node of every row, shape (size, 3), m."""
        return np.repeat(self.nodes, 3, axis=0)

    def dofs(self, nodes: IndexArray) -> tuple[Dof, ...]:
        """Return labels of the rows of nodes; points are numbered from 1."""
        return tuple(Dof(int(i) + 1, d) for i in np.asarray(nodes) for d in ("+x", "+y", "+z"))

    def __repr__(self) -> str:
        kinds = " and ".join(dict.fromkeys(block.kind.name for block in self.blocks))
        return (f"SolidModel({self.element_count} {kinds} elements, {len(self.nodes)} nodes, {self.size} coordinates, "
                f"sets {', '.join(self.set_names)})")


def _stiffness(material: Material, kind: ElementKind, places: FloatArray) -> FloatArray:
    return matrices.stiffness(kind, places, material)


def _scalar_mass(material: Material, kind: ElementKind, places: FloatArray) -> FloatArray:
    return matrices.scalar_mass(kind, places, material.density)
