"""Example vertical machining centre of parametric castings: bed, column, saddle, table and head; every size is chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import count, positive
from toolpoint.bodies.solid import CAST_IRON, STEEL, Casting, Cuboid, Material, Patch, SolidModel
from toolpoint.studies.finite_elements.whole_machine import GROUND, FiniteElementMachine, PatchJoint

X, Y, Z = np.eye(3)
Place = Sequence[float]  # (3,) m
# Largest sides of elements, m: of the example, and of a finer mesh that shows the error of the first.
EXAMPLE_MESH_SIZE, FINE_EXAMPLE_MESH_SIZE = 0.17, 0.13
# Chosen: a carriage group, a bolted flange, a levelling foot; N/m and N m/rad along and about x, y, z of the machine.
_FOOT = np.array([1.35e8, 1.35e8, 4.0e8, 4e5, 4e5, 4e5])
# Of the size that such parts have (bolted flange, rail guides with their soft way along the screw), not of one machine.
_FLANGE = np.array([4e9, 4e9, 6e9, 3e8, 3e8, 3e8])
_X_GUIDE = np.array([1.5e8, 8e8, 1.2e9, 6e7, 9e7, 9e7])
_Y_GUIDE = np.array([8e8, 1.5e8, 1.2e9, 6e7, 9e7, 9e7])
_Z_GUIDE = np.array([9e8, 1.0e9, 1.6e8, 7e7, 5e7, 7e7])


# Chosen: what castings are filled with, a damping layer with the plate that constrains it, and plates that stiffen.
MINERAL_CAST = Material(35e9, 0.25, 2350.0, 0.03)
VISCOELASTIC = Material(20e6, 0.45, 1200.0, 0.8)


@dataclass(frozen=True)
class Layer:
    """Layer on the sides and the back of the column: name of its set of elements, thickness (m), material."""

    name: str
    thickness: float
    material: Material


# Layers of an option, from the casting outwards.
STIFFENING = (Layer("plate", 0.015, STEEL),)
DAMPING = (Layer("damping", 0.003, VISCOELASTIC), Layer("plate", 0.010, STEEL))


def example_mill(wall: float = 0.025, ribs: int = 2, *, filling: Material | None = None, layers: Sequence[Layer] = (),
                 bed_wall: float = 0.03, mesh_size: float = EXAMPLE_MESH_SIZE) -> FiniteElementMachine:
    """Return the example machine.

    wall : thickness of the column's walls, m; ribs : number of its inner plates; filling : material of its hollow; layers : on
    its sides and back, the first on the casting; bed_wall : thickness of the bed's walls, m.

    Axes: x along the table, y away from the operator, z up. Nothing is published but the first frequency of such a machine
    (31.87 Hz, thesis of the University of Huddersfield, 2006), which the feet are chosen for.
    """
    parts = {"bed": _hollow([0, 0, 0], [1.0, 1.6, 0.40], positive("bed_wall", bed_wall), 2, 2, mesh_size),
             "column": _column(positive("wall", wall), count("ribs", ribs, 0), filling, layers=layers, mesh_size=mesh_size),
             "saddle": _hollow([0.15, 0.15, 0.40], [0.85, 0.75, 0.53], 0.025, 0, 1, mesh_size),
             "table": _hollow([0.0, 0.2, 0.53], [1.0, 0.70, 0.63], 0.03, 2, 0, mesh_size),
             "head": _hollow([0.3, 0.45, 1.05], [0.7, 1.05, 1.45], 0.03, 1, 1, mesh_size)}
    feet = [PatchJoint(f"foot {i + 1}", GROUND, "bed", _FOOT, _level([x, y, 0.0], 0.1, 0.1, down=True))
            for i, (x, y) in enumerate(((0.1, 0.1), (0.9, 0.1), (0.1, 1.5), (0.9, 1.5)))]
    pairs = [("column foot", "bed", "column", _FLANGE, [0.5, 1.3, 0.40], 0.56, 0.46),
             ("y guide", "bed", "saddle", _Y_GUIDE, [0.5, 0.45, 0.40], 0.6, 0.5),
             ("x guide", "saddle", "table", _X_GUIDE, [0.5, 0.45, 0.53], 0.6, 0.4)]
    level = [PatchJoint(name, parent, child, k, _level(centre, a, b, down=True), _level(centre, a, b))
             for name, parent, child, k, centre, a, b in pairs]
    guide = np.array([0.5, 1.05, 1.25])
    z_guide = PatchJoint("z guide", "column", "head", _Z_GUIDE, Patch(guide, X, -Z, 0.36, 0.36),
                         Patch(guide, X, Z, 0.36, 0.36))
    points = {"tool": ("head", _level([0.5, 0.6, 1.05], 0.12, 0.12, down=True), (0.0, 0.0, -0.25)),
              "work": ("table", _level([0.5, 0.45, 0.63], 0.2, 0.2), (0.0, 0.0, 0.1))}
    return FiniteElementMachine(parts, (*feet, *level, z_guide), points)


def _level(centre: list[float], length: float, width: float, *, down: bool = False) -> Patch:
    """Return a horizontal patch with its length along x, m; its normal is up, or down."""
    return Patch(np.array(centre), X, -Y if down else Y, length, width)


def _column(wall: float, ribs: int, filling: Material | None, *, layers: Sequence[Layer], mesh_size: float) -> SolidModel:
    """Return the column with inner plates, filling and layers; see `example_mill`."""
    lower, upper = (0.2, 1.05, 0.40), (0.8, 1.55, 1.75)
    boxes = _boxes(lower, upper, wall, upright=2, level=ribs, filling="" if filling is None else "filling")
    materials = {"body": CAST_IRON} | ({} if filling is None else {"filling": filling})
    inner_offset = 0.0
    for layer in layers:
        outer_offset = inner_offset + positive("Layer.thickness", layer.thickness)
        sides = [(lower[0] - outer_offset, lower[0] - inner_offset), (upper[0] + inner_offset, upper[0] + outer_offset)]
        boxes += [Cuboid(np.array([a, lower[1], lower[2]]), np.array([b, upper[1] + inner_offset, upper[2]]), layer.name) for a,
                  b in sides]
        boxes.append(Cuboid(np.array([lower[0] - outer_offset, upper[1] + inner_offset, lower[2]]),
                            np.array([upper[0] + outer_offset, upper[1] + outer_offset, upper[2]]),
                            layer.name))
        materials[layer.name], inner_offset = layer.material, outer_offset
    return Casting(tuple(boxes), materials).meshed(mesh_size)


def _hollow(lower: Place, upper: Place, wall: float, upright: int, level: int, mesh_size: float) -> SolidModel:
    """Return a hollow cast-iron box between two corners; upright, level : number of its inner plates."""
    boxes = _boxes(lower, upper, wall, upright=upright, level=level)
    return Casting(tuple(boxes), {"body": CAST_IRON}).meshed(mesh_size)


def _boxes(lower: Place, upper: Place, wall: float, *, upright: int, level: int, filling: str = "") -> list[Cuboid]:
    """Return the cuboids of a hollow (or filled) box, with a number of upright plates across x and of level plates."""
    a, b = np.array(lower), np.array(upper)
    inside = Cuboid(a + wall, b - wall, filling) if filling else Cuboid(a + wall, b - wall, is_window=True)
    boxes = [Cuboid(a, b), inside]
    for x in np.linspace(a[0], b[0], upright + 2)[1:-1]:
        boxes.append(Cuboid(np.array([x - wall / 2, *(a[1:] + wall)]), np.array([x + wall / 2, *(b[1:] - wall)])))
    for z in np.linspace(a[2], b[2], level + 2)[1:-1]:
        boxes.append(Cuboid(np.array([*(a[:2] + wall), z - wall / 2]), np.array([*(b[:2] - wall), z + wall / 2])))
    return boxes


def example_variants(mesh_size: float = EXAMPLE_MESH_SIZE) -> dict[str, FiniteElementMachine]:
    """Return name to machine: other sizes, a filled column, layers on the column; one change each."""
    return {"column walls 20 mm": example_mill(0.020, mesh_size=mesh_size),
            "column with 4 plates": example_mill(ribs=4, mesh_size=mesh_size),
            "bed walls 40 mm": example_mill(bed_wall=0.04, mesh_size=mesh_size),
            "column filled with mineral cast": example_mill(filling=MINERAL_CAST, mesh_size=mesh_size),
            "15 mm steel plates on the column": example_mill(layers=STIFFENING, mesh_size=mesh_size),
            "damping layer and 10 mm plates": example_mill(layers=DAMPING, mesh_size=mesh_size)}


def example_tested_mill(machine: FiniteElementMachine) -> FiniteElementMachine:
    """Return the mill that a virtual test strikes: moduli and joint stiffnesses changed by chosen factors."""
    return machine.scaled(modulus={"column": 0.93, "bed": 1.04}, joints={"y guide": 0.8, "foot 3": 1.2})
