r"""Angular-contact ball bearing under axial preload at speed: balls in balance between both races and centrifugal force.

Unknown are the axial shift of the inner ring and the ball's place; :math:`Q = K \delta^{3/2}` at either race,
:math:`Q_i \sin\alpha_i = Q_o \sin\alpha_o = F_a/Z,\; Q_o \cos\alpha_o - Q_i \cos\alpha_i = F_c`. The tangent of a race is
:math:`Q' n n^T + (Q/L)(I - n n^T)`, L the distance of ball and groove centres; the ball's own motion is condensed.
Under rigid preload the rings keep the axial distance of standstill, and F_a is what the speed makes of it. Gyroscopic moments
of the balls, growth of the rings by speed and heat are left out. Sources: Jones, J. Basic Eng. 82 (1960); Harris, chapter 9.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._quantity import Quantity
from toolpoint.joints.guideway import AXES, Place, move_stiffness
from toolpoint.joints.rolling_contact import compliance_constant

BISECTION_STEPS = 60  # halvings: the bracket ends below the rounding of a double


@dataclass(frozen=True)
class BearingDescription:
    """Angular-contact ball bearings of one type at places in the joint's frame, axis along `along`.

    `preload` is the axial force of each at standstill; with `preload_by: force` (a spring, hydraulics) it is kept as the
    speed grows, with `preload_by: distance` (rigid spacers) the rings keep their distance and the force grows. `directions`
    are +1 or -1 for each bearing: the way along the axis in which its inner ring is pushed. `groove` is the groove radius
    over the ball diameter. With `follows: spin` the speed is that of the spinning body in place of `speed`.
    """

    at: tuple[Place, ...]
    directions: tuple[int, ...]
    balls: int
    ball_diameter: Annotated[float, Quantity("length", "m", above=0)]
    pitch_diameter: Annotated[float, Quantity("length", "m", above=0)]
    preload: Annotated[float, Quantity("force", "N", above=0)]
    contact_angle: Annotated[float, Quantity("angle", "rad", above=0, most=1.2)] = np.pi / 12
    along: Literal["x", "y", "z"] = "z"
    speed: Annotated[float, Quantity("spindle speed", "rpm", least=0)] = 0.0
    follows: Literal["", "spin"] = ""
    groove: Annotated[float, Quantity("ratio", "1", above=0.5, most=0.6)] = 0.52
    ball_density: Annotated[float, Quantity("density", "kg/m^3", above=0)] = 7850.0
    preload_by: Literal["force", "distance"] = "force"

    def axial_force(self) -> float:
        """Return the axial force of each bearing at its speed, N."""
        return self.preload if self.preload_by == "force" else _force_of_distance(self)

    def race_state(self) -> tuple[FloatArray, FloatArray]:
        """Return contact angles (inner, outer), rad, and contact forces (inner, outer), N, of every ball."""
        return _balance(self, self.axial_force(), self.speed)

    @property
    def single(self) -> FloatArray:
        """Stiffness (6, 6) of one bearing about its middle, axis along z, pushed towards +z; none about z."""
        (inner_angle, outer_angle), (force_in, force_out) = self.race_state()
        constant = _race_constant(self)
        tangents = [_tangent(angle, force, constant, (self.groove - 0.5) * self.ball_diameter)
                    for angle, force in ((inner_angle, force_in), (outer_angle, force_out))]
        # Both races act behind each other: the ball's own motion is condensed.
        pair = tangents[0] - tangents[0] @ np.linalg.solve(tangents[0] + tangents[1], tangents[0])
        radius = self.pitch_diameter / 2 + (self.groove - 0.5) * self.ball_diameter * np.cos(inner_angle)
        total = np.zeros((6, 6))
        for azimuth in 2 * np.pi * np.arange(self.balls) / self.balls:
            outward = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
            contact_point = radius * outward
            directions = np.array([np.concatenate([d, np.cross(contact_point, d)]) for d in (np.array([0.0, 0, 1]), outward)])
            total += directions.T @ pair @ directions
        return total

    @property
    def stiffness(self) -> FloatArray:
        """Stiffness (6, 6) about the joint's frame; none about the axis."""
        if len(self.directions) != len(self.at) or any(sense not in (1, -1) for sense in self.directions):
            fail("directions", f"{self.directions} for {len(self.at)} places", "must be +1 or -1 for every bearing")
        if self.preload_by == "distance" and sum(self.directions) != 0:
            fail("directions", f"{self.directions} with preload_by: distance", "must be as many +1 as -1",
                 remedy="spacers hold bearings against each other; a bearing that a spring pushes is preload_by: force")
        n, single = AXES[self.along], self.single
        total = np.zeros((6, 6))
        for place, sense in zip(self.at, self.directions, strict=True):
            frame = np.zeros((3, 3))
            frame[(n + 1) % 3, 0], frame[(n + 2) % 3, 1], frame[n, 2] = 1.0, float(sense), float(sense)
            total += move_stiffness(single, frame, np.array(place))
        return total


def _race_constant(bearing: BearingDescription) -> float:
    """Return K of Q = K delta^1.5 at one race: both races together have Palmgren's compliance, half each."""
    return (2 / compliance_constant("ball", bearing.ball_diameter)) ** 1.5


def _tangent(angle: float, force: float, constant: float, groove_distance: float) -> FloatArray:
    """Return the tangent (2, 2) of a race over axial and radial motion at its contact force.

    :math:`Q' n n^T + (Q/L)(I - n n^T)`, with L the distance `groove_distance` of the centres without load, plus the approach.
    """
    normal = np.array([np.sin(angle), np.cos(angle)])
    approach = (force / constant) ** (2 / 3)
    projection = np.outer(normal, normal)
    return 1.5 * force / approach * projection + force / (groove_distance + approach) * (np.eye(2) - projection)


def _balance(bearing: BearingDescription, axial_force: float, speed: float) -> tuple[FloatArray, FloatArray]:
    """Return contact angles and forces at an axial force (N) and a speed (rpm)."""
    outer_angle, inner_angle, error = _angles(bearing, axial_force, speed)
    if error > 1e-6:
        fail("bearing", f"no balance at {speed:g} rev/min with {axial_force:g} N", "must hold its balls between both races",
             remedy="raise the preload or lower the speed")
    ball_force = axial_force / bearing.balls
    return np.array([inner_angle, outer_angle]), np.array([ball_force / np.sin(inner_angle), ball_force / np.sin(outer_angle)])


def _angles(bearing: BearingDescription, axial_force: float, speed: float) -> tuple[float, float, float]:
    """Solve the ball's radial balance by bisection; return outer and inner angle, rad, and the distance's relative error."""
    diameter, ball_force = bearing.ball_diameter, axial_force / bearing.balls
    distance, constant = (bearing.groove - 0.5) * diameter, _race_constant(bearing)
    centrifugal = _centrifugal_force(bearing, speed)
    # The grooves' centres keep their radial distance 2 L0 cos(a0); each race's share of it is L cos(a), with Q sin(a) = F_a/Z.
    radial_distance = 2 * distance * np.cos(bearing.contact_angle)

    def radial_share(angle: float) -> float:
        return float((distance + (ball_force / np.sin(angle) / constant) ** (2 / 3)) * np.cos(angle))

    def inner_of(outer_angle: float) -> float:
        # (F_a/Z) (cot a_o - cot a_i) = F_c
        return float(np.arctan2(1.0, 1 / np.tan(outer_angle) - centrifugal / ball_force))

    # At zero the contact force F_a / (Z sin a) is infinite, at 90 degrees the radial share vanishes: between them it is
    # monotonic.
    angle_min, angle_max = 1e-3, np.pi / 2 - 1e-6
    for _ in range(BISECTION_STEPS):
        middle = 0.5 * (angle_min + angle_max)
        # A larger outer angle shortens both radial shares.
        if radial_share(middle) + radial_share(inner_of(middle)) > radial_distance:
            angle_min = middle
        else:
            angle_max = middle
    outer_angle = 0.5 * (angle_min + angle_max)
    inner_angle = inner_of(outer_angle)
    return outer_angle, inner_angle, abs(radial_share(outer_angle) + radial_share(inner_angle)
                                         - radial_distance) / radial_distance


def _centrifugal_force(bearing: BearingDescription, speed: float) -> float:
    """Return the centrifugal force of a ball, N."""
    diameter, omega = bearing.ball_diameter, speed * 2 * np.pi / 60
    ratio = diameter * np.cos(bearing.contact_angle) / bearing.pitch_diameter
    if ratio >= 1:
        fail("ball_diameter", f"{1e3 * diameter:g} mm on a pitch of {1e3 * bearing.pitch_diameter:g} mm", "must be smaller")
    # Balls roll between a race that turns and one that stands: half of its speed, less for the smaller inner race.
    orbit = 0.5 * omega * (1 - ratio)
    return float(bearing.ball_density * np.pi / 6 * diameter**3 * orbit**2 * bearing.pitch_diameter / 2)


def _axial_groove_distance(bearing: BearingDescription, axial_force: float, speed: float) -> float:
    """Return the axial distance of the grooves' centres, m; minus infinity where the balls are not held."""
    outer_angle, inner_angle, error = _angles(bearing, axial_force, speed)
    if error > 1e-6:
        return -np.inf
    distance, constant, ball_force = (bearing.groove
                                      - 0.5) * bearing.ball_diameter, _race_constant(bearing), axial_force / bearing.balls
    return float(sum((distance + (ball_force / np.sin(angle) / constant) ** (2 / 3)) * np.sin(angle)
                     for angle in (outer_angle, inner_angle)))


def _force_of_distance(bearing: BearingDescription) -> float:
    """Return the axial force at the bearing's speed, N, with which the rings keep the distance of standstill."""
    if bearing.speed == 0:
        return bearing.preload
    standstill_distance = _axial_groove_distance(bearing, bearing.preload, 0.0)
    log_min, log_max = np.log(1e-3 * bearing.preload), np.log(1e4 * bearing.preload)
    # The force may change by orders of magnitude: the bisection runs over its logarithm, and the distance grows with the force.
    for _ in range(BISECTION_STEPS):
        middle = 0.5 * (log_min + log_max)
        if _axial_groove_distance(bearing, float(np.exp(middle)), bearing.speed) < standstill_distance:
            log_min = middle
        else:
            log_max = middle
    force = float(np.exp(0.5 * (log_min + log_max)))
    if abs(_axial_groove_distance(bearing, force, bearing.speed) / standstill_distance - 1) > 1e-6:
        fail("bearing", f"no balance at {bearing.speed:g} rev/min between rings at a fixed distance",
             "must hold its balls between both races", remedy="raise the preload or lower the speed")
    return force
