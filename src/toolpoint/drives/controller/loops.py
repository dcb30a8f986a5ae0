"""Linear loops of a servo, exactly as sampled: each level closed and held over the next, with responses and margins.

The plant is linearised at rest: viscous friction is kept, dry friction and the bilinear terms of the motor are not (they
vanish at zero speed and current). Independent of the simulation kernel, so each checks the other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, floats
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.drives.axis.outputs import ANGLE, CURRENT_Q, OUTPUTS, SCALE, SPEED, TOOL
from toolpoint.drives.controller.loop_doubts import doubt_margins
from toolpoint.drives.controller.servo import Servo
from toolpoint.vibration import StateSpace
from toolpoint.vibration.state_space import hold_matrices

LEVELS = ("current", "velocity", "position")
Update = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]


@dataclass(frozen=True)
class Margins(NotebookText):
    """Gain margin (factor), phase margin (deg), smallest distance to -1, and their frequencies (Hz); nan where none.

    `trusted` is the share of the lines that were judged: on a measured loop the others lie beyond where it is coherent, and
    `doubt` says what stands there.
    """

    gain: float
    phase: float
    distance: float
    phase_crossover: float
    gain_crossover: float
    trusted: float = 1.0
    doubt: Doubt | None = None

    def __repr__(self) -> str:
        judged = "" if self.trusted == 1.0 else f"; {100 * self.trusted:.0f} % of the lines judged"
        return (f"Margins(gain {self.gain_db:.2f} dB at {self.phase_crossover:.4g} Hz, phase {self.phase:.1f} deg at "
                f"{self.gain_crossover:.4g} Hz, distance {20 * np.log10(max(self.distance, 1e-300)):.1f} dB{judged})")

    @property
    def gain_db(self) -> float:
        """Gain margin in dB."""
        return 20 * float(np.log10(self.gain)) if self.gain > 0 else float("nan")


@dataclass(frozen=True, eq=False)
class LoopLevel:
    """One level: closed loop of all axes, set points in and feedback values out, and the state it adds."""

    name: str
    closed: StateSpace
    opened: Callable[[int], StateSpace]

    def open_response(self, frequency: FloatArray, axis: int = 0) -> ComplexArray:
        """Return L = feedback/error of one axis, its loop cut and the others closed, shape (n_f,)."""
        return self.opened(axis).response(floats("frequency", frequency))[:, axis, axis]

    def closed_response(self, frequency: FloatArray, axis: int = 0) -> ComplexArray:
        """Return feedback/set point of one axis, all loops closed, shape (n_f,)."""
        return self.closed.response(floats("frequency", frequency))[:, axis, axis]

    @property
    def radius(self) -> float:
        """Largest multiplier; below one where the level is stable."""
        return float(np.abs(self.closed.poles).max())

    def margins(self, axis: int = 0, lines: int = 4000) -> Margins:
        """Return the margins of one axis' open loop, up to and with half the sample rate, where a sampled loop is real."""
        f_half = 0.5 / float(self.closed.sample_time or 1.0)
        # Dense to the end: between the last two lines of a logarithmic row the phase of a delay turns by many degrees.
        f = np.concatenate([np.geomspace(f_half * 1e-4, f_half * 0.99, lines), np.linspace(0.991, 1.0, 10) * f_half])
        open_loop = np.array(self.open_response(f, axis))
        open_loop[-1] = open_loop[-1].real
        return margins(f, open_loop)


# Lines about a crossing, and the quantile of their coherence that must reach the level: at noise, two averages give 0.5.
_COHERENCE_WINDOW, _COHERENCE_QUANTILE, _MIN_COHERENCE = 15, 0.25, 0.75


def coherent_lines(coherence: FloatArray) -> np.ndarray:
    """Return at which lines a measured response is trusted, (n_f,): from the first line at which three quarters of the 15 lines
    about have a coherence of 0.75, to the first at which they have it no more.

    Beyond a stretch of noise the phase cannot be counted through, and single coherent lines there are too few to judge.
    """
    c = floats("coherence", coherence, (None,))
    around = np.lib.stride_tricks.sliding_window_view(np.pad(c, _COHERENCE_WINDOW // 2, mode="edge"), _COHERENCE_WINDOW)
    good = np.quantile(around, _COHERENCE_QUANTILE, axis=1) >= _MIN_COHERENCE
    begun = np.maximum.accumulate(good)
    return good & ~np.maximum.accumulate(begun & ~good)


def margins(frequency: FloatArray, open_loop: ComplexArray, coherence: FloatArray | None = None) -> Margins:
    """Return the margins of an open loop L(f): the smallest |log gain| at -180 deg and the smallest phase margin.

    Parameters
    ----------
    frequency : (n_f,) floats
        Hz. Where the last line is half the sample rate of a sampled loop, L is real there; a negative L is a crossing.
    open_loop : (n_f,) complexes
    coherence : (n_f,) floats, optional
        Of a measured loop: crossings among lines of noise do not count.
    """
    f, l = floats("frequency", frequency), np.asarray(open_loop)
    trust = np.ones(f.size, bool) if coherence is None else coherent_lines(floats("coherence", coherence, f.shape))
    judged = trust[1:] & trust[:-1]  # a crossing lies between two lines: both must be coherent
    phase, size = np.unwrap(np.angle(l)), np.abs(l)
    turns = (phase + np.pi) / (2 * np.pi)
    cross = np.flatnonzero((np.floor(turns[1:]) != np.floor(turns[:-1])) & judged)
    gain, at_phase = np.inf, np.nan
    # At half the sample rate a sampled loop is real: a crossing that no two lines lie around.
    if l[-1].imag == 0 and l[-1].real < 0 and trust[-1]:
        gain, at_phase = 1 / size[-1], f[-1]
    for k in cross:  # between lines the loop is taken as straight in phase and logarithm of size
        target = max(np.floor(turns[k]), np.floor(turns[k + 1]))
        share = (target - turns[k]) / (turns[k + 1] - turns[k])
        value = size[k] ** (share - 1) * size[k + 1] ** -share
        if abs(np.log(value)) < abs(np.log(gain)):
            gain, at_phase = value, f[k] + share * (f[k + 1] - f[k])
    best, at_gain = np.nan, np.nan
    for k in np.flatnonzero(((size[1:] - 1) * (size[:-1] - 1) < 0) & judged):
        share = np.log(size[k]) / np.log(size[k] / size[k + 1])
        value = (np.degrees(phase[k] + share * (phase[k + 1] - phase[k])) + 180) % 360
        value = value - 360 if value > 180 else value  # 300 deg of margin are 60 deg too much lag
        if not abs(value) > abs(best):  # so written, the first one replaces the NaN
            best, at_gain = value, f[k] + share * (f[k + 1] - f[k])
    doubt = None
    if not trust.all():
        band = f"{f[trust][0]:.4g} to {f[trust][-1]:.4g} Hz" if trust.any() else "no band"
        full = margins(f, l)
        crossing = ("" if not full.gain < gain else
                    f" (a crossing at {full.phase_crossover:.4g} Hz with {full.gain_db:.1f} dB among incoherent lines)")
        doubt = Doubt("margins", f"coherent in {band} only", f"measure with more averages to judge the rest{crossing}",
                      figure=1 - float(trust.mean()))
    distance = float(np.abs(1 + l[trust]).min()) if trust.any() else float("nan")
    return Margins(float(gain), float(best), distance, float(at_phase), float(at_gain), float(trust.mean()),
                   doubt)


def bandwidth(frequency: FloatArray, closed_loop: ComplexArray, drop_db: float = 3.0) -> float:
    """Return the first frequency (Hz) at which |T| falls `drop_db` below its value at the first line; nan for none.

    Between two lines the level in dB is linear over log frequency.
    """
    level = 20 * np.log10(np.maximum(np.abs(closed_loop) / abs(closed_loop[0]), 1e-300)) + drop_db
    below = np.flatnonzero(level < 0)
    if not below.size:
        return float("nan")
    k = int(below[0])
    share = level[k - 1] / (level[k - 1] - level[k])
    return float(frequency[k - 1] * (frequency[k] / frequency[k - 1]) ** share)


@dataclass(frozen=True, eq=False)
class ServoLoops(NotebookText):
    """The three levels of a servo (the current level is missing where every motor is a TorqueMotor)."""

    current: LoopLevel
    velocity: LoopLevel
    position: LoopLevel

    @property
    def levels(self) -> tuple[LoopLevel, LoopLevel, LoopLevel]:
        """Levels from the innermost out."""
        return self.current, self.velocity, self.position

    @property
    def stable(self) -> bool:
        """Whether the outermost closed loop is stable (rigid motion included)."""
        return self.position.radius < 1.0

    @cached_property
    def figures(self) -> list[tuple[str, str, float, float, float]]:
        """Loop, axis, gain margin (dB), phase margin (deg) and bandwidth (Hz); no current loop where a motor has none."""
        rows = []
        for level in self.levels:
            f = np.geomspace(1e-4, 0.999, 2000) * 0.5 / float(level.closed.sample_time or 1)
            for axis, name in enumerate(level.closed.inputs):
                closed = level.closed_response(f, axis)
                if level is self.current and np.array_equal(closed, np.ones_like(closed)):
                    continue
                m = level.margins(axis)
                rows.append((level.name, name, m.gain_db, m.phase, bandwidth(f, closed)))
        return rows

    @property
    def doubts(self) -> list[Doubt]:
        """Doubts of loops that are hardly stable."""
        return doubt_margins(self.figures)

    def to_dict(self) -> dict[str, Any]:
        """Return margins, bandwidth and doubts as plain data."""
        return {"stable": self.stable, "doubts": list(self.doubts), "loops": [
            {"loop": loop, "axis": name, "gain_margin_db": gain, "phase_margin_deg": phase, "bandwidth_hz": width}
            for loop, name, gain, phase, width in self.figures]}

    def table(self) -> str:
        """Return doubts, then margins and bandwidth, one line for each level and axis."""
        return "\n".join([*mark_notes(self.doubts), self.margin_table()])

    def margin_table(self) -> str:
        """Return margins and bandwidth alone."""
        lines = ["loop      axis  gain margin dB  phase margin deg  bandwidth Hz"]
        return "\n".join(lines + [f"{loop:9s} {name:5s} {gain:14.2f}  {phase:16.1f}  {width:12.2f}"
                                  for loop, name, gain, phase, width in self.figures])


def compute_loops(servo: Servo, friction_slope: FloatArray | None = None) -> ServoLoops:
    """Return the loops of a servo.

    Parameters
    ----------
    friction_slope : (n_laws,) floats, optional
        dF/dv of every dry friction law at the working point (N s/m or N m s/rad), zero where left out.

    >>> import tempfile
    >>> from pathlib import Path
    >>> import numpy as np
    >>> from toolpoint import io
    >>> from toolpoint.drives import build_servo
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     drives = io.read_drives(io.write_template(Path(folder, "servo.yaml"), "servo"))
    >>> position = compute_loops(build_servo(drives, warn=False)).position.closed
    >>> rest = np.linalg.solve(np.eye(position.size) - position.a, position.b)  # at a constant set point z = 1
    >>> (position.c @ rest + position.d).round(6).tolist()  # both axes arrive, and neither moves the other
    [[1.0, 0.0], [0.0, 1.0]]
    """
    levels = _Levels(servo, friction_slope)
    return ServoLoops(levels.level(0), levels.level(1), levels.level(2))


class _Levels:
    """Builder of the levels from the innermost out."""

    def __init__(self, servo: Servo, slope: FloatArray | None) -> None:
        self.servo, plant = servo, servo.plant
        self.n = len(plant.axes)
        a = np.array(plant.a)
        if slope is not None:
            laws = plant.laws.size
            a = a + plant.b_scalar[:, :laws] @ (floats("friction_slope", slope, (laws,))[:, None] * plant.scalars[:laws])
        self.times = servo.controllers[0].sample_times
        self.phi, self.gamma, _ = hold_matrices(a, np.array(plant.b_input[:, 1::2]), self.times.current)
        self.y = plant.outputs.reshape(self.n, len(OUTPUTS), -1)
        self.models = [c.current.model if c.current else None for c in servo.controllers]
        self.levels: list[StateSpace] = []
        self.held: list[StateSpace] = []
        self._grow()

    def _grow(self) -> None:
        self.levels.append(self._linear(0, None))
        counts = self.servo.counts
        for number, repeat in ((1, counts.velocity), (2, counts.position // counts.velocity)):
            self.held.append(_held(self.levels[-1], repeat))
            self.levels.append(self._linear(number, None))

    def level(self, number: int) -> LoopLevel:
        return LoopLevel(LEVELS[number], self.levels[number], lambda axis: self._linear(number, axis))

    def _linear(self, number: int, cut: int | None) -> StateSpace:
        """Return the level as matrices: its update evaluated on the columns of the unit matrix."""
        update, size = (self._current, self._velocity, self._position)[number](cut)
        n = self.n
        # An update is written once, as the controller runs it: evaluated on unit vectors it gives its matrices, with no
        # second derivation.
        unit = np.eye(size + n)
        after, out = update(unit[:size], unit[size:])
        names = tuple(axis.name for axis in self.servo.plant.axes)
        return StateSpace(after[:, :size], after[:, size:], out[:, :size], out[:, size:], names, names,
                          sample_time=self.times[number], hold="zero")

    def _error(self, cut: int | None, setpoint: FloatArray, feedback: FloatArray) -> FloatArray:
        """Return set point less feedback; where a loop is cut, its set point is the error itself."""
        error = setpoint - feedback
        if cut is not None:
            error[cut] = setpoint[cut]
        return error

    def _current(self, cut: int | None) -> tuple[Update, int]:
        nx, n = self.phi.shape[0], self.n
        delay = max((c.current.delay for c in self.servo.controllers if c.current), default=0)

        def update(state: FloatArray, setpoint: FloatArray) -> tuple[FloatArray, FloatArray]:
            x, integral, line = state[:nx], state[nx:nx + n].copy(), state[nx + n:].reshape(delay, n, state.shape[1])
            feedback, u = self.y[:, CURRENT_Q] @ x, setpoint.copy()
            error = self._error(cut, setpoint, feedback)
            for i, c in enumerate(self.servo.controllers):
                if c.current is None:
                    # A motor without a current loop gives its torque at once: its level is one, so that the levels above
                    # need no case.
                    feedback[i], integral[i] = setpoint[i], 0.0
                    continue
                m = c.current.model
                u[i] = c.current.gain * error[i] + integral[i]
                if c.current.decoupling:
                    u[i] = u[i] + m.pole_pairs * m.flux * (self.y[i, SPEED] @ x)  # back-EMF, as the speed shows it
                integral[i] = integral[i] + self.times.current * c.current.integral * error[i]
            queue = np.concatenate([u[None], line]) if delay else u[None]
            drive = np.stack([queue[c.current.delay if c.current else 0, i] for i, c in
                              enumerate(self.servo.controllers)])
            x1 = self.phi @ x + self.gamma @ drive
            line_after = queue[:delay].reshape(delay * n, state.shape[1])
            return np.vstack([x1, integral, line_after]), feedback

        return update, nx + n + delay * n

    def _velocity(self, cut: int | None) -> tuple[Update, int]:
        held, n, nx = self.held[0], self.n, self.phi.shape[0]
        size, delay = held.size, max(c.velocity.delay for c in self.servo.controllers)
        stages = max(len(c.velocity.filters) for c in self.servo.controllers)
        # Behind the plant, the integrals and the angles stand the stretches of active damping, where an axis has it.
        first = size + (3 if any(c.velocity.damping_gain for c in self.servo.controllers) else 2) * n

        def update(state: FloatArray, setpoint: FloatArray) -> tuple[FloatArray, FloatArray]:
            x, integral, last = state[:nx], state[size:size + n].copy(), state[size + n:size + 2 * n]
            last_stretch = state[size + 2 * n:first]
            memory = state[first:first + 2 * n * stages].reshape(n, stages, 2, state.shape[1]).copy()
            line = state[first + 2 * n * stages:].reshape(delay, n, state.shape[1])
            angle, feedback = self.y[:, ANGLE] @ x, self.y[:, SPEED] @ x
            for i, c in enumerate(self.servo.controllers):
                # A speed from differences of angles is half a sample late, which costs phase; its steps are noise and left
                # out here.
                if c.encoders.difference or c.encoders.motor > 0:
                    feedback[i] = (angle[i] - last[i]) / self.times.velocity
            error = self._error(cut, setpoint, feedback)
            torque, stretch = np.zeros_like(setpoint), self._stretch(x)[:first - size - 2 * n]
            for i, c in enumerate(self.servo.controllers):
                value = c.velocity.gain * error[i] + integral[i]
                integral[i] = integral[i] + c.velocity.gain / c.velocity.integral_time * self.times.velocity * error[i]
                if c.velocity.damping_gain:
                    value = value + c.velocity.damping_gain * (stretch[i] - last_stretch[i]) / self.times.velocity
                for k, part in enumerate(c.velocity.filters):
                    b0, b1, b2, a1, a2 = part.coefficients(self.times.velocity)
                    y = b0 * value + memory[i, k, 0]
                    memory[i, k, 0] = b1 * value - a1 * y + memory[i, k, 1]
                    memory[i, k, 1] = b2 * value - a2 * y
                    value = y
                torque[i] = value
            queue = np.concatenate([torque[None], line])
            drive = np.stack([queue[c.velocity.delay, i] / self._constant(i) for i, c in
                              enumerate(self.servo.controllers)])
            after = held.a @ state[:size] + held.b @ drive
            line_after = queue[:delay].reshape(delay * n, state.shape[1])
            filters = memory.reshape(2 * n * stages, state.shape[1])
            return np.vstack([after, integral, angle, stretch, filters, line_after]), feedback

        return update, first + 2 * n * stages + delay * n

    def _stretch(self, x: FloatArray) -> FloatArray:
        """Return how far the sensors of active damping run ahead of their motors, rad at the motor, (n_axes, k)."""
        places = [TOOL if c.velocity.damping_sensor == "tool" else SCALE for c in self.servo.controllers]
        return np.stack([self.y[i, place] @ x / float(c.lead or 1) - self.y[i, ANGLE] @ x
                         for i, (c, place) in enumerate(zip(self.servo.controllers, places, strict=True))])

    def _constant(self, i: int) -> float:
        model = self.models[i]
        return 1.0 if model is None else model.torque_constant

    def _position(self, cut: int | None) -> tuple[Update, int]:
        held, nx = self.held[1], self.phi.shape[0]

        def update(state: FloatArray, setpoint: FloatArray) -> tuple[FloatArray, FloatArray]:
            x = state[:nx]
            feedback = np.stack([self.y[i, SCALE] @ x if c.position.feedback == "scale" else
                                 float(c.lead or 0) * (self.y[i, ANGLE] @ x) for i, c in enumerate(self.servo.controllers)])
            error = self._error(cut, setpoint, feedback)
            speed = np.stack([c.position.gain * error[i] / float(c.lead or 1)
                              for i, c in enumerate(self.servo.controllers)])
            return held.a @ state + held.b @ speed, feedback

        return update, held.size


def _held(system: StateSpace, repeat: int) -> StateSpace:
    """Return the system with its input held over `repeat` samples, and its output sampled as often."""
    # By repeated products, not by powers and a sum of inverses: the rigid motion makes I - A singular.
    a, b = np.eye(system.size), np.zeros_like(system.b)
    for _ in range(repeat):
        b = system.a @ b + system.b
        a = system.a @ a
    return StateSpace(a, b, system.c, system.d, system.inputs, system.outputs,
                      sample_time=float(system.sample_time or 0) * repeat, hold="zero")
