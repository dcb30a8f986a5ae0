"""A small mill of four rigid parts, after a published one; all values but the density are chosen to fill its gaps.

Source: "Machine tool multibody dynamic model updating using vision-based modal analysis": rigid base, column, spindle
housing, cross-slide with table, 6800 kg/m^3, four interfaces with orthogonal springs and dampers in the XZ and YZ planes, 16
parameters, modes near 13 Hz (rocking) and 64 Hz (housing with column) in both planes, damping 100 N s/m at the start.
Chosen: boxes, footprints, stiffnesses. An interface has a lateral and a vertical spring at each corner of its footprint
a x b; its rotational stiffness follows: k_rx = k_v b^2/4, k_ry = k_v a^2/4, k_rz = k_l (a^2 + b^2)/4; dampers likewise.
"""

from __future__ import annotations

from toolpoint.machine import Machine, build
from toolpoint.machine.description import (
    BodyDescription,
    FrameDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
    ShapeDescription,
)
from toolpoint.updating import Parameter

BOXES = {"base": ((0.8, 0.6, 0.25), (0.0, 0.0, 0.125)), "column": ((0.3, 0.3, 0.9), (0.0, 0.15, 0.7)),
         "housing": ((0.25, 0.4, 0.35), (0.0, -0.2, 0.95)), "cross_slide": ((0.5, 0.3, 0.12), (0.0, -0.15, 0.31))}
# Name: parent, child, place, footprint.
INTERFACES = {"floor_base": ("ground", "base", (0.0, 0.0, 0.0), (0.6, 0.601)),
              "base_column": ("base", "column", (0.0, 0.15, 0.25), (0.3, 0.3)),
              "column_housing": ("column", "housing", (0.0, 0.0, 0.95), (0.285, 0.3)),
              "base_cross_slide": ("base", "cross_slide", (0.0, -0.15, 0.25), (0.5, 0.3))}
# Lateral and vertical stiffness, N/m; lateral and vertical damping, N s/m.
TRUTH = {"floor_base": (3e8, 4.852e7, 2e4, 2e4), "base_column": (2e10, 2e10, 1e2, 1e2),
         "column_housing": (6.661e7, 1.2416e8, 6e3, 8e3), "base_cross_slide": (2e9, 2e9, 1e2, 1e2)}


def four_part_mill(values=TRUTH) -> Machine:
    """Return the mill with these interface values."""
    bodies = {name: BodyDescription(density=6800.0, centre=centre, shape=ShapeDescription("box", size=size))
              for name, (size, centre) in BOXES.items()}
    joints = {}
    for name, (parent, child, at, foot) in INTERFACES.items():
        lateral, vertical, slow, fast = values[name]
        joints[name] = JointDescription(parent, child, FrameDescription(at), _six(lateral, vertical, foot),
                                        _six(slow, fast, foot))
    points = {"nose": PointDescription("housing", (0.0, -0.35, 0.77)),
              "table": PointDescription("cross_slide", (0.0, -0.15, 0.37))}
    for name, (size, centre) in BOXES.items():
        for i, (sx, sy, sz) in enumerate([(1, 1, 1), (-1, 1, -1), (1, -1, -1), (-1, -1, 1)]):
            points[f"{name}{i}"] = PointDescription(name, tuple(
                c + s * d / 2 for c, s, d in zip(centre, (sx, sy, sz), size, strict=True)))
    return build(MachineDescription("four-part mill", bodies, joints, points=points))


def _six(lateral, vertical, foot):
    a, b = foot
    return {"x": lateral, "y": lateral, "z": vertical, "rx": vertical * b**2 / 4, "ry": vertical * a**2 / 4,
            "rz": lateral * (a**2 + b**2) / 4}


def sixteen_parameters(machine: Machine) -> list[Parameter]:
    """Return lateral and vertical stiffness and damping of the four interfaces; the other directions are linked."""
    result = []
    for name, (_, _, _, (a, b)) in INTERFACES.items():
        for field in ("stiffness", "damping"):
            path = f"joints.{name}.{field}."
            for way, links in (("x", {"y": 1.0, "rz": (a**2 + b**2) / 4}), ("z", {"rx": b**2 / 4, "ry": a**2 / 4})):
                value = machine.value(path + way)
                result.append(Parameter(path + way, value, value / 1e3, value * 1e3,
                                        links={path + k: f for k, f in links.items()}))
    return result
