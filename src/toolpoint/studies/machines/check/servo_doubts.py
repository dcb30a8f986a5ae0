"""Doubts about a servo's file: numbers of other units, loops that contradict each other, axes that differ too much."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.drives.description import DriveAxisDescription, DriveDescription
from toolpoint.studies.machines.check.ranges import odd_among, question_range

# Least and most of machine tools and robots, SI: from small indexing slides to portal machines.
MECHANICS_RANGES: Mapping[str, tuple[float, float, str]] = {
    "lead": (1e-3, 0.15, "m"), "inertia": (1e-5, 2.0, "kg m^2"), "table_mass": (1.0, 5e4, "kg"),
    "stiffness": (5e5, 5e10, "N/m"), "pinion_radius": (5e-3, 0.3, "m"), "load_inertia": (1e-4, 5e4, "kg m^2"),
    "torsion": (1e2, 1e9, "N m/rad"), "screw_inertia": (1e-6, 2.0, "kg m^2"), "screw_mass": (0.1, 2e3, "kg"),
    "screw_diameter": (5e-3, 0.25, "m"), "screw_length": (0.05, 15.0, "m"), "nut_position": (1e-3, 15.0, "m"),
    "coupling_stiffness": (50.0, 1e7, "N m/rad"), "bearing_stiffness": (5e6, 5e10, "N/m"), "nut_stiffness": (5e6, 5e10, "N/m"),
    "backlash": (1e-7, 2e-3, "m"), "preload": (10.0, 1e6, "N")}
POSITION_GAIN_RANGE = (5.0, 600.0, "1/s")  # 0.3 to 36 (m/min)/mm
VELOCITY_BAND_RANGE = (5.0, 1e4, "rad/s")  # gain of the velocity loop over the inertia at the motor
MIN_VELOCITY_BAND_RATIO = 0.7  # band of the velocity loop over K_v: an inner loop slower than the outer one oscillates
INTEGRAL_TIME_RANGE, SAMPLE_TIME_RANGE = (1e-3, 2.0, "s"), (1e-5, 2e-2, "s")
BREAK_AWAY_RANGE = (1e-6, 0.05, "rad")  # motion in which bristles bend before they break loose
STRIBECK_RANGE = (1e-3, 50.0, "rad/s")
MAX_STICTION_RATIO = 4.0  # static over Coulomb friction
MAX_VISCOUS_RATIO = 150.0  # viscous over Coulomb friction at the largest speed; 56 of a published servo
# From large machines to the quickest linear motors: beyond, a number has another unit (mm, minutes).
LIMIT_RANGES = {"speed": (0.01, 5.0, "m/s"), "acceleration": (0.05, 60.0, "m/s^2"), "jerk": (0.5, 5e3, "m/s^3")}
MOTOR_SPEED_RANGE = (60.0, 20000.0, "rev/min")
MAX_AXIS_RATIO = 60.0  # of a number of one axis beside the same number of the others


def question_servo(drives: DriveDescription) -> tuple[Doubt, ...]:
    """Return doubts about the numbers of a servo that are possible and hardly meant."""
    lines = [line for key, bounds in LIMIT_RANGES.items() for line in question_range(f"limits.{key}",
                                                                                     getattr(drives.limits, key),
                                                                              bounds)]
    for name, axis in drives.axes.items():
        lines += _question_axis(f"axes.{name}", axis)
        lines += _question_motor_speed(f"axes.{name}", axis, drives.limits.speed)
    said = {line.what for line in lines}
    return (*lines, *(line for line in _compare_axes(drives) if line.what not in said))


def _question_axis(path: str, axis: DriveAxisDescription) -> Iterator[Doubt]:
    m, position, velocity = axis.mechanics, axis.position, axis.velocity
    odd = set[str]()
    for key, bounds in MECHANICS_RANGES.items():
        for line in question_range(f"{path}.mechanics.{key}", getattr(m, key), bounds):
            odd.add(key)
            yield line
    gains = list(question_range(f"{path}.position.gain", position.gain, POSITION_GAIN_RANGE,
                                words="(1 (m/min)/mm is 16.7 1/s)"))
    yield from gains
    yield from question_range(f"{path}.position.sample_time", position.sample_time, SAMPLE_TIME_RANGE)
    yield from question_range(f"{path}.velocity.sample_time", velocity.sample_time, SAMPLE_TIME_RANGE)
    yield from question_range(f"{path}.velocity.integral_time", velocity.integral_time, INTEGRAL_TIME_RANGE)
    if m.inertia and "inertia" not in odd:
        band = velocity.gain / m.inertia
        words = f"with {m.inertia:.4g} kg m^2 at the motor the velocity loop reaches {band:.4g} rad/s"
        if not VELOCITY_BAND_RANGE[0] <= band <= VELOCITY_BAND_RANGE[1]:
            yield Doubt(f"{path}.velocity.gain", f"{velocity.gain:.4g} N m s/rad: {words}, {VELOCITY_BAND_RANGE[0]:g} to "
                        f"{VELOCITY_BAND_RANGE[1]:g} is usual", "check the units of gain and mechanics.inertia", figure=band)
        elif not gains and band < MIN_VELOCITY_BAND_RATIO * position.gain:
            yield Doubt(f"{path}.position.gain", f"{position.gain:.4g} 1/s, but {words}: slower than the position loop about "
                        "it", "check the units of both gains", figure=band / position.gain)
    yield from _question_friction(path, axis)


def _question_friction(path: str, axis: DriveAxisDescription) -> Iterator[Doubt]:
    for section, law in (("friction", axis.friction), ("guide_friction", axis.guide_friction)):
        if law.law == "none":
            continue
        if law.static is not None and law.coulomb > 0:
            ratio = law.static / law.coulomb
            if ratio < 1:
                yield Doubt(f"{path}.{section}.static", f"{law.static:.4g} is below coulomb, {law.coulomb:.4g}: what is at "
                            "rest would move more easily", "are the two exchanged? check the units of both", figure=ratio)
            elif ratio > MAX_STICTION_RATIO:
                yield Doubt(f"{path}.{section}.static", f"{law.static:.4g} is {ratio:.3g} times coulomb, {law.coulomb:.4g}",
                            "check the units of both", figure=ratio)
        if section == "friction":
            yield from question_range(f"{path}.{section}.stribeck_velocity", law.stribeck_velocity, STRIBECK_RANGE)
        if law.bristle_stiffness and law.coulomb > 0 and section == "friction":
            bend = law.coulomb / law.bristle_stiffness
            yield from question_range(f"{path}.{section}.bristle_stiffness", bend, BREAK_AWAY_RANGE,
                                      words="of motion before it breaks loose, coulomb over bristle_stiffness")


def _question_motor_speed(path: str, axis: DriveAxisDescription, speed: float) -> Iterator[Doubt]:
    lead = axis.mechanics.lead
    if not lead:
        return
    turning = 2 * np.pi * speed / lead
    in_range = (MECHANICS_RANGES["lead"][0] <= lead <= MECHANICS_RANGES["lead"][1]
                and LIMIT_RANGES["speed"][0] <= speed <= LIMIT_RANGES["speed"][1])
    if in_range:
        yield from question_range(f"{path}.mechanics.lead", 30 * turning / np.pi, MOTOR_SPEED_RANGE,
                                  words=f"of the motor at limits.speed with a lead of {1e3 * lead:.4g} mm")
        friction = axis.friction
        if friction.coulomb > 0 and friction.viscous * turning > MAX_VISCOUS_RATIO * friction.coulomb:
            yield Doubt(f"{path}.friction.viscous", f"{friction.viscous:.4g} N m s/rad is {friction.viscous * turning:.4g} N m "
                        f"at the largest speed, beside coulomb {friction.coulomb:.4g}", "check its unit",
                        figure=friction.viscous * turning / friction.coulomb)


def _compare_axes(drives: DriveDescription) -> Iterator[Doubt]:
    """Doubt numbers far from the same number of the other axes."""
    for key, bounds in (*((("mechanics", key), bounds) for key, bounds in MECHANICS_RANGES.items()),
                        (("velocity", "gain"), (1e-3, 1e2, "N m s/rad")), (("friction", "coulomb"), (1e-2, 1e2, "N m")),
                        (("friction", "viscous"), (1e-4, 1.0, "N m s/rad"))):
        values = {f"axes.{name}.{key[0]}.{key[1]}": getattr(getattr(axis, key[0]), key[1]) or 0.0
                  for name, axis in drives.axes.items()}
        yield from odd_among(values, MAX_AXIS_RATIO, bounds)
