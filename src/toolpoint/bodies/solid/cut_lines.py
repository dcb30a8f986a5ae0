"""Lines through elements along which material is found, and the rule that integrates over what is left of an element.

A hexahedron or tetrahedron that a tool has cut is integrated over the material alone, with its own shape functions (finite
cells: Parvizian, Duester, Rank, Comput. Mech. 41 (2007) 121). Bending of what is left is a polynomial there too, so that one
element follows its wall from full to half thickness; only the place of the cut must be known well.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.bodies.solid.element_kinds import ElementKind

LINE_NODES = 97  # places along a line, both ends among them: of two cuts nearer than 1/96 of the element the first one counts
_END_INSET = 1e-6  # of the half element: the first and the last place lie so far inside
_CROSS_CELLS = 3  # parts of an element across the lines, with two points of Gauss each
_CUT_BISECTIONS = 14  # of the distance of two places along a line: the cut is placed within 1e-4 of it
_RUN_POINTS = 3  # of Gauss, along each run of material

Question = Callable[[FloatArray, IndexArray], np.ndarray]  # places (n, 3), m, and the piece that cut beside them -> bools

_x, _w = np.polynomial.legendre.leggauss(2)
_starts = -1 + 2 / _CROSS_CELLS * np.arange(_CROSS_CELLS)
CROSS_POINTS = (_starts[:, None] + (1 + _x) / _CROSS_CELLS).ravel()
CROSS_WEIGHTS = np.tile(_w / _CROSS_CELLS, _CROSS_CELLS)
LINE_PLACES = np.linspace(-1, 1, LINE_NODES)
LINE_PLACES[[0, -1]] = -1 + _END_INSET, 1 - _END_INSET
PROBE_PLACES = np.concatenate([LINE_PLACES[:1], CROSS_POINTS, LINE_PLACES[-1:]])
LINE_COUNT = CROSS_POINTS.size**2


def parents_of(kind: ElementKind, cube: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return places in the parent element and weights of places in the cube -1 .. 1, (..., 3); a tetrahedron is a collapsed
    cube."""
    if kind.corner_count == 8:
        return cube, np.ones(cube.shape[:-1])
    a, b, c = (0.5 * (1 + cube[..., k]) for k in range(3))
    places = np.stack([a, (1 - a) * b, (1 - a) * (1 - b) * c], axis=-1)
    return places, (1 - a) ** 2 * (1 - b) / 8


def probe_cube() -> FloatArray:
    """Return the places of the cube (p, 3) at which an element is asked whether it is cut, and along which axis."""
    return np.stack(np.meshgrid(PROBE_PLACES, PROBE_PLACES, PROBE_PLACES, indexing="ij"), axis=-1).reshape(-1, 3)


def on_lines(axis: IndexArray, line: IndexArray, along: FloatArray) -> FloatArray:
    """Return places of the cube (n, 3) on lines along an axis (n,), by the number of the line (n,) and the place on it (n,)."""
    across = np.stack([CROSS_POINTS[line // CROSS_POINTS.size], CROSS_POINTS[line % CROSS_POINTS.size]], axis=-1)
    cube = np.empty((*np.shape(line), 3))
    rows = np.arange(np.size(line))
    cube[rows, axis], cube[rows, (axis + 1) % 3], cube[rows, (axis + 2) % 3] = along, across[:, 0], across[:, 1]
    return cube


def places_on(kind: ElementKind, corners: FloatArray, cube: FloatArray) -> FloatArray:
    """Return places (n, 3), m, of one place of the cube each (n, 3) in elements with nodes (n, nodes, 3)."""
    return np.einsum("pn,pnc->pc", kind.values(parents_of(kind, cube)[0]), corners)


def runs_of(kind: ElementKind, corners: FloatArray, axis: IndexArray, *, times: IndexArray, stage: int, ask: Question
            ) -> tuple[IndexArray, FloatArray, FloatArray]:
    """Return the rule over the material of cut elements: element (r,), places of the cube (r, 3), weights (r,).

    corners : (e, nodes, 3), m; axis : (e,) of the lines; times : (e, LINE_COUNT, LINE_NODES) piece that cut each place;
    material is where it is not before the stage. ask : whether places were swept by the move that cut the place beside them.
    """
    inside = np.pad(times >= stage, ((0, 0), (0, 0), (1, 1))).astype(np.int8)
    change = np.diff(inside, axis=2)
    element, line, first = np.nonzero(change == 1)
    last = np.nonzero(change == -1)[2] - 1
    ends = np.stack([LINE_PLACES[first], LINE_PLACES[last]], axis=1)
    ends[first == 0, 0], ends[last == LINE_NODES - 1, 1] = -1.0, 1.0
    for end, inner_node, outside in ((0, first, first - 1), (1, last, last + 1)):
        cut = np.flatnonzero((outside >= 0) & (outside < LINE_NODES))
        e, n = element[cut], line[cut]
        owner = times[e, n, outside[cut]]
        kept, removed_place = LINE_PLACES[inner_node[cut]], LINE_PLACES[outside[cut]]
        for _ in range(_CUT_BISECTIONS):
            middle = 0.5 * (kept + removed_place)
            is_cut = ask(places_on(kind, corners[e], on_lines(axis[e], n, middle)), owner)
            removed_place, kept = np.where(is_cut, middle, removed_place), np.where(is_cut, kept, middle)
        ends[cut, end] = 0.5 * (kept + removed_place)
    x, w = np.polynomial.legendre.leggauss(_RUN_POINTS)
    along = ends.mean(axis=1)[:, None] + 0.5 * (ends[:, 1] - ends[:, 0])[:, None] * x
    weight = 0.5 * (ends[:, 1] - ends[:, 0])[:, None] * w * (
        CROSS_WEIGHTS[line // CROSS_POINTS.size] * CROSS_WEIGHTS[line % CROSS_POINTS.size])[:, None]
    rows = np.repeat(np.arange(element.size), _RUN_POINTS)
    cube = on_lines(axis[element[rows]], line[rows], along.ravel())
    return element[rows], cube, weight.ravel()
