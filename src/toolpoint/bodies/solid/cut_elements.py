"""CutElements: elements of one set that a path cuts, when each goes, and their matrices over what is left at a stage."""

from __future__ import annotations

from functools import cached_property
from typing import Protocol

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.bodies.solid import matrices
from toolpoint.bodies.solid.cut_lines import (
    LINE_COUNT,
    LINE_NODES,
    LINE_PLACES,
    PROBE_PLACES,
    on_lines,
    parents_of,
    probe_cube,
    runs_of,
)
from toolpoint.bodies.solid.element_kinds import ElementKind
from toolpoint.bodies.solid.material import Material

_PROBED_ELEMENTS = 400  # probed at once: over a million places
_INTEGRATED_ELEMENTS = 48  # cut elements integrated at once: 50 MB of gradients
MIN_FILL = 1e-5  # of an element's volume: with less left it is gone
_VOID_STIFFNESS_RATIO = 1e-7  # of the whole element, that a cut one keeps: nodes out of the material stay where they are
MIXED_TIME = -1  # of an element whose places go at different pieces


class Sweep(Protocol):
    """Path that takes material away: its pieces, when each place goes, and where one move has cut."""

    @property
    def count(self) -> int: ...

    @property
    def box(self) -> FloatArray: ...

    def first_pieces(self, places: FloatArray) -> IndexArray: ...

    def is_swept(self, places: FloatArray, owner: IndexArray, stage: int) -> np.ndarray: ...


class CutElements:
    """Elements of one kind and material under a path.

    nodes : (e, nodes) numbers; corners : (e, nodes, 3), m; time : (e,) the piece that takes an element away, the number of
    pieces where none does, `MIXED_TIME` where its places go at different pieces.
    """

    def __init__(self, kind: ElementKind, nodes: IndexArray, corners: FloatArray, *, material: Material, sweep: Sweep) -> None:
        self.kind, self.nodes, self.corners, self.material, self.sweep = kind, nodes, corners, material, sweep
        self.time = np.full(len(nodes), sweep.count, np.int64)
        axis = np.zeros(len(nodes), np.int64)
        box = sweep.box
        within_reach = np.flatnonzero((corners.max(axis=1) >= box[0]).all(axis=1) & (corners.min(axis=1) <= box[1]).all(axis=1))
        for start in range(0, within_reach.size, _PROBED_ELEMENTS):
            part = within_reach[start:start + _PROBED_ELEMENTS]
            self.time[part], axis[part] = self._probe(part)
        self.mixed = np.flatnonzero(self.time == MIXED_TIME)
        self.axis = axis[self.mixed]
        self.line_times = np.concatenate([np.zeros((0, LINE_COUNT, LINE_NODES), np.int32), *(
            self._times_on_lines(self.mixed[start:start + _PROBED_ELEMENTS], self.axis[start:start + _PROBED_ELEMENTS])
            for start in range(0, self.mixed.size, _PROBED_ELEMENTS))])
        self._kept: dict[tuple[int, bytes], tuple[FloatArray, FloatArray, float]] = {}

    @cached_property
    def volumes(self) -> FloatArray:
        """Volumes of the whole elements, m^3."""
        return volumes_of(self.kind, self.corners)

    @property
    def events(self) -> IndexArray:
        """Pieces that take something of an element away, sorted."""
        times = np.unique(np.concatenate([self.time[self.time >= 0], self.line_times.ravel()]))
        return np.asarray(times[times < self.sweep.count])

    def _probe(self, part: IndexArray) -> tuple[IndexArray, IndexArray]:
        """Return the time of elements, and the axis of the cube along which their times differ most."""
        values = self.kind.values(parents_of(self.kind, probe_cube())[0])
        places = np.einsum("pn,enc->epc", values, self.corners[part]).reshape(-1, 3)
        side = PROBE_PLACES.size
        times = self.sweep.first_pieces(places).reshape(part.size, side, side, side)
        flat = times.reshape(part.size, -1)
        time = np.where((flat == flat[:, :1]).all(axis=1), flat[:, 0], MIXED_TIME)
        changes = np.stack([(np.diff(times, axis=1 + k) != 0).reshape(part.size, -1).sum(axis=1) for k in range(3)], axis=1)
        return time, changes.argmax(axis=1)

    def _times_on_lines(self, part: IndexArray, axis: IndexArray) -> IndexArray:
        """Return the times of the places on the lines of elements, (e, LINE_COUNT, LINE_NODES)."""
        times = np.empty((part.size, LINE_COUNT, LINE_NODES), np.int32)
        line, along = np.divmod(np.arange(LINE_COUNT * LINE_NODES), LINE_NODES)
        for k in range(3):
            rows = np.flatnonzero(axis == k)
            cube = on_lines(np.full(line.size, k), line, LINE_PLACES[along])
            values = self.kind.values(parents_of(self.kind, cube)[0])
            places = np.einsum("pn,enc->epc", values, self.corners[part[rows]]).reshape(-1, 3)
            times[rows] = self.sweep.first_pieces(places).reshape(rows.size, LINE_COUNT, LINE_NODES)
        return times

    def whole_at(self, stage: int) -> IndexArray:
        """Return the elements that are whole when `stage` pieces have been cut."""
        is_whole = self.time >= stage
        is_whole[self.mixed] = (self.line_times >= stage).all(axis=(1, 2))
        return np.flatnonzero(is_whole)

    def cut_at(self, stage: int) -> tuple[IndexArray, FloatArray, FloatArray, FloatArray]:
        """Return the elements that are cut at a stage: numbers, stiffness and scalar mass over what is left, share of volume.

        Those of which less than `MIN_FILL` is left are gone.
        """
        inside = self.line_times >= stage
        cut = np.flatnonzero(inside.any(axis=(1, 2)) & ~inside.all(axis=(1, 2)))
        keys = [(int(k), np.packbits(inside[k]).tobytes()) for k in cut]
        unsolved = [n for n, key in enumerate(keys) if key not in self._kept]
        for start in range(0, len(unsolved), _INTEGRATED_ELEMENTS):
            part = unsolved[start:start + _INTEGRATED_ELEMENTS]
            for n, result in zip(part, zip(*self._integrate(cut[part], stage), strict=True), strict=True):
                self._kept[keys[n]] = result
        results = [self._kept[key] for key in keys]
        share = np.array([result[2] for result in results])
        chosen = np.flatnonzero(share > MIN_FILL)
        width = self.nodes.shape[1]
        stiffness = np.array([results[n][0] for n in chosen]).reshape(-1, 3 * width, 3 * width)
        mass = np.array([results[n][1] for n in chosen]).reshape(-1, width, width)
        return self.mixed[cut[chosen]], stiffness, mass, share[chosen]

    def _integrate(self, cut: IndexArray, stage: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return stiffness, scalar mass and share of volume of cut elements (places in `mixed`)."""
        elements, kind = self.mixed[cut], self.kind
        corners = self.corners[elements]
        element, cube, weight = runs_of(kind, corners, self.axis[cut], times=self.line_times[cut], stage=stage,
                                        ask=lambda places, owner: self.sweep.is_swept(places, owner, stage))
        order = np.argsort(element, kind="stable")
        element, (parents, factor) = element[order], parents_of(kind, cube[order])
        place = np.arange(element.size) - np.searchsorted(element, element)
        points, weights = np.zeros((cut.size, int(place.max()) + 1, 3)), np.zeros((cut.size, int(place.max()) + 1))
        points[...] = kind.nodes.mean(axis=0)
        points[element, place], weights[element, place] = parents, weight[order] * factor
        slope, volume = gradients_at(kind, corners, points, weights=weights)
        values = kind.values(points.reshape(-1, 3)).reshape(*points.shape[:2], -1)
        stiffness_of_whole = matrices.stiffness(kind, corners, self.material)
        stiffness = matrices.stiffness_at(slope, volume, self.material) + _VOID_STIFFNESS_RATIO * stiffness_of_whole
        mass = self.material.density * np.swapaxes(values, 1, 2) @ (volume[:, :, None] * values)
        return stiffness, mass, volume.sum(axis=1) / self.volumes[elements]


def gradients_at(kind: ElementKind, corners: FloatArray, points: FloatArray, *, weights: FloatArray
                 ) -> tuple[FloatArray, FloatArray]:
    """Return gradients (e, p, nodes, 3), 1/m, and volumes (e, p), m^3, at points (e, p, 3) of the parent, weights (e, p)."""
    slopes = kind.slopes(points.reshape(-1, 3)).reshape(*points.shape[:2], -1, 3)
    jacobian = np.einsum("epna,enb->epab", slopes, corners, optimize=True)
    determinant = np.linalg.det(jacobian)
    return np.einsum("epna,epba->epnb", slopes, np.linalg.inv(jacobian), optimize=True), determinant * weights


def volumes_of(kind: ElementKind, corners: FloatArray) -> FloatArray:
    """Return the volumes (e,) of elements, m^3."""
    slopes = kind.slopes(kind.mass_points)
    determinant = np.linalg.det(np.einsum("pna,enb->epab", slopes, corners, optimize=True))
    return np.asarray(determinant @ kind.mass_weights)


