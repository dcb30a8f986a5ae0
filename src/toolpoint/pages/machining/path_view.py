"""The path of a program in space as ribbons in the colour of a quantity, over the surface that it leaves."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.plot import AnimatedShapes, Scene, ShapeView
from toolpoint.studies.machining.result import MachiningStudy

MAX_DRAWN_PIECES = 8000  # of the path: the page stays below its size; those of the largest values are kept
SURFACE_CELLS = 70  # along the longer side
RIBBON_RATIO = 0.004  # of the stock's size: half width of a ribbon
RIBBON_LIFT_RATIO = 0.006  # of the stock's size: above the floor that the tool leaves, which would hide it


def path_view(result: MachiningStudy, values: FloatArray, *, name: str, title: str, unit: str) -> ShapeView:
    """Return the cutting pieces coloured by a value of their block, and the surface of the work as it is left."""
    block = result.laid.moves.block
    chosen = np.flatnonzero(result.blocks.verdict[block] > 0)
    if chosen.size > MAX_DRAWN_PIECES:
        regular = chosen[np.linspace(0, chosen.size - 1, MAX_DRAWN_PIECES // 2).astype(int)]
        largest = chosen[np.argsort(-values[block[chosen]], kind="stable")[:MAX_DRAWN_PIECES // 2]]
        chosen = np.unique(np.concatenate([regular, largest]))
    size = float(np.max(result.setup.stock.upper - result.setup.stock.lower))
    nodes, triangles = _ribbons(result.laid.moves.rows[chosen], size)
    surface, faces = _surface(result)
    first = len(nodes)
    scene = Scene(np.concatenate([nodes, surface]), np.concatenate([triangles, faces + first]), np.zeros((0, 2), int),
                  np.repeat([0, 1], [first, len(surface)]), ("path", "work"))
    colour = np.concatenate([np.repeat(values[block[chosen]], 4), np.zeros(len(surface))])
    displacement = np.zeros((1, len(scene.nodes), 3), complex)
    displacement[0, :, 0] = colour
    return ShapeView(scene, AnimatedShapes(np.zeros(1), np.zeros(1), displacement), name, title,
                     static_range=(0.0, float(max(colour.max(), 1e-12)), unit))


def _ribbons(rows: FloatArray, size: float) -> tuple[FloatArray, np.ndarray]:
    """Return four nodes and two triangles for every piece, level across its way."""
    lift = np.array([0.0, 0.0, RIBBON_LIFT_RATIO * size])
    start, end = rows[:, 0:3] + lift, rows[:, 3:6] + lift
    way = end - start
    across = np.stack([-way[:, 1], way[:, 0], np.zeros(len(way))], axis=1)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    across = np.where(length > 0, across / np.where(length > 0, length, 1.0), [1.0, 0.0, 0.0]) * RIBBON_RATIO * size
    nodes = np.stack([start - across, start + across, end + across, end - across], axis=1).reshape(-1, 3)
    corner = 4 * np.arange(len(rows))[:, None]
    return nodes, np.concatenate([corner + np.array([0, 1, 2]), corner + np.array([0, 2, 3])])


def _surface(result: MachiningStudy) -> tuple[FloatArray, np.ndarray]:
    """Return the surface of the work as it is left, as a coarse grid."""
    height, spacing = result.removed.height, result.removed.settings.spacing
    step = max(1, int(np.ceil(max(height.shape) / SURFACE_CELLS)))
    coarse = np.where(np.isfinite(height), height, result.setup.stock.lower[2])[::step, ::step]
    x = result.removed.origin[0] + spacing * step * np.arange(coarse.shape[0])
    y = result.removed.origin[1] + spacing * step * np.arange(coarse.shape[1])
    nodes = np.stack([*np.meshgrid(x, y, indexing="ij"), coarse], axis=-1).reshape(-1, 3)
    n, m = coarse.shape
    corner = (np.arange(n - 1)[:, None] * m + np.arange(m - 1)).reshape(-1, 1)
    return nodes, np.concatenate([corner + np.array([0, m, m + 1]), corner + np.array([0, m + 1, 1])])
