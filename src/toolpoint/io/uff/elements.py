"""Set 2412 of universal files: finite elements, of which the edges are drawn as lines of the geometry.

Node orders are those of the format: an element of a surface lists its nodes around it, middle nodes included; a solid lists the
ring of its lower face, the middle nodes of its rising edges (parabolic elements), the ring of its upper face.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

from toolpoint._check import ToolpointError
from toolpoint.io.uff.sets import UniversalFile, UniversalSet

BEAMS = frozenset({11, 21, 22, 23, 24})  # a record of orientation stands between head and nodes
CURVES = BEAMS | {31, 32, 136, 137, 138, 139}
# Numbers of element kinds as I-DEAS gave them out, a decade a family.
SURFACES = frozenset({*range(41, 49), *range(51, 57), *range(61, 67), *range(71, 77), *range(81, 87), *range(91, 99)})
MOST_NODES = 100  # of an element; the largest solids have 27: a larger number is another field read as this one
# Solids by descriptor: nodes of the lower ring, of rising edges, of the upper ring.
SOLIDS = {101: (6, 3, 6), 102: (12, 6, 12), 103: (12, 8, 12), 104: (8, 0, 8), 105: (8, 4, 8), 106: (12, 8, 12),
          111: (3, 0, 1), 112: (3, 0, 3), 113: (6, 3, 6), 114: (9, 6, 9), 115: (4, 0, 4), 116: (8, 4, 8), 117: (12, 8, 12),
          118: (6, 3, 1)}


def edges(file: UniversalFile, dataset: UniversalSet) -> list[tuple[int, int]]:
    """Return the edges of all elements of a set 2412 as pairs of points, each once; elements of unknown kind are noted."""
    pairs: dict[tuple[int, int], None] = {}
    unknown: dict[int, int] = {}
    for kind, nodes in _elements(file, dataset):
        element = _edges(kind, nodes)
        if element is None:
            unknown[kind] = unknown.get(kind, 0) + 1
        else:
            pairs |= {(min(a, b), max(a, b)): None for a, b in element if a != b}
    for kind, count in unknown.items():
        file.repaired(f"{count} elements of kind {kind} in a set 2412 are not drawn: the order of their nodes is not known")
    return list(pairs)


def _elements(file: UniversalFile, dataset: UniversalSet) -> Iterable[tuple[int, list[int]]]:
    lines = [line for line in file.text(dataset).splitlines() if line.strip()]
    position = 0
    while position < len(lines):
        head = _whole(file, lines[position])
        if len(head) < 6 or not 0 < head[5] <= MOST_NODES:
            raise ToolpointError(f"{file.path}: element {lines[position].strip()[:60]!r} of a set 2412; must give six whole "
                                 f"numbers, the last of them its 1 to {MOST_NODES} nodes")
        position += 2 if head[1] in BEAMS else 1
        nodes: list[int] = []
        while len(nodes) < head[5] and position < len(lines):
            nodes += _whole(file, lines[position])
            position += 1
        if len(nodes) != head[5]:
            raise ToolpointError(f"{file.path}: element {head[0]} of a set 2412 lists {len(nodes)} nodes; must be {head[5]}; "
                                 "the file is damaged")
        yield head[1], nodes


def _edges(kind: int, nodes: Sequence[int]) -> list[tuple[int, int]] | None:
    """Return the edges of one element; nothing for a lumped mass or a rigid element's single node, None where unknown."""
    if len(nodes) == 1:
        return []
    if kind in CURVES or len(nodes) == 2:
        return list(pairwise(nodes))
    if kind in SURFACES:
        return list(pairwise((*nodes, nodes[0])))
    if kind in SOLIDS and len(nodes) == sum(SOLIDS[kind]):
        return _solid(nodes, SOLIDS[kind])
    return None


def _solid(nodes: Sequence[int], parts: tuple[int, int, int]) -> list[tuple[int, int]]:
    lower, rising, upper = nodes[:parts[0]], nodes[parts[0]:parts[0] + parts[1]], nodes[parts[0] + parts[1]:]
    pairs = list(pairwise((*lower, lower[0])))
    if len(upper) > 1:
        pairs += pairwise((*upper, upper[0]))
    corners = 4 if len(lower) % 4 == 0 else 3
    step = len(lower) // corners
    between = len(rising) // corners
    for corner in range(corners):
        upper_corner = upper[corner * step] if len(upper) > 1 else upper[0]
        # Cubic elements list the lower and the upper middle nodes of all edges in turn.
        middle = [rising[corner + k * corners] for k in range(between)]
        pairs += pairwise((lower[corner * step], *middle, upper_corner))
    return pairs


def _whole(file: UniversalFile, line: str) -> list[int]:
    words = line.split()
    if any(len(word) > 10 for word in words):  # columns that touch
        words = [line[start:start + 10] for start in range(0, len(line.rstrip()), 10)]
    try:
        return [int(word) for word in words]
    except ValueError:
        raise ToolpointError(f"{file.path}: {line.strip()[:60]!r} in a set 2412 where whole numbers must stand") from None
