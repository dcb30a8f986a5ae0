"""Projects: one folder from records to advice, whose steps are run again only where what they rest on has changed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolpoint._exports import export_lazily

if TYPE_CHECKING:
    from toolpoint.machine.description.project_plan import TriedCut
    from toolpoint.project.changed_machine import change_machine
    from toolpoint.project.demo import write_demo
    from toolpoint.project.engine.run import StepEvent
    from toolpoint.project.entering import add_files, add_part, enter_test, guess_kind
    from toolpoint.project.folder import Project
    from toolpoint.project.kept_states import KeptState
    from toolpoint.project.records_draft import RecordsDraft, draft_test
    from toolpoint.project.results import ProjectResults
    from toolpoint.project.state_difference import StateDifference
    from toolpoint.project.template import write_folder

__all__ = [
    "KeptState",
    "Project",
    "ProjectResults",
    "RecordsDraft",
    "StateDifference",
    "StepEvent",
    "TriedCut",
    "add_files",
    "add_part",
    "change_machine",
    "draft_test",
    "enter_test",
    "guess_kind",
    "write_demo",
    "write_folder",
]

__getattr__, __dir__ = export_lazily(__name__, {
    "toolpoint.machine.description.project_plan": ("TriedCut",),
    "changed_machine": ("change_machine",),
    "demo": ("write_demo",),
    "engine.run": ("StepEvent",),
    "entering": ("add_files", "add_part", "enter_test", "guess_kind"),
    "folder": ("Project",),
    "kept_states": ("KeptState",),
    "records_draft": ("RecordsDraft", "draft_test"),
    "results": ("ProjectResults",),
    "state_difference": ("StateDifference",),
    "template": ("write_folder",),
})
