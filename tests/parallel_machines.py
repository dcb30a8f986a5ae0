"""Parallel machines as descriptions: 3-RPS, hexapod 6-UPS, 3-PRS; shared by tests and benchmarks."""

from __future__ import annotations

import numpy as np

from toolpoint.machine import Machine, build
from toolpoint.machine.description import (
    AxisDescription,
    BodyDescription,
    CoordinateDescription,
    FrameDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
    ShapeDescription,
    TaskDescription,
)
from toolpoint.machine.description.frames import describe_frame
from toolpoint.spatial import transform as tf

BALL = ("rx", "ry", "rz")


def limb_frame(start, end, tangent):
    """Frame at the start of a limb: z towards its end, x along the tangent."""
    z = (end - start) / np.linalg.norm(end - start)
    x = tangent - (tangent @ z) * z
    x /= np.linalg.norm(x)
    return tf.transform(np.stack([x, np.cross(z, x), z], axis=1), start)


def at(frame, place):
    return tf.transform(frame[:3, :3], place)


def light(mass=1e-9):
    return BodyDescription(mass=mass, shape=ShapeDescription("sphere", diameter=0.05))


def platform(z, mass=45.0):
    return BodyDescription(mass=mass, centre=(0.0, 0.0, z), inertia=InertiaDescription(0.9, 0.9, 1.6))


def three_rps(base=0.35, radius=0.25, z=0.9, axial=9e7, tangential=3e7, limb_mass=1e-9) -> Machine:
    """The reference 3-RPS: axial springs in the legs, tangential ones at the spherical joints, massless limbs."""
    bodies, joints, axes = {"platform": platform(z)}, {}, {}
    rest = float(np.hypot(base - radius, z))
    for k in range(3):
        angle = 2 * np.pi * k / 3
        radial, tangent = np.array([np.cos(angle), np.sin(angle), 0]), np.array([-np.sin(angle), np.cos(angle), 0])
        start, end = base * radial, radius * radial + [0, 0, z]
        frame = limb_frame(start, end, tangent)
        n = k + 1
        bodies |= {f"collar{n}": light(limb_mass), f"limb{n}": light(limb_mass)}
        joints |= {
            f"hinge{n}": JointDescription("ground", f"collar{n}", describe_frame(frame), free=("rx",)),
            f"slide{n}": JointDescription(f"collar{n}", f"limb{n}", describe_frame(frame), {"z": axial}),
            f"ball{n}": JointDescription(f"limb{n}", "platform", describe_frame(at(frame, end)), {"x": tangential}, free=BALL,
                                         closes_loop=n > 1)}
        axes[f"L{n}"] = AxisDescription(f"slide{n}", "z", (0.3, 1.5), at_reference=rest)
    task = TaskDescription("centre", ("L1", "L2", "L3"), {
        "Z": CoordinateDescription("z", (0.3, 1.4)), "tilt": CoordinateDescription("tilt", (-np.pi, np.pi)),
        "azimuth": CoordinateDescription("azimuth", (-2 * np.pi, 2 * np.pi))})
    points = {"centre": PointDescription("platform", (0.0, 0.0, z)), "tool": PointDescription("platform", (0.0, 0.0, z + 0.15))}
    return build(MachineDescription("3-RPS", bodies, joints, axes, points, tool="tool", damping_ratio=0.02, task=task))


def hexapod(base=0.45, radius=0.25, z=0.8, axial=6e7) -> Machine:
    """A 6-UPS hexapod: universal joint, driven leg, spherical joint, six times."""
    bodies, joints, axes = {"platform": platform(z, 60.0)}, {}, {}
    for k in range(6):
        n, third = k + 1, 2 * np.pi / 3 * (k // 2)
        at_base, at_top = third + (0.9 if k % 2 else 0.2), third + (0.75 if k % 2 else 0.35)
        start = base * np.array([np.cos(at_base), np.sin(at_base), 0])
        end = np.array([radius * np.cos(at_top), radius * np.sin(at_top), z])
        frame = limb_frame(start, end, np.array([-np.sin(at_base), np.cos(at_base), 0]))
        bodies |= {f"collar{n}": light(2.0), f"limb{n}": light(3.0)}
        joints |= {
            f"knuckle{n}": JointDescription("ground", f"collar{n}", describe_frame(frame), free=("rx", "ry")),
            f"slide{n}": JointDescription(f"collar{n}", f"limb{n}", describe_frame(frame), {"z": axial}),
            f"ball{n}": JointDescription(f"limb{n}", "platform", describe_frame(at(frame, end)), free=BALL, closes_loop=n > 1)}
        axes[f"L{n}"] = AxisDescription(f"slide{n}", "z", (0.2, 2.0), at_reference=float(np.linalg.norm(end - start)))
    names = {"X": "x", "Y": "y", "Z": "z", "tilt": "tilt", "azimuth": "azimuth", "torsion": "torsion"}
    task = TaskDescription("centre", tuple(axes), {name: CoordinateDescription(kind) for name, kind in names.items()})
    points = {"centre": PointDescription("platform", (0.0, 0.0, z))}
    return build(MachineDescription("6-UPS", bodies, joints, axes, points, tool="centre", damping_ratio=0.02, task=task))


def three_prs(base=0.4, radius=0.25, z=0.7, axial=8e7) -> Machine:
    """A 3-PRS: carriages on upright guides, hinged rods of fixed length, spherical joints."""
    bodies, joints, axes = {"platform": platform(z, 50.0)}, {}, {}
    for k in range(3):
        angle, n = 2 * np.pi * k / 3, k + 1
        radial, tangent = np.array([np.cos(angle), np.sin(angle), 0]), np.array([-np.sin(angle), np.cos(angle), 0])
        start, end = base * radial, radius * radial + [0, 0, z]
        rod = limb_frame(start, end, tangent)
        guide = limb_frame(start, start + np.array([0, 0, 1]), tangent)
        bodies |= {f"carriage{n}": light(15.0), f"rod{n}": light(6.0)}
        joints |= {
            f"guide{n}": JointDescription("ground", f"carriage{n}", describe_frame(guide), {"z": axial}),
            f"hinge{n}": JointDescription(f"carriage{n}", f"rod{n}", describe_frame(rod), free=("rx",)),
            f"ball{n}": JointDescription(f"rod{n}", "platform", describe_frame(at(rod, end)), free=BALL, closes_loop=n > 1)}
        axes[f"S{n}"] = AxisDescription(f"guide{n}", "z", (-0.3, 0.3))
    task = TaskDescription("centre", tuple(axes), {"Z": CoordinateDescription("z"), "tilt": CoordinateDescription("tilt"),
                                                   "azimuth": CoordinateDescription("azimuth")})
    points = {"centre": PointDescription("platform", (0.0, 0.0, z))}
    return build(MachineDescription("3-PRS", bodies, joints, axes, points, tool="centre", damping_ratio=0.02, task=task))


def four_bar(mode: str = "") -> MachineDescription:
    """Crank 0.2, coupler 0.45, rocker 0.4, pivots 0.5 m apart, turning about y; the reference assembly is the upper one."""
    crank, pivot = np.array([0, 0, 0.2]), np.array([0.5, 0, 0])
    pin, other = (_meeting(crank, pivot, sign) for sign in (1, -1))
    hinge = describe_frame(np.eye(4)).rotation

    def joint(parent, child, place, **more):
        return JointDescription(parent, child, FrameDescription(tuple(map(float, place)), hinge), free=("ry",), **more)

    bodies = {"crank": light(1.0), "coupler": light(1.0), "rocker": light(1.0)}
    joints = {"a": JointDescription("ground", "crank", FrameDescription(), {"ry": 1e4}), "b": joint("crank", "coupler", crank),
              "c": joint("ground", "rocker", pivot), "d": joint("coupler", "rocker", pin, closes_loop=True)}
    crossed = {"b.ry": _turn(pin - crank, other - crank), "c.ry": _turn(pin - pivot, other - pivot)}
    return MachineDescription("four-bar", bodies, joints, {"q": AxisDescription("a", "ry")},
                              {"pin": PointDescription("coupler", tuple(map(float, pin)))},
                              assembly_modes={"crossed": crossed}, assembly_mode=mode)


def _meeting(first, second, sign):
    apart = second - first
    d = np.linalg.norm(apart)
    along = (0.45**2 - 0.4**2 + d**2) / (2 * d)
    across = np.array([-apart[2], 0, apart[0]]) / d
    return first + along * apart / d + sign * np.sqrt(0.45**2 - along**2) * across


def _turn(start, end):
    return float(np.arctan2(end[0], end[2]) - np.arctan2(start[0], start[2]))
