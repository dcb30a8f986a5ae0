"""What a chain is: axis positions in, frames of its links and their derivatives out. All chains join here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, fail
from toolpoint.kinematics.axis import Axis

Pose = Mapping[str, ArrayLike]


def check_pose(pose: Pose) -> Pose:
    """Return a pose after refusing what is no mapping of axis names to positions, a list of poses above all."""
    if not isinstance(pose, Mapping):
        fail("pose", repr(pose)[:60], "must map axis names to positions in m or rad, such as {'X': 0.2}",
             "several poses are one mapping with arrays of positions, {'X': [0.1, 0.2]}")
    return pose


def check_poses(poses: Sequence[Mapping[str, float]]) -> Sequence[Mapping[str, float]]:
    """Return a sequence of poses after refusing a single mapping, or a sequence of anything else."""
    if isinstance(poses, (Mapping, str)) or not all(isinstance(pose, Mapping) for pose in poses):
        fail("poses", repr(poses)[:60], "must be a sequence of poses", "put one pose into a list: [{'X': 0.2}]")
    return poses


class Chain(Protocol):
    """The interface of every chain: a Cartesian tree today, serial and parallel chains later.

    A pose maps axis names to positions (m, rad), each a number or an array of shape (n_poses,).
    """

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The driven axes."""
        ...

    def displacements(self, pose: Pose) -> FloatArray:
        """Return how far every link has moved from its reference place, machine frame, shape (n_poses, n_links, 4, 4)."""
        ...

    def jacobian(self, pose: Pose, link: int, point: ArrayLike) -> FloatArray:
        """Return the twist of a link about one of its points per axis rate, shape (n_poses, 6, n_axes)."""
        ...
