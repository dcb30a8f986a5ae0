"""Stick-out of a project's coupled tool in the view of lobes: its slider, or why there is none, and the command."""

from __future__ import annotations

from typing import Any

from toolpoint._check import ToolpointError
from toolpoint.project import Project
from toolpoint.project.limits.coupled_tool import coupling_words, stick_out_range
from toolpoint.workbench.state.desk import Desk


def stick_out_words(desk: Desk, project: Project, stick_out: float) -> list[str]:
    """Return the words of the command that couples the project's tool at a stick-out, m."""
    plan = project.description.coupling
    assert plan is not None
    file = project.machine_file.relative_to(desk.folder).as_posix() if plan.point is not None else ""
    return coupling_words(plan, file, stick_out, segment=stick_out_range(plan, desk.folder)[0])


def stick_out_slider(project: Project) -> dict[str, Any]:
    """Return the slider of the stick-out: its segment, length and ends (m), or why there is none."""
    plan = project.description.coupling
    if plan is None:
        return {"reason": "The stick-out cannot be changed: the tool is not described. A shaft file of it and a gauge that was "
                          "struck in the spindle, or a point of the machine where it begins (coupling: in project.yaml), do."}
    try:
        segment, length, lower, upper = stick_out_range(plan, project.folder)
    except ToolpointError as error:
        return {"reason": f"The stick-out cannot be changed: {error}"}
    return {"segment": segment, "value": length, "lower": lower, "upper": upper}
