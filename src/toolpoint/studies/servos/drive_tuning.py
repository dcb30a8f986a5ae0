"""Gains of a drive file for stated margins: before and after, axis by axis, and the file with the new gains."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.drives.build import build_servo
from toolpoint.drives.controller.loop_doubts import doubt_gains
from toolpoint.drives.controller.loops import ServoLoops, compute_loops
from toolpoint.drives.controller.servo import Servo
from toolpoint.drives.controller.tuning import NOTCH_DAMPING, NOTCH_DEPTH, tune
from toolpoint.drives.description import DriveAxisDescription, DriveDescription, TorqueFilterDescription
from toolpoint.machine import Machine
from toolpoint.studies.servos.drive_structure import question_structure, structure_of


@dataclass(frozen=True)
class TuningTarget:
    """Margins that gains must keep: phase (deg) and gain (dB) of the velocity loop, peak of the closed position loop (dB).

    notches : how many may be added to each axis.

    Examples
    --------
    >>> TuningTarget(phase_margin=50.0).gain_margin_db
    8.0
    """

    phase_margin: float = 45.0
    gain_margin_db: float = 8.0
    peak_db: float = 0.5
    notches: int = 1


TUNING_HEADER = ("axis", "gain", "before", "after", "unit")


@dataclass(frozen=True, eq=False)
class TunedDrives(NotebookText):
    """A drive with the largest gains that keep the margins.

    drives, servo : with the new gains; loops_before, loops_after : of the old and new gains; notches : Hz of those added, by
    axis; has_structure : whether a machine is behind the axes.
    """

    base: DriveDescription
    drives: DriveDescription
    servo: Servo
    loops_before: ServoLoops
    loops_after: ServoLoops
    notches: Mapping[str, tuple[float, ...]]
    target: TuningTarget
    notes: tuple[str, ...] = ()
    has_structure: bool = False

    @property
    def doubts(self) -> list[Doubt]:
        """Axes whose model holds no resonance, tuned loops that are hardly stable, and gains that no axis has."""
        return [*self.rigid_doubts, *self.loops_after.doubts, *doubt_gains(list(self.drives.axes), self.servo.controllers)]

    @property
    def rigid_doubts(self) -> list[Doubt]:
        """Axes whose model holds no resonance that would limit their gains."""
        return [] if self.has_structure else [
            Doubt(f"gains of {name}", "its mechanics are rigid: no resonance limits them here",
                  "describe it as two masses or a screw, or give the machine")
            for name, axis in self.drives.axes.items() if axis.mechanics.kind == "rigid"]

    def rows(self) -> list[list[str]]:
        """Return axis, gain, value before and after, unit."""
        rows = []
        for name, axis in self.drives.axes.items():
            old = self.base.axes[name]
            rows += [[name, "K_v", f"{old.position.gain:.4g}", f"{axis.position.gain:.4g}", "1/s"],
                     [name, "velocity gain", f"{old.velocity.gain:.4g}", f"{axis.velocity.gain:.4g}", "N m s/rad"],
                     [name, "integral time", _milliseconds(old), _milliseconds(axis), "ms"]]
            rows += [[name, "notch", "", f"{frequency:.4g}", "Hz"] for frequency in self.notches[name]]
        return rows

    def loop_rows(self) -> list[list[str]]:
        """Return loop, axis, then gain margin (dB), phase margin (deg) and bandwidth (Hz), each before and after."""
        return [[loop, axis, *(f"{old_value:.4g} to {new_value:.4g}" for old_value, new_value in zip(old, new, strict=True))]
                for (loop, axis, *old), (_, _, *new) in zip(self.loops_before.figures, self.loops_after.figures, strict=True)]

    def table(self) -> str:
        """Return doubts and notes, the gains, and the loops before and after."""
        gains = [f"{axis}: {gain} {old or 'none'} to {new} {unit}" for axis, gain, old, new, unit in self.rows()]
        loops = [f"{loop} loop {axis}: gain margin {gain} dB, phase margin {phase} deg, bandwidth {width} Hz"
                 for loop, axis, gain, phase, width in self.loop_rows()]
        return "\n".join([*mark_notes([*self.doubts, *self.notes], "note: "), *gains, *loops])

    def to_dict(self) -> dict[str, Any]:
        """Return gains and loops before and after as plain data, SI."""
        def gains(drives: DriveDescription) -> dict[str, Any]:
            return {name: {"position_gain": axis.position.gain, "velocity_gain": axis.velocity.gain,
                           "integral_time_s": axis.velocity.integral_time} for name, axis in drives.axes.items()}
        return {"before": {"gains": gains(self.base), **self.loops_before.to_dict()},
                "after": {"gains": gains(self.drives), **self.loops_after.to_dict()},
                "notches_hz": {name: list(lines) for name, lines in self.notches.items()}, "doubts": list(self.doubts),
                "notes": list(self.notes)}


def _milliseconds(axis: DriveAxisDescription) -> str:
    time = axis.velocity.integral_time
    return "none" if time is None else f"{1e3 * time:.4g}"


def tune_drives(drives: DriveDescription, target: TuningTarget | None = None, *, machine: Machine | None = None,
                pose: Mapping[str, float] | None = None, progress: Callable[[str], None] = lambda name: None) -> TunedDrives:
    """Return the drive with the largest gains of each axis that keep the margins, on a machine's structure at one pose.

    Axes are tuned in turn, each with the gains that the ones before have received. Raises ToolpointError where no gain keeps
    the margins.

    Examples
    --------
    >>> from toolpoint.drives.description import (
    ...     DriveAxisDescription,
    ...     DriveDescription,
    ...     MechanicsDescription,
    ...     PositionDescription,
    ...     VelocityDescription,
    ... )
    >>> axis = DriveAxisDescription(mechanics=MechanicsDescription("two-mass", lead=0.01, inertia=0.006, table_mass=300.0,
    ...                                                           stiffness=1e8), position=PositionDescription(20.0),
    ...                             velocity=VelocityDescription(1.0))
    >>> drives = DriveDescription("slide", {"X": axis})
    >>> tune_drives(drives).drives.axes["X"].velocity.gain > 1.0
    True
    """
    target = target or TuningTarget()
    first = servo = build_servo(drives, structure_of(drives, machine, pose))
    notches: dict[str, tuple[float, ...]] = {}
    for number, name in enumerate(drives.axes):
        progress(f"axis {name}")
        tuned = tune(servo, number, phase_margin=target.phase_margin, gain_margin_db=target.gain_margin_db,
                     peak_db=target.peak_db, notches=target.notches)
        servo, notches[name] = tuned.servo, tuned.notches
    axes = {name: _with_gains(axis, servo, number, notches[name]) for number, (name, axis) in enumerate(drives.axes.items())}
    notes = [*question_structure(drives, machine, pose), _pose_note(machine)]
    return TunedDrives(drives, replace(drives, axes=axes), servo, compute_loops(first), compute_loops(servo), notches, target,
                       tuple(notes), machine is not None)


def _pose_note(machine: Machine | None) -> str:
    if machine is None:
        return "No machine's structure is behind the axes: its resonances may allow less."
    return "The margins are those of one pose: see them over the workspace (`map`) before the gains are used."


def _with_gains(axis: DriveAxisDescription, servo: Servo, number: int, notches: tuple[float, ...]) -> DriveAxisDescription:
    controller = servo.controllers[number]
    filters = [TorqueFilterDescription("notch", frequency, NOTCH_DAMPING, NOTCH_DEPTH) for frequency in notches]
    velocity = replace(axis.velocity, gain=controller.velocity.gain, integral_time=controller.velocity.integral_time,
                       filters=(*axis.velocity.filters, *filters))
    return replace(axis, velocity=velocity, position=replace(axis.position, gain=controller.position.gain))
