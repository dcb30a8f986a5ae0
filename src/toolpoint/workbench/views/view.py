"""View: what a page of the workbench shows, with answer and doubts, and the command and the Python call that give the same."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from toolpoint._doubt import Doubt
from toolpoint.plot.page.markup import typeset
from toolpoint.project.steps.plain_files import plain


@dataclass(frozen=True)
class WorkbenchView:
    """Content of a view.

    name : of the view; answer : in a sentence; doubts : what must be known before it is believed; commands, calls : lines of a
    shell and of Python that give the same, from the project's folder; data : numbers in SI, by the view; is_stale : whether
    files have changed since the numbers were computed.
    """

    name: str
    answer: str
    doubts: tuple[Doubt, ...] = ()
    commands: tuple[str, ...] = ()
    calls: tuple[str, ...] = ()
    data: Mapping[str, Any] = field(default_factory=dict)
    is_stale: bool = False

    def to_dict(self) -> dict[str, Any]:
        """Return plain data; numbers that JSON lacks become null."""
        doubts = [{"text": typeset(doubt), "what": doubt.what, "why": doubt.why, "remedy": doubt.remedy, "grave": doubt.grave}
                  for doubt in dict.fromkeys(self.doubts)]
        return {"name": self.name, "answer": typeset(self.answer), "doubts": doubts, "commands": list(self.commands),
                "calls": list(self.calls), "is_stale": self.is_stale, "data": plain(dict(self.data))}


def command_line(*words: object) -> str:
    """Return a command of toolpoint as a shell takes it."""
    return shlex.join(["toolpoint", *map(str, words)])


def pose_words_of(pose: Mapping[str, float]) -> str:
    """Return a pose as the option `--pose` takes it, empty for none."""
    return ",".join(f"{axis}={position!r}" for axis, position in pose.items())
