"""Doubts about a robot as a whole: first frequency and damping against its length, reach and payload against its datasheet.

Measured robots keep their first frequency within some 5 to 15 Hz at 2.5 to 3 m and 10 to 40 Hz at 0.7 to 1 m, damping ratios of
0.3 to 10 %: so frequency times length is judged, not the frequency alone.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.kinematics import ClosedChain
from toolpoint.machine import Machine, assemble
from toolpoint.machine.description import GROUND
from toolpoint.machine.parts.build import build
from toolpoint.machine.robot.datasheet import RobotDatasheet
from toolpoint.machine.robot.model import calibrate_density, rigid_members, robot_machine
from toolpoint.vibration import eigen

MIN_ARM_AXES = 3  # turning axes, each on the one before: from here on a chain is an arm
MIN_FREQUENCY_LENGTH, MAX_FREQUENCY_LENGTH = 4.0, 80.0  # Hz m, first frequency times length of the arm (`arm_length`)
MIN_FIRST_DAMPING_RATIO, MAX_FIRST_DAMPING_RATIO = 1e-3, 0.15  # damping ratio of the first mode
MIN_PAYLOAD_FRACTION, MAX_PAYLOAD_FRACTION = 0.005, 1.0  # payload over the robot's own mass
MIN_REACH_RATIO, MAX_REACH_RATIO = 0.5, 1.25  # stated reach over the sum of lengths between the axes
MIN_MEMBER_DENSITY, MAX_MEMBER_DENSITY = 100.0, 9e3  # kg/m^3, of members that make up the weight


def question_arm(machine: Machine) -> Iterator[Doubt]:
    """Yield doubts about first frequency and damping ratio of a machine that is an arm: turning axes, one on the other."""
    length = arm_length(machine)
    if length <= 0:
        return
    try:
        modes = eigen.solve_damped(assemble(machine))
    except ValueError:  # what cannot be solved here says so where it is solved
        return
    frequency, ratio = np.asarray(modes.frequency).ravel(), np.asarray(modes.damping_ratio).ravel()
    elastic = np.flatnonzero(frequency > 1e-3)
    if not elastic.size:
        return
    first = float(frequency[elastic[0]])
    frequency_length = first * length
    if not MIN_FREQUENCY_LENGTH <= frequency_length <= MAX_FREQUENCY_LENGTH:
        frequency_min, frequency_max = MIN_FREQUENCY_LENGTH / length, MAX_FREQUENCY_LENGTH / length
        yield Doubt("first frequency",
                    f"{first:.3g} Hz, robots of {length:.3g} m have {frequency_min:.2g} to {frequency_max:.2g} Hz",
                    "check the units of torsion (N m/rad), of the weight and of the payload",
                    figure=max(MIN_FREQUENCY_LENGTH / frequency_length, frequency_length / MAX_FREQUENCY_LENGTH))
    first_ratio = float(ratio[elastic[0]])
    if first_ratio > 0 and not MIN_FIRST_DAMPING_RATIO <= first_ratio <= MAX_FIRST_DAMPING_RATIO:
        yield Doubt("damping of the first mode", f"{100 * first_ratio:.3g} % at {first:.3g} Hz, robots have "
                    f"{100 * MIN_FIRST_DAMPING_RATIO:g} to {100 * MAX_FIRST_DAMPING_RATIO:g} %",
                    "check the unit of damping (N m s/rad) and of torsion",
                    figure=max(MIN_FIRST_DAMPING_RATIO / first_ratio, first_ratio / MAX_FIRST_DAMPING_RATIO))


def arm_length(machine: Machine) -> float:
    """Return the length of an arm along its driven joints up to the tip at the reference pose, m.

    It is 0 for a machine with loops, without a tool, with a linear axis, or with less than three driven joints in a row.
    """
    description, axes = machine.description, machine.chain.axes
    if isinstance(machine.chain, ClosedChain) or description.tool is None:
        return 0.0
    if sum(axis.is_rotary for axis in axes) < MIN_ARM_AXES or not all(axis.is_rotary for axis in axes):
        return 0.0
    point = description.points[description.tool]
    if point.body == GROUND:
        return 0.0
    link = machine.link(point.body)
    frame = machine.body_frames[link]
    turning = {drive.joint for axis in description.axes.values() for drive in axis.moved}
    places = [frame[:3, :3] @ np.array(point.at) + frame[:3, 3]]
    while link >= 0:
        if machine.joint_names[link] in turning:
            places.append(machine.chain.frames[link][:3, 3])
        link = machine.chain.parents[link]
    if len(places) <= MIN_ARM_AXES:  # axes beside each other are no arm
        return 0.0
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def question_whole_robot(sheet: RobotDatasheet) -> Iterator[Doubt]:
    """Yield doubts about a datasheet's reach, weight, payload, first frequency and damping, its members taken as rigid.

    The first that no robot follows from ends the questions; members given as meshes leave reach and payload only.
    """
    lengths = sum(float(np.hypot(axis.a, axis.d)) for axis in sheet.axes)
    if sheet.reach is not None and lengths > 0 and not MIN_REACH_RATIO <= sheet.reach / lengths <= MAX_REACH_RATIO:
        yield Doubt("reach", f"{sheet.reach:.4g} m beside {lengths:.4g} m of lengths between its axes (a, d)",
                    "check the unit of both", figure=sheet.reach / lengths)
    if any(member.kind == "mesh" for member in sheet.members.values()):
        yield from _question_payload(sheet)  # volumes of meshes are known only when they are read
        return
    try:
        density = calibrate_density(sheet)
    except ToolpointError as error:
        yield Doubt("weight", f"no robot follows from it: {error}", "check its unit and those of the masses of its parts",
                    figure=1.0)
        return
    if not MIN_MEMBER_DENSITY <= density <= MAX_MEMBER_DENSITY:
        yield Doubt("weight",
                    f"{sheet.weight:.4g} kg gives the members {density:.3g} kg/m^3 ({MIN_MEMBER_DENSITY:g} to "
                    f"{MAX_MEMBER_DENSITY:g} is "
                    "usual)", "check the unit of the weight and the sizes of members", figure=density)
        return
    yield from _question_payload(sheet)
    try:
        machine = build(robot_machine(rigid_members(sheet)))
    except ToolpointError as error:
        yield Doubt("datasheet", f"no robot follows from it: {error}", "mend what it names", figure=1.0)
        return
    yield from question_arm(machine)


def _question_payload(sheet: RobotDatasheet) -> Iterator[Doubt]:
    """Yield a doubt about a payload far from the robot's own mass."""
    payload = sheet.payload.mass / sheet.weight
    if not MIN_PAYLOAD_FRACTION <= payload <= MAX_PAYLOAD_FRACTION:
        yield Doubt("payload.mass", f"{sheet.payload.mass:.4g} kg, {payload:.2g} times the robot's own weight of "
                    f"{sheet.weight:.4g} kg", "check the units of both", figure=payload)
