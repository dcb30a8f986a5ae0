"""Ansys archive files (.cdb, CDWRITE): NBLOCK and EBLOCK of SOLID186 and SOLID187; sets are materials, CMBLOCK node sets."""

from __future__ import annotations

import re
from pathlib import Path

from toolpoint._check import ToolpointError
from toolpoint.io.door import door
from toolpoint.io.meshes.mesh_content import MeshContent, gather_mesh, real, whole

_FIELDS_BEFORE_NODES = 11


@door("Ansys archive file")
def read(path: Path) -> MeshContent:
    """Return the mesh of the blocked form (CDWRITE with the BLOCKED format); elements are set apart as ``material 1``."""
    lines = Path(path).read_text(encoding="latin-1").splitlines()
    nodes: dict[int, tuple[float, float, float]] = {}
    elements: dict[tuple[str, int], list[list[int]]] = {}
    sets: dict[str, list[int]] = {}
    index = 0
    while index < len(lines):
        word = lines[index].split(",")[0].strip().upper()
        if word == "NBLOCK":
            index = _nodes(path, lines, index, nodes)
        elif word == "EBLOCK":
            index = _elements(path, lines, index, elements)
        elif word == "CMBLOCK" and lines[index].upper().split(",")[2].strip().startswith("NODE"):
            index = _component(path, lines, index, sets)
        else:
            index += 1
    return gather_mesh(Path(path), nodes, elements, node_sets=sets)


def _widths(path: Path, lines: list[str], index: int) -> list[tuple[int, int]]:
    """Return (count, width) of the groups of a format such as (3i9,6e21.13e3)."""
    groups = re.findall(r"(\d+)[ieIE](\d+)(?:\.\d+(?:[eE]\d+)?)?", lines[index]) if index < len(lines) else []
    if not groups:
        raise ToolpointError(f"{path}:{index + 1}: no format such as (3i9,6e21.13) after the head of a block; it is cut off")
    return [(int(count), int(width)) for count, width in groups]


def _nodes(path: Path, lines: list[str], index: int, nodes: dict[int, tuple[float, float, float]]) -> int:
    groups = _widths(path, lines, index + 1)
    (count, width), (_, coordinate_width) = groups[0], groups[-1]
    for k in range(index + 2, len(lines)):
        line = lines[k]
        if line.strip().startswith(("-1", "N,")) or not line[:width].strip().lstrip("-").isdigit():
            return k + 1
        first = count * width
        xyz = [line[first + coordinate_width * a:first + coordinate_width * (a + 1)] for a in range(3)]
        values = [real(path, k + 1, word) if word.strip() else 0.0 for word in xyz]
        nodes[whole(path, k + 1, line[:width])] = (values[0], values[1], values[2])
    raise ToolpointError(f"{path}: nodes go on to the end of the file; it is cut off")


def _elements(path: Path, lines: list[str], index: int, elements: dict[tuple[str, int], list[list[int]]]) -> int:
    if "SOLID" not in lines[index].upper():
        raise ToolpointError(f"{path}:{index + 1}: EBLOCK without SOLID; must be written in the solid form (CDWRITE)")
    _, width = _widths(path, lines, index + 1)[0]
    pending: list[int] = []
    for k in range(index + 2, len(lines)):
        if lines[k].strip() == "-1":
            return k + 1
        pending += [whole(path, k + 1, lines[k][c:c + width]) for c in range(0, len(lines[k].rstrip()), width)]
        if len(pending) >= _FIELDS_BEFORE_NODES and len(pending) >= _FIELDS_BEFORE_NODES + pending[8]:
            members = pending[_FIELDS_BEFORE_NODES:]
            if len(set(members)) < len(members):
                raise ToolpointError(f"{path}:{k + 1}: element {pending[10]} is a degenerate hexahedron; nodes must differ "
                                     "(mesh with SOLID187 tetrahedra instead)")
            elements.setdefault((f"material {pending[0]}", len(members)), []).append(members)
            pending = []
    raise ToolpointError(f"{path}: elements go on to the end of the file; it is cut off")


def _component(path: Path, lines: list[str], index: int, sets: dict[str, list[int]]) -> int:
    words = lines[index].split(",")
    count = whole(path, index + 1, words[3].split("!")[0])
    (_, width), = _widths(path, lines, index + 1)[:1]
    numbers: list[int] = []
    index += 2
    while len(numbers) < count:
        if index >= len(lines):
            raise ToolpointError(f"{path}: component {words[1].strip()} ends after {len(numbers)} of {count} numbers")
        numbers += [whole(path, index + 1, lines[index][c:c + width]) for c in range(0, len(lines[index].rstrip()), width)]
        index += 1
    # A negative number ends a range that the one before it began.
    members: list[int] = []
    for number in numbers:
        members += range(members[-1] + 1, -number + 1) if number < 0 else [number]
    sets[words[1].strip()] = members
    return index
