r"""LoopClosure: a joint that closes a loop, the gap between its two sides at a pose, and the rate of that gap.

Relative place of the child's side in the parent's: translation t and rotation R. Of the directions that are not free, t must
vanish, and R may only be what the free rotations allow: about one axis a, :math:`R a = a`; about a, then b,
:math:`a \cdot R b = 0`; about none, the skew part of R vanishes; about three, anything. Translations act before rotations.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from toolpoint._check import FloatArray, floats, one_of
from toolpoint.kinematics.axis import AXES
from toolpoint.spatial import transform as tf
from toolpoint.spatial.rotation import skew


@dataclass(frozen=True, eq=False)
class LoopClosure:
    """Joint that closes a loop between two links (-1 is the ground), its frame (4, 4) at the reference pose.

    free : directions that it leaves free, in order; elastic : those that hold by springs; stiffness (6, 6), N/m, N m/rad;
    largest_tilt : largest angle between the z axes of its two sides, rad.

    Examples
    --------
    A pin is free about z; its sides are 0.1 m apart where the child's has moved along x:

    >>> from toolpoint.spatial.transform import transform
    >>> pin = LoopClosure("pin", parent=-1, child=0, frame=np.eye(4), free=("rz",))
    >>> pin.gap(transform(None, [0.1, 0, 0])[None])[0, :3].tolist()
    [0.1, 0.0, 0.0]
    """

    name: str
    parent: int
    child: int
    frame: FloatArray
    free: tuple[str, ...] = ()
    elastic: tuple[str, ...] = ()
    stiffness: FloatArray | None = None
    largest_tilt: float = np.inf

    def __post_init__(self) -> None:
        object.__setattr__(self, "frame", floats("LoopClosure.frame", self.frame, (4, 4)))
        for direction in (*self.free, *self.elastic):
            one_of(f"loop {self.name}", direction, AXES)

    @cached_property
    def rows(self) -> tuple[int, ...]:
        """Directions that are not free, 0 .. 5."""
        return tuple(i for i, name in enumerate(AXES) if name not in self.free)

    @cached_property
    def turning(self) -> tuple[int, ...]:
        """Free rotations 0 .. 2, in their order."""
        return tuple(AXES.index(name) - 3 for name in self.free if AXES.index(name) > 2)

    def relative(self, moved: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the place of the parent's side (P, 4, 4) and that of the child's side in it, for displacements of links."""
        count = len(moved)
        base = self.frame[None] if self.parent < 0 else moved[:, self.parent] @ self.frame
        end = self.frame[None] if self.child < 0 else moved[:, self.child] @ self.frame
        base = np.broadcast_to(base, (count, 4, 4))
        return base, tf.inverse(base) @ end

    def gap(self, relative: FloatArray) -> FloatArray:
        """Return the gap between the sides, zero in free directions, m and rad, shape (P, 6).

        Rotations as in the module's docstring: the skew part of R, R a - a across a, or a . R b.
        """
        result = np.zeros((len(relative), 6))
        r = relative[:, :3, :3]
        result[:, :3] = relative[:, :3, 3]
        if not self.turning:
            # Axis times sine of the angle: smooth where the angle is zero, where the angle itself has no slope.
            result[:, 3:] = 0.5 * np.stack([r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]], axis=-1)
        elif len(self.turning) == 1:
            a, b, c = _cycle(self.turning[0])
            # R a = a has two equations: the third, along a, is a cosine, which has no slope where it is met.
            result[:, 3 + b], result[:, 3 + c] = -r[:, c, a], r[:, b, a]
        elif len(self.turning) == 2:
            a, b = self.turning
            # The child carries the second axis, which stays across the first: one equation, about the third direction.
            result[:, 3 + 3 - a - b] = _hand(a, b) * -r[:, a, b]
        free = [i for i in range(3) if AXES[i] in self.free]
        result[:, free] = 0.0
        return result

    def gap_rate(self, relative: FloatArray, velocity: FloatArray, turn: FloatArray) -> FloatArray:
        """Return the rate of the gap (P, 6, k) for k motions of the child's side against the parent's, in its axes.

        velocity, turn : (P, 3, k), of the point at the parent's origin, and the angular velocity.
        """
        r, t = relative[:, :3, :3], relative[:, :3, 3]
        result = np.zeros((len(relative), 6, velocity.shape[-1]))
        result[:, :3] = velocity - skew(t) @ turn
        if not self.turning:
            trace = np.trace(r, axis1=-2, axis2=-1)[:, None, None]
            # [w] R + R^T [w] is the cross-product matrix of (tr R - R) w.
            result[:, 3:] = 0.5 * (trace * np.eye(3) - r) @ turn
        elif len(self.turning) == 1:
            a, b, c = _cycle(self.turning[0])
            rate = -skew(r[:, :, a]) @ turn
            result[:, 3 + b], result[:, 3 + c] = -rate[:, c], rate[:, b]
        elif len(self.turning) == 2:
            a, b = self.turning
            result[:, 3 + 3 - a - b] = _hand(a, b) * (skew(r[:, :, b]) @ turn)[:, a]
        free = [i for i in range(3) if AXES[i] in self.free]
        result[:, free] = 0.0
        return result

    def tilt(self, relative: FloatArray) -> FloatArray:
        """Return the angle between the z axes of both sides, rad, shape (P,)."""
        return np.arccos(np.clip(relative[:, 2, 2], -1.0, 1.0))


def _cycle(first: int) -> tuple[int, int, int]:
    return first, (first + 1) % 3, (first + 2) % 3


def _hand(a: int, b: int) -> float:
    """+1 where a, b and the third axis are right-handed."""
    return 1.0 if (b - a) % 3 == 1 else -1.0


def joint_directions(free: tuple[int, ...], relative: FloatArray) -> FloatArray:
    """Return the twists (P, 6, 6) of a joint's six directions, in the frame of its parent's side, at a relative place.

    Free rotations turn about their moved axes through the child's place, the others about the axes of the parent's side.
    """
    result = np.broadcast_to(np.eye(6), (len(relative), 6, 6)).copy()
    turning = [way - 3 for way in free if way > 2]
    for number, axis in enumerate(turning):
        # The first rotation of a universal joint carries the axis of the second.
        is_second = len(turning) == 2 and number == 1
        unit = relative[:, :3, axis] if is_second else np.broadcast_to(np.eye(3)[axis], (len(relative), 3))
        result[:, :3, 3 + axis] = np.cross(relative[:, :3, 3], unit)
        result[:, 3:, 3 + axis] = unit
    return result
