"""The eighteen-freedom elastic robot of the reference case B2 as a toolpoint description, shared by tests and benchmarks."""

from __future__ import annotations

import numpy as np

from toolpoint.machine import Machine, build
from toolpoint.machine.description import (
    AxisDescription,
    BodyDescription,
    FrameDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.spatial import rotation
from toolpoint.spatial import transform as tf

LINKS = [(0, 0, 0.15, -90), (-90, 0, 0.25, 180), (0, 0, 0.075, -90), (0, -0.29, 0, 90), (0, 0, 0, -90), (0, -0.08, 0, 180)]
MASSES = [12, 9, 7, 4, 2, 3]
CENTRES = [(-0.06, 0.05, 0), (-0.12, 0, -0.05), (-0.02, 0, -0.02), (0, 0.12, 0), (0, 0, 0.01), (0, 0, 0.02)]
INERTIAS = [(0.12, 0.11, 0.10), (0.03, 0.09, 0.085), (0.03, 0.035, 0.03), (0.03, 0.01, 0.03), (0.004,) * 3,
            (0.006, 0.006, 0.004)]
SPRINGS = [(4e5, 1.2e5), (3e5, 1e5), (2e5, 6e4), (8e4, 2e4), (5e4, 1.2e4), (3e4, 8e3)]
REFERENCE = [21.977065251, 24.551560544, 50.868133852, 70.656469104]


def link(theta: float, d: float, a: float, alpha: float) -> np.ndarray:
    """Return a Denavit-Hartenberg link transform; angles in degrees."""
    first = tf.transform(rotation.about("z", np.deg2rad(theta)), [0, 0, d])
    return first @ tf.transform(rotation.about("x", np.deg2rad(alpha)), [a, 0, 0])


def _frame(transform: np.ndarray) -> FrameDescription:
    r = transform[:3, :3]
    b = -np.arcsin(np.clip(r[2, 0], -1, 1))
    if abs(abs(r[2, 0]) - 1) < 1e-9:
        angles = (np.arctan2(-r[0, 1], r[1, 1]), b, 0.0)
    else:
        angles = (np.arctan2(r[1, 0], r[0, 0]), b, np.arctan2(r[2, 1], r[2, 2]))
    return FrameDescription(tuple(transform[:3, 3]), tuple(float(x) for x in angles))


def robot() -> Machine:
    """Return the robot with a modal damping ratio of 2 % and one point at the flange."""
    bodies, joints, axes, place = {}, {}, {}, np.eye(4)
    for i in range(6):
        before, place = place, place @ link(*LINKS[i])
        bodies[f"link{i + 1}"] = BodyDescription(mass=MASSES[i], centre=CENTRES[i], inertia=InertiaDescription(*INERTIAS[i]),
                                                 frame=_frame(place))
        k, kz = SPRINGS[i]
        joints[f"joint{i + 1}"] = JointDescription("ground" if i == 0 else f"link{i}", f"link{i + 1}", _frame(before),
                                                   {"rx": k, "ry": k, "rz": kz})
        axes[f"q{i + 1}"] = AxisDescription(f"joint{i + 1}", "rz")
    return build(MachineDescription("elastic robot", bodies, joints, axes, {"flange": PointDescription("link6")},
                                    damping_ratio=0.02))
