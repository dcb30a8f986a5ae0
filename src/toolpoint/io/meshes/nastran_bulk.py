"""Nastran bulk data (.bdf, .nas, .dat): GRID, CHEXA and CTETRA in small, large and free fields; sets are properties."""

from __future__ import annotations

from pathlib import Path

from toolpoint._check import ToolpointError
from toolpoint.io.door import door
from toolpoint.io.matrices.dmig import logical_cards
from toolpoint.io.meshes.mesh_content import NASTRAN_HEXAHEDRON, MeshContent, gather_mesh, real, whole


@door("Nastran bulk data file")
def read(path: Path) -> MeshContent:
    """Return the mesh; elements are set apart by their property's number, as ``property 1``."""
    nodes: dict[int, tuple[float, float, float]] = {}
    elements: dict[tuple[str, int], list[list[int]]] = {}
    for line, card in logical_cards(path, "GRID"):
        if len(card) > 2 and card[2].strip() not in ("", "0"):
            raise ToolpointError(f"{path}:{line}: GRID in coordinate system {card[2].strip()}; must be in the basic one (0)")
        xyz = [real(path, line, card[k]) if card[k].strip() else 0.0 for k in (3, 4, 5)]
        nodes[whole(path, line, card[1])] = (xyz[0], xyz[1], xyz[2])
    for keyword, node_count in (("CHEXA", 20), ("CTETRA", 10)):
        for line, card in logical_cards(path, keyword):
            members = [whole(path, line, word) for word in card[3:3 + node_count] if word.strip()]
            if node_count == 20 and len(members) == 20:
                members = [members[k] for k in NASTRAN_HEXAHEDRON]
            elements.setdefault((f"property {whole(path, line, card[2])}", len(members)), []).append(members)
    return gather_mesh(Path(path), nodes, elements)
