"""Simulation of a servo: the discrete step of the plant, command and excitation in, histories out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, count, fail, floats, frozen, one_of
from toolpoint._deprecation import rename_argument
from toolpoint._notebook import NotebookText
from toolpoint.drives.axis.outputs import OUTPUTS
from toolpoint.drives.axis.plant import Plant
from toolpoint.drives.controller.loop_stability import check_stable
from toolpoint.drives.controller.records import CONTROL_STATE, SET_POINT, SampleCounts
from toolpoint.drives.controller.servo import Servo
from toolpoint.drives.friction.records import LAW_STATE
from toolpoint.drives.program.command import Command
from toolpoint.drives.simulation.arrays import (
    PLACES,
    SIGNALS,
    ControlArrays,
    Histories,
    LawArrays,
    MotionArrays,
    StepArrays,
)
from toolpoint.drives.simulation.exact_step import StepMatrices, step_matrices
from toolpoint.vibration import Dof, Record


@dataclass(frozen=True, eq=False)
class ServoResult(NotebookText):
    """Histories of a simulation.

    `outputs` (n, n_axes, 7): motor angle, speed, scale, i_d, i_q, table, tool; `signals` (n, n_axes, 6): speed, torque and
    current set points, u_d, u_q, following error; `forces` (n, n_laws): friction and contact values; `command` the
    position command at every instant. SI throughout.
    """

    time: FloatArray
    axes: tuple[str, ...]
    outputs: FloatArray
    signals: FloatArray
    forces: FloatArray
    command: FloatArray
    state: FloatArray
    unconverged: int = 0
    notes: tuple[str, ...] = field(default=())

    def output(self, name: str, axis: str | int | None = None) -> FloatArray:
        """Return one output: (n, n_axes), or (n,) of one axis."""
        one_of("output", name, OUTPUTS)
        return self._of(self.outputs[:, :, OUTPUTS.index(name)], axis)

    def signal(self, name: str, axis: str | int | None = None) -> FloatArray:
        """Return one controller signal: (n, n_axes), or (n,) of one axis."""
        one_of("signal", name, SIGNALS)
        return self._of(self.signals[:, :, SIGNALS.index(name)], axis)

    def record(self, name: str) -> Record:
        """Return one output of all axes as a Record, an axis a point with direction +x."""
        units = {"angle": "rad", "speed": "rad/s", "i_d": "A", "i_q": "A"}.get(name, "m")
        return Record(self.output(name), 1 / (self.time[1] - self.time[0]), tuple(Dof(a, "+x") for a in self.axes),
                      (name,) * len(self.axes), (units,) * len(self.axes), name=name)

    def _of(self, values: FloatArray, axis: str | int | None) -> FloatArray:
        if axis is None:
            return values
        return values[:, axis if isinstance(axis, int) else self.axes.index(axis)]

    @property
    def status(self) -> str:
        """Convergence of the steps, with a remedy."""
        if self.unconverged == 0:
            return "all steps converged"
        return f"{self.unconverged} of {self.time.size} steps did not converge; use more substeps"

    def __repr__(self) -> str:
        return f"ServoResult({', '.join(self.axes)}; {self.time[-1]:.4g} s, {self.time.size} samples; {self.status})"


@dataclass(frozen=True, eq=False)
class Excitation:
    """Additive excitation of every axis, (n, n_axes), at one place: ``speed`` (rad/s), ``torque`` (N m), ``current`` (A)
    or ``voltage`` (V), sampled with that loop; ``position`` is an ordinary command."""

    place: str
    values: FloatArray

    def __post_init__(self) -> None:
        one_of("Excitation.place", self.place, PLACES[2:])
        object.__setattr__(self, "values", floats("Excitation.values", self.values, (None, None)))


@rename_argument("every", "record_interval", since="0.2")
def simulate(servo: Servo, command: Command, *, substeps: int = 1, record_interval: int = 1,
             excitation: Excitation | None = None,
             load: FloatArray | None = None, start: FloatArray | None = None, duration: float | None = None,
             matrices: StepMatrices | None = None, check: bool = True) -> ServoResult:
    """Return the histories of a servo that follows a command from rest.

    Parameters
    ----------
    servo : Servo
    command : Command
        Positions, velocities and accelerations at the position loop's sample time, an axis a column, in the plant's order.
    substeps : int
        Plant steps for each current sample.
    record_interval : int
        Plant steps between records.
    excitation : Excitation, optional
    load : (n_steps, n_axes) floats, optional
        Force on every table, N, held over each plant step; the last line holds to the end.
    start : (n_states,) floats, optional
        State of the plant at the start; at rest where left out.
    duration : float, optional
        s; the command's where left out.
    matrices : StepMatrices, optional
        Of the same plant and step, to simulate many commands.
    check : bool
        Refuse a servo whose linear loops are unstable before simulating (a millisecond or so).

    Raises
    ------
    ToolpointError
        Where the command's sample time is not the position loop's, or the motion is not finite (unstable).

    Examples
    --------
    A position loop of 20/s without feed-forward follows a ramp of 0.1 m/s 5 mm behind:

    >>> from toolpoint.drives import (Controller, DriveAxis, PositionLoop, TorqueMotor, VelocityLoop, build_plant, rigid_axis)
    >>> from toolpoint.drives.program.command import constant_velocity
    >>> plant = build_plant([DriveAxis("X", TorqueMotor(), rigid_axis(0.005, 2e-3))])
    >>> servo = Servo(plant, (Controller(PositionLoop(20.0), VelocityLoop(1.0), lead=2e-3),))
    >>> result = simulate(servo, constant_velocity(0.1, 1e-3, 0.6))
    >>> print(f"{1e3 * result.signal('following_error', 'X')[-1]:.2f} mm")
    5.00 mm
    """
    if check:
        check_stable(servo)
    ready = prepare(servo, command, substeps=substeps, record_interval=record_interval, excitation=excitation,
                    load=load, start=start,
                    duration=duration, matrices=matrices)
    # Loaded here: what refuses a servo above must not wait for the compiler.
    from toolpoint.drives.simulation.kernel import run

    failed = run(*ready.arguments)
    return ready.result(failed)


def simulate_many(cases: Iterable[tuple[Servo, Command]], *, threads: int = 1, **options: Any) -> list[ServoResult]:
    """Return the results of many servos and commands, in `threads` threads (the kernel releases the interpreter lock).

    Examples
    --------
    >>> from toolpoint.drives import (Controller, DriveAxis, PositionLoop, TorqueMotor, VelocityLoop, build_plant, rigid_axis)
    >>> from toolpoint.drives.program.command import constant_velocity
    >>> plant = build_plant([DriveAxis("X", TorqueMotor(), rigid_axis(0.005, 2e-3))])
    >>> servo = Servo(plant, (Controller(PositionLoop(20.0), VelocityLoop(1.0), lead=2e-3),))
    >>> results = simulate_many([(servo, constant_velocity(feed, 1e-3, 0.02)) for feed in (0.1, 0.2)], record_interval=4)
    >>> [result.status for result in results]
    ['all steps converged', 'all steps converged']
    """
    with ThreadPoolExecutor(count("threads", threads)) as pool:
        return list(pool.map(lambda case: simulate(case[0], case[1], **options), list(cases)))


@dataclass
class Prepared:
    """Arguments of the compiled run (see `arrays`); it changes `motion` and `histories`."""

    servo: Servo
    command: Command
    matrices: StepMatrices
    steps: int
    laws: LawArrays
    control: ControlArrays
    motion: MotionArrays
    histories: Histories

    @property
    def arguments(self) -> tuple[int, int, StepArrays, LawArrays, ControlArrays, MotionArrays, Histories]:
        """Arguments of the whole run."""
        return 0, self.steps, self.matrices.arrays, self.laws, self.control, self.motion, self.histories

    def result(self, failed: int) -> ServoResult:
        """Return the histories after a run that returned `failed`."""
        if failed < 0:
            fail("simulate", f"motion not finite after {-failed} steps", "the servo is unstable or the step too long",
                 remedy="check drives.compute_loops(servo), or take more substeps")
        outputs, axes = self.histories.outputs, self.servo.plant.axes
        time = np.arange(outputs.shape[0]) * (self.matrices.step * self.histories.record_interval)
        return ServoResult(frozen(time), tuple(a.name for a in axes), frozen(outputs.reshape(time.size, len(axes), -1)),
                           frozen(self.histories.signals), frozen(self.histories.forces), frozen(self.command.held_at(time)),
                           frozen(self.matrices.outward(self.motion.coordinates)), failed)


def prepare(servo: Servo, command: Command, *, substeps: int = 1, record_interval: int = 1,
            excitation: Excitation | None = None,
            load: FloatArray | None = None, start: FloatArray | None = None, duration: float | None = None,
            matrices: StepMatrices | None = None) -> Prepared:
    """Return the arguments of the compiled run; see `simulate`."""
    axes = len(servo.plant.axes)
    count("substeps", substeps)
    count("record_interval", record_interval)
    current_time, _, position_time = servo.controllers[0].sample_times
    # Resampled without being asked, a command would have other velocities and accelerations than it states.
    if abs(command.sample_time / position_time - 1) > 1e-9 or command.position.shape[1] != axes:
        fail("command", f"{command!r}", f"must have {axes} axes at the position loop's sample time {position_time:g} s",
             remedy="use command.resampled(sample_time)")
    step = current_time / substeps
    m = step_matrices(servo.plant, step) if matrices is None else matrices
    # Matrices that are kept for many commands may be those of another step: nothing in them would look wrong.
    if abs(m.step - step) > 1e-12 * step:
        fail("matrices", f"step {m.step:g} s", f"must be {step:g} s")
    steps = round((command.duration if duration is None else duration) / step) + 1
    control = control_arrays(servo, command, substeps, excitation=excitation, load=load)
    return Prepared(servo, command, m, steps, law_arrays(servo.plant), control, motion_arrays(servo.plant, m, start),
                    empty_histories(servo.plant, steps, record_interval))


def control_arrays(servo: Servo, command: Command, substeps: int = 1, *, excitation: Excitation | None = None,
                   load: FloatArray | None = None) -> ControlArrays:
    """Return the controllers at rest, with their set points, excitation and load."""
    axes = len(servo.plant.axes)
    parameters = np.stack([c.parameters(a.motor) for c, a in zip(servo.controllers, servo.plant.axes, strict=True)])
    set_points = np.zeros(command.position.shape, SET_POINT)
    for name in ("position", "velocity", "acceleration"):
        set_points[name] = getattr(command, name)
    # The kernel holds the last line of a list to its end: one line of zeros is no excitation at all.
    inject = np.zeros((1, axes)) if excitation is None else floats("excitation", excitation.values, (None, axes))
    place = 0 if excitation is None else PLACES.index(excitation.place)
    loads = np.zeros((1, axes)) if load is None else floats("load", load, (None, axes))
    counts = SampleCounts(*(steps * substeps for steps in servo.counts))
    states = np.zeros(axes, CONTROL_STATE)
    return ControlArrays(counts, parameters, states, set_points, np.array(inject), place, np.array(loads))


def law_arrays(plant: Plant) -> LawArrays:
    """Return the laws of a plant."""
    return LawArrays(np.array(plant.laws), np.array(plant.viscous), plant.products)


def motion_arrays(plant: Plant, matrices: StepMatrices, start: FloatArray | None = None) -> MotionArrays:
    """Return the motion at its start: the plant's states (at rest where left out), the laws without deflection."""
    x = np.zeros(plant.a.shape[0]) if start is None else floats("start", start, (plant.a.shape[0],))
    return MotionArrays(matrices.inward(x), np.zeros(plant.laws.size, LAW_STATE), np.zeros((2, plant.b_scalar.shape[1])))


def empty_histories(plant: Plant, steps: int, record_interval: int) -> Histories:
    """Return the arrays that a run of so many steps fills."""
    lines, axes = (steps + record_interval - 1) // record_interval, len(plant.axes)
    return Histories(record_interval, np.zeros((lines, len(OUTPUTS) * axes)), np.zeros((lines, axes, len(SIGNALS))),
                     np.zeros((lines, plant.b_scalar.shape[1])))


def settling_time(result: ServoResult, names: Sequence[str] = ("scale",), within: float = 1e-6) -> float:
    """Return the first time after which the named outputs stay within `within` of their last value, s."""
    late = 0.0
    for name in names:
        values = result.output(name)
        outside = np.flatnonzero((np.abs(values - values[-1]) > within).any(axis=1))
        late = max(late, float(result.time[outside[-1] + 1]) if outside.size and outside[-1] + 1 < result.time.size else 0.0)
    # The last value is the value itself: a motion that is still going ends within any limit.
    if late >= result.time[-1]:
        raise ToolpointError(f"settled: still outside {within:g} at the end; simulate longer")
    return late
