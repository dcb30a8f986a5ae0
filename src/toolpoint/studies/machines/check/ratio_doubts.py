"""Doubts about springs a factor of ten off: directions of one joint that do the same work, and drives with each other.

A turning stiffness follows from the same springs as the stiffness along: K_r = sum(k_j r_k^2 + k_k r_j^2) over the contact.
With the size of the smaller body as lever, the directions of one joint lie within a factor of three of each other. A slip of
one decimal place does not. Joints with elastic bodies are left out.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.machine import Machine
from toolpoint.machine.description import GROUND, JointDescription
from toolpoint.machine.description.extent import body_span

MAX_TURNING_RATIO = 4.5  # turning stiffness over the mean of the others of its joint, both as stated and over that of edges
MAX_FOOT_RATIO = 6.0  # the same, and `MAX_GUIDE_RATIO`, for joints to the ground: levelling elements reach 5.2 (published)
MAX_DRIVEN_TURN_RATIO = 1.5  # stiffness of a driven rotation over the stiffest other rotation of its joint
MAX_GUIDE_RATIO = 5.5  # stiffness along a direction that no axis drives, over the mean of the others of its joint
MIN_RATIO_TO_OTHER_JOINTS = 1.6  # the same stiffness over the median of all other joints, which must be to the same side
MAX_DRIVE_RATIO = 4.0  # stiffness of a linear drive over the mean of the others of the machine
MAX_DRIVE_TO_GUIDE_RATIO = 2.0  # stiffness of a linear drive over the stiffest guide direction of its joint
TRANSLATION_NAMES = ("x", "y", "z")


def question_ratios(machine: Machine) -> list[Doubt]:
    """Return doubts about stiffness far from that of other directions: rotations, driven rotations, guides, drives."""
    description = machine.description
    driven = _driven_directions(machine)
    lines, drives, guides = list[Doubt](), dict[str, float](), dict[str, dict[str, float]]()
    for name, joint in description.joints.items():
        bodies = [body for body in (joint.parent, joint.child) if body != GROUND]
        if any(description.bodies[body].is_elastic for body in bodies):
            continue
        lines += [*_question_turning(machine, name, joint, driven[name]), *_question_driven_turns(name, joint, driven[name])]
        values = {way: float(joint.stiffness[way]) for way in TRANSLATION_NAMES if joint.stiffness.get(way, 0.0) > 0}
        guides[name] = {way: value for way, value in values.items() if way not in driven[name]}
        drives |= {f"joints.{name}.stiffness.{way}": values[way] for way in values if way in driven[name]}
    lines += _question_guides(guides, {name for name, joint in description.joints.items() if GROUND in (joint.parent,
                                                                                                        joint.child)})
    return [*lines, *_question_drives(drives, guides)]


def _driven_directions(machine: Machine) -> Mapping[str, set[str]]:
    """Return joint to its driven directions, without sign; an empty set for a joint without drives."""
    driven = defaultdict[str, set[str]](set)
    for axis in machine.description.axes.values():
        for drive in axis.moved:
            driven[drive.joint].add(drive.direction.lstrip("-"))
    return driven


def _question_turning(machine: Machine, name: str, joint: JointDescription, driven: set[str]) -> Iterator[Doubt]:
    """Yield a doubt about the turning stiffness farthest from the others of its joint, by itself and over that of edges.

    driven : driven directions of the joint, which are left out here.
    """
    ways = [way for way in ("rx", "ry", "rz") if joint.stiffness.get(way, 0.0) > 0
            and way not in driven and way not in _spin_directions(machine, joint)]
    if len(ways) < 2:
        return
    stiffness = np.log([joint.stiffness[way] for way in ways])
    edge_logs = np.log([_edge_stiffness(machine, joint, way) for way in ways])
    log_ratios = np.array([_difference_from_others(stiffness), _difference_from_others(stiffness - edge_logs)])
    smallest_ratio = np.where(log_ratios[0] * log_ratios[1] > 0, np.abs(log_ratios).min(axis=0), 0.0)
    candidates = np.flatnonzero(smallest_ratio > np.log(MAX_FOOT_RATIO if GROUND in (joint.parent,
                                                                                     joint.child) else MAX_TURNING_RATIO))
    if not candidates.size:
        return
    # Of two, the one whose lever is farther from what joints have (K_r of about half of what the smaller body's edges give).
    odd = int(max(candidates, key=lambda i: (smallest_ratio[i], abs(stiffness[i] - edge_logs[i] - np.log(0.45)))))
    factor = float(np.exp(smallest_ratio[odd]))
    word = "above" if log_ratios[0, odd] > 0 else "below"
    yield Doubt(f"joints.{name}.stiffness.{ways[odd]}", f"{joint.stiffness[ways[odd]]:.3g} N m/rad, {factor:.2g} times "
                f"{word} the turning stiffness about {' and '.join(ways[:odd] + ways[odd + 1:])} of the same joint, also for "
                "the size of its bodies", "check its digits and unit (N m/deg is 57.3 N m/rad)", figure=factor)


def _question_driven_turns(name: str, joint: JointDescription, driven: set[str]) -> Iterator[Doubt]:
    """Yield doubts about driven rotations stiffer than their bearing: gears and reducers in a row are softer."""
    turns = {way: float(value) for way, value in joint.stiffness.items() if "r" in way and value > 0}
    led = [value for way, value in turns.items() if way not in driven]
    for way in sorted(driven & turns.keys()):
        if len(led) > 1 and turns[way] > MAX_DRIVEN_TURN_RATIO * max(led):
            yield Doubt(f"joints.{name}.stiffness.{way}", f"{turns[way]:.3g} N m/rad about its drive, its bearing has "
                        f"{max(led):.3g} across at most", "check its digits and unit (N m/deg is 57.3 N m/rad)",
                        figure=turns[way] / max(led))


def _spin_directions(machine: Machine, joint: JointDescription) -> set[str]:
    """Return the rotations about the axes of cylindrical bodies: what holds them there is no guide."""
    shapes = [machine.description.bodies[body].shape for body in (joint.parent, joint.child) if body != GROUND]
    return {"r" + shape.axis for shape in shapes if shape is not None and shape.kind == "cylinder"}


def _edge_stiffness(machine: Machine, joint: JointDescription, way: str) -> float:
    """Return the turning stiffness of the joint's translational springs at the edges of the smaller body, N m/rad.

    way : ``rx``, ``ry`` or ``rz``. It is 1 where one of the two translations has no stiffness.
    """
    links = [machine.link(body) for body in (joint.parent, joint.child) if body != GROUND]
    halves = [body_span(machine.description.bodies[machine.body_names[i]], machine.body_frames[i], machine.bodies[i].mass)[1]
              for i in links]
    half = np.maximum(np.min(halves, axis=0), 1e-6)
    i, j = (k for k in range(3) if TRANSLATION_NAMES[k] != way[1])
    along, across = (joint.stiffness.get(TRANSLATION_NAMES[k], 0.0) for k in (i, j))
    return float(along * half[j] ** 2 + across * half[i] ** 2) if along > 0 and across > 0 else 1.0


def _difference_from_others(logs: FloatArray) -> FloatArray:
    """Return each logarithm (n,) less the mean of the others: the logarithm of its ratio to their geometric mean."""
    return logs - (logs.sum() - logs) / (len(logs) - 1)


def _question_guides(guides: Mapping[str, Mapping[str, float]], feet: set[str]) -> Iterator[Doubt]:
    """Yield doubts about directions far from the others of their joint and, to the same side, from other joints.

    guides : joint to direction to stiffness, N/m, without driven directions; feet : joints to the ground.
    """
    for name, joint_stiffness in guides.items():
        max_ratio = MAX_FOOT_RATIO if name in feet else MAX_GUIDE_RATIO
        other_logs = [np.log(value) for other, row in guides.items() if other != name for value in row.values()]
        if len(joint_stiffness) < 2 or not other_logs:
            continue
        logs = np.log(list(joint_stiffness.values()))
        log_ratios = np.array([_difference_from_others(logs), logs - np.median(other_logs)])
        candidates = [i for i in range(len(logs)) if log_ratios[0, i] * log_ratios[1, i] > 0
                      and abs(log_ratios[0, i]) > np.log(max_ratio)
                      and abs(log_ratios[1, i]) > np.log(MIN_RATIO_TO_OTHER_JOINTS)]
        if candidates:
            way = list(joint_stiffness)[odd := max(candidates, key=lambda i: abs(log_ratios[0, i]))]
            factor = float(np.exp(abs(log_ratios[0, odd])))
            yield Doubt(f"joints.{name}.stiffness.{way}", f"{joint_stiffness[way]:.3g} N/m, {factor:.2g} times "
                        f"{'above' if log_ratios[0, odd] > 0 else 'below'} "
                        f"{' and '.join(w for w in joint_stiffness if w != way)} of the same "
                        "joint, and far from other joints to the same side", "check its digits and unit (kgf/um is 9.81 N/um)",
                        figure=factor)


def _question_drives(drives: Mapping[str, float], guides: Mapping[str, Mapping[str, float]]) -> Iterator[Doubt]:
    """Yield doubts about drives far from all others, or stiffer than the guides of their joint.

    drives : path in the machine file to stiffness, N/m; guides : as of `_question_guides`.
    """
    others_of = {path: [other for place, other in drives.items() if place != path] for path in drives}
    # Where the others disagree among themselves the slip is one of them: a sound drive is not doubted for its neighbour's.
    agreed_paths = {path for path, others in others_of.items() if others and max(others) <= MAX_DRIVE_RATIO * min(others)}
    for path, value in drives.items():
        others = others_of[path]
        middle = float(np.exp(np.mean(np.log(others)))) if others else value
        factor = max(value / middle, middle / value)
        led = guides[path.split(".")[1]].values()
        if factor > MAX_DRIVE_RATIO and (path in agreed_paths or not agreed_paths):
            yield Doubt(path, f"{value:.3g} N/m, the other drives have about {middle:.3g} N/m", "check its digits and unit",
                        figure=factor)
        elif led and value > MAX_DRIVE_TO_GUIDE_RATIO * max(led):
            yield Doubt(path, f"{value:.3g} N/m along its drive, its guides across have {max(led):.3g} N/m at most",
                        "check its digits and unit: screw, nut and bearings in a row are softer than guides",
                        figure=value / max(led))
