"""Recordings of the workbench: one at a time, in a process of its own; every blow is on the disk before it is judged."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from toolpoint import io
from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.workbench.state.events import EventLog
from toolpoint.workbench.state.recording_settings import RecordingSettings

OPENING, WAITING, RECORDING = "opening", "waiting", "recording"
RECORDED, FAILED_RECORDING, NO_RECORDING = "ended", "failed", ""
END_PATIENCE = 5.0  # s between asking a recording to end and killing it
MAX_KEPT_WORDS = 60  # sentences of what happened


@dataclass
class RecordingState:
    """State of the last recording.

    state : ``opening``, ``waiting`` (for the first record of a watched folder), ``recording``, ``ended`` or ``failed``, empty
    before the first; blows : verdicts in the order of the blows; study : responses of all that are accepted; remaining : good
    blows that are still asked for; words : what happened, the newest last.
    """

    state: str = NO_RECORDING
    settings: RecordingSettings | None = None
    rate: float | None = None
    blows: list[dict[str, Any]] = field(default_factory=list)
    study: dict[str, Any] | None = None
    remaining: int | None = None
    doubts: list[Doubt] = field(default_factory=list)
    words: list[str] = field(default_factory=list)

    @property
    def is_running(self) -> bool:
        """Whether its process runs."""
        return self.state in (OPENING, WAITING, RECORDING)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        settings = None if self.settings is None else self.settings.to_dict()
        return {**vars(self), "is_running": self.is_running, "settings": settings}


class Recordings:
    """Recordings of one project, one at a time.

    folder : of the project; log : where events of the recording are published, ``recording`` after each change.
    """

    def __init__(self, folder: Path, log: EventLog) -> None:
        self.folder, self.log = folder, log
        self.recording = RecordingState()
        self._process: subprocess.Popen[str] | None = None
        self._lock = threading.Lock()

    def start(self, settings: RecordingSettings) -> None:
        """Start a recording; raises ToolpointError where one runs already."""
        with self._lock:
            if self._process is not None and self._process.poll() is None:
                raise ToolpointError("a recording is under way; end it before another begins")
            self.recording = RecordingState(OPENING, settings)
            self._process = subprocess.Popen(
                [sys.executable, "-m", "toolpoint.workbench.state.recording_process", json.dumps(settings.of_process())],
                cwd=self.folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
                encoding="utf-8", start_new_session=True)
            threading.Thread(target=self._follow, args=(self._process, self.recording), daemon=True).start()
        self.log.publish("recording")

    def stop(self) -> bool:
        """End the recording that runs; what was struck is kept. Return whether one ran."""
        with self._lock:
            process = self._process
            if process is None or process.poll() is not None:
                return False
            self._ask(process, {"end": True})
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(END_PATIENCE)
        process.kill()  # a device that does not answer; nothing where it has ended
        return True

    def decide(self, test_file: Path, blow: str, accept: bool | None) -> None:
        """Write a person's decision about a blow into its test file, None takes it back; a recording that runs hears of it."""
        _, description = io.read_hammer_test(test_file)
        decisions = {name: word == "accepted" for name, word in description.hits.items()}
        decisions.pop(blow, None)
        if accept is not None:
            decisions[blow] = accept
        io.write_test(description.with_decisions(decisions), test_file, replace=True)
        with self._lock:
            if self._process is not None and self._process.poll() is None:
                self._ask(self._process, {"blow": blow, "accept": accept})

    def _ask(self, process: subprocess.Popen[str], request: Mapping[str, Any]) -> None:
        assert process.stdin is not None
        with contextlib.suppress(OSError):  # it has just ended
            process.stdin.write(json.dumps(request) + "\n")
            process.stdin.flush()

    def _follow(self, process: subprocess.Popen[str], state: RecordingState) -> None:
        """Take the events of a recording into its state until it has ended."""
        assert process.stdout is not None
        for line in process.stdout:
            with contextlib.suppress(ValueError):  # a library that prints
                _note(state, json.loads(line))
                self.log.publish("recording")
        process.wait()
        if state.is_running:  # without a last word: ended while it waited for its first record, or killed
            state.state = RECORDED if process.returncode == 0 else FAILED_RECORDING
            if state.state == FAILED_RECORDING:
                state.words.append("its process was ended from outside; what was struck is kept: begin again")
            self.log.publish("recording")


def _note(state: RecordingState, event: dict[str, Any]) -> None:
    """Take one event into the state."""
    kind = event.pop("event")
    if kind in ("words", "waiting", "end") and event["words"]:
        state.words = [*state.words, event["words"]][-MAX_KEPT_WORDS:]
    if kind == "waiting":
        state.state = WAITING
    elif kind == "begin":
        state.state, state.rate, state.doubts = RECORDING, event["rate"], [Doubt.parsed(text) for text in event["doubts"]]
    elif kind == "blow":
        state.blows = [*state.blows, event]
    elif kind == "responses":
        state.study, state.remaining = event["study"], event["remaining"]
    elif kind == "end":
        state.state = FAILED_RECORDING if event["failed"] else RECORDED
