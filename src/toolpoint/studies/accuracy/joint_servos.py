r"""Servo loops under the joints of a machine along a path: rotors that give way, held by their position and velocity loops.

An axis' motor turns by a small :math:`\theta` (in the axis' own coordinate, through the travel r a radian of the motor) about
its set point. The joints that the axis drives by factors f feel it: their springs and dampers act on :math:`q - \sum f
\theta`, q the deviation of the joint. The rotor brings :math:`J / r^2`, the cascade :math:`(K_v K_p + K_i) / r^2` of stiffness,
:math:`K_v / r^2` of damping, and :math:`K_i K_p / r^2` on the integral s of the position's deviation, which takes slow loads
away below :math:`K_p K_i / (K_v K_p + K_i)` rad/s. s is a coordinate of its own, :math:`\tau \ddot s + \dot s = \theta`, with
half the position loop's sample time for :math:`\tau`. Left out, and stated: the sampling's delay, the current loop, the turn
of the rotor with the body that carries it, and the lag behind the set point itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from toolpoint._check import FloatArray, fail, nonnegative, positive
from toolpoint.drives.build import travel_per_angle
from toolpoint.drives.description import DriveDescription
from toolpoint.machine.parts.model import Machine
from toolpoint.vibration.simulation.varying import VaryingSystem


@dataclass(frozen=True)
class JointServo:
    """The servo of an axis.

    Parameters
    ----------
    position : float
        Gain of the position loop K_p, 1/s.
    velocity : float
        Gain of the velocity loop at the motor K_v, N m s/rad.
    integral : float
        Its integral gain K_i, N m/rad.
    inertia : float
        Of the rotor with what turns with it, kg m^2.
    travel : float
        Of the axis for a radian of the motor: rad (one over the gear ratio) or m (lead over 2 pi).
    sample_time : float
        Of the position loop, s.
    """

    position: float
    velocity: float
    integral: float
    inertia: float
    travel: float
    sample_time: float = 1e-3

    def __post_init__(self) -> None:
        for name in ("position", "velocity", "inertia", "travel", "sample_time"):
            positive(f"JointServo.{name}", getattr(self, name))
        nonnegative("JointServo.integral", np.array(self.integral))

    @property
    def mass(self) -> float:
        """Inertia in the axis' own coordinate, kg or kg m^2."""
        return self.inertia / self.travel**2

    @property
    def stiffness(self) -> float:
        """Of the loops, N/m or N m/rad."""
        return (self.velocity * self.position + self.integral) / self.travel**2

    @property
    def damping(self) -> float:
        """Of the velocity loop, N s/m or N m s/rad."""
        return self.velocity / self.travel**2

    @property
    def integral_stiffness(self) -> float:
        """On the integral of the position's deviation, N/(m s) or N m/(rad s)."""
        return self.integral * self.position / self.travel**2

    @property
    def delayed(self) -> float:
        """Degrees by which hold and delay of the position loop's sampling, left out, would turn it at its own gain."""
        return float(np.degrees(1.5 * self.sample_time * self.position))

    @property
    def slow(self) -> float:
        """Frequency (Hz) below which the integral part holds stiffer."""
        return self.position * self.integral / (self.velocity * self.position + self.integral) / (2 * np.pi)


def servos_of(drives: DriveDescription, machine: Machine) -> dict[str, JointServo]:
    """Return the servos of the axes that a drive file and a machine have in common.

    The travel of a rotary axis is one over the `gear_ratio` of its mechanics, whatever lead stands there; torsion and load are
    the machine's own.

    Raises ToolpointError where no axis is common, or one has no inertia, or a reducer drives a linear axis.
    """
    axes = machine.description.axes
    names = [name for name in drives.axes if name in axes]
    if not names:
        fail("drives", ", ".join(drives.axes), f"must share an axis with the machine ({', '.join(axes)})")
    servos = {}
    for name in names:
        drive = drives.axes[name]
        if drive.mechanics.inertia is None:
            fail(f"axes.{name}.mechanics.inertia", "missing", "must be given: the rotor's, with what turns with it")
        if drive.mechanics.kind == "reducer" and not axes[name].is_rotary:
            fail(f"axes.{name}.mechanics.kind", "reducer", f"must be of a rotary axis; {name} of the machine is linear")
        travel = 1 / drive.mechanics.gear_ratio if axes[name].is_rotary else travel_per_angle(drive.mechanics)
        time = drive.velocity.integral_time
        servos[name] = JointServo(drive.position.gain, drive.velocity.gain, 0.0 if time is None else drive.velocity.gain / time,
                                  drive.mechanics.inertia, travel, drive.position.sample_time)
    return servos


def add_servos(machine: Machine, system: VaryingSystem, coordinates: tuple[str, ...], *, servos: Mapping[str, JointServo],
               batch: Mapping[str, FloatArray], loads: tuple[str, ...], reference: float) -> VaryingSystem:
    """Return a system with a rotor for every servo, then an integral for each that has one, behind the coordinates it has.

    coordinates : their names; batch : axis positions at the nodes; loads : see `MillingSetup`; reference : Hz at which loss
    factors are as viscous dampers.
    """
    integrals = [i for i, servo in enumerate(servos.values()) if servo.integral > 0]
    n, count = system.size, len(servos) + len(integrals)
    if len(coordinates) != n:
        fail("servos", "a machine whose loops close", "must be a chain without loops here", "leave the servos out")
    stiffness, viscous, mass = (_grown(matrix, count) for matrix in (system.stiffness, system.damping, system.mass))
    for (at, factors), joint, way in _driven(machine, coordinates, servos):
        part = machine.description.joints[joint]
        k, loss = part.stiffness.get(way, 0.0), part.loss_factor
        share = loss.get(way, 0.0) if isinstance(loss, Mapping) else loss
        for matrix, value in ((stiffness, k), (viscous, part.damping.get(way, 0.0) + share * k / (2 * np.pi * reference))):
            rotors = slice(n, n + len(servos))
            matrix[:, at, rotors] -= value * factors
            matrix[:, rotors, at] -= value * factors
            matrix[:, rotors, rotors] += value * np.outer(factors, factors)
    for i, servo in enumerate(servos.values()):
        mass[:, n + i, n + i] += servo.mass
        stiffness[:, n + i, n + i] += servo.stiffness
        viscous[:, n + i, n + i] += servo.damping
    for k, i in enumerate(integrals):
        servo, at = list(servos.values())[i], n + len(servos) + k
        mass[:, at, at], viscous[:, at, at] = servo.sample_time / 2, 1.0
        stiffness[:, n + i, at], stiffness[:, at, n + i] = servo.integral_stiffness, -1.0
    inputs = np.concatenate([system.input_map, np.zeros((len(mass), count, system.input_map.shape[2]))], axis=1)
    if "path" in loads:
        for i, (name, servo) in enumerate(servos.items()):
            course = CubicSpline(system.length, batch[name])
            inputs[:, n + i, -2] = -servo.mass * course(system.length, 2)
            inputs[:, n + i, -1] = -servo.mass * course(system.length, 1)
    still = np.zeros((len(mass), 6, count))
    return VaryingSystem(system.length, mass, viscous, stiffness, inputs, np.concatenate([system.output_map, still], axis=2),
                         np.concatenate([system.momentum_map, still], axis=2))


def _grown(matrix: FloatArray, count: int) -> FloatArray:
    return np.pad(matrix, ((0, 0), (0, count), (0, count)))


def _driven(machine: Machine, coordinates: tuple[str, ...], servos: Mapping[str, JointServo]
            ) -> list[tuple[tuple[int, FloatArray], str, str]]:
    """Return for every joint direction that servos drive: its coordinate and the factors of the servos, joint, direction."""
    axes = machine.description.axes
    lost = [name for name in servos if name not in axes]
    if lost:
        fail("servos", repr(lost[0]), f"must be axes of the machine: {', '.join(axes)}")
    factors: dict[tuple[str, str], FloatArray] = {}
    for i, name in enumerate(servos):
        for drive in axes[name].moved:
            way = drive.direction.lstrip("+-")
            if f"{drive.joint}.{way}" not in coordinates:
                fail("servos", f"{name}: {drive.joint}.{way} is locked", "must be elastic there",
                     "give the joint a stiffness in its driven direction")
            sense = -1.0 if drive.direction.startswith("-") else 1.0
            factors.setdefault((drive.joint, way), np.zeros(len(servos)))[i] += sense * drive.factor
    return [((coordinates.index(f"{joint}.{way}"), row), joint, way) for (joint, way), row in factors.items()]


def servo_words(servos: Mapping[str, JointServo]) -> str:
    """Return what is in the servos and what is left out."""
    slow = max(servo.slow for servo in servos.values())
    turn = max(servo.delayed for servo in servos.values())
    words = f"servo loops of {', '.join(servos)}: rotors, cascades and their integral parts (below {slow:.2g} Hz)"
    return (f"{words} in the equations; left out: delay of the sampling ({turn:.2g} degrees at the position gain), current "
            "loops and the lag of the set points")
