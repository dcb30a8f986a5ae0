"""Controllers of an axis: current, velocity and position loop, each with its own sample time and its own model."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from toolpoint._check import count, fail, one_of, positive, scalar
from toolpoint.drives.axis.motor import Inverter, SynchronousMotor, TorqueMotor
from toolpoint.drives.controller.filters import Filter
from toolpoint.drives.controller.records import FILTER_FIELDS, MAX_DELAY, MAX_FILTERS, PARAMETERS, SampleTimes

DAMPING_SENSORS = ("scale", "tool")  # where active damping by a drive sees the table


@dataclass(frozen=True)
class CurrentLoop:
    """Current PI in d and q with decoupling, delay, voltage limit and back-calculating anti-windup.

    Parameters
    ----------
    gain, integral : float
        V/A and V/(A s).
    model : SynchronousMotor
        What the controller believes of the motor (decoupling, torque constant): an instance of its own.
    sample_time : float
        s.
    delay : int
        Samples between measurement and voltage.
    decoupling : bool
        Add the rotational voltages of the model.
    limit : float
        Largest q current, A (peak).

    Examples
    --------
    >>> motor = SynchronousMotor(4, 0.5, 5e-3, 5e-3, 0.2)
    >>> round(CurrentLoop.from_bandwidth(motor, bandwidth=500.0).gain, 4)  # w L_q, V/A
    15.708
    """

    gain: float
    integral: float
    model: SynchronousMotor
    sample_time: float = 125e-6
    delay: int = 1
    decoupling: bool = True
    limit: float = 60.0

    def __post_init__(self) -> None:
        for name in ("gain", "sample_time", "limit"):
            positive(f"CurrentLoop.{name}", getattr(self, name))
        _not_negative("CurrentLoop.integral", self.integral)
        _delay("CurrentLoop.delay", self.delay)

    @classmethod
    def from_bandwidth(cls, motor: SynchronousMotor, bandwidth: float, *, sample_time: float = 125e-6, delay: int = 1,
                       decoupling: bool = True, limit: float = 60.0) -> CurrentLoop:
        """Return the loop of pole cancellation: gain = w L_q, integral = w R with w = 2 pi bandwidth (Hz)."""
        w = 2 * np.pi * positive("bandwidth", bandwidth)
        return cls(w * motor.inductance_q, w * motor.resistance, motor, sample_time, delay, decoupling, limit)


@dataclass(frozen=True)
class VelocityLoop:
    """Velocity PI: torque = gain (w_set - w) + gain/T_i integral, then filters, delay and limit.

    Parameters
    ----------
    gain : float
        N m s/rad (N s/m for a linear motor).
    integral_time : float
        T_i, s; infinite for none.
    sample_time : float
        s.
    filters : sequence of Filter
        On the torque command, at most four.
    delay : int
        Samples from measurement to torque command.
    limit : float
        Largest torque, N m; infinite for none.
    damping_gain : float
        Torque per speed of the sensor beyond that of the motor, the travel per radian divided out, N m s/rad: active damping
        by the drive. Positive damps what lies between motor and sensor; a mode of the frame may want the other sign.
    damping_sensor : str
        ``scale``, or ``tool`` (table against tool, an ideal sensor).

    Examples
    --------
    >>> VelocityLoop(gain=1.0, integral_time=0.05).sample_time
    0.00025
    """

    gain: float
    integral_time: float = np.inf
    sample_time: float = 250e-6
    filters: tuple[Filter, ...] = ()
    delay: int = 0
    limit: float = np.inf
    damping_gain: float = 0.0
    damping_sensor: str = "scale"

    def __post_init__(self) -> None:
        positive("VelocityLoop.gain", self.gain)
        scalar("VelocityLoop.damping_gain", self.damping_gain)
        one_of("VelocityLoop.damping_sensor", self.damping_sensor, DAMPING_SENSORS)
        positive("VelocityLoop.sample_time", self.sample_time)
        if not self.integral_time > 0 or not self.limit > 0:
            fail("VelocityLoop.integral_time, limit", f"{self.integral_time:g}, {self.limit:g}", "must be above zero")
        if len(self.filters) > MAX_FILTERS:
            fail("VelocityLoop.filters", f"{len(self.filters)} filters", f"must be at most {MAX_FILTERS}")
        _delay("VelocityLoop.delay", self.delay)


@dataclass(frozen=True)
class PositionLoop:
    """Position P with feed-forward: velocity set point = K_v (x_set - x) + f v_set.

    Parameters
    ----------
    gain : float
        K_v, 1/s.
    sample_time : float
        s.
    velocity_feedforward, inertia_feedforward : float
        f (1 = full); inertia in kg m2 at the motor whose acceleration torque is added to the torque command.
    friction_feedforward, friction_velocity : float
        Level (N m) and width (m/s) of level tanh(v_set/width) added to the torque command.
    feedback : str
        ``scale`` or ``motor``.

    Examples
    --------
    >>> PositionLoop(gain=20.0, velocity_feedforward=1.0).feedback
    'motor'
    """

    gain: float
    sample_time: float = 1e-3
    velocity_feedforward: float = 0.0
    inertia_feedforward: float = 0.0
    friction_feedforward: float = 0.0
    friction_velocity: float = 1e-4
    feedback: str = "motor"

    def __post_init__(self) -> None:
        for name in ("gain", "sample_time", "friction_velocity"):
            positive(f"PositionLoop.{name}", getattr(self, name))
        one_of("PositionLoop.feedback", self.feedback, ("scale", "motor"))


@dataclass(frozen=True)
class Encoders:
    """Resolution of the motor encoder (rad) and the linear scale (m); 0 is ideal.

    With a resolution the velocity is the difference of two readings over the velocity sample; without, the exact speed.
    `difference` True takes the difference also from an ideal encoder.

    Examples
    --------
    >>> Encoders(scale=10e-9).difference
    False
    """

    motor: float = 0.0
    scale: float = 0.0
    difference: bool = False

    def __post_init__(self) -> None:
        _not_negative("Encoders.motor", self.motor)
        _not_negative("Encoders.scale", self.scale)


@dataclass(frozen=True)
class Controller:
    """Cascade of one axis; `current` None where the motor is a TorqueMotor.

    `lead` is the travel per motor angle (m/rad) as the controller knows it.

    Examples
    --------
    >>> controller = Controller(PositionLoop(20.0), VelocityLoop(1.0), lead=2e-3)
    >>> controller.with_gains(position=40.0).position.gain
    40.0
    """

    position: PositionLoop
    velocity: VelocityLoop
    lead: float | None
    current: CurrentLoop | None = None
    encoders: Encoders = field(default_factory=Encoders)
    inverter: Inverter = field(default_factory=Inverter)

    def __post_init__(self) -> None:
        if self.lead is None:
            fail("Controller.lead", "missing", "the controller needs the travel per motor angle in m/rad",
                 remedy="lead of the screw / 2 pi; 1 for a linear motor")
        positive("Controller.lead", self.lead)

    def with_gains(self, position: float | None = None, velocity: float | None = None,
                   integral_time: float | None = None) -> Controller:
        """Return the controller with other gains: K_v 1/s, K_p N m s/rad, T_i s."""
        speed = replace(self.velocity, gain=velocity or self.velocity.gain,
                        integral_time=integral_time or self.velocity.integral_time)
        return replace(self, velocity=speed, position=replace(self.position, gain=position or self.position.gain))

    @property
    def sample_times(self) -> SampleTimes:
        """Sample times of the current, velocity and position loop, s; velocity twice where there is no current loop."""
        current_time = self.velocity.sample_time if self.current is None else self.current.sample_time
        return SampleTimes(current_time, self.velocity.sample_time, self.position.sample_time)

    def parameters(self, motor: SynchronousMotor | TorqueMotor) -> np.ndarray:
        """Return the record of `PARAMETERS` (shape ()) that the control kernel reads."""
        position, velocity = self.position, self.velocity
        if isinstance(motor, SynchronousMotor) != (self.current is not None):
            fail("Controller.current", repr(self.current), f"must suit {type(motor).__name__}",
                 remedy="a SynchronousMotor needs a CurrentLoop, a TorqueMotor none")
        lead = float(self.lead or 0.0)
        p = np.zeros((), PARAMETERS)
        p["position_gain"], p["velocity_feedforward"], p["lead"] = position.gain, position.velocity_feedforward, lead
        # The set point accelerates in m/s^2, the torque belongs to rad/s^2 of the motor.
        p["inertia_feedforward"] = position.inertia_feedforward / lead
        p["friction_feedforward"], p["friction_velocity"] = position.friction_feedforward, position.friction_velocity
        p["scale_feedback"] = position.feedback == "scale"
        p["angle_resolution"], p["scale_resolution"] = self.encoders.motor, self.encoders.scale
        p["difference"] = self.encoders.difference or self.encoders.motor > 0
        p["velocity_gain"], p["velocity_integral"] = velocity.gain, velocity.gain / velocity.integral_time
        p["torque_limit"], p["torque_constant"] = velocity.limit, motor.torque_constant
        p["velocity_delay"], p["velocity_sample_time"] = velocity.delay, velocity.sample_time
        p["damping_gain"], p["damps_tool"] = velocity.damping_gain, velocity.damping_sensor == "tool"
        p["current_sample_time"] = self.sample_times.current
        p["filter_count"] = len(velocity.filters)
        for i, part in enumerate(velocity.filters):
            for name, value in zip(FILTER_FIELDS, part.coefficients(velocity.sample_time), strict=True):
                p[name][i] = value
        if self.current is not None and isinstance(motor, SynchronousMotor):
            self._write_current(p, self.current, motor)
        return p

    def _write_current(self, p: np.ndarray, current: CurrentLoop, motor: SynchronousMotor) -> None:
        model = current.model
        p["has_current_loop"], p["torque_constant"] = True, model.torque_constant
        p["current_gain"], p["current_integral"] = current.gain, current.integral
        p["current_limit"], p["current_delay"], p["decoupling"] = current.limit, current.delay, current.decoupling
        p["model_inductance_d"], p["model_inductance_q"] = model.inductance_d, model.inductance_q
        p["model_flux"], p["model_pole_pairs"], p["pole_pairs"] = model.flux, model.pole_pairs, motor.pole_pairs
        p["voltage_limit"], p["six_pulse"] = self.inverter.voltage, self.inverter.kind == "six-pulse"
        p["carrier"] = self.inverter.carrier


def _not_negative(name: str, value: float) -> None:
    if scalar(name, value) < 0:
        fail(name, f"{value:g}", "must not be negative")


def _delay(name: str, value: int) -> None:
    if count(name, value, 0) >= MAX_DELAY:
        fail(name, f"{value} samples", f"must be below {MAX_DELAY}")
