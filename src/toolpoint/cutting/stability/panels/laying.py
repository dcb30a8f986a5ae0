"""Compiled layout of a cut over panels: ends of the panels, their nodes, and the cut at each.

Charts of helical tools lay panels anew at every depth, thousands of times; array calls of a dozen numbers would take longer
than the cut itself.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from toolpoint._check import Array, FloatArray, IndexArray
from toolpoint._inner_kernels import inner_njit
from toolpoint.cutting.stability.panels.edge_walls import TURN, limits, place
from toolpoint.cutting.stability.panels.kernels import lay, look_back
from toolpoint.cutting.stability.panels.records import EdgeLaw, EdgeLines, LaidCut, LookBack, PanelNodes, Walls
from toolpoint.cutting.stability.sorting import sort

DISTINCT_ANGLE_PARTS = 1e11  # of a period: angles nearer than one are the same


@inner_njit(cache=True, nogil=True)
def tell_apart(angles: FloatArray, period: float) -> FloatArray:
    """Return the distinct angles in rising order, rounded to a part of the period."""
    out = np.empty(angles.size)
    for i in range(angles.size):
        # Ends that are one in theory differ by rounding of different sums; a panel between them would have no length.
        out[i] = np.rint(angles[i] / period * DISTINCT_ANGLE_PARTS) / DISTINCT_ANGLE_PARTS
    sort(out)
    used = 0
    for i in range(out.size):
        if i == 0 or out[i] != out[used - 1]:
            out[used] = out[i]
            used += 1
    for i in range(used):
        out[i] *= period
    return out[:used]


@nb.njit(cache=True, nogil=True)
def find_ends(heights: FloatArray, lines: EdgeLines, walls: Walls, period: float, longest: float) -> FloatArray:
    """Return the ends of the panels, rad: entries and exits of every edge at these edge lengths (m), the same one delay later
    where that edge cuts, split so that none is longer than `longest`."""
    teeth, turns = lines.start.size, max(1, round(period / TURN))
    number = heights.size * teeth
    begin, arc, delay = np.empty(number), np.empty(number), np.empty(number)
    angles = np.empty(2 * number * turns)
    k = 0
    for u in heights:
        z, _, r = place(u, walls.corner, walls.radius)
        entry, leave = limits(walls.entry, walls.leave, walls.radius / max(r, 1e-9 * walls.radius))
        for j in range(teeth):
            lag = lines.start[j] + lines.slope[j] * z
            begin[k], arc[k] = entry + lag, (leave + lag) - (entry + lag)
            delay[k] = lines.tip_delay[j] + lines.delay_slope[j] * z
            for t in range(turns):
                angles[2 * (k * turns + t)] = (entry + lag + TURN * t) % period
                angles[2 * (k * turns + t) + 1] = (leave + lag + TURN * t) % period
            k += 1
    first = tell_apart(angles, period)
    candidates = np.empty(2 + first.size * (1 + number))
    candidates[0], candidates[1], used = 0.0, period, 2 + first.size
    for i in range(first.size):
        candidates[2 + i] = first[i]
    for k in range(number):
        for angle in first:  # images matter only while that edge cuts
            if (angle + delay[k] - begin[k] - 1e-9) % TURN < arc[k]:
                candidates[used] = (angle + delay[k]) % period
                used += 1
    return split(tell_apart(candidates[:used], period), longest)


@inner_njit(cache=True, nogil=True)
def split(ends: FloatArray, longest: float) -> FloatArray:
    """Split panels evenly so that none is longer than `longest`; return the ends."""
    parts, number = np.empty(ends.size - 1, np.int64), 1
    for p in range(parts.size):
        parts[p] = max(1, math.ceil((ends[p + 1] - ends[p]) / longest))
        number += parts[p]
    out = np.empty(number)
    out[0], used = 0.0, 1
    for p in range(parts.size):
        for i in range(1, parts[p] + 1):
            out[used] = ends[p] + (ends[p + 1] - ends[p]) * i / parts[p]
            used += 1
    return out


@nb.njit(cache=True, nogil=True)
def lay_panels(ends: FloatArray, count: IndexArray, tables: tuple[FloatArray, FloatArray],
               edges: tuple[EdgeLines, Walls, EdgeLaw, FloatArray, FloatArray, float],
               size: int) -> tuple[Array, ...]:
    """Lay a cut of `size` directions over panels with so many nodes: angle and half panel of every node, first node of every
    panel, panels that cut, panels that are looked into; and what is laid and looked back to, in the order of `Layout`.

    tables : Gauss nodes and their barycentric weights, a row for every number of nodes; edges : (lines, walls, law, Gauss nodes
    and weights along a piece of an edge, period).
    """
    lines, walls, law, gx, gw, period = edges
    p, q, nodes_max = count.size, 0, 0
    for n in count:
        q, nodes_max = q + n, max(nodes_max, n)
    offset, panel = np.zeros(p, np.int64), np.empty(q, np.int64)
    angle, half, x, bary = np.empty(q), np.empty(q), np.empty(q), np.empty(q)
    k = 0
    for g in range(p):
        offset[g] = k
        for i in range(count[g]):
            panel[k], x[k], bary[k] = g, tables[0][count[g], i], tables[1][count[g], i]
            half[k] = (ends[g + 1] - ends[g]) / 2
            angle[k] = ends[g] + half[k] * (1 + x[k])
            k += 1
    # Where all teeth look back by delays of their own a point of an edge is an entry; else a tooth is one.
    room = q * lines.start.size * (lines.marks.size * gx.size if lines.spread else 1)
    cut = LaidCut(np.zeros((q, size, size)), np.zeros((q, size, size)), np.zeros(q + 1, np.int64),
                  np.zeros((room, size, size)), np.zeros(room))
    used = lay(angle, lines, walls, law, gx, gw, cut)
    cuts, needed = np.zeros(p, np.bool_), np.zeros(p, np.bool_)
    for i in range(q):
        if cut.first[i + 1] > cut.first[i]:
            cuts[panel[i]] = True
    entries = LookBack(np.zeros(used, np.int64), np.zeros(used, np.bool_), np.zeros((used, nodes_max)))
    look_back(angle, cut.first, cut.entry_delay[:used], PanelNodes(period, ends, offset, count, x, bary), needed, entries)
    return (angle, half, offset, cuts, needed, cut.now, cut.drag, cut.first, cut.matrix[:used], entries.source, entries.past,
            entries.rows)

# Code of other modules in these kernels: 7f721a9f3c66
