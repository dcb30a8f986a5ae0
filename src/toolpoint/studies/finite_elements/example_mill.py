"""An example vertical machining centre of parametric castings: bed, column, saddle, table and head; every size is chosen."""

from __future__ import annotations

import numpy as np

from toolpoint._check import count, positive
from toolpoint.bodies.solid import CAST_IRON, Casting, Cuboid, Patch, SolidModel
from toolpoint.studies.finite_elements.whole_machine import GROUND, FiniteElementMachine, PatchJoint

X, Y, Z = np.eye(3)
# Chosen: a carriage group, a bolted flange, a levelling foot; N/m and N m/rad along and about x, y, z of the machine.
_FOOT = np.array([1.35e8, 1.35e8, 4.0e8, 4e5, 4e5, 4e5])
_FLANGE = np.array([4e9, 4e9, 6e9, 3e8, 3e8, 3e8])
_X_GUIDE = np.array([1.5e8, 8e8, 1.2e9, 6e7, 9e7, 9e7])
_Y_GUIDE = np.array([8e8, 1.5e8, 1.2e9, 6e7, 9e7, 9e7])
_Z_GUIDE = np.array([9e8, 1.0e9, 1.6e8, 7e7, 5e7, 7e7])


def example_mill(wall: float = 0.025, ribs: int = 2, *, mesh_size: float = 0.13) -> FiniteElementMachine:
    """Return the machine; `wall` is the thickness of the column's walls (m), `ribs` the number of its inner plates.

    Axes: x along the table, y away from the operator, z up. Nothing is published but the first frequency of such a machine
    (31.87 Hz, thesis of the University of Huddersfield, 2006), which the feet are chosen for.
    """
    parts = {"bed": _hollow([0, 0, 0], [1.0, 1.6, 0.40], 0.03, 2, 2, mesh_size),
             "column": _hollow([0.2, 1.05, 0.40], [0.8, 1.55, 1.75], positive("wall", wall), 2, count("ribs", ribs, 0),
                               mesh_size),
             "saddle": _hollow([0.15, 0.15, 0.40], [0.85, 0.75, 0.53], 0.025, 0, 1, mesh_size),
             "table": _hollow([0.0, 0.2, 0.53], [1.0, 0.70, 0.63], 0.03, 2, 0, mesh_size),
             "head": _hollow([0.3, 0.45, 1.05], [0.7, 1.05, 1.45], 0.03, 1, 1, mesh_size)}
    feet = [PatchJoint(f"foot {i + 1}", GROUND, "bed", _FOOT, _level([x, y, 0.0], 0.1, 0.1, down=True))
            for i, (x, y) in enumerate(((0.1, 0.1), (0.9, 0.1), (0.1, 1.5), (0.9, 1.5)))]
    pairs = [("column foot", "bed", "column", _FLANGE, [0.5, 1.3, 0.40], 0.56, 0.46),
             ("y guide", "bed", "saddle", _Y_GUIDE, [0.5, 0.45, 0.40], 0.6, 0.5),
             ("x guide", "saddle", "table", _X_GUIDE, [0.5, 0.45, 0.53], 0.6, 0.4)]
    level = [PatchJoint(name, parent, child, k, _level(at, a, b, down=True), _level(at, a, b))
             for name, parent, child, k, at, a, b in pairs]
    guide = np.array([0.5, 1.05, 1.25])
    z_guide = PatchJoint("z guide", "column", "head", _Z_GUIDE, Patch(guide, X, -Z, 0.36, 0.36),
                         Patch(guide, X, Z, 0.36, 0.36))
    points = {"tool": ("head", _level([0.5, 0.6, 1.05], 0.12, 0.12, down=True), (0.0, 0.0, -0.25)),
              "work": ("table", _level([0.5, 0.45, 0.63], 0.2, 0.2), (0.0, 0.0, 0.1))}
    return FiniteElementMachine(parts, (*feet, *level, z_guide), points)


def _level(at: list[float], length: float, width: float, *, down: bool = False) -> Patch:
    return Patch(np.array(at), X, -Y if down else Y, length, width)


def _hollow(low: list[float], high: list[float], wall: float, upright: int, level: int, mesh_size: float) -> SolidModel:
    """Return a hollow box with a number of upright plates along y and of level plates."""
    a, b = np.array(low), np.array(high)
    boxes = [Cuboid(a, b), Cuboid(a + wall, b - wall, is_window=True)]
    for x in np.linspace(a[0], b[0], upright + 2)[1:-1]:
        boxes.append(Cuboid(np.array([x - wall / 2, *(a[1:] + wall)]), np.array([x + wall / 2, *(b[1:] - wall)])))
    for z in np.linspace(a[2], b[2], level + 2)[1:-1]:
        boxes.append(Cuboid(np.array([*(a[:2] + wall), z - wall / 2]), np.array([*(b[:2] - wall), z + wall / 2])))
    return Casting(tuple(boxes), {"body": CAST_IRON}).meshed(mesh_size)
