"""Random machines of boxes on elastic joints, whose joint stiffnesses are to be found again."""

from __future__ import annotations

import numpy as np

from toolpoint.machine import Machine, build
from toolpoint.machine.description import (
    BodyDescription,
    FrameDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
    ShapeDescription,
)

_WAYS = ("x", "y", "z", "rx", "ry", "rz")


def random_machine(rng: np.random.Generator) -> Machine:
    """Return two to four boxes in a chain, each joint with three elastic directions of three that are not alike."""
    bodies, joints, points, at = {}, {}, {}, np.zeros(3)
    parent = "ground"
    for i in range(int(rng.integers(2, 5))):
        name, size = f"b{i}", rng.uniform(0.3, 1.0, 3)
        centre = at + np.array([*rng.uniform(-0.2, 0.2, 2), size[2] / 2])
        bodies[name] = BodyDescription(density=float(rng.uniform(1500, 4000)), centre=tuple(centre),
                                       shape=ShapeDescription("box", size=tuple(size)))
        ways = rng.choice(_WAYS, 3, replace=False)
        values = {w: float(10 ** rng.uniform(7.0, 8.0) * (0.2 if w.startswith("r") else 1.0)) for w in map(str, ways)}
        joints[f"j{i}"] = JointDescription(parent, name, FrameDescription(tuple(at)), values)
        for k in range(6):
            points[f"{name}p{k}"] = PointDescription(name, tuple(centre + size * rng.uniform(-0.5, 0.5, 3)))
        at, parent = centre + np.array([0.0, 0.0, size[2] / 2]), name
    return build(MachineDescription("random", bodies, joints, points=points))
