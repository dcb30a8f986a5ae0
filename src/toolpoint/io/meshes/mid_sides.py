"""Mid-side nodes for meshes of linear elements: the same straight edges, and elements that bend as the solid does."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.bodies.solid.element_kinds import HEX_SIDES, TET_SIDES

_SIDES_OF_WIDTH = {4: TET_SIDES, 8: HEX_SIDES}
LINEAR_WIDTHS = tuple(_SIDES_OF_WIDTH)  # nodes of an element without mid-sides


class MidSides:
    """Nodes of a mesh file, to which the middles of the edges of linear elements are added; neighbours share them."""

    def __init__(self, numbers: IndexArray, places: FloatArray) -> None:
        self._numbers, self._places = numbers, places
        self._middle_of: dict[tuple[int, int], int] = {}
        self.element_count = 0  # elements that were completed

    def completed(self, block: IndexArray) -> IndexArray:
        """Return elements (e, 10 or 20) of node numbers for those of 4 or 8; others as they are."""
        sides = _SIDES_OF_WIDTH.get(block.shape[1])
        if sides is None:
            return block
        self.element_count += len(block)
        edges = np.sort(block[:, sides].reshape(-1, 2), axis=1)
        pairs, place = np.unique(edges, axis=0, return_inverse=True)
        first_free = int(self._numbers.max()) + 1
        middles = np.array([self._middle_of.setdefault((a, b), first_free + len(self._middle_of)) for a, b in pairs.tolist()])
        return np.hstack([block, middles[place.ravel()].reshape(len(block), len(sides))])

    def joined(self, members: IndexArray) -> IndexArray:
        """Return a node set with the middles of edges between two of its nodes."""
        if not self._middle_of:
            return members
        is_member = set(members.tolist())
        middles = [middle for (a, b), middle in self._middle_of.items() if a in is_member and b in is_member]
        return np.concatenate([members, np.array(middles, dtype=np.int64)])

    @property
    def numbers(self) -> IndexArray:
        """Numbers of all nodes (n,), those of the middles last."""
        return np.concatenate([self._numbers, np.array(sorted(self._middle_of.values()), dtype=np.int64)])

    @property
    def places(self) -> FloatArray:
        """Places of all nodes (n, 3), in the file's unit."""
        if not self._middle_of:
            return self._places
        pairs = np.array([pair for pair, _ in sorted(self._middle_of.items(), key=lambda item: item[1])])
        return np.vstack([self._places, self._places[np.searchsorted(self._numbers, pairs)].mean(axis=1)])
