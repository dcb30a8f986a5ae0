"""Projects: one folder from records to advice, whose steps are run again only where what they rest on has changed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolpoint._exports import export_lazily

if TYPE_CHECKING:
    from toolpoint.machine.description.project_plan import TriedCut
    from toolpoint.project.changed_machine import change_machine
    from toolpoint.project.demo import write_demo
    from toolpoint.project.engine.run import StepEvent
    from toolpoint.project.entering import add_files, add_part, guess_kind
    from toolpoint.project.folder import Project
    from toolpoint.project.kept_states import KeptState
    from toolpoint.project.results import ProjectResults
    from toolpoint.project.state_difference import StateDifference
    from toolpoint.project.template import write_folder

__all__ = ["KeptState", "Project", "ProjectResults", "StateDifference", "StepEvent", "TriedCut", "add_files", "add_part",
           "change_machine", "guess_kind", "write_demo", "write_folder"]

__getattr__, __dir__ = export_lazily(__name__, {
    "toolpoint.machine.description.project_plan": ("TriedCut",),
    "changed_machine": ("change_machine",),
    "demo": ("write_demo",),
    "engine.run": ("StepEvent",),
    "entering": ("add_files", "add_part", "guess_kind"),
    "folder": ("Project",),
    "kept_states": ("KeptState",),
    "results": ("ProjectResults",),
    "state_difference": ("StateDifference",),
    "template": ("write_folder",),
})
