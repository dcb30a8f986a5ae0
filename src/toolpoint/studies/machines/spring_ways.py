r"""Ways of a point per spring: how far it gives way to a force, exact for trees of springs in single directions.

With minimal coordinates of a tree the stiffness is diagonal, and a point's motion per spring's stretch is its row of the
output map L: :math:`u = L K^{-1} L^T F = \sum_j l_j (l_j^T F) / k_j`. Other stiffnesses need no other machine.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._notebook import NotebookText
from toolpoint.machine import Machine, assemble
from toolpoint.studies.machines.tool_point import batch_of
from toolpoint.vibration import Dof

_MAX_COUPLING = 1e-9  # of the stiffness between two coordinates, relative to their own: above, springs are not single


@dataclass(frozen=True, eq=False)
class SpringWays(NotebookText):
    """Springs of a machine and the ways of a point at poses.

    way : (n_poses, 6, n_springs), motion x, y, z (m) and turns (rad) of the point per unit of each coordinate; stiffness :
    (n_springs,), N/m or N m/rad; names : of the coordinates, such as ``joint_q1.rz``.
    """

    way: FloatArray
    stiffness: FloatArray
    names: tuple[str, ...]

    def shifted(self, offset: Sequence[float]) -> SpringWays:
        """Return the ways of a point of the same body that lies `offset` (m, machine axes, the same at every pose) away."""
        moved = self.way[:, :3] + np.cross(self.way[:, 3:], np.asarray(offset, float)[None, :, None], axis=1)
        return SpringWays(np.concatenate([moved, self.way[:, 3:]], axis=1), self.stiffness, self.names)

    def factors(self, by_start: Mapping[str, float]) -> FloatArray:
        """Return a factor for every spring: that of the start of its name, 1 where none fits."""
        result = np.ones(len(self.names))
        for start, factor in by_start.items():
            chosen = np.char.startswith(np.array(self.names), start)
            if not chosen.any():
                fail("by_start", repr(start), f"must begin one of {', '.join(self.names[:6])} ...")
            result[chosen] *= factor
        return result

    def moved(self, force: FloatArray, stiffness: FloatArray | None = None) -> FloatArray:
        """Return the motion (m) and turns (rad) of the point under forces (n_poses, 3) in N, (n_poses, 6)."""
        springs = self.stiffness if stiffness is None else stiffness
        stretch = np.einsum("pk,pkc->pc", np.asarray(force, float), self.way[:, :3]) / springs
        return np.asarray(np.einsum("pic,pc->pi", self.way, stretch))

    def __repr__(self) -> str:
        return f"SpringWays({len(self.names)} springs, {len(self.way)} poses)"


def spring_ways(machine: Machine, poses: Sequence[Mapping[str, float]], point: str) -> SpringWays:
    """Return the springs of a machine and the ways of a point at poses.

    Raises ToolpointError where springs are coupled: loops, full stiffness matrices, preload.

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import (
    ...     BodyDescription, InertiaDescription, JointDescription, MachineDescription, PointDescription)
    >>> machine = build(MachineDescription(
    ...     "slide", {"table": BodyDescription(2.0, inertia=InertiaDescription(1.0, 1.0, 1.0))},
    ...     {"guide": JointDescription("ground", "table", stiffness={"x": 5e6})},
    ...     points={"top": PointDescription("table", (0.0, 0.0, 0.1))}))
    >>> springs = spring_ways(machine, [{}], "top")
    >>> (1e6 * springs.moved([[10.0, 0.0, 0.0]])[0, :3]).round(6).tolist()  # 10 N over 5 N/um
    [2.0, 0.0, 0.0]
    """
    labels = [Dof.parse(f"{point}:{way}") for way in ("+x", "+y", "+z", "+rx", "+ry", "+rz")]
    system = assemble(machine, batch_of(machine, poses), labels, modal_damping=False)
    matrix = system.stiffness if system.stiffness.ndim == 2 else system.stiffness[0]
    stiffness = np.diagonal(matrix)
    if np.abs(matrix - np.diag(stiffness)).max() > _MAX_COUPLING * float(stiffness.max()):
        fail("machine", machine.name, "must be a tree of springs in single directions: some of its coordinates are coupled",
             remedy="take the static response of `tool_point` instead")
    way = np.array(np.broadcast_to(system.output_map, (len(poses), 6, len(stiffness))))
    return SpringWays(way, np.array(stiffness), machine.coordinates)
