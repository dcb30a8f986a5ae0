"""Abaqus input files (.inp): nodes, C3D20 and C3D10 elements by their ELSET, node sets."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from toolpoint._check import ToolpointError
from toolpoint.io.door import door
from toolpoint.io.meshes.mesh_content import MeshContent, gather_mesh, real, whole

_WIDTHS = {"C3D20": 20, "C3D10": 10, "C3D8": 8, "C3D4": 4, "C3D15": 15, "C3D6": 6}


@door("Abaqus input file")
def read(path: Path) -> MeshContent:
    """Return the mesh of a flat file (no *INSTANCE with a place of its own)."""
    nodes: dict[int, tuple[float, float, float]] = {}
    elements: dict[tuple[str, int], list[list[int]]] = {}
    sets: dict[str, list[int]] = {}
    for line, keyword, options, rows in _cards(path):
        if keyword == "*INSTANCE" and rows:
            raise ToolpointError(f"{path}:{line}: an instance that is moved; must be a flat file (write one part alone)")
        if keyword == "*NODE":
            for row_line, words in rows:
                xyz = [real(path, row_line, word) for word in words[1:4]]
                nodes[whole(path, row_line, words[0])] = (xyz[0], xyz[1], xyz[2])
        elif keyword == "*ELEMENT" and options.get("TYPE", "").startswith("C3D"):
            width = next((_WIDTHS[k] for k in _WIDTHS if options["TYPE"].rstrip("RHMTIS") == k), 0)
            flat = [whole(path, row_line, word) for row_line, words in rows for word in words]
            if not width or len(flat) % (width + 1):
                raise ToolpointError(f"{path}:{line}: {len(flat)} numbers for {options['TYPE']}; it is cut off or unknown")
            block = elements.setdefault((options.get("ELSET", "body"), width), [])
            block += [flat[k + 1:k + 1 + width] for k in range(0, len(flat), width + 1)]
        elif keyword == "*NSET":
            sets.setdefault(options.get("NSET", "set"), []).extend(_members(path, options, rows))
    return gather_mesh(Path(path), nodes, elements, node_sets=sets)


def _members(path: Path, options: dict[str, str], rows: list[tuple[int, list[str]]]) -> list[int]:
    numbers = [(line, [whole(path, line, word) for word in words if word.lstrip("-").isdigit()]) for line, words in rows]
    if "GENERATE" in options:
        return [n for _, w in numbers for n in range(w[0], w[1] + 1, w[2] if len(w) > 2 else 1)]
    return [n for _, w in numbers for n in w]


def _cards(path: Path) -> Iterator[tuple[int, str, dict[str, str], list[tuple[int, list[str]]]]]:
    """Yield line, keyword, options and data lines of every keyword."""
    head: tuple[int, str, dict[str, str]] | None = None
    rows: list[tuple[int, list[str]]] = []
    for row_line, raw in enumerate(Path(path).read_text(encoding="latin-1").splitlines(), 1):
        line = raw.strip()
        if not line or line.startswith("**"):
            continue
        if line.startswith("*"):
            if head:
                yield *head, rows
            words = [word.strip() for word in line.split(",")]
            pairs = [word.partition("=") for word in words[1:]]
            head, rows = (row_line, words[0].upper(), {k.strip().upper(): v.strip() for k, _, v in pairs}), []
            if "TYPE" in head[2]:
                head[2]["TYPE"] = head[2]["TYPE"].upper()
        else:
            rows.append((row_line, [word.strip() for word in line.split(",") if word.strip()]))
    if head:
        yield *head, rows
