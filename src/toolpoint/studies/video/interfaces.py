r"""Ranking of soft interfaces: relative motion of two bodies in the video times the sensitivity of the model.

For every joint and mode: :math:`m_{jr}`, the length of the bodies' relative displacement at the joint and of their relative
turn times the child's half length, over the largest motion of the mode; :math:`w_r`, the mode's share of the motion after
the blow (over the strongest mode of its video); :math:`S_j`, the largest relative sensitivity of the model's frequencies to
all stiffnesses of the joint. Joints are ranked by :math:`\sum_r w_r m_{jr} \sqrt{S_j}` over the motions that stand out of
their uncertainty.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, fail
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.machine import Machine
from toolpoint.machine.description import GROUND
from toolpoint.machine.pose.placement import place_machine
from toolpoint.studies.machines.sensitivity_study import study_sensitivity
from toolpoint.studies.text_table import text_table
from toolpoint.studies.video.video_study import VideoStudy
from toolpoint.vision.modes.bodies import BodyMotion

HEADER = ("rank", "interface", "relative motion in the modes", "sigma", "model sensitivity", "score", "verdict")
MIN_MOTION_SIGMA = 5.0  # standard deviations, from which a relative motion counts
MIN_WEIGHTED_MOTION = 0.05  # of a mode's largest motion, from which an interface moves


@dataclass(frozen=True, eq=False)
class InterfaceRank:
    """One interface.

    joint : name; motion : relative motion in the modes of all videos, over each mode's largest; sigma : that over its standard
    deviation; sensitivity : of the model; score, verdict.
    """

    joint: str
    motion: FloatArray
    sigma: FloatArray
    sensitivity: float
    score: float
    verdict: str


@dataclass(frozen=True, eq=False)
class InterfaceRanking(NotebookText):
    """All interfaces, the softest in the modes of the videos first."""

    interfaces: tuple[InterfaceRank, ...]
    frequencies: FloatArray
    doubts: tuple[Doubt, ...] = ()

    @property
    def moving(self) -> tuple[str, ...]:
        """Joints whose bodies move against each other beyond doubt, and that matter."""
        return tuple(entry.joint for entry in self.interfaces if entry.verdict.startswith("moves"))

    def rows(self) -> list[list[str]]:
        """Return the table's rows."""
        return [[str(k + 1), e.joint, " ".join(f"{m:.3f}" for m in e.motion), " ".join(f"{s:.0f}" for s in e.sigma),
                 f"{e.sensitivity:.3f}", f"{e.score:.4f}", e.verdict]
                for k, e in enumerate(self.interfaces)]

    def table(self) -> str:
        """Return the ranking as text."""
        frequency_text = ", ".join(f"{f:.2f}" for f in self.frequencies)
        return "\n".join([*mark_notes(self.doubts),
                          text_table(f"Interfaces by relative motion in the modes at {frequency_text} Hz", HEADER,
                                     self.rows())])

    def to_dict(self) -> dict[str, Any]:
        """Return the ranking as plain data."""
        return {"frequency_hz": self.frequencies.tolist(), "doubts": list(self.doubts), "interfaces": [
            {"joint": e.joint, "relative_motion": e.motion.tolist(), "sigma": e.sigma.tolist(), "score": e.score,
             "verdict": e.verdict} for e in self.interfaces]}


def rank_interfaces(machine: Machine, videos: Sequence[VideoStudy],
                    pose: Mapping[str, float] | None = None) -> InterfaceRanking:
    """Return the interfaces of a machine by the relative motion of their bodies in one or more videos.

    Raises
    ------
    ToolpointError
        Where a video has no body of the machine.

    Examples
    --------
    Runs in ``examples/films_of_a_machine_to_its_joints.py``.
    """
    if not videos:
        fail("videos", "none", "must be one at least")
    motions, sigmas, weights, frequencies, doubts = [], [], [], [], []
    for video in videos:
        if not video.bodies:
            fail("videos", f"{video.scan.clip.name} has no bodies", "must show bodies of the machine",
                 remedy="give their regions, or a view that places the machine in the picture")
        motion, sigma, weight = _relative_motion(machine, video, pose)
        motions.append(motion)
        weights.append(weight)
        sigmas.append(sigma)
        frequencies.append(video.poles.frequency[video.is_mode])
        doubts += list(video.doubts)
    motion, sigma = np.concatenate(motions, axis=1), np.concatenate(sigmas, axis=1)
    all_frequencies, share = np.concatenate(frequencies), np.concatenate(weights)
    sensitivity = _sensitivity(machine, all_frequencies.size, pose)
    entries = []
    for j, name in enumerate(machine.description.joints):
        sure = np.where(sigma[j] > MIN_MOTION_SIGMA, share * motion[j], 0.0)
        score = float(sure.sum() * np.sqrt(sensitivity[name]))
        unknown = np.isnan(motion[j]).all()
        is_moving = bool((sure > MIN_WEIGHTED_MOTION).any())
        verdict = "unknown: a body without texture" if unknown else (
            "moves: update it" if is_moving else "does not move: leave it as it is")
        entries.append(InterfaceRank(name, motion[j], sigma[j], sensitivity[name], 0.0 if unknown else score, verdict))
    entries.sort(key=lambda entry: -entry.score)
    return InterfaceRanking(tuple(entries), all_frequencies, tuple(dict.fromkeys(doubts)))


def _relative_motion(machine: Machine, video: VideoStudy, pose: Mapping[str, float] | None) -> tuple[FloatArray, FloatArray,
                                                                                                     FloatArray]:
    """Return relative motion over the mode's largest and over its deviation, (n_joints, n_modes), and the modes' weights."""
    place = place_machine(machine, pose)
    bodies = {body.name: body for body in video.bodies}
    mode_indices = np.flatnonzero(video.is_mode)
    largest = np.max([np.abs(body.coefficients[:, [0, 6]]).max(axis=1) + np.abs(body.coefficients[:, [1, 2, 7, 8]]).max(axis=1)
                      for body in video.bodies if "unknown" not in body.orders], axis=0)[mode_indices]
    frames = {name: k for k, name in enumerate(machine.joint_names)}
    motion = np.full((len(machine.description.joints), mode_indices.size), np.nan)
    sigma = np.zeros_like(motion)
    for j, (name, joint) in enumerate(machine.description.joints.items()):
        where = place.joint_frames[0, frames[name], :3, 3] if name in frames else np.asarray(joint.frame.at)
        pixel = video.view.project(where[None])
        parent, child = bodies.get(joint.parent), bodies.get(joint.child)
        # A body that the video does not show leaves its joints unknown.
        if child is None or (parent is None and joint.parent != GROUND) or any(
                body is not None and "unknown" in body.orders for body in (parent, child)):
            continue
        value, variance = _difference(child, parent, pixel)
        motion[j] = np.sqrt((np.abs(value) ** 2).sum(axis=0))[mode_indices] / largest
        sigma[j] = np.sqrt((np.abs(value) ** 2 / np.maximum(variance, 1e-30)).sum(axis=0))[mode_indices]
    return motion, sigma, largest / largest.max()


def _difference(child: BodyMotion, parent: BodyMotion | None, pixel: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """Return relative right, down and turn times the child's half length at a place, (3, r), and their variances."""
    reach = max(child.region.width, child.region.height) / 2
    # Motion at the place, and to the right of it and below, gives the turn.
    steps = np.array([[0.0, 0.0], [reach, 0.0], [0.0, reach]])
    value: ComplexArray = np.zeros((3, child.coefficients.shape[0]), complex)
    variance = np.zeros(value.shape)
    for sign, body in ((1, child), (-1, parent)):
        if body is None:
            continue
        shape = body.shape_at(pixel + steps)
        turn = ((shape[1, 1] - shape[0, 1]) - (shape[2, 0] - shape[0, 0])) / 2
        value = value + sign * np.stack([shape[0, 0], shape[0, 1], turn])
        spread = body.deviation_at(pixel + steps)
        half = np.sqrt((spread[1, 1] ** 2 + spread[2, 0] ** 2) / 2)
        variance = variance + np.stack([spread[0, 0], spread[0, 1], half]) ** 2
    return value, variance


def _sensitivity(machine: Machine, modes: int, pose: Mapping[str, float] | None) -> dict[str, float]:
    """Return the largest relative sensitivity of the model's lowest frequencies to all stiffnesses of every joint."""
    joints = machine.description.joints
    paths = [f"joints.{name}.stiffness.{way}" for name, joint in joints.items() for way in joint.stiffness]
    study = study_sensitivity(machine, paths, min(machine.size, max(2 * modes, 4)), pose=pose)
    cumulative = study.cumulative("stiffness")
    return {name: float(cumulative[f"joints.{name}"].max()) if f"joints.{name}" in cumulative else 0.0 for name in joints}
