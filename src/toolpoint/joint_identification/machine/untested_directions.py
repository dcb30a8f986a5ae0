r"""Directions of a joint that a test neither moves nor loads: there it may be soft without any sign of it.

A joint carries the inertia of all components outward of it, the wrench :math:`R_r = \omega_r^2 \sum_c M_c t_{c,r}` in mode r.
That it is stiff along a direction q is known only where a mode loads it that way and it does not yield: with
:math:`u_r = q^T M \tau_r` of the relative twist, M the mass that it carries and :math:`q^T M q = 1`, the compliance
:math:`u_r / (q^T R_r)` is the inverse square of the frequency at which that mass would vibrate along q. Where a struck point
pushes the carried mass along q itself, a soft direction would have shown a mode. Modes that no struck point excites leave
neither, nor do all but one of several modes of one frequency under one struck point.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.joint_identification.joints.estimate import JointEstimate
from toolpoint.joint_identification.joints.kinds import unit_twists
from toolpoint.joint_identification.machine.whole_machine import WholeMachine
from toolpoint.joint_identification.motion.measured import Point
from toolpoint.joint_identification.motion.relative_motion import RelativeMotion
from toolpoint.joint_identification.motion.rigid_motion import RigidMotion
from toolpoint.spatial import transform as tf
from toolpoint.vibration import Modes

_WAYS = ("x", "y", "z", "rx", "ry", "rz")
_SURE_DEVIATIONS = 3.0  # standard deviations of a compliance, within which it is not excluded
_LOAD_ERROR_SHARE = 0.003  # of a mode's load on the joint: errors of masses and shapes turn it so far
_MOTION_ERROR_SHARE = 1e-3  # of a mode's motion: systematic errors of the relative motion beside its noise
_MIN_PUSHED_SHARE = 0.03  # of a struck point's push on the carried mass: a soft direction so far along it would show a mode
_MIN_NAMED_SHARE = 0.3  # of the carried mass's motion along a way, in the untested directions, from which it is named


@dataclass(frozen=True, eq=False)
class TestedDirections:
    """Directions in which a joint is not free, and how far a test excludes that it is soft there.

    ways : (6, p), carried mass 1 along each; squares : (p,) of frequencies, rad/s, below which the loads exclude a mode along
    them; pushed : (p,), largest share of a struck point's push; carried : (6, 6) mass; omega : of the modes, rad/s;
    has_forces : whether the struck points are known.
    """

    joint: JointEstimate
    squares: FloatArray
    ways: FloatArray
    pushed: FloatArray
    carried: FloatArray
    omega: FloatArray
    has_forces: bool

    @property
    def frequency(self) -> float:
        """Frequency, Hz, below which no further freedom of the joint brings a mode; infinite for a joint without locked ones.

        What a struck point pushes would have shown a mode within the measured band.
        """
        squares = np.where(self.pushed >= _MIN_PUSHED_SHARE, np.maximum(self.squares, self.omega.max() ** 2), self.squares)
        return float(np.sqrt(max(squares.min(initial=np.inf), 0.0)) / (2 * np.pi))

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """The doubt, if any, that the joint may be soft where the test does not load it.

        Directions count as tested where a mode of the carried mass along them, as low as the lowest one, is excluded.
        """
        is_untested = (self.squares < self.omega.min() ** 2) & (self.pushed < _MIN_PUSHED_SHARE)
        # Struck points that nobody told may have pushed any direction; fewer modes than directions load not all in any case.
        is_open = not self.has_forces and self.omega.size >= self.squares.size
        if is_open or not is_untested.any():
            return ()
        hertz = float(np.sqrt(max(self.squares[is_untested].min(), 0.0)) / (2 * np.pi))
        names = _names_of(self.joint, self.ways[:, is_untested], self.carried)
        return (Doubt("freedoms", f"nothing in this test loads the joint along {', '.join(names)}: it may be soft there too (a "
                      f"mode of it above {hertz:.3g} Hz is not excluded)", "strike a further point, in another direction",
                      figure=hertz),)


def find_tested_directions(joint: JointEstimate, machine: WholeMachine, motions: Mapping[str, RigidMotion], *,
                           relative: RelativeMotion, omega: FloatArray, forces: Mapping[str, FloatArray]
                           ) -> TestedDirections | None:
    """Return how far the test excludes that a joint is soft where it is not free; None where it is free along all directions.

    omega : (n_modes,) measured, rad/s; forces : wrenches (6, n) about the origin that struck each component, of unit force.
    """
    columns = list(machine.modes)
    model, place = machine.fit.model, machine.names.index(joint.child)
    masses = [mass.matrix for mass in model.changed_masses(machine.fit.x)]
    outward = [i for i in range(len(machine.names)) if _carries(model.parents, place, i)]
    carried = np.sum([masses[i] for i in outward], axis=0)
    locked = _complement(joint.screws, carried)
    if not locked.shape[1] or not columns:
        return None
    twists = {i: motions[machine.names[i]].twist[:, columns] for i in outward}
    load = omega[columns] ** 2 * np.sum([masses[i] @ twists[i] for i in outward], axis=0)
    squares, ways = _excluded_squares(load, relative, columns, locked=locked, carried=carried)
    pushed = _pushed_share([forces[machine.names[i]] for i in outward if machine.names[i] in forces], ways, carried)
    return TestedDirections(joint, squares, ways, pushed, carried, omega[columns], bool(forces))


def struck_wrenches(modes: Modes, points: Mapping[Point, ArrayLike], components: Mapping[str, Sequence[Point]]
                    ) -> dict[str, FloatArray]:
    """Return the wrenches (6, n) of unit forces at the struck points about the origin, by the component that is struck."""
    wrenches: dict[str, list[FloatArray]] = {}
    for dof in modes.input_dofs:
        name = next((name for name, members in components.items() if dof.point in members), None)
        if name is not None and dof.point in points:
            force, moment = dof.unit[:3], dof.unit[3:]
            moment = moment + np.cross(np.asarray(points[dof.point], float), force)
            wrenches.setdefault(name, []).append(np.concatenate([force, moment]))
    return {name: np.array(columns).T for name, columns in wrenches.items()}


def _carries(parents: tuple[int, ...], joint: int, component: int) -> bool:
    """Whether a component hangs on a joint."""
    while component >= 0 and component != joint:
        component = parents[component]
    return component == joint


def _complement(screws: FloatArray, carried: FloatArray) -> FloatArray:
    """Return directions (6, 6 - f) with unit carried mass, each orthogonal by it to the others and to the free screws."""
    lower = np.linalg.cholesky(carried)
    free = lower.T @ screws
    basis = scipy.linalg.null_space(free.T) if free.shape[1] else np.eye(6)
    return np.asarray(scipy.linalg.solve_triangular(lower.T, basis))


def _excluded_squares(load: FloatArray, relative: RelativeMotion, columns: list[int], *, locked: FloatArray, carried: FloatArray
                      ) -> tuple[FloatArray, FloatArray]:
    """Return squares (p,) of frequencies, rad/s, below which modes along locked directions are excluded, and these (6, p)."""
    projection, twists = carried @ locked, relative.twist[:, columns]
    noise = np.linalg.eigvalsh(projection.T @ relative.covariance[columns] @ projection)[:, -1]
    motion = np.einsum("ir,ij,jr->r", twists, carried, twists)
    variance = np.maximum(noise + _MOTION_ERROR_SHARE**2 * motion, 1e-300)
    loads = locked.T @ load
    vectors = np.linalg.eigh(loads / variance @ loads.T)[1]
    # A load that errors of masses and shapes may feign tests nothing.
    feigned = _LOAD_ERROR_SHARE**2 * np.einsum("ir,ir->r", load, np.linalg.solve(carried, load))
    information = (np.maximum((vectors.T @ loads) ** 2 - feigned, 0.0) / variance).sum(axis=1)
    return np.sqrt(information) / _SURE_DEVIATIONS, locked @ vectors


def _pushed_share(forces: list[FloatArray], ways: FloatArray, carried: FloatArray) -> FloatArray:
    """Return how much of a struck point's push on the carried mass goes along each direction (6, p), the most of all points."""
    share = np.zeros(ways.shape[1])
    for wrench in [column for group in forces for column in group.T]:
        share = np.maximum(share, np.abs(wrench @ ways) / np.sqrt(wrench @ np.linalg.solve(carried, wrench)))
    return share


def _names_of(joint: JointEstimate, untested: FloatArray, carried: FloatArray) -> list[str]:
    """Return the ways of the joint's frame that lie in the untested directions, the likeliest where none does so clearly."""
    ways = tf.adjoint(tf.transform(joint.frame, joint.position)) @ unit_twists(_WAYS)
    share = ((untested.T @ carried @ ways) ** 2).sum(axis=0) / np.einsum("iw,ij,jw->w", ways, carried, ways)
    names = [way for way, part in zip(_WAYS, share, strict=True) if part >= _MIN_NAMED_SHARE]
    return names or [_WAYS[int(np.argmax(share))]]
