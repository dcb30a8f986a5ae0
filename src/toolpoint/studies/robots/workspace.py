"""Study of a machine at its described poses, with its frequencies and the stiffness of its tool over the workspace."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from toolpoint._notebook import NotebookText
from toolpoint.cutting.stability.method import StabilityMethod
from toolpoint.machine import Machine
from toolpoint.studies.machines.check.machine_words import describe_motion
from toolpoint.studies.machines.machine_report import MachineReport, study_machine
from toolpoint.studies.machines.pose_map import PoseMap, pose_map
from toolpoint.studies.machines.stiffness_map import StiffnessMap, stiffness_map


@dataclass(frozen=True, eq=False)
class WorkspaceStudy(NotebookText):
    """A machine at its described poses, its frequencies and the static stiffness of its tool over the workspace."""

    report: MachineReport
    frequencies: PoseMap
    stiffness: StiffnessMap

    def table(self) -> str:
        """Return the report, the motion of the machine in words, and the extremes over the workspace as text."""
        return "\n".join([self.report.table(), *describe_motion(self.report.machine), *self.frequencies.extremes(),
                          *self.stiffness.extremes()])

    def to_dict(self) -> dict[str, Any]:
        """Return all parts as plain data."""
        return {"report": self.report.to_dict(), "frequencies": self.frequencies.to_dict(),
                "stiffness": self.stiffness.to_dict()}


def study_workspace(machine: Machine, positions: Mapping[str, ArrayLike], *, step: Callable[[str], None] = lambda name: None,
                    method: StabilityMethod | None = None) -> WorkspaceStudy:
    """Return the report of a machine and two maps of it over positions of its axes (m or rad); see `study_machine`.

    Examples
    --------
    Runs in ``examples/map_a_machine_over_its_workspace.py``.
    """
    report = study_machine(machine, step=step, method=method)
    step("frequencies over the workspace")
    frequencies = pose_map(machine, positions)
    step("stiffness over the workspace")
    return WorkspaceStudy(report, frequencies, stiffness_map(machine, positions))
