"""What `check` says of a machine with reduced elastic bodies: how good their reduction is where the machine is used."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt, doubts_among, place_note
from toolpoint.kinematics import ClosedChain
from toolpoint.machine import Machine
from toolpoint.machine.assembly.reduction_error import estimate_note
from toolpoint.machine.assembly.reduction_estimate import ReductionEstimate, can_estimate, estimate_reduction
from toolpoint.machine.pose.placement import place_machine
from toolpoint.spatial import transform as tf
from toolpoint.studies.machines.pose_words import pose_words

MODES = 6  # asked of at every pose
OFF = 1e-4  # m: what a joint may leave the line of its slide by


def question_reduction(machine: Machine) -> tuple[tuple[Doubt, ...], tuple[str, ...]]:
    """Return doubts about ends of travel that no elastic body reaches, and the worst pose by reduction: a doubt, or a line.

    Of the reference pose, the described poses, and every axis at both of its ends (alone, where no loop has to follow).
    """
    if not can_estimate(machine):
        return (), ()
    doubts, worst = list[Doubt](), list[tuple[float, dict[str, float], ReductionEstimate]]()
    for axis, pose in _poses(machine):
        try:
            estimate = estimate_reduction(machine, pose, MODES)
        except ToolpointError as error:
            if axis:
                doubts.append(Doubt(f"axes.{axis}", f"at {pose_words(machine, pose)}, an end of its travel: {error}",
                                    "narrow the limits of the axis, or lengthen the slide"))
            continue  # a described pose that cannot be is said by what asks for it
        assert estimate is not None
        if axis:
            doubts += _aside(machine, axis, pose)
        worst.append((estimate.largest, pose, estimate))
    if not worst:
        return tuple(doubts), ()
    _, pose, estimate = max(worst, key=lambda row: row[0])
    note = place_note(estimate_note(estimate), f"{pose_words(machine, pose)}, the worst of {len(worst)} poses")
    return (*doubts, *doubts_among([note])), () if isinstance(note, Doubt) else (note,)


def _aside(machine: Machine, axis: str, pose: dict[str, float]) -> list[Doubt]:
    """Return doubts about joints that an axis carries off a slide sideways: the place on the body stays, on a longer arm."""
    here, there = place_machine(machine, {}), place_machine(machine, pose)
    lines = []
    for i, name in enumerate(machine.joint_names):
        for link, interface in zip((machine.chain.parents[i], i), machine.interfaces[i], strict=True):
            known = machine.bodies[link].interfaces.get(interface or "") if link >= 0 else None
            if known is None or known.along is None:
                continue
            moved = np.subtract(*(tf.move(tf.inverse(place.frames[0, link]), place.joint_frames[0, i, None, :3, 3])[0]
                                  for place in (there, here)))
            off = float(np.linalg.norm(moved - (moved @ known.along) * known.along))
            if off > OFF:
                lines.append(Doubt(f"axes.{axis}", f"at {pose_words(machine, pose)} joint {name} is {1e3 * off:.4g} mm beside "
                                   f"slide {interface} of {machine.body_names[link]}",
                                   "let it move along the slide, or turn the slide", figure=off))
    return lines


def _poses(machine: Machine) -> Iterator[tuple[str, dict[str, float]]]:
    """Yield poses, each with the axis whose end it is."""
    yield "", {}
    for pose in machine.description.poses:
        yield "", dict(pose)
    if isinstance(machine.chain, ClosedChain):
        return
    for axis in machine.chain.axes:
        for end in (axis.lower, axis.upper):
            if np.isfinite(end) and end != axis.reference_position:
                yield axis.name, {axis.name: float(end)}
