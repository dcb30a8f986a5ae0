"""Jobs of the workbench: one run of the project at a time, in its own process; what was cut off goes on at the next start."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from toolpoint._check import ToolpointError
from toolpoint.workbench.state.events import EventLog
from toolpoint.workbench.state.kept_files import keep_file

RUNNING, ENDED, FAILED_JOB, STOPPED = "running", "ended", "failed", "stopped"
STOP_PATIENCE = 3.0  # s between asking a job to end and killing it


@dataclass
class JobState:
    """State of the last job.

    steps : asked for, all where empty; overwrite : whether hand-changed results are replaced; state : ``running``, ``ended``,
    ``failed`` or ``stopped``, empty before the first job; total : number of steps of the project; current : step that runs;
    ended : steps that have ended; words : reason of a failure; started : s since 1970; is_resumed : whether it goes on with a
    job of an earlier server.
    """

    steps: list[str] = field(default_factory=list)
    overwrite: bool = False
    state: str = ""
    total: int = 0
    current: str = ""
    ended: list[str] = field(default_factory=list)
    words: str = ""
    started: float = 0.0
    is_resumed: bool = False

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return dict(vars(self))


class Jobs:
    """Jobs of one project, one at a time.

    folder : of the project; file : where the last job is kept for `resume`; log : where events of the job are published.
    """

    def __init__(self, folder: Path, file: Path, log: EventLog) -> None:
        self.folder, self.log, self._file = folder, log, file
        self.job = JobState()
        self._process: subprocess.Popen[str] | None = None
        self._follower: threading.Thread | None = None
        self._lock = threading.Lock()
        self._is_stopping = False

    def resume(self) -> bool:
        """Start the job anew that ran when the last server was killed; return whether there was one.

        What it had finished is on the disk: the project's engine runs the remaining steps.
        """
        try:
            kept = json.loads(self._file.read_text(encoding="utf-8"))
            steps, overwrite = [str(name) for name in kept["steps"]], bool(kept["overwrite"])
            was_running = kept["state"] == RUNNING
        except (OSError, ValueError, KeyError, TypeError):
            return False
        if was_running:
            self.start(steps, overwrite=overwrite, is_resumed=True)
        return was_running

    def start(self, steps: Sequence[str] = (), *, overwrite: bool = False, is_resumed: bool = False) -> None:
        """Start a run of these steps and all that they rest on; raises ToolpointError where one runs already."""
        with self._lock:
            if self._process is not None and self._process.poll() is None:
                raise ToolpointError("a run of this project is under way; wait until it has ended, or stop it")
            if self._follower is not None:  # the end of the last job is written before the next one begins
                self._follower.join(STOP_PATIENCE)
            self._is_stopping = False
            self.job = JobState(list(steps), overwrite, RUNNING, started=time.time(), is_resumed=is_resumed)
            self._keep(RUNNING)
            settings = {"folder": str(self.folder), "steps": list(steps), "overwrite": overwrite}
            self._process = subprocess.Popen(
                [sys.executable, "-m", "toolpoint.workbench.state.job_process", json.dumps(settings)], stdin=subprocess.PIPE,
                stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, encoding="utf-8", start_new_session=True)
            self._follower = threading.Thread(target=self._follow, args=(self._process,), daemon=True)
            self._follower.start()
        self.log.publish("job", **self.job.to_dict())

    def stop(self) -> bool:
        """Stop the job that runs; finished steps are kept. Return whether one ran."""
        with self._lock:
            process = self._process
            if process is None or process.poll() is not None:
                return False
            self._is_stopping = True
            _signal(process, signal.SIGTERM)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(STOP_PATIENCE)
        if process.poll() is None:
            _signal(process, getattr(signal, "SIGKILL", signal.SIGTERM))
        return True

    def _follow(self, process: subprocess.Popen[str]) -> None:
        """Read the events of a job until it has ended, and pass them on."""
        assert process.stdout is not None
        outcome: dict[str, Any] = {}
        for line in process.stdout:
            try:
                event = json.loads(line)
            except ValueError:  # a library that prints
                continue
            if event["event"] == "end":
                outcome = event
            else:
                self._note(event)
        process.wait()
        self._end(outcome)

    def _note(self, event: dict[str, Any]) -> None:
        """Take an event of the running job into its state, and publish it."""
        if event["event"] == "begin":
            self.job.total = event["total"]
        elif event["ended"]:
            self.job.ended.append(event["step"])
            self.job.current = ""
        else:
            self.job.current = event["step"]
        self.log.publish("step", **{**event, "event": "step", "total": self.job.total, "count": len(self.job.ended)})

    def _end(self, outcome: dict[str, Any]) -> None:
        """Set, keep and publish the final state; outcome : the job's own last event, empty where it was killed."""
        if self._is_stopping:
            state = STOPPED
        elif not outcome:
            state, self.job.words = FAILED_JOB, "its process was ended from outside (out of memory?); run again"
        else:
            state, self.job.words = FAILED_JOB if outcome["failed"] else ENDED, outcome["words"]
        with contextlib.suppress(OSError):  # a full disk must not take the server's thread with it
            self._keep(state)
        self.job.current, self.job.state = "", state
        self.log.publish("job", **self.job.to_dict())

    def _keep(self, state: str) -> None:
        """Write what `resume` needs to the job's file."""
        keep_file(self._file, json.dumps({"steps": self.job.steps, "overwrite": self.job.overwrite, "state": state}))


def _signal(process: subprocess.Popen[str], number: int) -> None:
    """Send a signal to the process group of a job; where the system has no groups, terminate the job alone."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, number)
        else:
            process.terminate()
