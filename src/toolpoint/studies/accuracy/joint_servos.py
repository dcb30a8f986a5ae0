r"""Servo loops under the joints of a machine along a path: elastic rotors, held by their position and velocity loops.

An axis' motor turns by a small :math:`\theta` (in the axis' own coordinate, through the travel r a radian of the motor) about
its set point. The joints that the axis drives by factors f feel it: their springs and dampers act on :math:`q - \sum f
\theta`, q the deviation of the joint. The rotor brings :math:`J / r^2`, the cascade :math:`(K_v K_p + K_i) / r^2` of stiffness,
:math:`K_v / r^2` of damping, and :math:`K_i K_p / r^2` on the integral s of the position's deviation, which takes slow loads
away below :math:`K_p K_i / (K_v K_p + K_i)` rad/s. s is a coordinate of its own, :math:`\tau \ddot s + \dot s = \theta`, with
half the position loop's sample time for :math:`\tau`.

A sampled loop answers one and a half of its sample times late (computed in one, held over the next): what the velocity loop
sees is :math:`\theta_1 = \theta(t - \tau_1)`, the position loop :math:`y = \theta_1(t - \tau_2)`. Each delay is Pade's of order
[2/2], :math:`\frac{\tau^2}{12} \ddot p + \frac{\tau}{2} \dot p + p = \theta`, :math:`\theta(t - \tau) = \theta - \tau \dot p`,
a coordinate p of its own; its phase is wrong by :math:`(\omega \tau)^5/720` rad. Left out, and stated: the current loop,
the turn of the rotor with the body that carries it, and the lag behind the set point itself.

Source: Baker, Graves-Morris, Pade Approximants, 1996; Astrom, Wittenmark, Computer-Controlled Systems, 1997, for the delay.
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

LOOP_DELAY_SAMPLES = 1.5  # sample times: computed in one, held over the next
MIN_LOOP_SAMPLE_TIME = 1e-6  # s, below which a loop is continuous


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
    sample_time, velocity_sample_time : float
        Of the position loop and of the velocity loop, s; below a microsecond a loop is continuous.
    """

    position: float
    velocity: float
    integral: float
    inertia: float
    travel: float
    sample_time: float = 1e-3
    velocity_sample_time: float = 0.0

    def __post_init__(self) -> None:
        for name in ("position", "velocity", "inertia", "travel", "sample_time"):
            positive(f"JointServo.{name}", getattr(self, name))
        for name in ("integral", "velocity_sample_time"):
            nonnegative(f"JointServo.{name}", np.array(getattr(self, name)))

    @property
    def mass(self) -> float:
        """Inertia in the axis' own coordinate, kg or kg m^2."""
        return self.inertia / self.travel**2

    @property
    def stiffness(self) -> float:
        """Stiffness of the loops, N/m or N m/rad."""
        return (self.velocity * self.position + self.integral) / self.travel**2

    @property
    def damping(self) -> float:
        """Damping of the velocity loop, N s/m or N m s/rad."""
        return self.velocity / self.travel**2

    @property
    def integral_stiffness(self) -> float:
        """Stiffness on the integral of the position's deviation, N/(m s) or N m/(rad s)."""
        return self.integral * self.position / self.travel**2

    @property
    def delays(self) -> tuple[float, float]:
        """Delay of the velocity loop, and that of the position loop behind it, s: 0 where a loop is continuous."""
        times = self.velocity_sample_time, self.sample_time
        return (times[0] * LOOP_DELAY_SAMPLES * (times[0] >= MIN_LOOP_SAMPLE_TIME),
                times[1] * LOOP_DELAY_SAMPLES * (times[1] >= MIN_LOOP_SAMPLE_TIME))

    @property
    def feeds_energy(self) -> bool:
        """Whether the loops hold energy of their own or give it: an integral part or a delay."""
        return self.integral > 0 or any(self.delays)

    @property
    def delayed(self) -> float:
        """Degrees by which both delays turn the position loop at its own gain."""
        return float(np.degrees(sum(self.delays) * self.position))

    @property
    def slow(self) -> float:
        """Frequency (Hz) below which the integral part holds stiffer."""
        return self.position * self.integral / (self.velocity * self.position + self.integral) / (2 * np.pi)


def servos_of(drives: DriveDescription, machine: Machine) -> dict[str, JointServo]:
    """Return the servos of the axes that a drive file and a machine have in common.

    The travel of a rotary axis is one over the `gear_ratio` of its mechanics, whatever lead stands there; torsion and load are
    the machine's own.

    Raises ToolpointError where no axis is common, or one has no inertia, or a reducer drives a linear axis.

    Examples
    --------
    >>> from importlib import resources
    >>> from toolpoint.io import read_drives, read_machine
    >>> folder = resources.files("toolpoint.app") / "machines"
    >>> machine = read_machine(folder / "three_axis_vertical_drives.yaml")
    >>> servos = servos_of(read_drives(folder / "three_axis_vertical_servo_on_structure.yaml"), machine)
    >>> sorted(servos)
    ['X', 'Y']
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
                                  drive.mechanics.inertia, travel, drive.position.sample_time, drive.velocity.sample_time)
    return servos


def add_servos(machine: Machine, system: VaryingSystem, coordinates: tuple[str, ...], *, servos: Mapping[str, JointServo],
               batch: Mapping[str, FloatArray], loads: tuple[str, ...], reference: float) -> VaryingSystem:
    """Return a system with a rotor for every servo, then the integrals and delays of each, behind the coordinates it has.

    coordinates : their names; batch : axis positions at the nodes; loads : see `MillingSetup`; reference : Hz at which loss
    factors are as viscous dampers.
    """
    n, count = system.size, len(servos) + sum(_count_inner_coordinates(servo) for servo in servos.values())
    if len(coordinates) != n:
        fail("servos", "a machine whose loops close", "must be a chain without loops here", remedy="leave the servos out")
    stiffness, viscous, mass = (_pad(matrix, count) for matrix in (system.stiffness, system.damping, system.mass))
    for (coordinate, factors), joint, way in _servo_directions(machine, coordinates, servos):
        part = machine.description.joints[joint]
        k, loss = part.stiffness.get(way, 0.0), part.loss_factor
        share = loss.get(way, 0.0) if isinstance(loss, Mapping) else loss
        for matrix, value in ((stiffness, k), (viscous, part.damping.get(way, 0.0) + share * k / (2 * np.pi * reference))):
            rotors = slice(n, n + len(servos))
            matrix[:, coordinate, rotors] -= value * factors
            matrix[:, rotors, coordinate] -= value * factors
            matrix[:, rotors, rotors] += value * np.outer(factors, factors)
    coordinate = n + len(servos)
    for i, servo in enumerate(servos.values()):
        _close_loops(servo, n + i, coordinate, mass, viscous=viscous, stiffness=stiffness)
        coordinate += _count_inner_coordinates(servo)
    inputs = np.concatenate([system.input_map, np.zeros((len(mass), count, system.input_map.shape[2]))], axis=1)
    if "path" in loads:
        for i, (name, servo) in enumerate(servos.items()):
            course = CubicSpline(system.length, batch[name])
            inputs[:, n + i, -2] = -servo.mass * course(system.length, 2)
            inputs[:, n + i, -1] = -servo.mass * course(system.length, 1)
    no_output = np.zeros((len(mass), 6, count))
    return VaryingSystem(system.length, mass, viscous, stiffness, inputs,
                         np.concatenate([system.output_map, no_output], axis=2),
                         np.concatenate([system.momentum_map, no_output], axis=2))


def _count_inner_coordinates(servo: JointServo) -> int:
    """Return the number of coordinates of a servo beside its rotor: one for each delay, and one for the integral."""
    return sum(delay > 0 for delay in servo.delays) + (servo.integral > 0)


def _close_loops(servo: JointServo, rotor: int, row: int, mass: FloatArray, *, viscous: FloatArray, stiffness: FloatArray
                 ) -> None:
    """Write rotor and loops of a servo into the matrices: its delays, then its integral, from coordinate `row` on."""
    velocity, position = servo.delays
    stiff, square = servo.velocity * servo.position / servo.travel**2, servo.travel**2
    mass[:, rotor, rotor] += servo.mass
    stiffness[:, rotor, rotor] += servo.stiffness
    viscous[:, rotor, rotor] += servo.damping
    delayed: list[tuple[int, float]] = []  # y = theta less the sum of delay x rate of these
    for delay in (velocity, position):
        if delay == 0:
            continue
        mass[:, row, row], viscous[:, row, row], stiffness[:, row, row] = delay**2 / 12, delay / 2, 1.0
        stiffness[:, row, rotor] = -1.0
        for previous, previous_delay in delayed:  # the position loop sees what the velocity loop sees
            viscous[:, row, previous] = previous_delay
        delayed.append((row, delay))
        row += 1
    for place, delay in delayed:
        viscous[:, rotor, place] -= stiff * delay
    if velocity > 0:  # the rate of theta_1, and K_i theta_1
        first = delayed[0][0]
        mass[:, rotor, first] -= servo.damping * velocity
        viscous[:, rotor, first] -= servo.integral / square * velocity
    if servo.integral > 0:
        mass[:, row, row], viscous[:, row, row] = servo.sample_time / 2, 1.0
        stiffness[:, rotor, row], stiffness[:, row, rotor] = servo.integral_stiffness, -1.0
        for place, delay in delayed:
            viscous[:, row, place] = delay


def _pad(matrix: FloatArray, count: int) -> FloatArray:
    return np.pad(matrix, ((0, 0), (0, count), (0, count)))


def _servo_directions(machine: Machine, coordinates: tuple[str, ...], servos: Mapping[str, JointServo]
                      ) -> list[tuple[tuple[int, FloatArray], str, str]]:
    """Return for every joint direction that servos drive: its coordinate and the factors of the servos, joint, direction."""
    axes = machine.description.axes
    unknown = [name for name in servos if name not in axes]
    if unknown:
        fail("servos", repr(unknown[0]), f"must be axes of the machine: {', '.join(axes)}")
    factors: dict[tuple[str, str], FloatArray] = {}
    for i, name in enumerate(servos):
        for drive in axes[name].moved:
            way = drive.direction.lstrip("+-")
            if f"{drive.joint}.{way}" not in coordinates:
                fail("servos", f"{name}: {drive.joint}.{way} is locked", "must be elastic there",
                     remedy="give the joint a stiffness in its driven direction")
            sense = -1.0 if drive.direction.startswith("-") else 1.0
            factors.setdefault((drive.joint, way), np.zeros(len(servos)))[i] += sense * drive.factor
    return [((coordinates.index(f"{joint}.{way}"), row), joint, way) for (joint, way), row in factors.items()]


def servo_words(servos: Mapping[str, JointServo]) -> str:
    """Return the contents of the servos in words, and what is left out."""
    slow = max(servo.slow for servo in servos.values())
    turn = max(servo.delayed for servo in servos.values())
    words = f"servo loops of {', '.join(servos)}: rotors, cascades and their integral parts (below {slow:.2g} Hz)"
    return (f"{words} in the equations, with the delay of their sampling ({turn:.2g} degrees at the position gain, Pade [2/2]);"
            " left out: current loops and the lag of the set points")
