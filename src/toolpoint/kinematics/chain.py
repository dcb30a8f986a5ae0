"""Poses of a chain: axis positions by name, checked before a chain takes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from numpy.typing import ArrayLike

from toolpoint._check import fail

Pose = Mapping[str, ArrayLike]  # axis name -> position or positions, m or rad


def check_pose(pose: Pose) -> Pose:
    """Return a pose after refusing anything but a mapping of axis names to positions, above all a list of poses.

    Examples
    --------
    >>> from toolpoint.kinematics import Pose
    >>> pose: Pose = {"X": [0.1, 0.2], "Z": 0.3}
    >>> check_pose(pose) is pose
    True
    """
    if not isinstance(pose, Mapping):
        fail("pose", repr(pose)[:60], "must map axis names to positions in m or rad, such as {'X': 0.2}",
             remedy="several poses are one mapping with arrays of positions, {'X': [0.1, 0.2]}")
    return pose


def check_poses(poses: Sequence[Mapping[str, float]]) -> Sequence[Mapping[str, float]]:
    """Return a sequence of poses after refusing a single mapping, or a sequence of anything else."""
    if isinstance(poses, (Mapping, str)) or not all(isinstance(pose, Mapping) for pose in poses):
        fail("poses", repr(poses)[:60], "must be a sequence of poses", remedy="put one pose into a list: [{'X': 0.2}]")
    return poses
