"""Nastran bulk data (.bdf, .nas, .dat): GRID, CHEXA, CTETRA, SET1, PSOLID and MAT1 in small, large and free fields."""

from __future__ import annotations

from pathlib import Path

from toolpoint.io.door import door
from toolpoint.io.matrices.bulk_cards import bulk_cards, bulk_lines
from toolpoint.io.meshes.mesh_content import NASTRAN_HEXAHEDRON, MeshContent, MeshMaterial, gather_mesh

_SOLIDS = {"CHEXA": 20, "CTETRA": 10, "CPENTA": 15, "CPYRAM": 13}  # nodes an element at most
# Elements that are no solids.
_OTHERS = frozenset({"CQUAD4", "CQUAD8", "CTRIA3", "CTRIA6", "CBAR", "CBEAM", "CROD", "CELAS1", "CELAS2", "CBUSH", "CONM2",
                     "RBE2", "RBE3"})


@door("Nastran bulk data file")
def read(path: Path) -> MeshContent:
    """Return the mesh; elements are set apart by their property's number, as ``property 1``."""
    nodes: dict[int, tuple[float, float, float]] = {}
    elements: dict[tuple[str, int], list[list[int]]] = {}
    for card in bulk_cards(path, ("GRID",)):
        if card.word(2) not in ("", "0"):
            card.refuse(f"in coordinate system {card.word(2)}", "must be in the basic one (0)")
        xyz = card.reals((3, 4, 5))
        nodes[card.whole(1)] = (xyz[0], xyz[1], xyz[2])
    for card in bulk_cards(path, _SOLIDS):
        node_count = _SOLIDS[card.keyword]
        members = [card.whole_of(word) for word in card.fields[3:3 + node_count] if word.strip()]
        if node_count == 20 and len(members) == 20:
            members = [members[k] for k in NASTRAN_HEXAHEDRON]
        elements.setdefault((f"property {card.whole(2)}", len(members)), []).append(members)
    return gather_mesh(Path(path), nodes, elements, node_sets=_node_sets(path), materials=_materials(path),
                       other_elements=_other_elements(path))


def _other_elements(path: Path) -> dict[str, int]:
    """Return the elements that are no solids, with the line of the first of each kind."""
    others: dict[str, int] = {}
    for _, number, line in bulk_lines(Path(path)):
        keyword = line[:8].split(",")[0].strip().rstrip("*").upper()
        if keyword in _OTHERS:
            others.setdefault(keyword, number)
    return others


def _node_sets(path: Path) -> dict[str, list[int]]:
    """Return the sets of SET1 cards, as ``SET1 7``; with ranges such as 1, THRU, 9."""
    sets = {}
    for card in bulk_cards(path, ("SET1",)):
        words = card.words(2)
        members: list[int] = []
        for k, word in enumerate(words):
            if word.upper() == "THRU":
                members += range(members[-1] + 1, card.whole_of(words[k + 1]) if k + 1 < len(words) else 0)
            else:
                members.append(card.whole_of(word))
        sets[f"SET1 {card.whole(1)}"] = members
    return sets


def _materials(path: Path) -> dict[str, MeshMaterial]:
    """Return the isotropic material (MAT1) of every property (PSOLID)."""
    materials = {}
    for card in bulk_cards(path, ("MAT1",)):
        modulus, shear, poisson, density = (card.real(k) if card.word(k) else None for k in (2, 3, 4, 5))
        if poisson is None:
            # A MAT1 states any two of E, G and nu: the third follows, and where only one stands it is that of steel.
            poisson = modulus / (2 * shear) - 1 if modulus and shear else 0.3
        materials[card.whole(1)] = MeshMaterial(f"MAT1 {card.word(1)}", modulus, density, poisson)
    return {f"property {card.whole(1)}": materials[number] for card in bulk_cards(path, ("PSOLID",))
            if (number := card.whole(2)) in materials}
