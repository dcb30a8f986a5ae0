"""Process of a job: one run of a project, its events as lines of JSON; it ends when its server has ended."""

from __future__ import annotations

import json
import os
import sys
import threading
from typing import Any

from toolpoint._check import ToolpointError
from toolpoint._threads import hold_process
from toolpoint.project import Project, StepEvent

ORPHAN_EXIT_CODE = 3  # exit code of a job whose server has ended


def run_job(folder: str, steps: list[str], *, overwrite: bool = False) -> None:
    """Run steps of the project in a folder (all where none is named), and write its events to the standard output.

    A line of JSON for each: ``begin`` with the number of all steps, ``step`` at start and end of each, ``end`` with the names
    of failed steps, or the words of the error that ended the run.
    """
    def listen(event: StepEvent) -> None:
        _say(event="step", step=event.decision.step, action=event.decision.action, reason=event.decision.reason,
             ended=event.ended, words=event.words, seconds=round(event.seconds, 2), failed=event.failed)

    try:
        project = Project.open(folder)
        _say(event="begin", total=len(project.chain.steps))
        results = project.run(steps, overwrite=overwrite, listen=listen)
        failed = [entry["step"] for entry in results.data["steps"] if entry["state"] in ("failed", "stopped")]
        _say(event="end", failed=failed, words="")
    except ToolpointError as error:
        _say(event="end", failed=["run"], words=str(error))
    except OSError as error:
        _say(event="end", failed=["run"], words=f"{error}; free disk space, and run again")


def _say(**data: Any) -> None:
    """Write one event as a line of JSON, at once."""
    print(json.dumps(data), flush=True)


def _end_with_server() -> None:
    """End this process when its standard input closes: that of a killed server closes at once."""
    sys.stdin.buffer.read()
    os._exit(ORPHAN_EXIT_CODE)


if __name__ == "__main__":
    hold_process()
    threading.Thread(target=_end_with_server, daemon=True).start()
    settings = json.loads(sys.argv[1])
    run_job(settings["folder"], settings["steps"], overwrite=settings["overwrite"])
