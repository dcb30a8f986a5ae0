r"""Rotors of a robot's motors that spin: their gyroscopic part at given speeds of the axes.

A rotor of inertia J that turns with :math:`\Omega = R \dot q` carries the angular momentum :math:`J \Omega` along its axis,
whatever else the motor weighs. The motor's body spins in its place at the speed that gives it the same momentum.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.machine import description as d
from toolpoint.machine.parts.mass import mass_properties
from toolpoint.machine.robot.datasheet import RobotDatasheet
from toolpoint.machine.robot.gearing import compute_gearing, reducers_of

_AXIS_VECTORS = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def rotor_momenta(sheet: RobotDatasheet, speeds: Mapping[str, float] | None = None) -> dict[str, float]:
    """Return the angular momentum (N m s) of the rotor of every axis whose motor is placed and has an inertia.

    speeds : of the axes, rad/s; their largest where left out.
    """
    reducers = reducers_of(sheet)
    axis_names = {axis.name for axis in sheet.axes}
    for name in speeds or {}:
        if name not in axis_names:
            fail("speeds", repr(name), f"must be of {', '.join(sorted(axis_names))}")
    momenta = {}
    for axis, row in zip(sheet.axes, compute_gearing(sheet), strict=True):
        inertia = sheet.motors[axis.motor].inertia
        if inertia is not None and any(place.axis == axis.name for place in sheet.motor_places):
            speed = axis.largest_speed if speeds is None else speeds.get(axis.name, 0.0)
            momenta[row.axis] = inertia * reducers[axis.name].ratio * axis.stage * speed
    return momenta


def with_rotors(description: d.MachineDescription, sheet: RobotDatasheet, speeds: Mapping[str, float] | None = None
                ) -> d.MachineDescription:
    """Return the machine of a datasheet with its rotors turning as its axes move at these speeds (see `rotor_momenta`)."""
    places = {place.axis: place for place in sheet.motor_places}
    bodies = dict(description.bodies)
    for name, momentum in rotor_momenta(sheet, speeds).items():
        body, along = bodies[f"motor_{name}"], _AXIS_VECTORS[places[name].along]
        polar = _polar(mass_properties(body).inertia, np.array(along))
        bodies[f"motor_{name}"] = replace(body, spin=d.SpinDescription(momentum / polar, along))
    return replace(description, bodies=bodies)


def _polar(inertia: FloatArray, axis: FloatArray) -> float:
    """Return the moment of inertia about a unit axis, kg m^2."""
    return float(axis @ inertia @ axis)
