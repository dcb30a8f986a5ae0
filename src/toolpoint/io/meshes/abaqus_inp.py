"""Abaqus input files (.inp): nodes, C3D elements by their ELSET, node sets, surfaces, and isotropic materials of sections."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from toolpoint._check import ToolpointError
from toolpoint.io.door import door
from toolpoint.io.meshes.mesh_content import MeshContent, MeshMaterial, gather_mesh, real, whole

_WIDTHS = {"C3D20": 20, "C3D10": 10, "C3D8": 8, "C3D4": 4, "C3D15": 15, "C3D6": 6}
# Wedges (15 and 6 nodes) are not here: they are named as elements that are not read.
_CORNERS = {20: 8, 10: 4, 8: 8, 4: 4}
# Corners of the sides S1, S2 ... of an element with 8 and with 4 corners.
_SIDES = {8: ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
          4: ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))}


@dataclass
class _Deck:
    """Content of an input file as far as it was read; names of sets as the file writes them."""

    path: Path
    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    elements: dict[tuple[str, int], list[list[int]]] = field(default_factory=dict)
    members: dict[int, list[int]] = field(default_factory=dict)  # element to its nodes
    node_sets: dict[str, list[int]] = field(default_factory=dict)
    element_sets: dict[str, list[int]] = field(default_factory=dict)
    surfaces: dict[str, list[tuple[int, ...]]] = field(default_factory=dict)
    materials: dict[str, MeshMaterial] = field(default_factory=dict)
    material_of_set: dict[str, str] = field(default_factory=dict)
    other_elements: dict[str, int] = field(default_factory=dict)
    material: str = ""


@door("Abaqus input file")
def read(path: Path) -> MeshContent:
    """Return the mesh of a flat file (no *INSTANCE with a place of its own)."""
    deck = _Deck(Path(path))
    for line, keyword, options, rows in _cards(path):
        _take(deck, line, keyword, options=options, rows=rows)
    # A section may stand for a set of elements that the elements do not name themselves: the whole mesh then.
    sets = {name for name, _ in deck.elements}
    materials = {name: deck.materials[material] for name, material in deck.material_of_set.items()
                 if material in deck.materials}
    if len(sets) == 1 and not sets & set(materials) and len(set(materials.values())) == 1:
        materials = dict.fromkeys(sets, next(iter(materials.values())))
    return gather_mesh(deck.path, deck.nodes, deck.elements, node_sets=deck.node_sets, surfaces=deck.surfaces,
                       materials={name: material for name, material in materials.items() if name in sets},
                       other_elements=deck.other_elements)


def _take(deck: _Deck, line: int, keyword: str, *, options: dict[str, str], rows: list[tuple[int, list[str]]]) -> None:
    """Add what a keyword and its data lines say."""
    path = deck.path
    if keyword == "*INSTANCE" and rows:
        raise ToolpointError(f"{path}:{line}: an instance that is moved; must be a flat file (write one part alone)")
    if keyword == "*NODE":
        for row_line, words in rows:
            xyz = [real(path, row_line, word) for word in words[1:4]]
            deck.nodes[whole(path, row_line, words[0])] = (xyz[0], xyz[1], xyz[2])
        if "NSET" in options:
            deck.node_sets.setdefault(options["NSET"], []).extend(whole(path, n, words[0]) for n, words in rows)
    elif keyword == "*ELEMENT":
        _take_elements(deck, line, options, rows=rows)
    elif keyword == "*NSET":
        deck.node_sets.setdefault(options.get("NSET", "set"), []).extend(_members(path, options, rows, sets=deck.node_sets))
    elif keyword == "*ELSET":
        deck.element_sets.setdefault(options.get("ELSET", "set"), []).extend(
            _members(path, options, rows, sets=deck.element_sets))
    elif keyword == "*SURFACE":
        _take_surface(deck, options, rows)
    else:
        _take_material(deck, keyword, options, rows=rows)


def _take_elements(deck: _Deck, line: int, options: dict[str, str], *, rows: list[tuple[int, list[str]]]) -> None:
    kind = options.get("TYPE", "")
    if not kind.startswith("C3D"):
        deck.other_elements.setdefault(kind or "without TYPE", line)
        return
    width = next((_WIDTHS[k] for k in _WIDTHS if kind.rstrip("RHMTIS") == k), 0)
    flat = [whole(deck.path, row_line, word) for row_line, words in rows for word in words]
    if not width or len(flat) % (width + 1):
        raise ToolpointError(f"{deck.path}:{line}: {len(flat)} numbers for {kind}; it is cut off or unknown")
    block = deck.elements.setdefault((options.get("ELSET", "body"), width), [])
    for k in range(0, len(flat), width + 1):
        block.append(flat[k + 1:k + 1 + width])
        deck.members[flat[k]] = block[-1]
        deck.element_sets.setdefault(options.get("ELSET", "body"), []).append(flat[k])


def _take_surface(deck: _Deck, options: dict[str, str], rows: list[tuple[int, list[str]]]) -> None:
    """Add the faces of a surface by elements and sides (S1 ...), or the nodes of one by nodes."""
    name = options.get("NAME", "surface")
    for row_line, words in rows:
        if options.get("TYPE", "ELEMENT").upper() == "NODE":
            deck.node_sets.setdefault(name, []).extend(_numbers_of(deck.path, row_line, words[0], sets=deck.node_sets))
            continue
        side = words[1].upper() if len(words) > 1 else ""
        if side and not (side.startswith("S") and side[1:].isdigit()):
            raise ToolpointError(f"{deck.path}:{row_line}: surface {name} names the side {side!r}; must be S1, S2 ...")
        for element in _numbers_of(deck.path, row_line, words[0], sets=deck.element_sets):
            nodes = deck.members.get(element, [])
            sides = _SIDES.get(_CORNERS.get(len(nodes), 0), ())
            if not sides or int(side[1:] or 1) not in range(1, len(sides) + 1):
                raise ToolpointError(f"{deck.path}:{row_line}: surface {name} names element {element} {side}, which the file "
                                     "does not hold before it")
            # Without a side all of the element; those inside the body are left out later.
            chosen = [sides[int(side[1:]) - 1]] if side else sides
            deck.surfaces.setdefault(name, []).extend(tuple(nodes[corner] for corner in corners) for corners in chosen)


def _take_material(deck: _Deck, keyword: str, options: dict[str, str], *, rows: list[tuple[int, list[str]]]) -> None:
    """Add isotropic elasticity and density of a material, and which set a section gives it to."""
    if keyword == "*MATERIAL":
        deck.material = options.get("NAME", "")
        deck.materials[deck.material] = MeshMaterial(deck.material)
    elif keyword == "*SOLID SECTION" and options.get("ELSET") and options.get("MATERIAL"):
        deck.material_of_set[options["ELSET"]] = options["MATERIAL"]
    elif keyword in ("*ELASTIC", "*DENSITY") and deck.material in deck.materials and rows:
        line, words = rows[0]
        values = [real(deck.path, line, word) for word in words[:2]]
        material = deck.materials[deck.material]
        if keyword == "*DENSITY":
            deck.materials[deck.material] = replace(material, density=values[0])
        elif options.get("TYPE", "ISOTROPIC").upper().startswith("ISO"):
            poisson = values[1] if len(values) > 1 else material.poisson
            deck.materials[deck.material] = replace(material, modulus=values[0], poisson=poisson)


def _numbers_of(path: Path, line: int, word: str, *, sets: dict[str, list[int]]) -> list[int]:
    """Return the number that a word is, or the members of the set that it names."""
    if word.lstrip("-").isdigit():
        return [whole(path, line, word)]
    name = next((key for key in sets if key.upper() == word.upper()), None)
    if name is None:
        raise ToolpointError(f"{path}:{line}: set {word!r}, which the file does not hold before it")
    return sets[name]


def _members(path: Path, options: dict[str, str], rows: list[tuple[int, list[str]]], *, sets: dict[str, list[int]]
             ) -> list[int]:
    if "GENERATE" in options:
        numbers = [[whole(path, line, word) for word in words] for line, words in rows]
        return [n for w in numbers for n in range(w[0], w[1] + 1, w[2] if len(w) > 2 else 1)]
    return [n for line, words in rows for word in words for n in _numbers_of(path, line, word, sets=sets)]


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
