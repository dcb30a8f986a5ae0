r"""Inverse kinematics in closed form of arms with a spherical wrist and parallel second and third axes: all branches, named.

The wrist centre :math:`p` does not move with the last three axes. Axes 2 and 3 are parallel (direction u), so they leave
:math:`u \cdot p` as it is: axis 1 follows from a linear equation in its cosine and sine (two solutions), axis 3 from the
distance of the wrist centre to axis 2 (two), axis 2 from the direction, and the wrist's three from the rotation that is left
(two).
Source: Murray, Li, Sastry, A Mathematical Introduction to Robotic Manipulation, section 3.3 (Paden-Kahan subproblems).
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, fail, floats, frozen
from toolpoint._notebook import NotebookText
from toolpoint.kinematics.arms.branch_choice import ELBOWS, SHOULDERS, WRISTS
from toolpoint.kinematics.tree import TreeChain
from toolpoint.spatial import transform as tf
from toolpoint.spatial.rotation import skew

PARALLEL_TOLERANCE = 1e-9  # sine of the angle between axes 2 and 3
COSINE_TOLERANCE = 1e-9  # excess of a cosine over one that is rounding
_IDENTITY = frozen(np.eye(3))
STRAIGHT_WRIST_TOLERANCE = 1e-8  # sine of the angle between axes 4 and 6, below which joint 4 is arbitrary


@dataclass(frozen=True, eq=False)
class ArmBranch(NotebookText):
    """Inverse solution of an arm on one branch.

    name : as of `SphericalWrist.branch_name`; positions : (6,) of the axes, rad; within_limits : of all axes; note : text where
    the wrist is singular, else empty.
    """

    name: str
    positions: FloatArray
    within_limits: bool
    note: str = ""

    def __repr__(self) -> str:
        angles = ", ".join(f"{v:.2f}" for v in np.degrees(self.positions))
        return f"ArmBranch({self.name}: {angles} deg{'' if self.within_limits else ', beyond limits'})"


@dataclass(frozen=True, eq=False)
class SphericalWrist:
    """Geometry of an arm for its closed-form inverse, taken from its chain with all axes at rest, in the machine frame.

    directions : (6, 3) unit vectors of the joint axes; places : (6, 3) a point on each, m; centre : (3,) wrist centre, where
    the last three meet, m. In the methods w is the direction of axis 1, u that of axis 2.
    """

    chain: TreeChain
    directions: FloatArray
    places: FloatArray
    centre: FloatArray

    @cached_property
    def _crosses(self) -> list[FloatArray]:
        """Matrices of the cross product with each direction, and their squares, (6, 2, 3, 3)."""
        single = skew(self.directions)
        return list(np.stack([single, single @ single], axis=1))

    @cached_property
    def _probe(self) -> tuple[FloatArray, FloatArray]:
        """A direction (3,) across axis 6, and the one that it moves to as the axis begins to turn."""
        w6 = self.directions[5]
        probe = _across(np.eye(3)[int(np.argmin(np.abs(w6)))], w6)
        return probe, self._crosses[5][0] @ probe

    def _turn(self, axis: int, angle: float) -> FloatArray:
        """Return the rotation (3, 3) about a joint axis (0 .. 5), I + sin(q) [w] + (1 - cos(q)) [w]^2 (Rodrigues), q in rad."""
        k = self._crosses[axis]
        return _IDENTITY + math.sin(angle) * k[0] + (1 - math.cos(angle)) * k[1]

    @classmethod
    def of(cls, chain: TreeChain) -> SphericalWrist:
        """Return the geometry of a chain of six turning joints; raises ToolpointError where it has no spherical wrist.

        Joint i turns about z of its frame, as `arm_chain` makes it.
        """
        if len(chain.parents) != 6 or chain.parents != (-1, 0, 1, 2, 3, 4) or any(
                step.way != 5 for step in chain.steps) or len(chain.steps) != 6:
            fail("chain", repr(chain), "must be six turning joints in a row",
                 remedy="use kinematics.arms.inverse.solve_inverse")
        directions, places = chain.frames[:, :3, 2], chain.frames[:, :3, 3]
        centre, miss = _meeting_point(directions[3:], places[3:])
        size = float(np.ptp(places, axis=0).max()) or 1.0
        if miss > 1e-9 * size:
            fail("chain", f"the last three axes miss each other by {miss:.3g} m", "must meet in one point",
                 remedy="use kinematics.arms.inverse.solve_inverse")
        if np.linalg.norm(np.cross(directions[1], directions[2])) > PARALLEL_TOLERANCE:
            fail("chain", "axes 2 and 3 are not parallel", "this closed form needs them parallel",
                 remedy="use kinematics.arms.inverse.solve_inverse")
        return cls(chain, directions, places, centre)

    def forward(self, positions: ArrayLike) -> FloatArray:
        """Return the displacement of the last link for positions of the axes (..., 6), shape (..., 4, 4)."""
        q = floats("positions", positions, (6,))
        values = self.chain.driven_values(q.reshape(-1, 6))
        moved = self.chain.displacements_of(self.chain.motions_of(values))[:, 5]
        return moved.reshape(*q.shape[:-1], 4, 4)

    def inverse(self, target: ArrayLike, *, turn_at_singular: float = 0.0) -> list[ArmBranch]:
        """Return all branches that bring the last link to a displacement (4, 4) from its reference place.

        turn_at_singular : angle of joint 4, rad, where a straight wrist leaves it arbitrary. The list is empty where the wrist
        centre is out of reach. Names as of `branch_name`.

        The three shoulder, elbow and wrist equations are solved in turn (Paden-Kahan subproblems, see the module), at most two
        solutions each: eight branches.
        """
        goal = floats("target", target, (4, 4))
        centre = goal[:3, :3] @ self.centre + goal[:3, 3]
        branches = []
        for shoulder, first in enumerate(self._shoulder_angles(centre)):
            shoulder_centre = self._move_back(0, first, centre)
            for elbow, (second, third) in enumerate(self._elbow_angles(shoulder_centre)):
                turn = goal[:3, :3]
                for axis, angle in ((0, first), (1, second), (2, third)):
                    turn = self._turn(axis, -angle) @ turn
                for wrist, (angles, note) in enumerate(self._wrist_angles(turn, turn_at_singular)):
                    joints = [first, second, third, *angles]
                    branches.append(self._branch(self._name(joints, (shoulder, elbow, wrist)), joints, note))
        return branches

    def branch_name(self, positions: ArrayLike) -> str:
        """Return the name of the branch on which positions of the axes (6,) lie.

        ``front`` or ``back``: the side of axis 1 on which the wrist centre is, against that at rest; ``up`` or ``down``: to
        which side of the line from shoulder to wrist the elbow is bent, up where the arm reaches the way it faces; ``no flip``
        or ``flip``: to which side joint 5 is bent. A name changes at singular poses only.
        """
        return self._name(self.joint_angles(floats("positions", positions, (6,))).tolist(), (0, 0, 0))

    def joint_angles(self, positions: FloatArray) -> FloatArray:
        """Return the angles of the joints for positions of the axes (6,), which may be coupled."""
        return self.chain.driven_values(positions[None])[0, self._step_of_joint]

    @cached_property
    def _step_of_joint(self) -> list[int]:
        """Index of the step (rotation) of each joint, (6,)."""
        steps = {step.joint: k for k, step in enumerate(self.chain.steps)}
        return [steps[i] for i in range(6)]

    @cached_property
    def _plane(self) -> tuple[float, complex, complex, float, float]:
        """Arm in the plane across axes 2 and 3 as complex numbers, the real axis forward (u x w), angles about u.

        Forward distance from axis 1 to axis 2 (m), upper and lower arm (m), sense of axis 3 (+1 along axis 2, -1 against it),
        and forward distance of the wrist centre from axis 1 at the reference pose (m; 1 where it lies on axis 1).
        """
        u, w = self.directions[1], self.directions[0]
        forward = np.cross(u, w)
        forward = forward / np.linalg.norm(forward)
        across = np.cross(u, forward)
        upper, lower = (complex(v @ forward, v @ across) for v in (self.places[2] - self.places[1],
                                                                   self.centre - self.places[2]))
        home = float(forward @ (self.centre - self.places[0]))
        return (float(forward @ (self.places[1] - self.places[0])), upper, lower, float(np.sign(self.directions[2] @ u)),
                home if abs(home) > 1e-9 else 1.0)

    @cached_property
    def _straight_wrist(self) -> float:
        """Angle of joint 5, rad, at which joints 4 and 6 turn about one line, or are nearest to it: the largest w4 . R5 w6."""
        w4, w5, w6 = self.directions[3:]
        return math.atan2(float(w4 @ self._crosses[4][0] @ w6), float(w4 @ w6 - (w4 @ w5) * (w5 @ w6)))

    def _name(self, angles: Sequence[float], numbers: tuple[int, int, int]) -> str:
        """Return the branch name of joint angles (6,); `numbers` of the solutions decide where two of them meet."""
        start, upper, lower, sense, home = self._plane
        turned = cmath.exp(1j * angles[1])
        elbow, wrist = upper * turned, (upper + lower * cmath.exp(1j * sense * angles[2])) * turned
        forward_distance = start + wrist.real
        # On the border between two branches either name fits: the one that was asked for is given back.
        facing = forward_distance if abs(forward_distance) > 1e-12 else 0.5 - numbers[0]
        # The elbow above the line from shoulder to wrist, of an arm that leans the way it faces; the sign against the line
        # itself is kept where the wrist passes over axis 2, at which "above" changes though no axis turns round.
        side = (elbow.conjugate() * wrist).imag
        above = side * facing if abs(side) > 1e-12 * abs(upper) * abs(lower) else 0.5 - numbers[1]
        straight = self._straight_wrist
        bend = math.sin(angles[4] - straight) * (1 if math.cos(straight) >= -1e-9 else -1)
        bend = bend if abs(bend) > 1e-12 else 0.5 - numbers[2]
        words = SHOULDERS[facing * home <= 0], ELBOWS[above <= 0], WRISTS[bend < 0]
        return " ".join(words)

    def _branch(self, name: str, angles: list[float], note: str) -> ArmBranch:
        """Return the branch of joint angles (6,), rad: positions of the axes, each by whole turns into its limits."""
        joint = np.array([math.atan2(math.sin(angle), math.cos(angle)) for angle in angles])
        # Whole turns are taken off the joints first: an axis may drive several, and is turned whole after that.
        joints_to_axes, reference_positions = self._decoupling
        positions = joints_to_axes @ joint + reference_positions
        values = [_wrap_into_limits(v, *limits) for v, limits in zip(positions.tolist(), self._limits, strict=True)]
        is_within = all(lower - 1e-9 <= v <= upper + 1e-9 for v, (lower, upper) in zip(values, self._limits, strict=True))
        return ArmBranch(name, np.array(values), is_within, note)

    @cached_property
    def _limits(self) -> list[tuple[float, float]]:
        """Limits of every axis, rad."""
        return [(axis.lower, axis.upper) for axis in self.chain.driven_axes]

    @cached_property
    def _decoupling(self) -> tuple[FloatArray, FloatArray]:
        """Matrix (6, 6) from joint angles to axis positions, and the reference positions (6,) of the axes, rad."""
        coupling = self.chain.coupling[self._step_of_joint]
        return np.linalg.inv(coupling), np.array([axis.reference_position for axis in self.chain.driven_axes])

    def _move_back(self, axis: int, angle: float, point: FloatArray) -> FloatArray:
        """Return a point (3,) turned back about joint axis 0 .. 5 by an angle, rad."""
        return self._turn(axis, -angle) @ (point - self.places[axis]) + self.places[axis]

    def _shoulder_angles(self, centre: FloatArray) -> list[float]:
        """Return the angles of axis 1, rad, that bring the wrist centre (3,) back to its component along u at rest."""
        w, u = self.directions[0], self.directions[1]
        reach = centre - self.places[0]
        distance = u @ (self.centre - self.places[0])
        # u . R(-t) r = distance
        along = (u @ w) * (w @ reach)
        cosine, sine = float(u @ reach - along), float(-u @ self._crosses[0][0] @ reach)
        return _solve_linear_angle(cosine, sine, float(distance - along))

    def _elbow_angles(self, target_centre: FloatArray) -> Iterator[tuple[float, float]]:
        """Yield the angles of axes 2 and 3, rad, that bring the wrist centre to a place (3,), axis 1 turned back."""
        u, cross = self.directions[1], self._crosses[1][0]
        sense = float(np.sign(self.directions[2] @ u))
        a = _across(self.places[2] - self.places[1], u)
        b = _across(self.centre - self.places[2], u)
        c = _across(target_centre - self.places[1], u)
        # |a + R(t3) b| = |c|, both turning about u.
        constant = (c @ c - a @ a - b @ b) / 2
        for angle in _solve_linear_angle(float(a @ b), float(a @ cross @ b), float(constant)):
            moved = a + self._turn(1, angle) @ b
            yield float(math.atan2((cross @ moved) @ c, moved @ c)), sense * angle

    def _wrist_angles(self, turn: FloatArray, turn_at_singular: float) -> Iterator[tuple[tuple[float, float, float], str]]:
        """Yield the angles of the last three axes, rad, that make a rotation (3, 3), and a note where they are singular."""
        w4, w5, w6 = self.directions[3:]
        goal = turn @ w6
        along = (w4 @ w5) * (w5 @ w6)
        # w4 . R5 w6 = w4 . goal gives joint 5; R4 turns R5 w6 onto the goal about w4; the rest is a turn about w6.
        for fifth in _solve_linear_angle(float(w4 @ w6 - along), float(w4 @ self._crosses[4][0] @ w6),
                                         float(w4 @ goal - along)):
            bent = self._turn(4, fifth) @ w6
            bent_across, goal_across = _across(bent, w4), _across(goal, w4)
            note = ""
            if bent_across @ bent_across < STRAIGHT_WRIST_TOLERANCE**2:
                fourth, note = turn_at_singular, "singular wrist: joints 4 and 6 turn about one line, joint 4 is arbitrary"
            else:
                fourth = float(math.atan2((self._crosses[3][0] @ bent_across) @ goal_across, bent_across @ goal_across))
            remaining = self._turn(4, -fifth) @ self._turn(3, -fourth) @ turn
            probe, turned_probe = self._probe
            moved = remaining @ probe
            sixth = math.atan2(float(turned_probe @ moved), float(probe @ moved))
            yield (fourth, fifth, sixth), note


def _solve_linear_angle(cosine: float, sine: float, constant: float) -> list[float]:
    """Return the angles t, rad, with cosine cos t + sine sin t = constant: two, one where they meet, none out of reach.

    Where both factors vanish every angle will do, and 0 is returned.
    """
    size = math.hypot(cosine, sine)
    if size < 1e-14:
        # The axis goes through the point: any angle will do, and nought is given.
        return [0.0] if abs(constant) < 1e-12 else []
    ratio = constant / size
    if abs(ratio) > 1 + COSINE_TOLERANCE:
        return []
    middle, half_angle = math.atan2(sine, cosine), math.acos(min(max(ratio, -1.0), 1.0))
    return [middle + half_angle, middle - half_angle] if half_angle > 1e-12 else [middle]


def _across(vector: FloatArray, unit: FloatArray) -> FloatArray:
    """Return the part of a vector perpendicular to a unit vector, (3,)."""
    return vector - unit * float(unit @ vector)


def _wrap_into_limits(value: float, lower: float, upper: float) -> float:
    """Return an angle (rad) changed by up to two turns: within limits the one nearest to zero, else the smallest of all."""
    if abs(value) < math.pi and lower - 1e-9 <= value <= upper + 1e-9:
        return value  # no whole turn brings it nearer to zero
    turns = [value + 2 * np.pi * k for k in (-2, -1, 0, 1, 2)]
    inside = [v for v in turns if lower - 1e-9 <= v <= upper + 1e-9]
    return min(inside or turns, key=abs)


def _meeting_point(directions: FloatArray, places: FloatArray) -> tuple[FloatArray, float]:
    """Return the point (3,) nearest to lines by least squares, and its largest distance to them, m.

    directions, places : (n, 3) unit vectors of the lines, and a point on each, m.
    """
    projectors = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    point = np.linalg.lstsq(projectors.reshape(-1, 3), (projectors @ places[..., None]).reshape(-1), rcond=None)[0]
    return point, float(np.linalg.norm((projectors @ (point - places)[..., None])[..., 0], axis=-1).max())


def move_tool(frame: ArrayLike, reference: ArrayLike) -> FloatArray:
    """Return the displacement (4, 4) of the last link that brings a frame of it to a target.

    frame : (4, 4) target; reference : (4, 4) the same frame at the reference pose; both in the machine frame.
    """
    return floats("frame", frame, (4, 4)) @ tf.inverse(floats("reference", reference, (4, 4)))
