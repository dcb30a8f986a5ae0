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

STEPS = 60


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
        """Axial force of each bearing at its speed, N."""
        return self.preload if self.preload_by == "force" else _force_of_distance(self)

    def race_state(self) -> tuple[FloatArray, FloatArray]:
        """Return contact angles (inner, outer), rad, and contact forces (inner, outer), N, of every ball."""
        return _balance(self, self.axial_force(), self.speed)

    @property
    def single(self) -> FloatArray:
        """Stiffness (6, 6) of one bearing about its middle, axis along z, pushed towards +z; none about z."""
        (inner, outer), (force_in, force_out) = self.race_state()
        constant = _race_constant(self)
        tangents = [_tangent(angle, force, constant, (self.groove - 0.5) * self.ball_diameter)
                    for angle, force in ((inner, force_in), (outer, force_out))]
        pair = tangents[0] - tangents[0] @ np.linalg.solve(tangents[0] + tangents[1], tangents[0])
        radius = self.pitch_diameter / 2 + (self.groove - 0.5) * self.ball_diameter * np.cos(inner)
        total = np.zeros((6, 6))
        for turn in 2 * np.pi * np.arange(self.balls) / self.balls:
            out = np.array([np.cos(turn), np.sin(turn), 0.0])
            at = radius * out
            rows = np.array([np.concatenate([d, np.cross(at, d)]) for d in (np.array([0.0, 0, 1]), out)])
            total += rows.T @ pair @ rows
        return total

    @property
    def stiffness(self) -> FloatArray:
        """Stiffness (6, 6) about the joint's frame; none about the axis."""
        if len(self.directions) != len(self.at) or any(way not in (1, -1) for way in self.directions):
            fail("directions", f"{self.directions} for {len(self.at)} places", "must be +1 or -1 for every bearing")
        if self.preload_by == "distance" and sum(self.directions) != 0:
            fail("directions", f"{self.directions} with preload_by: distance", "must be as many +1 as -1",
                 remedy="spacers hold bearings against each other; a bearing that a spring pushes is preload_by: force")
        n, single = AXES[self.along], self.single
        total = np.zeros((6, 6))
        for place, way in zip(self.at, self.directions, strict=True):
            frame = np.zeros((3, 3))
            frame[(n + 1) % 3, 0], frame[(n + 2) % 3, 1], frame[n, 2] = 1.0, float(way), float(way)
            total += move_stiffness(single, frame, np.array(place))
        return total


def _race_constant(bearing: BearingDescription) -> float:
    """Return K of Q = K delta^1.5 at one race: both races together have Palmgren's compliance, half each."""
    return (2 / compliance_constant("ball", bearing.ball_diameter)) ** 1.5


def _tangent(angle: float, force: float, constant: float, free: float) -> FloatArray:
    """Return the tangent (2, 2) over axial and radial motion of a race at its contact force."""
    normal = np.array([np.sin(angle), np.cos(angle)])
    delta = (force / constant) ** (2 / 3)
    along = np.outer(normal, normal)
    return 1.5 * force / delta * along + force / (free + delta) * (np.eye(2) - along)


def _balance(bearing: BearingDescription, axial: float, speed: float) -> tuple[FloatArray, FloatArray]:
    """Return contact angles and forces at an axial force (N) and a speed (rpm)."""
    outer, inner, error = _angles(bearing, axial, speed)
    if error > 1e-6:
        fail("bearing", f"no balance at {speed:g} rev/min with {axial:g} N", "must hold its balls between both races",
             remedy="raise the preload or lower the speed")
    share = axial / bearing.balls
    return np.array([inner, outer]), np.array([share / np.sin(inner), share / np.sin(outer)])


def _angles(bearing: BearingDescription, axial: float, speed: float) -> tuple[float, float, float]:
    """Solve the ball's radial balance by bisection; return outer and inner angle, rad, and the distance left open (ratio)."""
    d, share = bearing.ball_diameter, axial / bearing.balls
    free, constant = (bearing.groove - 0.5) * d, _race_constant(bearing)
    thrown = _thrown(bearing, speed)
    # The grooves' centres keep their radial distance 2 free cos(a0); each race's share is L cos(a), with Q sin(a) = share.
    radial = 2 * free * np.cos(bearing.contact_angle)

    def reach(angle: float) -> float:
        return float((free + (share / np.sin(angle) / constant) ** (2 / 3)) * np.cos(angle))

    def inner_of(outer: float) -> float:
        # share (cot outer - cot inner) = thrown
        return float(np.arctan2(1.0, 1 / np.tan(outer) - thrown / share))

    low, high = 1e-3, np.pi / 2 - 1e-6
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        # A larger outer angle shortens both radial shares.
        if reach(middle) + reach(inner_of(middle)) > radial:
            low = middle
        else:
            high = middle
    outer = 0.5 * (low + high)
    inner = inner_of(outer)
    return outer, inner, abs(reach(outer) + reach(inner) - radial) / radial


def _thrown(bearing: BearingDescription, speed: float) -> float:
    """Return the centrifugal force of a ball, N."""
    d, omega = bearing.ball_diameter, speed * 2 * np.pi / 60
    ratio = d * np.cos(bearing.contact_angle) / bearing.pitch_diameter
    if ratio >= 1:
        fail("ball_diameter", f"{1e3 * d:g} mm on a pitch of {1e3 * bearing.pitch_diameter:g} mm", "must be smaller")
    orbit = 0.5 * omega * (1 - ratio)
    return float(bearing.ball_density * np.pi / 6 * d**3 * orbit**2 * bearing.pitch_diameter / 2)


def _distance(bearing: BearingDescription, axial: float, speed: float) -> float:
    """Return the axial distance of the grooves' centres, m; less than any where the balls are not held."""
    outer, inner, error = _angles(bearing, axial, speed)
    if error > 1e-6:
        return -np.inf
    free, constant, share = (bearing.groove - 0.5) * bearing.ball_diameter, _race_constant(bearing), axial / bearing.balls
    return float(sum((free + (share / np.sin(angle) / constant) ** (2 / 3)) * np.sin(angle) for angle in (outer, inner)))


def _force_of_distance(bearing: BearingDescription) -> float:
    """Return the axial force at the bearing's speed, N, with which the rings keep the distance of standstill."""
    if bearing.speed == 0:
        return bearing.preload
    kept = _distance(bearing, bearing.preload, 0.0)
    low, high = np.log(1e-3 * bearing.preload), np.log(1e4 * bearing.preload)
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        if _distance(bearing, float(np.exp(middle)), bearing.speed) < kept:
            low = middle
        else:
            high = middle
    force = float(np.exp(0.5 * (low + high)))
    if abs(_distance(bearing, force, bearing.speed) / kept - 1) > 1e-6:
        fail("bearing", f"no balance at {bearing.speed:g} rev/min between rings at a fixed distance",
             "must hold its balls between both races", remedy="raise the preload or lower the speed")
    return force
