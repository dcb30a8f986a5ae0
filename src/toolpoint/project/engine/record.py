"""Record of a step: the parts of its key, its outputs with their digests, its doubts; written last, by renaming."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from toolpoint._check import ToolpointError
from toolpoint._doubt import UNKNOWN, Doubt
from toolpoint.project.engine.content import text_digest
from toolpoint.project.engine.drafts import write_whole

# Raised when the layout changes: records of other versions are not read, and their steps run again.
RECORD_VERSION = 1
DONE, FAILED, IN_MOTION = "done", "failed", "moving"


@dataclass(frozen=True)
class TracedDoubt:
    """Doubt, and the step in which it arose and can be mended."""

    doubt: Doubt
    step: str

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        figure = None if self.doubt.figure != self.doubt.figure else self.doubt.figure
        return {"step": self.step, "what": self.doubt.what, "why": self.doubt.why, "remedy": self.doubt.remedy,
                "figure": figure, "grave": self.doubt.grave}

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> TracedDoubt:
        """Return the doubt of plain data."""
        figure = UNKNOWN if data["figure"] is None else float(data["figure"])
        return cls(Doubt(data["what"], data["why"], data["remedy"], figure=figure, grave=bool(data["grave"])), data["step"])


@dataclass(frozen=True)
class KeyParts:
    """All that a step's results depend on: version of its computation, digests of its inputs, options, doubts inherited."""

    version: int
    inputs: Mapping[str, str]
    options: Mapping[str, Any]
    inherited: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """SHA-256 of the parts; times and places on the disk are none of them."""
        return text_digest(json.dumps(self.to_dict(), sort_keys=True))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"version": self.version, "inputs": dict(self.inputs), "options": dict(self.options),
                "inherited": list(self.inherited)}


@dataclass(frozen=True)
class StepRecord:
    """Record of a step's last run.

    status : done, failed (for the reason in `words`), or moving (its outputs were being put in place when the process ended);
    outputs : file of its folder to digest; earlier : digests that the folder may still hold while moving; doubts : with those
    of all that it rests on; seconds, versions : how long it took, and with what it was computed.
    """

    step: str
    status: str
    parts: KeyParts
    outputs: Mapping[str, str] = field(default_factory=dict)
    words: str = ""
    doubts: tuple[TracedDoubt, ...] = ()
    seconds: float = 0.0
    started: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)
    earlier: Mapping[str, str] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"record": RECORD_VERSION, "step": self.step, "status": self.status, "key": self.parts.key,
                "parts": self.parts.to_dict(), "outputs": dict(self.outputs), "words": self.words,
                "doubts": [doubt.to_dict() for doubt in self.doubts], "seconds": self.seconds, "started": self.started,
                "versions": dict(self.versions), "earlier": dict(self.earlier)}


class RecordStore:
    """The records of a project, one JSON file a step."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def read(self, step: str) -> StepRecord | None:
        """Return the record of a step, None where there is none, or none that can be read.

        Raises ToolpointError for a record of a newer version of toolpoint: an older one must not write over it.
        """
        try:
            data = json.loads(self._file(step).read_text(encoding="utf-8"))
            if data["record"] > RECORD_VERSION:
                raise ToolpointError(f"{self._file(step)}: written by a newer toolpoint (records {data['record']}, this one "
                                     f"reads {RECORD_VERSION}); nothing was changed; use that toolpoint, or a copy of the "
                                     "folder without .toolpoint and results")
            parts = data["parts"]
            return StepRecord(step, data["status"], KeyParts(parts["version"], parts["inputs"], parts["options"],
                                                             tuple(parts["inherited"])),
                              data["outputs"], data["words"], tuple(map(TracedDoubt.of, data["doubts"])), data["seconds"],
                              data["started"], data["versions"], data["earlier"])
        except ToolpointError:
            raise
        # A record that is damaged is none: its step runs again.
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            return None

    def write(self, record: StepRecord) -> None:
        """Write a record by a draft."""
        write_whole(self._file(record.step), json.dumps(record.to_dict(), indent=1))

    def _file(self, step: str) -> Path:
        return self.folder / (re.sub(r"[^\w-]", "_", step) + f"-{text_digest(step)[:8]}.json")
