"""Round bodies of a scene: cylinders, also bored ones, and spheres, as triangles with the edges that a drawing would show."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.plot.shape_view.scene import Scene

_CIRCLE_CORNERS, _SPHERE_RINGS = 32, 12  # corners of a circle; rings of a sphere from pole to pole
_DRAWN_EDGES = 4  # lines along a cylinder's wall, so that its turning can be seen


def cylinder_scene(body: str, *, diameter: float, length: float, axis: str = "z", bore: float = 0.0) -> Scene:
    """Return a cylinder about the origin along an axis; with a bore, a tube."""
    radii = [diameter / 2] + ([bore / 2] if 0 < bore < diameter else [])
    angle = 2 * np.pi * np.arange(_CIRCLE_CORNERS) / _CIRCLE_CORNERS
    rings = [np.stack([r * np.cos(angle), r * np.sin(angle), np.full(_CIRCLE_CORNERS, z)], axis=1)
             for r in radii for z in (-length / 2, length / 2)]
    nodes, faces = np.concatenate(rings), [_wall(0, 1)]
    if len(radii) == 2:
        faces += [_wall(3, 2), _wall(2, 0), _wall(1, 3)]
    else:
        nodes = np.concatenate([nodes, [[0, 0, -length / 2], [0, 0, length / 2]]])
        faces += [_cap(0, 2 * _CIRCLE_CORNERS), _cap(1, 2 * _CIRCLE_CORNERS + 1)[:, ::-1]]
    lines = np.concatenate([_ring(k) for k in range(len(rings))] + [
        [[k, k + _CIRCLE_CORNERS] for k in range(0, _CIRCLE_CORNERS, _CIRCLE_CORNERS // _DRAWN_EDGES)]])
    return Scene(_rotate_to_axis(nodes, axis), np.concatenate(faces), lines, None, (body,))


def sphere_scene(body: str, *, diameter: float) -> Scene:
    """Return a sphere about the origin, with its equator and one meridian drawn."""
    height = np.cos(np.pi * np.arange(1, _SPHERE_RINGS) / _SPHERE_RINGS)
    angle = 2 * np.pi * np.arange(_CIRCLE_CORNERS) / _CIRCLE_CORNERS
    rings = [np.stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), np.full(_CIRCLE_CORNERS, z)],
                      axis=1)
             for z in height]
    poles = _CIRCLE_CORNERS * len(rings)
    nodes = np.concatenate([*rings, [[0, 0, 1], [0, 0, -1]]]) * diameter / 2
    faces = [_wall(k + 1, k) for k in range(len(rings) - 1)] + [_cap(0, poles)[:, ::-1], _cap(len(rings) - 1, poles + 1)]
    meridian = [[k * _CIRCLE_CORNERS + i, (k + 1) * _CIRCLE_CORNERS + i] for k in range(len(rings) - 1)
                for i in (0, _CIRCLE_CORNERS // 2)]
    return Scene(nodes, np.concatenate(faces), np.concatenate([_ring(_SPHERE_RINGS // 2 - 1), meridian]), None, (body,))


def _ring(number: int) -> FloatArray:
    """Return the edges (n, 2) of a ring."""
    nodes = _CIRCLE_CORNERS * number + np.arange(_CIRCLE_CORNERS)
    return np.stack([nodes, np.roll(nodes, -1)], axis=1)


def _wall(lower: int, upper: int) -> FloatArray:
    """Return the triangles between two rings, outwards where the lower one is first."""
    a, b = _ring(lower), _ring(upper)
    return np.concatenate([np.stack([a[:, 0], a[:, 1], b[:, 0]], axis=1), np.stack([a[:, 1], b[:, 1], b[:, 0]], axis=1)])


def _cap(ring: int, centre: int) -> FloatArray:
    """Return the triangles from a ring to its centre."""
    a = _ring(ring)
    return np.stack([a[:, 1], a[:, 0], np.full(_CIRCLE_CORNERS, centre)], axis=1)


def _rotate_to_axis(nodes: FloatArray, axis: str) -> FloatArray:
    """Return nodes with their z along an axis, right-handed."""
    return np.roll(nodes, {"x": 1, "y": 2, "z": 0}[axis], axis=1)
