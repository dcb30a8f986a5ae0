"""CutSolid: a clamped solid model of which a path takes material away, and its stiffness and mass at any stage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.csgraph import connected_components

from toolpoint._check import FloatArray, IndexArray, fail
from toolpoint.bodies.solid import matrices
from toolpoint.bodies.solid.assembly import add_pairs
from toolpoint.bodies.solid.cut_elements import CutElements, Sweep
from toolpoint.bodies.solid.model import SolidModel
from toolpoint.vibration.sparse.node_matrix import NodeMatrix, NodePattern, pattern_of

_MIN_BREADTH_RATIO = 1e-9  # of the held nodes' length: below, they are a line
MAX_CUT_ELEMENTS = 30_000  # of a part: every stage is solved anew

_CutPart: TypeAlias = tuple[IndexArray, FloatArray, FloatArray, FloatArray]  # as `CutElements.cut_at` gives it


@dataclass(frozen=True, eq=False)
class CutState:
    """Part at a stage.

    free : rows of the model's coordinates that move; stiffness (N/m), mass (kg), loss (N/m: stiffness times loss factors) over
    these; coordinates : (free, 3), m; active : for each block of the model its elements with material; volume : m^3, and of
    pieces that are not joined to the held nodes, `loose_volume`, which are left out.
    """

    free: IndexArray
    stiffness: csc_array
    mass: csc_array
    loss: csc_array
    coordinates: FloatArray
    active: tuple[IndexArray, ...]
    volume: float
    loose_volume: float


@dataclass(frozen=True, eq=False)
class SpringHold:
    """Springs between a face and the ground: twist (size, 6) gives the face's mean motion W^T u (m, rad) about a place;
    stiffness (6, 6) of it, N/m; loss_factor. They add W K W^T to the part's stiffness."""

    twist: csc_array
    stiffness: FloatArray
    loss_factor: float = 0.0

    @property
    def nodes(self) -> IndexArray:
        """Numbers of the nodes that they hold."""
        return np.unique(self.twist.nonzero()[0] // 3)

    def on(self, free: IndexArray) -> csc_array:
        """Return what they add to the stiffness of the coordinates that move, N/m."""
        twist = csc_array(self.twist[free])
        return csc_array(twist @ csc_array(self.stiffness) @ twist.T)


class CutSolid:
    """Solid model under a path, held at nodes and by springs.

    model : SolidModel; held : numbers of nodes that do not move; sweep : the path, in the model's coordinates; springs : of
    faces that move.

    Raises ToolpointError for nodes that hold no body (fewer than three, or in one line), and too many elements.
    """

    def __init__(self, model: SolidModel, held: IndexArray, sweep: Sweep, springs: Sequence[SpringHold] = ()) -> None:
        self.springs = tuple(springs)
        anchored = np.unique(np.concatenate([held, *(spring.nodes for spring in springs)]).astype(np.int64))
        if model.element_count > MAX_CUT_ELEMENTS:
            fail("part", f"{model.element_count} elements", f"must be {MAX_CUT_ELEMENTS} at most: every stage is solved anew",
                 remedy="a larger mesh size; one element may be as thick as the wall")
        places = model.nodes[anchored]
        spread = np.linalg.svd(places - places.mean(axis=0), compute_uv=False) if len(anchored) > 2 else np.zeros(2)
        if spread[1] <= _MIN_BREADTH_RATIO * spread[0]:
            fail("held", f"{len(anchored)} nodes", "must be three at least, not in one line",
                 remedy="name a face that is clamped")
        self.model, self.held, self.sweep, self.anchored = model, np.unique(held).astype(np.int64), sweep, anchored
        self.blocks = tuple(CutElements(block.kind, block.nodes, model.nodes[block.nodes],
                                        material=model.materials[block.name], sweep=sweep) for block in model.blocks)

    @cached_property
    def events(self) -> IndexArray:
        """Pieces of the path that take something of the part away, sorted."""
        return np.unique(np.concatenate([block.events for block in self.blocks]))

    @cached_property
    def _pattern(self) -> NodePattern:
        return pattern_of([block.nodes for block in self.blocks], len(self.model.nodes))

    @cached_property
    def _loss_factor(self) -> float | None:
        """Loss factor of the whole part; None where its sets differ."""
        factors = {block.material.loss_factor for block in self.blocks}
        return factors.pop() if len(factors) == 1 else None

    @cached_property
    def _never_cut(self) -> list[FloatArray]:
        """Stiffness, mass and, of unlike sets, loss by node pairs of elements that the path does not meet."""
        count = self._pattern.block_count
        sums: list[FloatArray] = [np.zeros((count, 3, 3)), np.zeros((count, 1, 1))]
        sums += [np.zeros((count, 3, 3))] if self._loss_factor is None else []
        for block in self.blocks:
            self._add_whole(block, np.flatnonzero(block.time == self.sweep.count), sums)
        return sums

    def _add_whole(self, block: CutElements, chosen: IndexArray, sums: list[FloatArray]) -> None:
        """Add whole elements to the sums."""
        kind, material, factors = block.kind, block.material, (1.0, 1.0, block.material.loss_factor)

        def stiffness(places: FloatArray) -> FloatArray:
            return matrices.stiffness(kind, places, material)

        def mass(places: FloatArray) -> FloatArray:
            return matrices.scalar_mass(kind, places, material.density)

        def loss(places: FloatArray) -> FloatArray:
            return factors[2] * stiffness(places)

        for values, matrices_of in zip(sums, (stiffness, mass, loss), strict=False):
            add_pairs(self.model.nodes, block.nodes[chosen], self._pattern, blocks=values, matrices=matrices_of)

    def _add_cut(self, block: CutElements, part: _CutPart, kept: np.ndarray, sums: list[FloatArray]) -> None:
        """Add those of the cut elements that are kept to the sums."""
        from toolpoint.vibration.sparse import node_kernels

        number, stiffness, mass, _ = part
        if not kept.any():
            return
        for values, matrix in zip(sums, (stiffness, mass, block.material.loss_factor * stiffness), strict=False):
            node_kernels.scatter_pairs(block.nodes[number[kept]], np.ascontiguousarray(matrix[kept]), values.shape[1],
                                       self._pattern.pointers, self._pattern.columns, self._pattern.entries, values)

    def at(self, stage: int) -> CutState:
        """Return the part when `stage` pieces of the path have been cut.

        Raises ToolpointError where nothing of the held nodes is left.
        """
        sums = [part.copy() for part in self._never_cut]
        partial = [block.cut_at(stage) for block in self.blocks]
        uncut = [block.whole_at(stage) for block in self.blocks]
        active = [np.concatenate([elements, part[0]]) for elements, part in zip(uncut, partial, strict=True)]
        joined, loose_volume = self._joined(active, partial)
        for block, elements, part, keep in zip(self.blocks, uncut, partial, joined, strict=True):
            is_new = keep[:elements.size] & (block.time[elements] != self.sweep.count)
            self._add_whole(block, elements[is_new], sums)
            self._add_cut(block, part, keep[elements.size:], sums)
        kept = tuple(elements[keep] for elements, keep in zip(active, joined, strict=True))
        free = self._free(kept)
        columns = [NodeMatrix(self._pattern, part if part.shape[1] == 3 else part.ravel()).columns() for part in sums]
        stiffness, mass, *loss = (csc_array(part[free][:, free]) for part in columns)
        # One loss factor for all sets is a multiple of the stiffness: no second assembly.
        damped = loss[0] if loss else csc_array((self._loss_factor or 0.0) * stiffness)
        for spring in self.springs:
            held = spring.on(free)
            stiffness, damped = csc_array(stiffness + held), csc_array(damped + spring.loss_factor * held)
        return CutState(free, stiffness, mass, damped, self.model.dof_places[free], kept, self._volume(kept, partial),
                        loose_volume)

    def _free(self, active: Sequence[IndexArray]) -> IndexArray:
        is_free = np.zeros(len(self.model.nodes), bool)
        for block, elements in zip(self.blocks, active, strict=True):
            is_free[block.nodes[elements]] = True
        is_free[self.held] = False
        return np.flatnonzero(np.repeat(is_free, 3))

    def _joined(self, active: Sequence[IndexArray], partial: Sequence[_CutPart]) -> tuple[list[np.ndarray], float]:
        """Return which of the active elements are joined to the held nodes, and the volume of the others, m^3."""
        nodes = [block.nodes[elements] for block, elements in zip(self.blocks, active, strict=True)]
        total = sum(len(part) for part in nodes)
        rows = np.concatenate([part.ravel() for part in nodes])
        columns = np.concatenate([np.repeat(np.arange(len(part)), part.shape[1]) + start for part, start in zip(
            nodes, np.cumsum([0, *(len(part) for part in nodes[:-1])]), strict=True)])
        count = len(self.model.nodes)
        # Elements and nodes as the two sides of one graph: elements that share a node are joined, without a list of pairs.
        graph = coo_array((np.ones(rows.size, np.int8), (rows, count + columns)), shape=(count + total, count + total))
        label = connected_components(graph, directed=False)[1]
        elements = label[count:]
        is_held = np.isin(elements, np.unique(label[self.anchored]))
        if not is_held.any():
            fail("held", "no element is left at the held faces", "must stay until the end of the program",
                 remedy="hold the part where the program does not cut; are both in the same coordinates?")
        keep = np.split(is_held, np.cumsum([len(part) for part in nodes])[:-1])
        loose = [elements[~kept] for elements, kept in zip(active, keep, strict=True)]
        return list(keep), self._volume(loose, partial)

    def _volume(self, active: Sequence[IndexArray], partial: Sequence[_CutPart]) -> float:
        """Return the volume of material in active elements, m^3."""
        total = 0.0
        for block, elements, part in zip(self.blocks, active, partial, strict=True):
            share = np.ones(len(block.nodes))
            share[part[0]] = part[3]
            total += float((block.volumes[elements] * share[elements]).sum())
        return total
