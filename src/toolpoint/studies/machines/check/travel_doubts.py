"""Doubts that motion reveals: ends of travel out of reach, axes of the wrong sign, tables that turn backwards."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.kinematics import ClosedChain
from toolpoint.machine import Machine, assemble
from toolpoint.machine.parts.laws import driven_ways
from toolpoint.machine.pose.placement import place_machine
from toolpoint.studies.machines.check.machine_doubts import tearing_axes
from toolpoint.studies.machines.pose_words import direction_words, pose_words

# component of direction that the axis name stands for (ISO 841)
AXIS_INDEX_BY_NAME = {"X": 0, "Y": 1, "Z": 2, "A": 0, "B": 1, "C": 2}
MIN_DIRECTION_COSINE = 0.9  # from which a motion is along a machine axis
SIGN_STEP = 1e-3  # m or rad by which an axis is moved to see the direction of the tool


def question_travel(machine: Machine) -> list[Doubt]:
    """Return doubts about ends of travel that cannot be solved, screws that end before the travel, and signs of axes."""
    return [*_question_ends(machine), *_question_screw_ends(machine), *_question_signs(machine)]


def describe_signs(machine: Machine) -> list[str]:
    """Return a line for every axis that moves the tool relative to the work: which way a positive step goes."""
    return [f"+{name} moves the tool {'about' if turns else 'along'} {direction_words(way)} relative to the work"
            for name, way, turns in _tool_directions(machine)]


def _question_ends(machine: Machine) -> list[Doubt]:
    lines = list[Doubt]()
    if not _moves_alone(machine) or tearing_axes(machine) or any(body.modal_count for body in machine.bodies):
        return lines  # slides of elastic bodies are judged with their reduction
    for axis in machine.chain.axes:
        for end in (axis.lower, axis.upper):
            if not np.isfinite(end):
                continue
            pose = {axis.name: float(end)}
            try:
                assemble(machine, pose)
            except ToolpointError as error:
                lines.append(Doubt(f"axes.{axis.name}", f"at {pose_words(machine, pose)}, an end of its travel: {error}",
                                   "check the limits of the axis, and the place and length of what it runs on", figure=end))
    return lines


def _moves_alone(machine: Machine) -> bool:
    """Return whether every axis may be moved by itself: legs of a parallel machine need not reach their ends alone."""
    return not isinstance(machine.chain, ClosedChain) or all(axis.name in AXIS_INDEX_BY_NAME for axis in machine.chain.axes)


def _question_screw_ends(machine: Machine) -> Iterator[Doubt]:
    """Doubt screws that do not follow their axis and are too short for its travel to either side of the nut."""
    for name, joint in machine.description.joints.items():
        screw = None if joint.law is None else joint.law.ball_screw
        if screw is None or screw.follows or screw.along not in driven_ways(machine.description, name):
            continue
        for axis in machine.chain.axes:
            if not np.isfinite([axis.lower, axis.upper]).all() or all(
                    drive.joint != name for drive in machine.description.axes[axis.name].moved):
                continue
            nut = screw.nut_at
            reaches = [(nut + axis.lower, nut + axis.upper), (nut - axis.upper, nut - axis.lower)]
            if all(nut_min <= 0 or nut_max > screw.length for nut_min, nut_max in reaches):
                yield Doubt(f"joints.{name}.law.ball_screw.nut_at", f"{1e3 * screw.length:.4g} mm long with its nut at "
                            f"{1e3 * nut:.4g} mm, but axis {axis.name} travels {axis.words(axis.lower)} .. "
                            f"{axis.words(axis.upper)}: the nut leaves the screw", "check nut_at, the length and the "
                            "limits of the axis", figure=(axis.upper - axis.lower) / screw.length)


def _question_signs(machine: Machine) -> Iterator[Doubt]:
    for name, way, turns in _tool_directions(machine):
        if name not in AXIS_INDEX_BY_NAME or turns != (name in "ABC"):
            continue
        named = np.eye(3)[AXIS_INDEX_BY_NAME[name]]
        verb = "turns the tool about" if turns else "moves the tool along"
        cosine = float(way @ named)
        if cosine < -MIN_DIRECTION_COSINE:
            yield Doubt(f"axes.{name}", f"+{name} {verb} {direction_words(way)} relative to the work, against its name",
                        "turn the sign of its direction (ISO 841: + is the tool's way relative to the work)", figure=cosine)
        elif abs(cosine) < 1 - MIN_DIRECTION_COSINE and np.abs(way).max() > MIN_DIRECTION_COSINE:
            yield Doubt(f"axes.{name}", f"+{name} {verb} {direction_words(way)} relative to the work, not its own direction",
                        "check its joint and direction", figure=cosine)


def _tool_directions(machine: Machine) -> list[tuple[str, FloatArray, bool]]:
    """Return name, unit direction of the tool's motion relative to the work (machine frame), and whether it is a rotation."""
    description = machine.description
    if description.tool is None or not _moves_alone(machine):
        return []
    tool = machine.link(description.points[description.tool].body)
    work = -1 if description.table is None else machine.link(description.points[description.table].body)
    result = list[tuple[str, FloatArray, bool]]()
    if tearing_axes(machine):
        return result  # an axis that tears a loop open alone is doubted for that
    reference_motion = _relative_motion(machine, work, tool, {})
    for axis in machine.chain.axes:
        step = SIGN_STEP if axis.reference_position + SIGN_STEP <= axis.upper else -SIGN_STEP
        if not axis.lower <= axis.reference_position + step <= axis.upper:
            continue
        change = _relative_motion(machine, work, tool,
                                  {axis.name: axis.reference_position + step}) @ np.linalg.inv(reference_motion)
        # Antisymmetric part of a small rotation: its vector.
        turn = np.array([change[2, 1] - change[1, 2], change[0, 2] - change[2, 0], change[1, 0] - change[0, 1]]) / 2
        way = (turn if axis.is_rotary else change[:3, 3]) / step
        size = float(np.linalg.norm(way))
        if size > SIGN_STEP:
            result.append((axis.name, way / size, axis.is_rotary))
    return result


def _relative_motion(machine: Machine, work: int, tool: int, pose: dict[str, float]) -> FloatArray:
    """Return the motion of the tool's body relative to the work since the reference pose, as a transform (4, 4)."""
    frames = place_machine(machine, pose).frames[0]
    moved = [np.eye(4) if link < 0 else frames[link] @ np.linalg.inv(machine.body_frames[link]) for link in (work, tool)]
    return np.asarray(np.linalg.inv(moved[0]) @ moved[1], float)
