"""Shared servos of the tests and the benchmark, and a continuous reference solution by DOP853."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from toolpoint.drives.axis.motor import Inverter, SynchronousMotor
from toolpoint.drives.axis.plant import DriveAxis, Plant, Structure, build_plant
from toolpoint.drives.axis.simple_axes import two_mass_axis
from toolpoint.drives.controller.servo import Servo
from toolpoint.drives.controller.settings import Controller, CurrentLoop, PositionLoop, VelocityLoop
from toolpoint.drives.friction.laws import Coulomb, FrictionLaw, LuGre, Viscous
from toolpoint.drives.program.command import circle
from toolpoint.vibration import Dof, Modes

RATIO = 0.010 / (2 * np.pi)
MOTOR = SynchronousMotor(4, 0.5, 5e-3, 5e-3, 0.15)


def frame(scale: float = 1.0, tool: tuple[float, float] = (1.522, 1.9711), phase: tuple[float, float] = (-0.7163, -1.2335)
          ) -> Structure:
    """Twenty modes 38..800 Hz, 2 %: both bases are driven, both bases and the tool move.

    How far the tool point moves with each mode (amplitude and phase along the mode number, in x and in y) is open in the
    reference: it sets what static compliance, seen by the table's inertia, and what share of the low modes, rung by the
    reversal of friction, reach the tool.
    """
    frequency = np.geomspace(38.0, 800.0, 20)
    k = np.arange(20)
    shape = np.stack([np.cos(1.3 * k + 0.2), np.sin(1.7 * k + 0.5), -tool[0] * np.cos(1.3 * k + phase[0]),
                      -tool[1] * np.sin(1.7 * k + phase[1])])
    shape = scale * shape / np.sqrt(2000.0)
    modes = Modes(frequency, np.full(20, 0.02), shape, ("base:+x", "base:+y", "tool:+x", "tool:+y"))
    return Structure.from_modes(modes, {"x.base": Dof("base", "+x"), "y.base": Dof("base", "+y")},
                                {"x": Dof("tool", "+x"), "y": Dof("tool", "+y")})


def lugre(coulomb: float = 338.9, ratio: float = 1.2, stiffness: float = 1e7, velocity: float = 2e-3,
          viscous: float = 400.0) -> LuGre:
    """Guideway friction, N."""
    return LuGre(stiffness, 3e3, coulomb, ratio * coulomb, velocity, viscous)


def benchmark_plant(law: FrictionLaw, frame_scale: float = 0.4704, masses: tuple[float, float] = (400.0, 354.8)) -> Plant:
    """Two axes with dq motors on the frame: 54 states with two LuGre bristles (52 in the linear part)."""
    axes = [DriveAxis(name, MOTOR, two_mass_axis(0.008, mass, RATIO, stiffness=1.2e8, damping=6e3, motor_damping=0.01,
                                                 guide_friction=law))
            for name, mass in zip("xy", masses, strict=True)]
    return build_plant(axes, frame(frame_scale))


def controller(position: float = 60.0, velocity: float = 2.0, integral: float = 0.015, ff: float = 1.0,
               feedback: str = "scale") -> Controller:
    """Cascade of the benchmark: 125 us, 250 us, 1 ms; 60 A, 320 V; velocity feed-forward."""
    return Controller(PositionLoop(position, 1e-3, ff, feedback=feedback), VelocityLoop(velocity, integral, 250e-6), RATIO,
                      CurrentLoop.from_bandwidth(MOTOR, 500.0, sample_time=125e-6, delay=1, limit=60.0),
                      inverter=Inverter(320.0))


def benchmark_servo(law: FrictionLaw | None = None, frame_scale: float = 0.4704) -> Servo:
    """The servo of the benchmark."""
    return Servo(benchmark_plant(lugre() if law is None else law, frame_scale), (controller(), controller()))


def benchmark_command(duration: float = 1.0, angle: float = 0.0):
    """Circle of 10 mm at 4000 mm/min, starting at the origin."""
    return circle(0.010, 4 / 60, 1e-3, duration=duration, center=(-0.010 * np.cos(angle), -0.010 * np.sin(angle)),
                  start_angle=angle)


def smooth(law: LuGre) -> Viscous:
    """The same without its dry part."""
    return Viscous(law.viscous)


def dry(law: LuGre) -> Coulomb:
    """The same as Coulomb friction."""
    return Coulomb(law.coulomb, law.viscous)


def continuous(servo: Servo, command, duration: float, tolerance: float = 1e-12, method: str = "DOP853"):
    """Return plant states at every current sample from an adaptive solver between the same sampled controllers."""
    from toolpoint.drives.simulation.kernel import held_inputs, sample_controllers
    from toolpoint.drives.simulation.simulate import control_arrays

    p, step = servo.plant, servo.controllers[0].sample_times[0]
    control, u, voltage = control_arrays(servo, command), np.zeros(2 * len(p.axes)), np.zeros(2)
    reading, n, laws = np.array(p.outputs), p.a.shape[0], p.laws.size
    friction = [rub.law for axis in p.axes for rub in axis.mechanics.friction]
    right = plant_rate(p, friction)
    x = np.zeros(n + laws)
    history, evaluations = [x.copy()], 0
    for k in range(round(duration / step)):
        sample_controllers(k, control, reading @ x[:n])
        held_inputs(k, control, reading @ x[:n], u, voltage)
        made = solve_ivp(right, (0.0, step), x, method, args=(p.b_input @ u,), rtol=tolerance, atol=1e-15)
        x = made.y[:, -1]
        evaluations += made.nfev
        history.append(x.copy())
    return np.array(history), evaluations


def plant_rate(p: Plant, friction: list):
    """Return the right-hand side of the continuous plant with LuGre or viscous laws."""
    n, laws = p.a.shape[0], p.laws.size
    a, bw, sc, one, other = np.array(p.a), np.array(p.b_scalar), np.array(p.scalars), *p.products.T

    def rate(t, x, drive):
        s, w, dz = sc @ x[:n], np.empty(bw.shape[1]), np.zeros(laws)
        for j, law in enumerate(friction):
            if isinstance(law, LuGre):
                v, z = s[j], x[n + j]
                e = (law.static - law.coulomb) * np.exp(-((v / law.stribeck_velocity) ** 2))
                dz[j] = v - law.stiffness * abs(v) * z / (law.coulomb + e)
                w[j] = law.stiffness * z + law.damping * dz[j]
            else:
                w[j] = 0.0
        w[laws:] = s[one] * s[other]
        return np.concatenate([a @ x[:n] + bw @ w + drive, dz])

    return rate
