r"""Serial arms by their Denavit-Hartenberg table, standard or modified, with coupled axes.

Standard: :math:`T_i = R_z(\theta_i) T_z(d_i) T_x(a_i) R_x(\alpha_i)`; modified (Craig):
:math:`T_i = R_x(\alpha_{i-1}) T_x(a_{i-1}) R_z(\theta_i) T_z(d_i)`, a row's own a and alpha being those of the link before.
Source: Siciliano et al., Robotics, 2009, section 2.8; Craig, Introduction to Robotics, 3rd ed., chapter 3.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import FloatArray, fail, floats, one_of, scalar
from toolpoint.kinematics.axis import Axis, Drive
from toolpoint.kinematics.tree import TreeChain
from toolpoint.spatial import rotation as rot
from toolpoint.spatial import transform as tf

CONVENTIONS = ("standard", "modified")


@dataclass(frozen=True)
class ArmRow:
    """Row of the Denavit-Hartenberg table: theta and alpha in rad, d and a in m.

    axis : name of the axis that moves the joint; theta, d : values at the axis's zero, to which its position is added; slides :
    whether the joint moves along z instead of about it; coupled : further axes that move it, by name and factor (theta_3 = q_3
    + q_2 is ``{"q2": 1.0}``); lower, upper : limits of the axis, m or rad.
    """

    axis: str
    theta: float = 0.0
    d: float = 0.0
    a: float = 0.0
    alpha: float = 0.0
    slides: bool = False
    coupled: Mapping[str, float] = field(default_factory=dict)
    lower: float = -np.inf
    upper: float = np.inf

    def __post_init__(self) -> None:
        for name in ("theta", "d", "a", "alpha"):
            scalar(f"ArmRow {self.axis}.{name}", getattr(self, name))
        for name in ("theta", "alpha"):
            # Tables print degrees: 90 taken as rad would be a valid rotation of another arm.
            if abs(getattr(self, name)) > 2 * np.pi + 1e-9:
                fail(f"ArmRow {self.axis}.{name}", f"{getattr(self, name):g} rad", "must be within one turn",
                     remedy=f"angles are in rad; did you mean {getattr(self, name):g} deg?")


def arm_frames(rows: Sequence[ArmRow], convention: str = "standard", base: FloatArray | None = None
               ) -> tuple[FloatArray, FloatArray]:
    """Return the frames of the joints and of the links with all axes at zero, machine frame, shape (n, 4, 4) each.

    A joint moves about (or along) the z axis of its frame. base : (4, 4) frame before the first row, the machine frame where
    left out.
    """
    one_of("convention", convention, CONVENTIONS)
    place = np.eye(4) if base is None else floats("base", base, (4, 4))
    joints, links = [], []
    for row in rows:
        screw = tf.transform(rot.about("z", row.theta), [0.0, 0.0, row.d])
        across = tf.transform(rot.about("x", row.alpha), [row.a, 0.0, 0.0])
        if convention == "standard":
            joints.append(place)  # theta_i turns about the z axis of the frame before
            place = place @ screw @ across
        else:
            place = place @ across @ screw
            joints.append(place)
        links.append(place)
    return np.array(joints), np.array(links)


def arm_axes(rows: Sequence[ArmRow]) -> tuple[Axis, ...]:
    """Return the axes of an arm, in the order of rows: each drives the joint of its row, and those that name it as coupled."""
    names = [row.axis for row in rows]
    repeated = next((name for name in names if names.count(name) > 1), None)
    if repeated is not None:
        fail("rows", f"axis {repeated} appears twice", "every row needs an axis of its own")
    drives: dict[str, list[Drive]] = {name: [] for name in names}
    for i, row in enumerate(rows):
        way = "z" if row.slides else "rz"
        # The axis's own joint comes first, also where an earlier row is coupled to it.
        drives[row.axis].insert(0, Drive(i, way))
        for name, factor in row.coupled.items():
            if name not in drives:
                fail(f"row {row.axis}: coupled", f"no axis {name!r}", f"must be of {', '.join(names)}")
            drives[name].append(Drive(i, way, factor))
    return tuple(Axis(row.axis, tuple(drives[row.axis]), row.lower, row.upper) for row in rows)


def arm_chain(rows: Sequence[ArmRow], convention: str = "standard", base: FloatArray | None = None) -> TreeChain:
    """Return the chain of a serial arm; link i hangs on link i - 1, the first on the ground.

    Examples
    --------
    A planar arm of two links of 1 m, its elbow at a right angle; the tip is at (2, 0, 0) m for zero angles:

    >>> import numpy as np
    >>> arm = arm_chain([ArmRow("A", a=1.0), ArmRow("B", a=1.0)])
    >>> (arm.displacements({"A": 0.0, "B": np.pi / 2})[0, 1] @ [2, 0, 0, 1])[:3].round(9).tolist()
    [1.0, 1.0, 0.0]
    """
    if not rows:
        fail("rows", "none", "must be at least one")
    return TreeChain(tuple(range(-1, len(rows) - 1)), arm_frames(rows, convention, base)[0], arm_axes(rows))
