"""WorkCourse: the response of the work at every place of a program that cuts, and the stages that it is of."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint._doubt import Doubt
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.machining.mesh_share import MeshError
from toolpoint.studies.machining.thin_walls.part_stages import StageCourse
from toolpoint.studies.machining.thin_walls.wall_contacts import ThicknessAtCuts

STAGE_HEADER = ("stage", "from line", "modes Hz", "change", "thinnest wall mm", "elements across", "compliance µm/N")


@dataclass(frozen=True, eq=False)
class WorkCourse:
    """Responses of the work along a program.

    group : (m,) of each place that cuts, as `PlaceArcs`; dynamics : of each group; rows : of the stages, see `STAGE_HEADER`;
    mesh_error : of the lowest frequencies, relative; mode_errors : of all modes; none where no second mesh is known.
    compliance : (m,) static, along the normal of the wall or the middle of the arc, m/N, not a number where not known.
    """

    group: IndexArray
    dynamics: tuple[ToolDynamics, ...]
    compliance: FloatArray
    rows: tuple[tuple[str, ...], ...] = ()
    notes: tuple[str, ...] = ()
    doubts: tuple[Doubt, ...] = ()
    stages: StageCourse | None = None
    mesh_error: float | None = None
    mode_errors: MeshError | None = None
    walls: tuple[ThicknessAtCuts, ...] = field(default=())

    def to_dict(self) -> dict[str, Any]:
        """Return the stages as plain numbers, SI, and the largest compliance of the work at a cut."""
        compliance = self.compliance[np.isfinite(self.compliance)]
        stages = () if self.stages is None else self.stages.stages
        return {"stages": [{"piece": stage.piece, "frequencies_hz": stage.frequency.tolist(), "volume_m3": stage.state.volume}
                           for stage in stages], "responses": len(self.dynamics), "mesh_error": self.mesh_error,
                "largest_compliance_m_n": float(compliance.max()) if compliance.size else None}

    def joined(self, place: IndexArray, pose: IndexArray) -> tuple[IndexArray, IndexArray, tuple[ToolDynamics, ...]]:
        """Return poses that are distinct in the machine's and in the work's response: their number (n,) for every place of
        the removal, the machine's pose of each, and the work of each.

        place : (m,) of the removal, of every place that cuts; pose : (n,) of the machine.
        """
        pairs = np.stack([pose[place], self.group], axis=1)
        unique, number = np.unique(pairs, axis=0, return_inverse=True)
        joined = np.zeros(pose.size, np.int64)
        joined[place] = number.reshape(-1)
        return joined, unique[:, 0], tuple(self.dynamics[k] for k in unique[:, 1].tolist())
