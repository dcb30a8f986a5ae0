"""MeshContent: nodes, solid elements and sets as a mesh file holds them, before units and materials are given."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, IndexArray, ToolpointError

# Mid-sides of the top and of the uprights change places between programs.
NASTRAN_HEXAHEDRON = (*range(12), 16, 17, 18, 19, 12, 13, 14, 15)


@dataclass(frozen=True, eq=False)
class MeshContent:
    """Node numbers (n,), coordinates (n, 3) in the file's unit, elements (e, 20 or 10) of node numbers by set, node sets."""

    numbers: IndexArray
    places: FloatArray
    elements: Mapping[str, IndexArray]
    node_sets: Mapping[str, IndexArray] = field(default_factory=dict)


def gather_mesh(
    path: Path, nodes: Mapping[int, tuple[float, float, float]], elements: Mapping[tuple[str, int], list[list[int]]],
    *, node_sets: Mapping[str, list[int]] | None = None,
) -> MeshContent:
    """Return the content of what was read; elements by (set, nodes an element). Raises where they name missing nodes."""
    if not nodes or not elements:
        raise ToolpointError(f"{path}: {len(nodes)} nodes and {len(elements)} kinds of solid elements; must hold both")
    numbers = np.array(sorted(nodes), dtype=np.int64)
    places = np.array([nodes[int(n)] for n in numbers], dtype=float)
    if not np.isfinite(places).all():
        raise ToolpointError(f"{path}: coordinates that are not finite; damaged")
    blocks = {}
    for (name, width), rows in elements.items():
        if width not in (10, 20):
            raise ToolpointError(f"{path}: solid elements of {width} nodes in {name}; must have 10 (tetrahedra) or 20 "
                                 "(hexahedra): linear elements are far too stiff in bending, mesh again with mid-side nodes")
        block = np.array(rows, dtype=np.int64)
        if not np.isin(block, numbers).all():
            missing_node = int(block[~np.isin(block, numbers)][0])
            raise ToolpointError(f"{path}: an element of {name} names node {missing_node}, which the file does not hold; it is "
                                 f"cut off")
        if len({name for name, _ in elements}) < len(elements):
            name = f"{name} {width}"
        blocks[name] = block
    return MeshContent(numbers, places, blocks, {key: np.array(v, dtype=np.int64) for key, v in (node_sets or {}).items()})


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
