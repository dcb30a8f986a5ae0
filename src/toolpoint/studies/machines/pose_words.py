"""Poses and directions in words: rotary axes in degrees, directions by name where they have one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from toolpoint.kinematics import Axis
from toolpoint.machine.model import Machine


def pose_words(machine: Machine | None, pose: Mapping[str, float], empty: str = "reference pose") -> str:
    """Return a pose in words, ``X 0.1, B 30 deg``: m where no unit stands; without a machine the bare numbers."""
    axes: dict[str, Axis] = {} if machine is None else {axis.name: axis for axis in machine.chain.axes}
    return ", ".join(f"{name} {axes[name].words(value)}" if name in axes and axes[name].is_rotary else f"{name} {value:g}"
                     for name, value in pose.items()) or empty


def direction_words(direction: ArrayLike) -> str:
    """Return a unit direction in words: ``+z``, or its three components."""
    d = np.asarray(direction, float)
    for i, name in enumerate("xyz"):
        if abs(abs(d[i]) - 1) < 1e-9:
            return ("+" if d[i] > 0 else "-") + name
    return "(" + ", ".join(f"{v:.4g}" for v in np.where(np.abs(d) < 1e-12, 0.0, d)) + ")"
