"""Directions of the tool in the work: from the angles of a machine's rotary axes, and the angles that give a direction."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.kinematics.tool_frame import smallest_turn
from toolpoint.machine import Machine
from toolpoint.machine.pose.tool_pose import tool_pair
from toolpoint.studies.machining.setup import MachiningSetup
from toolpoint.studies.machining.tilted_poses import check_zero

ROTARY_LETTERS = "ABC"
_GRID_STEP = np.radians(15.0)  # rad, of the positions of rotary axes from which a direction is looked for
_GRID_SPAN = np.radians(360.0)  # rad, on either side of zero, of an axis without limits
_MAX_DIRECTION_STEPS = 30  # quadratic from within the grid's 15 degrees; near a pole, where the slope vanishes, each halves
_VECTOR_TOLERANCE = 1e-9  # of a unit vector
_ANGLE_DIFFERENCE = 1e-6  # rad, of the slopes of a direction
_SMALL_CHANGE = 0.6  # rad: a solution so near is taken without a look for others


@dataclass(frozen=True, eq=False)
class RotaryAxes:
    """Rotary axes A, B and C of a machine, which turn tool or work.

    Raises ToolpointError where they do not stand at zero at the program's zero, and for a machine without a tool or such axes.
    """

    machine: Machine
    setup: MachiningSetup
    indices: tuple[int, ...] = field(init=False)

    def __post_init__(self) -> None:
        check_zero(self.machine, self.setup)
        names = [axis.name for axis in self.machine.chain.axes if axis.is_rotary]
        object.__setattr__(self, "indices", tuple(k for k, letter in enumerate(ROTARY_LETTERS) if letter in names))
        if not self.indices:
            raise ToolpointError("machine: none of its axes is a rotary A, B or C; tool centre control needs one")

    @property
    def letters(self) -> str:
        """Letters of the axes that the machine has."""
        return "".join(ROTARY_LETTERS[k] for k in self.indices)

    @property
    def limits(self) -> FloatArray:
        """Travels of the axes, (axes, 2) rad."""
        axes = {axis.name: axis for axis in self.machine.chain.axes}
        return np.array([[axes[letter].lower, axes[letter].upper] for letter in self.letters])

    def frames(self, angles: FloatArray) -> FloatArray:
        """Return the tool's x, y and z in the axes of the work, columns of (n, 3, 3), at angles of A, B and C (n, 3), rad."""
        pair = tool_pair(self.machine)
        pose: dict[str, ArrayLike] = {**self.setup.zero, **{ROTARY_LETTERS[k]: angles[:, k] for k in self.indices}}
        moved = self.machine.chain.displacements(pose)
        tool, work = (np.tile(np.eye(3), (len(angles), 1, 1)) if link < 0 else moved[:, link, :3, :3]
                      for link in (pair.tool, pair.table))
        own = smallest_turn(np.einsum("nij,j->ni", tool, pair.direction))
        return np.asarray(np.einsum("nki,nkj->nij", work, own))

    def angles_for(self, direction: FloatArray, start: FloatArray) -> FloatArray:
        """Return the angles (3,) within the travels that give a direction (3,), those nearest to a start.

        Raises ToolpointError for a direction that no position gives.
        """
        close_solutions = self._solve(direction, start[None].astype(float))
        if close_solutions.size and np.abs(close_solutions[0] - start).max() < _SMALL_CHANGE:
            return np.asarray(close_solutions[0])
        grids = [np.arange(max(lower, -_GRID_SPAN), min(upper, _GRID_SPAN) + 1e-9, _GRID_STEP) for lower, upper in self.limits]
        mesh = np.stack([axis.ravel() for axis in np.meshgrid(*grids, indexing="ij")], axis=1)
        starts = np.zeros((len(mesh), 3))
        starts[:, self.indices] = mesh
        facing = self.frames(starts)[:, :, 2] @ direction
        grid_solutions = self._solve(direction, starts[facing > np.cos(2 * _GRID_STEP)])
        solutions = np.concatenate([close_solutions, grid_solutions])
        if not len(solutions):
            words = ", ".join(f"{value:.4g}" for value in direction)
            raise ToolpointError(f"machine: no position of {', '.join(self.letters)} points the tool along ({words})")
        return np.asarray(solutions[np.argmin(np.abs(solutions - start).sum(axis=1))])

    def _solve(self, direction: FloatArray, starts: FloatArray) -> FloatArray:
        """Return the solutions (m, 3) within the travels that Gauss-Newton steps from several starts (n, 3) lead to."""
        if not len(starts):
            return starts
        angles, columns = starts.copy(), list(self.indices)
        for _ in range(_MAX_DIRECTION_STEPS):
            residual = direction - self.frames(angles)[:, :, 2]
            slopes = []
            for m, k in enumerate(columns):
                shifted = angles.copy()
                way = np.where(angles[:, k] + _ANGLE_DIFFERENCE > self.limits[m, 1], -_ANGLE_DIFFERENCE, _ANGLE_DIFFERENCE)
                shifted[:, k] += way
                slopes.append((residual - direction + self.frames(shifted)[:, :, 2]) / way[:, None])
            # The least step: where an axis does not move the tool it stays.
            step = np.einsum("nij,nj->ni", np.linalg.pinv(np.stack(slopes, axis=2), rcond=1e-6), residual)
            # The chain is not asked beyond its travels.
            angles[:, columns] = np.clip(angles[:, columns] + np.clip(step, -_GRID_STEP, _GRID_STEP), *self.limits.T)
            if np.abs(step).max(initial=0.0) < _VECTOR_TOLERANCE:
                break
        error = np.linalg.norm(direction - self.frames(angles)[:, :, 2], axis=1)
        return np.asarray(angles[error < 1e3 * _VECTOR_TOLERANCE])
