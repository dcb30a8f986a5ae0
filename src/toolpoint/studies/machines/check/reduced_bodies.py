"""Doubts about reduced elastic bodies for `check`: error of their reduction at the poses where the machine is used."""

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

REDUCTION_MODE_COUNT = 6  # modes estimated at every pose
SLIDE_TOLERANCE = 1e-4  # m, distance of a joint from the line of its slide


def question_reduction(machine: Machine) -> tuple[tuple[Doubt, ...], tuple[str, ...]]:
    """Return doubts, and a remark on the pose with the largest reduction error unless that is a doubt itself.

    Doubted are ends of travel beyond an elastic body, and joints that leave the line of their slide.

    Asked at the reference pose, the described poses, and both ends of every axis (alone, where no loop has to follow).
    """
    if not can_estimate(machine):
        return (), ()
    doubts, estimates = list[Doubt](), list[tuple[float, dict[str, float], ReductionEstimate]]()
    for axis, pose in _poses_of_use(machine):
        try:
            estimate = estimate_reduction(machine, pose, REDUCTION_MODE_COUNT)
        except ToolpointError as error:
            if axis:
                doubts.append(Doubt(f"axes.{axis}", f"at {pose_words(machine, pose)}, an end of its travel: {error}",
                                    "narrow the limits of the axis, or lengthen the slide"))
            continue  # a described pose that cannot be reached is reported by the study that needs it
        assert estimate is not None
        if axis:
            doubts += _question_slides(machine, axis, pose)
        estimates.append((estimate.largest, pose, estimate))
    if not estimates:
        return tuple(doubts), ()
    _, pose, estimate = max(estimates, key=lambda row: row[0])
    note = place_note(estimate_note(estimate), f"{pose_words(machine, pose)}, the worst of {len(estimates)} poses")
    return (*doubts, *doubts_among([note])), () if isinstance(note, Doubt) else (note,)


def _question_slides(machine: Machine, axis: str, pose: dict[str, float]) -> list[Doubt]:
    """Return doubts about joints that an axis moves sideways off a slide of an elastic body.

    The reduced body keeps its point on the line of the slide, so the force would act there over a rigid arm.
    """
    reference_placement, placement = place_machine(machine, {}), place_machine(machine, pose)
    lines = []
    for i, name in enumerate(machine.joint_names):
        for link, interface in zip((machine.chain.parents[i], i), machine.interfaces[i], strict=True):
            slide = machine.bodies[link].interfaces.get(interface or "") if link >= 0 else None
            if slide is None or slide.along is None:
                continue
            moved = np.subtract(*(tf.move(tf.inverse(place.frames[0, link]), place.joint_frames[0, i, None, :3, 3])[0]
                                  for place in (placement, reference_placement)))
            offset = float(np.linalg.norm(moved - (moved @ slide.along) * slide.along))
            if offset > SLIDE_TOLERANCE:
                lines.append(Doubt(f"axes.{axis}",
                                   f"at {pose_words(machine, pose)} joint {name} is {1e3 * offset:.4g} mm beside "
                                   f"slide {interface} of {machine.body_names[link]}",
                                   "let it move along the slide, or turn the slide", figure=offset))
    return lines


def _poses_of_use(machine: Machine) -> Iterator[tuple[str, dict[str, float]]]:
    """Yield (axis, pose): the reference pose and the described ones with an empty name, then the ends of every axis.

    Axes of a closed chain are left out, as loops would have to follow.
    """
    yield "", {}
    for pose in machine.description.poses:
        yield "", dict(pose)
    if isinstance(machine.chain, ClosedChain):
        return
    for axis in machine.chain.axes:
        for end in (axis.lower, axis.upper):
            if np.isfinite(end) and end != axis.reference_position:
                yield axis.name, {axis.name: float(end)}
