"""MeshContent: nodes, solid elements, sets, surfaces and materials as a mesh file holds them, before units are given."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, IndexArray, ToolpointError
from toolpoint.io.meshes.mid_sides import LINEAR_WIDTHS, MidSides

# Mid-sides of the top and of the uprights change places between programs.
NASTRAN_HEXAHEDRON = (*range(12), 16, 17, 18, 19, 12, 13, 14, 15)


@dataclass(frozen=True)
class MeshMaterial:
    """Young's modulus, density and Poisson's ratio as the file states them, in the file's own units; None where it does not."""

    name: str
    modulus: float | None = None
    density: float | None = None
    poisson: float = 0.3


@dataclass(frozen=True, eq=False)
class MeshContent:
    """Content of a mesh file.

    numbers : (n,) of nodes; places : (n, 3) in the file's unit; elements : set to (e, 20 or 10) node numbers.
    surfaces : name to corner numbers of each face, sorted; materials : set to its material.
    notes : what was done to it.
    """

    numbers: IndexArray
    places: FloatArray
    elements: Mapping[str, IndexArray]
    node_sets: Mapping[str, IndexArray] = field(default_factory=dict)
    surfaces: Mapping[str, tuple[tuple[int, ...], ...]] = field(default_factory=dict)
    materials: Mapping[str, MeshMaterial] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def gather_mesh(
    path: Path, nodes: Mapping[int, tuple[float, float, float]], elements: Mapping[tuple[str, int], list[list[int]]],
    *, node_sets: Mapping[str, list[int]] | None = None, surfaces: Mapping[str, Iterable[tuple[int, ...]]] | None = None,
    materials: Mapping[str, MeshMaterial] | None = None, other_elements: Mapping[str, int] | None = None,
) -> MeshContent:
    """Return the content of what was read; elements by (set, nodes an element). Raises where they name missing nodes.

    other_elements : kind of elements that are no solids to the line of the first, for the message where there are no others.
    """
    if not nodes:
        raise ToolpointError(f"{path}: no nodes; must hold nodes and solid elements")
    if not elements:
        others = "; its elements are " + ", ".join(f"{kind} (line {line})" for kind, line in list(other_elements.items())[:5]
                                                   ) if other_elements else ""
        raise ToolpointError(f"{path}: {len(nodes)} nodes and no solid elements{others}; must hold tetrahedra or hexahedra")
    numbers = np.array(sorted(nodes), dtype=np.int64)
    places = np.array([nodes[int(n)] for n in numbers], dtype=float)
    if not np.isfinite(places).all():
        raise ToolpointError(f"{path}: coordinates that are not finite; damaged")
    middles = MidSides(numbers, places)
    blocks = {name: middles.completed(block) for name, block in _blocks(path, elements, numbers).items()}
    sets = {name: middles.joined(np.array(members, dtype=np.int64)) for name, members in (node_sets or {}).items()}
    faces = {name: tuple(tuple(sorted(face)) for face in rows) for name, rows in (surfaces or {}).items()}
    notes = [f"left out: elements that are no solids, {', '.join(other_elements)}"] if other_elements else []
    if middles.element_count:
        notes.append(f"{middles.element_count} elements with straight edges (4 or 8 nodes) were given mid-side nodes: linear "
                     "ones are far too stiff in bending")
    return MeshContent(middles.numbers, middles.places, blocks, sets, faces, dict(materials or {}), tuple(notes))


def _blocks(path: Path, elements: Mapping[tuple[str, int], list[list[int]]], numbers: IndexArray) -> dict[str, IndexArray]:
    """Return set to elements, checked for their width and their nodes."""
    blocks: dict[str, IndexArray] = {}
    has_one_width = len({name for name, _ in elements}) == len(elements)
    for (name, width), rows in elements.items():
        if width not in (10, 20, *LINEAR_WIDTHS):
            raise ToolpointError(f"{path}: solid elements of {width} nodes in {name}; must have 4 or 10 (tetrahedra), or 8 or "
                                 "20 (hexahedra)")
        block = np.array(rows, dtype=np.int64)
        if not np.isin(block, numbers).all():
            row, column = np.argwhere(~np.isin(block, numbers))[0]
            first_nodes = ", ".join(map(str, block[row][:4])) + (" ..." if width > 4 else "")
            raise ToolpointError(f"{path}: element {row + 1} of {name} (nodes {first_nodes}) names node {block[row, column]}, "
                                 "which the file does not hold; it is cut off, or the element is wrong")
        blocks[name if has_one_width else f"{name} {width}"] = block
    return blocks


def real(path: Path, line: int, word: str) -> float:
    """Return a number as finite-element programs write it (1.5, 1.5+3, 1.5D3), or say where it is none."""
    text = word.strip().upper().replace("D", "E")
    if "E" not in text:
        text = re.sub(r"(?<=[0-9.])([+-]\d+)$", r"E\1", text)
    try:
        return float(text)
    except ValueError:
        raise ToolpointError(f"{path}:{line}: {word.strip()!r}; must be a number") from None


def whole(path: Path, line: int, word: str) -> int:
    """Return a whole number, or say where it is none."""
    try:
        return int(word)
    except ValueError:
        raise ToolpointError(f"{path}:{line}: {word.strip()!r}; must be a whole number") from None
