"""Step tests of a servo: the current, velocity or position set point of an axis jumps, the loops outside are open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail, one_of
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint._rounding import number_text
from toolpoint.drives.build import build_servo
from toolpoint.drives.controller.loop_stability import check_stable
from toolpoint.drives.controller.loops import bandwidth, compute_loops
from toolpoint.drives.controller.servo import Servo
from toolpoint.drives.controller.step_response import StepFigures, step_figures
from toolpoint.drives.description import DriveDescription
from toolpoint.drives.program.command import Command
from toolpoint.drives.simulation.simulate import Excitation, ServoResult, simulate
from toolpoint.machine import Machine
from toolpoint.studies.servos.drive_structure import question_structure, structure_of

STEP_LEVELS = ("current", "velocity", "position")
OPEN_LOOP_GAIN = 1e-12  # 1/s, or N m s/rad: gain of a loop that is open
REST_SAMPLES = 4  # of the loop, before the step
BAND_TIMES = 12.0  # length of the record over 1/(2 pi bandwidth)
MIN_RECORD_SAMPLES = 60  # of the loop
MAX_LENGTHENINGS = 4  # doublings of a record that has not settled
SETTLED_SHARE = 0.6  # of a record, within which a response must have settled
REACHED_LIMIT_SHARE = 0.999  # of a limit of torque, current or voltage


@dataclass(frozen=True)
class StepSetting:
    """A step of one axis.

    level : one of `STEP_LEVELS`; height : A, m/s or m (rad/s or rad of a rotary axis); with `is_share` a share of the
    drive's current limit.

    Examples
    --------
    >>> StepSetting("X", "velocity", 0.5 / 60).level
    'velocity'
    """

    axis: str
    level: str
    height: float
    is_share: bool = False

    def __post_init__(self) -> None:
        one_of("StepSetting.level", self.level, STEP_LEVELS)
        if self.height == 0 or not np.isfinite(self.height):
            fail("height of the step", f"{self.height:g}", "must be finite and not zero")
        if self.is_share and self.level != "current":
            fail("height of the step", "a share", f"must carry a unit for a {self.level} step",
                 remedy="a share is that of the current limit")


@dataclass(frozen=True, eq=False)
class StepTest:
    """Response of one axis to a step.

    time : (n,) s from the step; set_point, response : (n,) A, m/s or m; torque : (n,) N m (N of a
    linear motor), set point, of a current step that of the current;
    figures : None where the response does not reach 90 % of the step; bandwidth : of the closed loop, Hz.
    """

    setting: StepSetting
    height: float
    unit: str
    time: FloatArray
    set_point: FloatArray
    response: FloatArray
    torque: FloatArray
    figures: StepFigures | None
    bandwidth: float
    doubts: tuple[Doubt, ...] = ()

    @property
    def name(self) -> str:
        """Axis, level and height in words."""
        scale, unit = DISPLAY_UNITS[self.unit]
        return f"{self.setting.axis}, {self.setting.level} step of {number_text(scale * self.height, digits=3)} {unit}"

    def row(self) -> list[str]:
        """Return name, rise time, overshoot, settling time, steady error, bandwidth and largest torque as words."""
        scale, unit = DISPLAY_UNITS[self.unit]
        if self.figures is None:
            figures = ["not reached", "none", "none", f"{scale * (self.height - float(self.response[-1])):.3g} {unit}"]
        else:
            f = self.figures
            figures = [f"{1e3 * f.rise_time:.3g} ms", f"{100 * f.overshoot:.3g} %", f"{1e3 * f.settling_time:.3g} ms",
                       f"{scale * f.steady_error:.3g} {unit}"]
        return [self.name, *figures, f"{self.bandwidth:.4g} Hz", f"{np.abs(self.torque).max():.3g} N m"]

    def to_dict(self) -> dict[str, Any]:
        """Return height, figures and bandwidth as plain data, SI."""
        f = self.figures
        figures = None if f is None else {"rise_time_s": f.rise_time, "settling_time_s": f.settling_time,
                                          "overshoot": f.overshoot, "peak_time_s": f.peak_time,
                                          "steady_error": f.steady_error}
        return {"axis": self.setting.axis, "level": self.setting.level, "height": self.height, "unit": self.unit,
                "figures": figures, "bandwidth_hz": self.bandwidth, "largest_torque_nm": float(np.abs(self.torque).max())}


STEP_HEADER = ("step", "rise 10-90 %", "overshoot", "settled to 2 %", "steady error", "bandwidth", "largest torque")
# Factor and unit in which a step is shown, by its SI unit.
DISPLAY_UNITS = {"A": (1.0, "A"), "m/s": (60e3, "mm/min"), "m": (1e3, "mm"), "rad/s": (1.0, "rad/s"), "rad": (1.0, "rad")}


@dataclass(frozen=True, eq=False)
class StepStudy(NotebookText):
    """Step tests of a servo, in the order asked for; notes : what they rest on."""

    drives: DriveDescription
    tests: tuple[StepTest, ...]
    notes: tuple[str, ...] = ()

    @property
    def doubts(self) -> list[Doubt]:
        """Limits that were reached, and steps that were not followed."""
        return [doubt for test in self.tests for doubt in test.doubts]

    def table(self) -> str:
        """Return doubts and notes, then a line for each step."""
        lines = ["; ".join(f"{head} {cell}" if k else cell for k, (head, cell) in
                           enumerate(zip(STEP_HEADER, test.row(), strict=True))) for test in self.tests]
        return "\n".join([*mark_notes([*self.doubts, *self.notes], "note: "), *lines])

    def to_dict(self) -> dict[str, Any]:
        """Return the steps, doubts and notes as plain data."""
        return {"steps": [test.to_dict() for test in self.tests], "doubts": list(self.doubts), "notes": list(self.notes)}


def step_drives(drives: DriveDescription, steps: Sequence[StepSetting], *, machine: Machine | None = None,
                pose: Mapping[str, float] | None = None) -> StepStudy:
    """Return step tests of the servo of a drive file, on a machine's structure where one is given.

    The loops outside the one that is tested are open, as a drive's commissioning has it: a current step leaves the axis free to
    turn, a velocity step leaves its position alone. A position step is one of the position alone, no feed-forward sees it.

    Raises
    ------
    ToolpointError
        For an axis that is not there, a current step of a drive without current loop, an unstable servo.

    Examples
    --------
    >>> from toolpoint.drives.description import (
    ...     DriveAxisDescription,
    ...     DriveDescription,
    ...     MechanicsDescription,
    ...     PositionDescription,
    ...     VelocityDescription,
    ... )
    >>> axis = DriveAxisDescription(mechanics=MechanicsDescription("rigid", lead=0.01, inertia=0.01),
    ...                             position=PositionDescription(20.0), velocity=VelocityDescription(1.0))
    >>> drives = DriveDescription("slide", {"X": axis})
    >>> test = step_drives(drives, [StepSetting("X", "velocity", 0.01)]).tests[0]
    >>> round(1e3 * test.figures.rise_time)  # ms: a lag of J/K_p = 10 ms rises in ln(9) of it
    22
    """
    servo = build_servo(drives, structure_of(drives, machine, pose))
    check_stable(servo)
    tests = tuple(_test(drives, servo, step) for step in steps)
    notes = ["Loops outside the one that steps are open; friction and limits of the drive act."]
    return StepStudy(drives, tests, (*question_structure(drives, machine, pose), *notes))


def _test(drives: DriveDescription, servo: Servo, setting: StepSetting) -> StepTest:
    names = [axis.name for axis in servo.plant.axes]
    axis = names.index(one_of("step", setting.axis, names))
    number = STEP_LEVELS.index(setting.level)
    height, unit = _height(drives, servo, axis, setting)
    loops = compute_loops(servo)
    level = (loops.current, loops.velocity, loops.position)[number]
    sample = servo.controllers[axis].sample_times[number]
    lines = np.geomspace(1e-4, 0.999, 2000) * 0.5 / sample
    width = bandwidth(lines, level.closed_response(lines, axis))
    length = max(BAND_TIMES / (2 * np.pi * width), MIN_RECORD_SAMPLES * sample) if np.isfinite(width) else 1000 * sample
    for _ in range(MAX_LENGTHENINGS + 1):
        run = _simulate_step(drives, _open(servo, axis, number), number, axis=axis, height=height, length=length)
        time, response = _response(run, servo, number, axis)
        begin = REST_SAMPLES * sample
        figures = _figures(time, response - response[0], height, begin)
        if figures is not None and figures.settling_time < SETTLED_SHARE * length:
            break
        length *= 2
    set_point, current = np.where(time >= begin, height, 0.0), servo.controllers[axis].current
    # Of a current step the torque is that of the current: the set point of torque belongs to the open loop above.
    torque = run.signal("torque_set", axis) if number or current is None else current.model.torque_constant * response
    return StepTest(setting, height, unit, time - begin, set_point, response - response[0], torque, figures, float(width),
                    tuple(_doubts(run, servo, axis, setting, reached=figures is not None)))


def _height(drives: DriveDescription, servo: Servo, axis: int, setting: StepSetting) -> tuple[float, str]:
    """Return the height of a step and its unit: A, m/s, m, or rad/s and rad of a rotary axis."""
    current = servo.controllers[axis].current
    if setting.level == "current":
        if current is None:
            fail("step", f"current of {setting.axis}", "must be that of a drive with motor and current loop",
                 remedy="give motor and current in the drive file, or step the velocity")
        return setting.height * (current.limit if setting.is_share else 1.0), "A"
    is_rotary = drives.axes[setting.axis].mechanics.kind == "reducer"
    length = "rad" if is_rotary else "m"
    return setting.height, length if setting.level == "position" else f"{length}/s"


def _open(servo: Servo, axis: int, number: int) -> Servo:
    """Return the servo with the loops of an axis open that lie outside of one."""
    gains: dict[str, float] = {}
    if number < 2:
        gains["position"] = OPEN_LOOP_GAIN
    if number < 1:
        gains |= {"velocity": OPEN_LOOP_GAIN, "integral_time": np.inf}
    controllers = list(servo.controllers)
    controllers[axis] = controllers[axis].with_gains(**gains)
    return replace(servo, controllers=tuple(controllers))


def _simulate_step(drives: DriveDescription, servo: Servo, number: int, *, axis: int, height: float, length: float
                   ) -> ServoResult:
    controller, axes = servo.controllers[axis], len(servo.plant.axes)
    sample, position_sample = controller.sample_times[number], controller.position.sample_time
    duration = length + REST_SAMPLES * sample
    count = int(np.ceil(duration / (sample if number < 2 else position_sample))) + 1
    values = np.zeros((count, axes))
    values[REST_SAMPLES:, axis] = height if number != 1 else height / float(controller.lead or 1.0)
    options: dict[str, Any] = {"substeps": drives.substeps, "duration": duration, "check": False}
    zeros = np.zeros((int(np.ceil(duration / position_sample)) + 1, axes))
    if number == 2:
        return simulate(servo, Command(values, position_sample, np.zeros_like(values), np.zeros_like(values)), **options)
    standstill = Command(zeros, position_sample, zeros, zeros)
    return simulate(servo, standstill, excitation=Excitation(("current", "speed")[number], values), **options)


def _response(run: ServoResult, servo: Servo, number: int, axis: int) -> tuple[FloatArray, FloatArray]:
    controller = servo.controllers[axis]
    lead = float(controller.lead or 1.0)
    if number == 0:
        return run.time, run.output("i_q", axis)
    if number == 1:
        return run.time, lead * run.output("speed", axis)
    is_scale = controller.position.feedback == "scale"
    return run.time, run.output("scale", axis) if is_scale else lead * run.output("angle", axis)


def _figures(time: FloatArray, response: FloatArray, height: float, begin: float) -> StepFigures | None:
    try:
        return step_figures(time, response, height, start=begin)
    except ToolpointError:  # the response does not reach 90 % of the step
        return None


def _doubts(run: ServoResult, servo: Servo, axis: int, setting: StepSetting, *, reached: bool) -> list[Doubt]:
    """Return doubts about limits that a step reached, and about a step that was not followed."""
    controller, name = servo.controllers[axis], f"{setting.axis}, {setting.level} step"
    doubts = []
    torque = float(np.abs(run.signal("torque_set", axis)).max())
    if torque >= REACHED_LIMIT_SHARE * controller.velocity.limit:
        doubts.append(Doubt(name, f"the torque reaches its limit of {controller.velocity.limit:.4g} N m", "its figures are "
                            "those of the limit: step less"))
    if controller.current is not None:
        voltage = float(np.hypot(run.signal("u_d", axis), run.signal("u_q", axis)).max())
        limit = controller.inverter.voltage
        if voltage >= REACHED_LIMIT_SHARE * limit:
            doubts.append(Doubt(name, f"the voltage reaches its limit of {limit:.4g} V", "its figures are those of the limit: "
                                "step less"))
    if not reached:
        doubts.append(Doubt(name, "the response does not reach 90 % of the step", "friction or a loop without integral holds "
                            "it: step more, or give `integral_time`"))
    return doubts
