"""Rigid motions of all components with the covariance of their errors, from shapes, coordinates and gains as they are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.joint_identification.joints.joint_fit import Criterion
from toolpoint.joint_identification.motion.measured import Component, Point, component
from toolpoint.joint_identification.motion.motion_errors import (
    column_correlation,
    coordinate_variance,
    with_bending,
    with_common_noise,
    with_errors,
    with_placed_errors,
)
from toolpoint.joint_identification.motion.point_places import place_points
from toolpoint.joint_identification.motion.rigid_motion import RigidMotion, SmallMotion, rigid_motion
from toolpoint.joint_identification.motion.sensor_gains import SensorGains
from toolpoint.vibration import Modes


class MotionMethod(Protocol):
    """A way to find the twists of a component: `SmallMotion`, `FiniteRotation` or `ClosestPoint`."""

    def twists(self, part: Component) -> FloatArray:
        """Return the twists (6, n_columns) about the origin."""


def align_phase(modes: Modes) -> Modes:
    """Return complex shapes turned to where their real parts are largest; real ones as they are."""
    if not np.iscomplexobj(modes.shape):
        return modes
    phase = np.exp(-0.5j * np.angle((modes.shape**2).sum(axis=0)))
    return replace(modes, shape=modes.shape * phase, scaling="unscaled", participation=None, input_dofs=(),
                   lower_residual=None, upper_residual=None)


def real_variance(modes: Modes) -> FloatArray | None:
    """Return the variance of one real column: half of that of a complex shape."""
    variance = modes.shape_variance
    return variance if variance is None or not np.iscomplexobj(modes.shape) else variance / 2


def component_motions(modes: Modes, points: Mapping[Point, ArrayLike], components: Mapping[str, Sequence[Point]], *,
                      method: MotionMethod, deviation: float, criterion: Criterion, gains: SensorGains | None = None
                      ) -> tuple[dict[str, Component], dict[str, RigidMotion], list[Doubt]]:
    """Return the components, their rigid motions with the covariance of all columns, and doubts of the coordinates.

    Components stay where their coordinates are stated, with what these may be wrong by in their variance, so that they are
    judged fairly; the motions are those of the points where all modes together place them.
    """
    stated = {name: component(name, modes, points, labels=labels) for name, labels in components.items()}
    parts = {name: add_coordinate_variance(part, deviation) for name, part in stated.items()}
    motions = {name: rigid_motion(part, _twists(method, part)) for name, part in parts.items()}
    doubts: list[Doubt] = []
    if deviation > 0:
        motions, doubts = _place_motions(stated, motions, method, deviation, gains=gains)
    else:
        motions = with_common_noise(parts, motions)
        correlation = column_correlation(parts, motions)
        motions = {name: with_errors(part, motions[name], correlation, gains=gains) for name, part in parts.items()}
    tests = sum(motion.twist.shape[1] for motion in motions.values())
    significance, floor = criterion.significance / tests, max(criterion.floor, 1e-3)
    bent = {name: with_bending(parts[name], motion, significance, floor=floor) for name, motion in motions.items()}
    return parts, bent, doubts


def _place_motions(stated: Mapping[str, Component], judged: Mapping[str, RigidMotion], method: MotionMethod,
                   deviation: float, *, gains: SensorGains | None) -> tuple[dict[str, RigidMotion], list[Doubt]]:
    """Return the motions of the components with their points placed; how rigid they are stays as it was judged."""
    placed = {name: place_points(part, deviation) for name, part in stated.items()}
    parts = {name: part.part for name, part in placed.items()}
    motions = with_common_noise(parts, {name: part.motion for name, part in placed.items()})
    correlation = column_correlation(parts, motions)
    result = {}
    for name, part in placed.items():
        motion, first = with_placed_errors(part, motions[name], correlation, gains=gains), judged[name]
        twist = _twists(method, part.part)
        result[name] = replace(motion, twist=motion.twist if twist is None else twist, bending=first.bending,
                               bending_p=first.bending_p, residual=first.residual)
    return result, [
        Doubt(f"points of {name}", f"the motions place them {1e3 * part.deviation:.3g} mm (rms a coordinate) from where they "
              f"are stated, {1e3 * deviation:.3g} mm were told: intervals take the former", "check them, whether it bends, and "
              "that the directions of the sensor have one calibration", figure=part.deviation / deviation)
        for name, part in placed.items() if part.deviation > deviation]


def add_coordinate_variance(part: Component, deviation: float) -> Component:
    """Return the component with the variance that wrong coordinates bring added to that of the shapes."""
    if deviation == 0:
        return part
    motion = rigid_motion(part)
    added = coordinate_variance(part, motion.twist, deviation)
    if part.variance is not None:
        return replace(part, variance=part.variance + added)
    # Noise of unknown size: what the rigid motion leaves, less the coordinates' mean share, at least a hundredth of it.
    noise = motion.variance.mean(axis=0)
    # What errors of place add is in the scatter already; a hundredth of the noise stays, so that no line gets infinite
    # weight.
    return replace(part, variance=np.maximum(noise - added.mean(axis=0), 0.01 * noise) + added)


def _twists(method: MotionMethod, part: Component) -> FloatArray | None:
    """Return the twists of a method; None for the default, which the motion computes itself."""
    return None if isinstance(method, SmallMotion) else method.twists(part)
