"""Faults of the description of a drive: missing or contradictory keys, each with its place and its remedy."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from toolpoint._check import ToolpointError
from toolpoint._quantity import limit_faults
from toolpoint.drives.controller.records import MAX_DELAY, MAX_FILTERS
from toolpoint.drives.description import (
    CurrentDescription,
    DriveAxisDescription,
    DriveDescription,
    FrictionDescription,
    GuideFrictionDescription,
    MechanicsDescription,
)

Key = tuple[str | int, ...]
Faults = Iterator[tuple[Key, str]]

_KEYS_OF_KIND = {
    "rigid": ("lead", "inertia"), "two-mass": ("lead", "inertia", "table_mass", "stiffness"),
    "rack": ("inertia", "table_mass", "pinion_radius", "stiffness"), "linear-motor": ("table_mass",),
    "screw": ("lead", "inertia", "table_mass", "screw_diameter", "screw_length", "nut_position", "coupling_stiffness",
              "bearing_stiffness", "nut_stiffness"),
    "ball-screw": ("lead", "inertia", "screw_inertia", "screw_mass", "coupling_stiffness", "bearing_stiffness",
                   "nut_stiffness"),
    "reducer": ("inertia", "gear_ratio", "load_inertia", "torsion")}
_KEYS_OF_LAW = {"stribeck": ("static", "stribeck_velocity"), "lugre": ("static", "stribeck_velocity", "bristle_stiffness"),
                "two-exponential": ("static", "stribeck_velocity", "coulomb_velocity"),
                "maxwell-slip": ("static", "stribeck_velocity", "element_stiffness", "element_share", "attraction")}
_KEYS_OF_FILTER = {"notch": ("frequency",), "low-pass": ("frequency",), "low-pass-1": ("time_constant",)}


def check_description(drives: DriveDescription) -> None:
    """Raise ToolpointError with every fault of a description."""
    texts = [f"{'.'.join(map(str, key))}: {message}" for key, message in find_faults(drives)]
    if texts:
        raise ToolpointError("\n".join(texts))


def find_faults(drives: DriveDescription) -> Faults:
    """Yield the place (keys from the top of the file) and the text of every fault, in file order."""
    outside = list(limit_faults(drives))
    if outside:
        yield from outside
        return
    if not drives.axes:
        yield ("axes",), "missing; a drive file needs at least one axis"
    if drives.look_ahead is not None and drives.look_ahead < 0:
        yield ("look_ahead",), f"{drives.look_ahead} blocks; must be at least 0"
    if drives.substeps < 1:
        yield ("substeps",), f"{drives.substeps}; must be at least 1"
    for name, axis in drives.axes.items():
        for key, message in _axis_faults(axis):
            yield ("axes", name, *key), message
    yield from _clock_faults(drives)


def _axis_faults(axis: DriveAxisDescription) -> Faults:
    """Yield the faults of one axis, those of its parts in file order."""
    yield from _mechanics_faults(axis.mechanics)
    if axis.mechanics.kind == "ball-screw" and axis.ends is None:
        yield (), "'ends' is missing; a ball screw needs base, table, tool and the stiffness it replaces"
    if axis.guide_friction.law != "none" and axis.mechanics.kind in ("rigid", "ball-screw", "reducer"):
        yield ("guide_friction",), f"a {axis.mechanics.kind} axis has no guide of its own; put the friction at the shaft"
    if axis.friction.law != "none" and axis.mechanics.kind in ("linear-motor", "rack"):
        yield ("friction",), f"a {axis.mechanics.kind} axis takes its friction at the guide: guide_friction, N and m/s"
    yield from _friction_faults("friction", axis.friction)
    yield from _friction_faults("guide_friction", axis.guide_friction)
    yield from _velocity_faults(axis)
    yield from _motor_faults(axis)
    yield from _sample_faults(axis)


def _mechanics_faults(m: MechanicsDescription) -> Faults:
    """Yield keys that the kind of the mechanics lacks, and numbers that contradict each other."""
    yield from _missing(("mechanics",), m, _KEYS_OF_KIND[m.kind], f"a {m.kind} axis")
    if m.backlash is not None and m.preload is not None:
        yield ("mechanics", "preload"), "a nut or a rack has either backlash or a preload; leave one out"
    if (m.backlash is not None or m.preload is not None) and m.kind not in ("two-mass", "rack", "screw", "ball-screw"):
        key = "backlash" if m.backlash is not None else "preload"
        yield ("mechanics", key), f"a {m.kind} axis has no contact; use two-mass, rack, screw or ball-screw"
    if m.kind == "reducer" and m.lead is not None:
        yield ("mechanics", "lead"), "a rotary axis has no lead; its gear_ratio is what a turn of the motor makes of it"
    if m.kind != "reducer" and (m.load_inertia is not None or m.torsion is not None):
        key = "torsion" if m.load_inertia is None else "load_inertia"
        yield ("mechanics", key), f"a {m.kind} axis has none; a rotary one is kind reducer"
    if m.coupling_doubling_twist is not None and m.kind not in ("screw", "ball-screw"):
        yield ("mechanics", "coupling_doubling_twist"), f"a {m.kind} axis has no coupling; use screw or ball-screw"
    if m.bearing_friction_arm and m.kind not in ("screw", "ball-screw"):
        yield ("mechanics", "bearing_friction_arm"), f"a {m.kind} axis has no thrust bearing; use screw or ball-screw"
    elif m.lead is not None and m.bearing_friction_arm >= m.lead / (2 * math.pi):
        yield (("mechanics", "bearing_friction_arm"),
               f"{m.bearing_friction_arm:g} m; must be below the travel per radian, {m.lead / (2 * math.pi):.4g} m, or no "
               "torque moves the table; it is the coefficient of friction times half of the bearing's mean diameter")
    if m.nut_moves and m.kind != "screw":
        yield ("mechanics", "nut_moves"), f"a {m.kind} axis has no nut along a screw; use kind screw"
    if m.kind == "screw" and m.nut_position and m.screw_length and m.nut_position >= m.screw_length:
        yield ("mechanics", "nut_position"), f"{m.nut_position:g} m; must be below the screw's length {m.screw_length:g} m"


def _friction_faults(name: str, law: FrictionDescription | GuideFrictionDescription) -> Faults:
    """Yield the keys that a friction law lacks; `name`: of the friction in the file."""
    yield from _missing((name,), law, _KEYS_OF_LAW.get(law.law, ()), f"the law {law.law!r}")
    if law.static is not None and law.law != "two-exponential" and law.static < law.coulomb:
        yield (name, "static"), f"{law.static:g} is below the Coulomb level {law.coulomb:g}; exchange the two"
    if law.law == "maxwell-slip" and abs(sum(law.element_share) - 1) > 1e-6:
        yield (name, "element_share"), f"sum {sum(law.element_share):g}; the shares must sum to one"
    if len(law.element_share) != len(law.element_stiffness):
        yield (name, "element_share"), f"{len(law.element_share)} shares for {len(law.element_stiffness)} stiffnesses"


def _velocity_faults(axis: DriveAxisDescription) -> Faults:
    """Yield the faults of the velocity loop and its filters."""
    velocity = axis.velocity
    for i, part in enumerate(velocity.filters):
        yield from _missing(("velocity", "filters", i), part, _KEYS_OF_FILTER[part.kind], f"a {part.kind}")
        if part.frequency is not None and part.frequency * velocity.sample_time >= 0.5:
            yield (("velocity", "filters", i, "frequency"),
                   f"{part.frequency:g} Hz; must be below half the sample rate, {0.5 / velocity.sample_time:g} Hz")
    if len(velocity.filters) > MAX_FILTERS:
        yield ("velocity", "filters"), f"{len(velocity.filters)} filters; must be at most {MAX_FILTERS}"
    delays = {"velocity": velocity.delay} | ({"current": axis.current.delay} if axis.current else {})
    for loop, delay in delays.items():
        if not 0 <= delay < MAX_DELAY:
            yield (loop, "delay"), f"{delay} samples; must be 0 to {MAX_DELAY - 1}"


def _motor_faults(axis: DriveAxisDescription) -> Faults:
    """Yield the faults of a motor and of a current loop without one."""
    if (axis.motor is None) != (axis.current is None):
        absent = "motor" if axis.motor is None else "current"
        yield (), f"{absent!r} is missing; motor and current loop are given together, or both left out"
    model = axis.current.model if axis.current else None
    for key, motor in ((("motor",), axis.motor), (("current", "model"), model)):
        if motor is not None and (motor.flux is None) == (motor.torque_constant is None):
            yield key, "give either flux or torque_constant"
    if axis.current is not None:
        yield from _current_faults(axis.current)


def _current_faults(current: CurrentDescription) -> Faults:
    """Yield the faults of a current loop: bandwidth, or gain and integral."""
    by_bandwidth, by_gain = current.bandwidth is not None, current.gain is not None or current.integral is not None
    if by_bandwidth == by_gain or (not by_bandwidth and current.gain is None):
        yield ("current",), "give either bandwidth, or gain and integral"
    if current.carrier < 1:
        yield ("current", "carrier"), f"{current.carrier}; must be at least 1"


def _sample_faults(axis: DriveAxisDescription) -> Faults:
    """Yield the sample times that are no whole multiples of those of the loop within."""
    for (inner_loop, short), (outer_loop, long) in pairwise(sample_times(axis).items()):
        ratio = long / short
        if ratio < 0.999 or abs(ratio - round(ratio)) > 1e-6:
            yield (outer_loop, "sample_time"), (f"{long:g} s; must be a whole multiple of the {inner_loop} loop's {short:g} s, "
                                                f"for example {max(1, round(ratio)) * short:g} s")


def sample_times(axis: DriveAxisDescription) -> dict[str, float]:
    """Return the sample time (s) of every loop of an axis by its name, the innermost first."""
    current = {"current": axis.current.sample_time} if axis.current else {}
    return {**current, "velocity": axis.velocity.sample_time, "position": axis.position.sample_time}


def _clock_faults(drives: DriveDescription) -> Faults:
    """Yield sample times that differ from those of the first axis: all axes share one clock."""
    clocks = {name: sample_times(axis) for name, axis in drives.axes.items()}
    first = next(iter(clocks.values()), {})
    for name, times in clocks.items():
        if times.keys() != first.keys():
            yield ("axes", name), "must have a current loop, or none, as the first axis"
            continue
        for loop in ("position", "velocity", "current"):
            if loop in times and abs(times[loop] - first[loop]) > 1e-12:
                yield (("axes", name, loop, "sample_time"),
                       f"{times[loop]:g} s; must be those of the first axis, {first[loop]:g} s")


def _missing(key: Key, part: object, names: tuple[str, ...], whose: str) -> Faults:
    """Yield each of the keys `names` that a part lacks; `whose`: what needs them, in words."""
    for name in names:
        if getattr(part, name) in (None, ()):
            yield key, f"{name!r} is missing; {whose} needs it"
