"""What a chain is: axis positions in, frames of its links and their derivatives out. All chains join here."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from numpy.typing import ArrayLike

from toolpoint._check import FloatArray
from toolpoint.kinematics.axis import Axis

Pose = Mapping[str, ArrayLike]


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
