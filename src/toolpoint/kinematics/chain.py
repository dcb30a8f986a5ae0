"""What a chain is: axis positions in, frames of its links and their derivatives out. All chains join here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from numpy.typing import ArrayLike

from toolpoint._check import fail

Pose = Mapping[str, ArrayLike]


def check_pose(pose: Pose) -> Pose:
    """Return a pose after refusing what is no mapping of axis names to positions, a list of poses above all."""
    if not isinstance(pose, Mapping):
        fail("pose", repr(pose)[:60], "must map axis names to positions in m or rad, such as {'X': 0.2}",
             remedy="several poses are one mapping with arrays of positions, {'X': [0.1, 0.2]}")
    return pose


def check_poses(poses: Sequence[Mapping[str, float]]) -> Sequence[Mapping[str, float]]:
    """Return a sequence of poses after refusing a single mapping, or a sequence of anything else."""
    if isinstance(poses, (Mapping, str)) or not all(isinstance(pose, Mapping) for pose in poses):
        fail("poses", repr(poses)[:60], "must be a sequence of poses", remedy="put one pose into a list: [{'X': 0.2}]")
    return poses
