"""JudgedPlaces: places of a program with their groups and margins, judged again at other speeds, sorted by what is in hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from toolpoint.material_removal import RemovedMaterial
from toolpoint.studies.machining.engagement_classes import EngagementClasses, PlaceArcs, group_places
from toolpoint.studies.machining.margins import PlaceMargins, limit_over_depth, place_margins
from toolpoint.studies.machining.program_path import ProgramPath
from toolpoint.studies.machining.solver import StabilitySolver


@dataclass(frozen=True, eq=False)
class JudgedPlaces:
    """Places of a program with their groups and margins, and the solver that judged them."""

    laid: ProgramPath
    removed: RemovedMaterial
    arcs: PlaceArcs
    groups: EngagementClasses
    margins: PlaceMargins
    solver: StabilitySolver

    @property
    def block(self) -> np.ndarray:
        """Block of every place that cuts."""
        return np.asarray(self.laid.moves.block[self.removed.piece[self.arcs.place]])

    @property
    def pose(self) -> np.ndarray:
        """Index of the pose of every place of the removal."""
        pose = np.zeros(self.removed.piece.size, int)
        pose[self.arcs.place] = self.groups.pose[self.groups.group]
        return pose

    def nearest(self, count: int) -> np.ndarray:
        """Return at most `count` places, the nearest to its limit (or beyond it) first: of each line of the program, and of
        each distinct engagement, the worst one.

        Those without a limit within the searched depths come last, the longest edge in cut first.
        """
        ratio = np.nan_to_num(limit_over_depth(self.margins, self.arcs), nan=np.inf, posinf=np.inf)
        order = np.lexsort((-self.arcs.depth * (self.arcs.exit - self.arcs.entry), ratio))
        for key in (self.laid.path.line[self.block], self.groups.group):
            order = order[np.sort(np.unique(key[order], return_index=True)[1])]
        return np.asarray(order[:count])

    def at_speeds(self, factors: Mapping[int, float]) -> JudgedPlaces:
        """Return the places judged anew with the speeds of tools times factors, by the tool's number."""
        speed = self.laid.speed.copy()
        for number, factor in factors.items():
            speed[self.laid.tool == number] *= factor
        laid, pose = replace(self.laid, speed=speed), self.pose
        groups = group_places(self.arcs, laid, self.removed.piece, pose=pose, isotropic=self.solver.is_isotropic)
        margins = place_margins(self.arcs, groups, laid, piece=self.removed.piece, solver=self.solver, pose=pose)
        return replace(self, laid=laid, groups=groups, margins=margins)
