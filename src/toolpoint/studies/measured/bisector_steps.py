r"""Steps of the first source beside the package's own joints: for every mode the axis of a component against the one before it.

The motion of the component before is undone on the child's displaced points (eq. 5 of the source), what is left is registered
(eqs. 7-10), the axis lies where the perpendicular bisectors of the displacements are densest (eqs. 11, 12), and the joint where
the axes of all modes meet. How far shapes are enlarged before is a choice that the source leaves open: two are taken, as a
straight displacement is no arc. Source: Machines 2022, 10(11), 1102.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._notebook import NotebookText
from toolpoint.joint_identification import JointIdentification
from toolpoint.joint_identification.motion.finite_motion import (
    BisectorAxis,
    displacements_beside_parent,
    meeting_point,
    relative_bisector_axes,
)
from toolpoint.joint_identification.motion.measured import component
from toolpoint.machine.components import Components
from toolpoint.modal_identification import real_modes
from toolpoint.vibration import Modes
from toolpoint.vibration.geometry import Geometry

STEP_AMPLITUDES = (1e-4, 0.02)  # enlargement of the shapes, of a component's size: nearly none, and one that shows


@dataclass(frozen=True, eq=False)
class BisectorSteps(NotebookText):
    """Steps at one joint.

    joint : parent and child in words; point_count : of the child; axes : of every mode, of shapes enlarged by the first of
    `STEP_AMPLITUDES`; frequency : Hz; meeting : (2, 3), where they meet by both enlargements, m; position : of the package's
    joint; undetermined : (n, 3), directions along which its place is a choice; reason : why there are no steps, else empty;
    plain_axes : of every mode, without the compensation; points : the child's; shape : (n_points, 3, n_modes), the child's
    motion with that of the component before undone.
    """

    joint: str
    point_count: int
    axes: tuple[BisectorAxis, ...]
    frequency: FloatArray
    meeting: FloatArray
    position: FloatArray
    undetermined: FloatArray
    reason: str = ""
    plain_axes: tuple[BisectorAxis, ...] = ()
    points: tuple[str | int, ...] = ()
    shape: FloatArray = field(default_factory=lambda: np.zeros((0, 3, 0)))

    def turn_shares(self) -> FloatArray:
        """Return the turn of every mode over the largest of them, each as enlarged."""
        angle = np.array([axis.angle for axis in self.axes])
        return np.asarray(angle / angle.max())

    def passes(self) -> FloatArray:
        """Return how far every axis passes the package's joint, m."""
        return self._distances(self.axes)

    def plain_passes(self) -> FloatArray:
        """Return how far every axis passes the package's joint where the motion of the component before is left in, m."""
        return self._distances(self.plain_axes)

    def _distances(self, axes: tuple[BisectorAxis, ...]) -> FloatArray:
        offset = np.array([self.position - axis.point for axis in axes])
        along = np.array([axis.direction for axis in axes])
        return np.asarray(np.linalg.norm(offset - (offset * along).sum(axis=1)[:, None] * along, axis=1))

    def misses(self) -> FloatArray:
        """Return how far both meeting places lie from the package's joint, m, across the directions that it leaves open."""
        offset = self.meeting - self.position
        return np.asarray(np.linalg.norm(offset - offset @ self.undetermined.T @ self.undetermined, axis=1))

    def rows(self) -> list[list[str]]:
        """Return a row for every mode and two for the meeting places."""
        if self.reason:
            return [[self.joint, "", "", "", self.reason, ""]]
        columns = (self.frequency, self.axes, self.turn_shares(), self.passes(), self.plain_passes())
        rows = [[self.joint, f"{f:.2f} Hz", " ".join(f"{v:+.2f}" for v in axis.direction), f"{share:.2f}", f"{1e3 * miss:.2f}",
                 f"{1e3 * plain_miss:.2f}"] for f, axis, share, miss, plain_miss in zip(*columns, strict=True)]
        for amplitude, place, miss in zip(STEP_AMPLITUDES, self.meeting, self.misses(), strict=True):
            rows.append([self.joint, f"all meet, enlarged to {100 * amplitude:g} %",
                         "at " + " ".join(f"{1e3 * v:.1f}" for v in place) + " mm", "", f"{1e3 * miss:.2f}", ""])
        return rows

    def to_dict(self) -> dict[str, Any]:
        """Return the steps as plain data, m."""
        return {"joint": self.joint, "reason": self.reason, "frequency_hz": self.frequency.tolist(),
                "directions": [axis.direction.tolist() for axis in self.axes],
                "passes_m": self.passes().tolist() if self.axes else [],
                "passes_uncompensated_m": self.plain_passes().tolist() if self.axes else [], "meeting_m": self.meeting.tolist(),
                "misses_m": self.misses().tolist() if self.axes else []}

    def __repr__(self) -> str:
        return f"BisectorSteps({self.joint!r}, {len(self.axes)} axes)"


def retrace_steps(joints: JointIdentification, modes: Modes, geometry: Geometry, *, components: Components
                  ) -> tuple[BisectorSteps, ...]:
    """Return the source's steps at every joint; one whose points are not measured in three directions has a reason instead."""
    real = real_modes(modes)
    result = []
    for joint in joints.joints:
        owner = components.points
        words, count = f"{joint.parent} - {joint.child}", len(owner.get(joint.child, ()))
        place, free = np.asarray(joint.position, float), np.asarray(joint.undetermined, float).reshape(-1, 3)
        try:
            parent, child = (component(name, real, geometry.points, labels=owner[name]) if name in owner else None
                             for name in (joint.parent, joint.child))
            assert child is not None
            both = [relative_bisector_axes(parent, child, amplitude) for amplitude in STEP_AMPLITUDES]
        except ToolpointError as error:
            empty = np.zeros((0, 3))
            result.append(BisectorSteps(words, count, (), np.zeros(0), empty, place, free, str(error)))
            continue
        meeting = np.array([meeting_point(axes) for axes in both])
        result.append(BisectorSteps(
            words, count, both[0], real.frequency, meeting, place, free,
            plain_axes=relative_bisector_axes(None, child, STEP_AMPLITUDES[0]), points=tuple(child.points),
            shape=displacements_beside_parent(parent, child, STEP_AMPLITUDES[0])))
    return tuple(result)
