"""Step: an elementary motion of a joint along or about one of its directions; a ball is three of them together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.spatial import rotation as rot


class Step(NamedTuple):
    """Motion of a joint along (0, 1, 2: x, y, z) or about (3, 4, 5) a direction of its frame, after the steps before it.

    Examples
    --------
    >>> Step(joint=0, way=5).turns  # a rotation about z
    True
    """

    joint: int
    way: int
    is_ball: bool = False

    @property
    def turns(self) -> bool:
        """Whether it is a rotation."""
        return self.way > 2


def step_sequence(steps: Sequence[Step], joint: int) -> tuple[tuple[int, ...], ...]:
    """Return the steps of a joint in their order, those of a ball together."""
    groups: list[tuple[int, ...]] = []
    ball = tuple(k for k, step in enumerate(steps) if step.joint == joint and step.is_ball)
    for k, step in enumerate(steps):
        if step.joint == joint and not step.is_ball:
            groups.append((k,))
    # The directions of a ball are sorted, so that its three values are a rotation vector.
    return (*groups, tuple(sorted(ball, key=lambda k: steps[k].way))) if ball else tuple(groups)


def step_motion(steps: Sequence[Step], group: tuple[int, ...], values: FloatArray) -> FloatArray:
    """Return the motion of a step, or of the three of a ball, for values of all steps, shape (n_poses, 4, 4)."""
    result = np.zeros((len(values), 4, 4))
    result[:, 3, 3] = 1.0
    if len(group) == 3:
        result[:, :3, :3] = rot.from_vector(values[:, group])
        return result
    way, value = steps[group[0]].way, values[:, group[0]]
    if way < 3:
        result[:, [0, 1, 2], [0, 1, 2]] = 1.0
        result[:, way, 3] = value
        return result
    a, b, c = way - 3, (way - 2) % 3, (way - 1) % 3
    cosine, sine = np.cos(value), np.sin(value)
    result[:, a, a] = 1.0
    result[:, b, b] = result[:, c, c] = cosine
    result[:, c, b], result[:, b, c] = sine, -sine
    return result


def advance(steps: Sequence[Step], balls: Sequence[tuple[int, ...]], values: FloatArray, *, change: FloatArray) -> FloatArray:
    """Return step values (P, n) after a change: rotation vectors of balls by a further turn about their moved directions.

    Rotation vectors do not add: exp(a) exp(b) is not exp(a + b).
    """
    result = values + change
    for ball in balls:
        turn = change[:, ball]
        if np.any(turn):
            moved = rot.from_vector(values[:, ball]) @ rot.from_vector(turn)
            result[:, ball] = rot.to_vector(moved)
    return result
