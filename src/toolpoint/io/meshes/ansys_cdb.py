"""Ansys archive files (.cdb, CDWRITE): NBLOCK, EBLOCK of solids, CMBLOCK node sets, and materials by MP and MPDATA."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from toolpoint._check import ToolpointError
from toolpoint.io.door import door
from toolpoint.io.meshes.mesh_content import MeshContent, MeshMaterial, gather_mesh, real, whole

# Material, type, real constants, section, system, death, solid model, shape, number of nodes, one unused, number of the
# element; then its nodes begin.
_FIELDS_BEFORE_NODES = 11
_SOLID_KINDS = (45, 92, 95, 185, 186, 187)  # numbers of the solid elements with 4, 8, 10 or 20 nodes
_KEY_OF_LABEL = {"EX": "modulus", "DENS": "density", "NUXY": "poisson", "PRXY": "poisson"}


@dataclass
class _Archive:
    """Content of an archive as far as it was read."""

    path: Path
    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    elements: dict[tuple[str, int], list[list[int]]] = field(default_factory=dict)
    node_sets: dict[str, list[int]] = field(default_factory=dict)
    kinds: dict[int, int] = field(default_factory=dict)  # type number to the element's own number
    materials: dict[str, MeshMaterial] = field(default_factory=dict)
    other_elements: dict[str, int] = field(default_factory=dict)


@door("Ansys archive file")
def read(path: Path) -> MeshContent:
    """Return the mesh of the blocked form (CDWRITE with the BLOCKED format); elements are set apart as ``material 1``."""
    lines = Path(path).read_text(encoding="latin-1").splitlines()
    archive = _Archive(Path(path))
    index = 0
    while index < len(lines):
        words = [word.strip().upper() for word in lines[index].split(",")]
        if words[0] == "NBLOCK":
            index = _nodes(path, lines, index, archive.nodes)
        elif words[0] == "EBLOCK":
            index = _elements(archive, lines, index)
        elif words[0] == "CMBLOCK" and words[2].startswith("NODE"):
            index = _component(path, lines, index, archive.node_sets)
        else:
            _take_command(archive, index + 1, words)
            index += 1
    return gather_mesh(archive.path, archive.nodes, archive.elements, node_sets=archive.node_sets,
                       materials={name: material for name, material in archive.materials.items()
                                  if name in {name for name, _ in archive.elements}}, other_elements=archive.other_elements)


def _take_command(archive: _Archive, line: int, words: list[str]) -> None:
    """Add a type of elements (ET), or a number of a material (MP, MPDATA)."""
    if words[0] == "ET" and len(words) > 2 and words[1].isdigit() and (number := re.search(r"\d+$", words[2])):
        archive.kinds[int(words[1])] = int(number[0])
    label, material, value = "", "", ""
    if words[0] == "MP" and len(words) > 3:
        label, material, value = words[1:4]
    elif words[0] == "MPDATA" and len(words) > 6 and words[2].isdigit():
        label, material, value = words[3], words[4], words[6]
    if label in _KEY_OF_LABEL and value:
        name = f"material {whole(archive.path, line, material)}"
        stated = archive.materials.get(name, MeshMaterial(name))
        numbers: dict[str, Any] = {_KEY_OF_LABEL[label]: real(archive.path, line, value)}
        archive.materials[name] = replace(stated, **numbers)


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


def _elements(archive: _Archive, lines: list[str], index: int) -> int:
    path = archive.path
    if "SOLID" not in lines[index].upper():
        raise ToolpointError(f"{path}:{index + 1}: EBLOCK without SOLID; must be written in the solid form (CDWRITE)")
    _, width = _widths(path, lines, index + 1)[0]
    pending: list[int] = []
    for k in range(index + 2, len(lines)):
        if lines[k].strip() == "-1":
            return k + 1
        pending += [whole(path, k + 1, lines[k][c:c + width]) for c in range(0, len(lines[k].rstrip()), width)]
        if len(pending) >= _FIELDS_BEFORE_NODES and len(pending) >= _FIELDS_BEFORE_NODES + pending[8]:
            _take_element(archive, k + 1, pending)
            pending = []
    raise ToolpointError(f"{path}: elements go on to the end of the file; it is cut off")


def _take_element(archive: _Archive, line: int, row: list[int]) -> None:
    """Add a solid element, or note the kind of another; `row` is material, type ... number of nodes ... element, nodes."""
    kind, members = archive.kinds.get(row[1]), row[_FIELDS_BEFORE_NODES:]
    if kind is not None and kind not in _SOLID_KINDS:
        archive.other_elements.setdefault(f"type {kind}", line)
        return
    if kind is None and len(members) in (4, 8):
        raise ToolpointError(f"{archive.path}:{line}: element {row[10]} of {len(members)} nodes without its type; must follow "
                             "an ET command, which tells solids from contacts")
    if len(members) == 8 and len(set(members)) == 4:
        members = [members[place] for place in (0, 1, 2, 4)]  # a tetrahedron written as a hexahedron: I, J, K, K, M, M, M, M
    if len(set(members)) < len(members):
        raise ToolpointError(f"{archive.path}:{line}: element {row[10]} is a degenerate hexahedron; nodes must differ "
                             "(mesh with SOLID187 tetrahedra instead)")
    archive.elements.setdefault((f"material {row[0]}", len(members)), []).append(members)


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
