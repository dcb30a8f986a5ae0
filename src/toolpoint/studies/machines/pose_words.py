"""Poses and directions in words: rotary axes in degrees, directions by name where they have one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from toolpoint.kinematics import Axis
from toolpoint.machine.parts.model import Machine

MIN_PRINTED_POSITION = 1e-9  # mm and degrees: smaller numbers are rounding and printed as zero


def pose_words(machine: Machine | None, pose: Mapping[str, float], empty: str = "reference pose") -> str:
    """Return a pose in words, ``X 100 mm, B 30°``; without a machine the bare numbers."""
    axes: dict[str, Axis] = {} if machine is None else {axis.name: axis for axis in machine.chain.axes}
    return ", ".join(f"{name} {position_words(value, axes[name].is_rotary) if name in axes else f'{value:g}'}"
                     for name, value in pose.items()) or empty


def position_words(value: float, is_angle: bool) -> str:
    """Return an axis position (m or rad) as it is printed: ``100 mm``, ``30°``; rounding errors about zero are zero."""
    display_value = np.degrees(value) if is_angle else 1e3 * value
    return f"{0.0 if abs(display_value) < MIN_PRINTED_POSITION else display_value:.6g}{'°' if is_angle else ' mm'}"


def direction_words(direction: ArrayLike) -> str:
    """Return a unit direction in words: ``+z``, or its three components."""
    d = np.asarray(direction, float)
    for i, name in enumerate("xyz"):
        if abs(abs(d[i]) - 1) < 1e-9:
            return ("+" if d[i] > 0 else "-") + name
    return "(" + ", ".join(f"{v:.4g}" for v in np.where(np.abs(d) < 1e-12, 0.0, d)) + ")"
