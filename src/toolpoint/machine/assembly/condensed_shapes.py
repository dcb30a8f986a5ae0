"""Shapes of condensed bodies: their part in modes and static deflections of a machine at poses, ordered by energy."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh, solve_triangular

from toolpoint._check import FloatArray
from toolpoint.bodies import Body
from toolpoint.machine.assembly.shapes import RIGID_FREQUENCY_FRACTION, body_shapes
from toolpoint.machine.assembly.system import equations, motion_map
from toolpoint.machine.parts.model import Machine
from toolpoint.machine.pose.placement import place_machine
from toolpoint.vibration import Dof

_FOLLOWED_MODE_RATIO = 1.5  # modes that are taken apart, over those in the band: the last ones are answered by those above
_MIN_STIFFNESS_SHARE = 1e-10  # of a motion, all diagonals one: below, it is free
_MIN_SHAPE_RATIO = 1e-9  # of the largest: smaller combinations are rounding


def take_snapshots(machine: Machine, bodies: Iterable[str], poses: list[dict[str, float]], *, band: float
                   ) -> dict[str, FloatArray]:
    """Return the amplitudes (r, k) of bodies in modes at poses, and in static deflections under forces on points.

    band : Hz; half as many modes more are followed. All store half a joule in the machine.
    """
    parts: dict[str, list[FloatArray]] = {name: [] for name in bodies}
    for pose in poses:
        shapes = body_shapes(machine, pose)
        number = int(np.ceil(_FOLLOWED_MODE_RATIO * (shapes.frequency <= band).sum())) + 1
        moving = np.flatnonzero(shapes.frequency > RIGID_FREQUENCY_FRACTION * shapes.frequency.max())[:number]
        deflections, _ = static_answers(machine, pose)
        for name, amplitudes in parts.items():
            # A mode of unit modal mass stores w^2/2: over w all count by the error of their own frequency.
            amplitudes.append(shapes.bending(machine.link(name))[:, moving] / (2 * np.pi * shapes.frequency[moving]))
            amplitudes.append(deflections[list(machine.modal_columns[machine.link(name)])])
    return {name: np.hstack(amplitudes) for name, amplitudes in parts.items()}


def _is_held(stiffness: FloatArray) -> bool:
    """Whether a stiffness leaves no motion free."""
    diagonal = np.diag(stiffness)
    if (diagonal <= 0).any():
        return False
    return bool(np.linalg.eigvalsh(stiffness / np.sqrt(np.outer(diagonal, diagonal)))[0] > _MIN_STIFFNESS_SHARE)


def static_answers(machine: Machine, pose: Mapping[str, float]) -> tuple[FloatArray, FloatArray]:
    """Return the deflections (n, k) under forces on all points along x, y and z, and the points' flexibilities (k,), m/N.

    Deflections are in the tree's coordinates, of forces that store half a joule each; none where the machine is free to move or
    has no points.
    """
    points = machine.description.points
    place = place_machine(machine, pose)
    _, stiffness, _, _, basis = equations(place)
    if not points or not _is_held(stiffness[0]):
        return np.zeros((machine.size, 0)), np.zeros(0)
    turn = np.eye(machine.size) if basis is None else basis[0]
    motion = motion_map(place, tuple(Dof(name, way) for name in points for way in ("+x", "+y", "+z")))[0] @ turn
    moving = motion[np.abs(motion).max(axis=1) > 0]
    answers = np.linalg.solve(stiffness[0], moving.T)
    flexibility = np.einsum("kn,nk->k", moving, answers)
    return turn @ (answers / np.sqrt(flexibility)), flexibility


@dataclass(frozen=True, eq=False)
class ShapeBasis:
    """Free modes (r, f) of a body that always stay, and further combinations (r, k) with their energies (k,), descending."""

    kept: FloatArray
    further: FloatArray
    energies: FloatArray

    @classmethod
    def of(cls, body: Body, answers: FloatArray) -> ShapeBasis:
        """Return the basis of a body from its amplitudes in modes, in the norm of its stiffness."""
        squares, vectors = eigh(body.stiffness, body.mass[6:, 6:])
        reach = 0.0 if body.residual is None else body.residual.reach
        kept = vectors[:, squares <= (2 * np.pi * reach) ** 2]
        lower = np.linalg.cholesky(body.stiffness)
        held = np.linalg.qr(lower.T @ kept)[0]
        remaining = lower.T @ answers
        remaining = remaining - held @ (held.T @ remaining)
        left, singular, _ = np.linalg.svd(remaining, full_matrices=False)
        usable = singular > _MIN_SHAPE_RATIO * singular.max(initial=0.0)
        return cls(kept, solve_triangular(lower.T, left[:, usable]), singular[usable])

    def mix(self, level: float) -> FloatArray:
        """Return the free modes and the combinations of at least an energy, (r, n)."""
        return np.hstack([self.kept, self.further[:, self.energies >= level]])
