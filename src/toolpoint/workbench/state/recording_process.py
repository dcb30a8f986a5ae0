"""Process of a recording: blows of a device or a watched folder, its events as lines of JSON; it ends with its server."""

from __future__ import annotations

import json
import os
import queue
import sys
import threading
from dataclasses import dataclass, field
from typing import Any

from toolpoint import io, studies
from toolpoint._check import ToolpointError
from toolpoint._threads import hold_process
from toolpoint.project.steps.plain_files import plain
from toolpoint.workbench.state.blow_responses import drawn_responses


@dataclass
class Requests:
    """Requests of the server, read from the standard input: decisions about blows, and the end."""

    decisions: queue.SimpleQueue[tuple[str, bool | None]] = field(default_factory=queue.SimpleQueue)
    ended: threading.Event = field(default_factory=threading.Event)
    is_following: bool = False

    def take(self) -> dict[str, bool | None]:
        """Return the decisions since the last call."""
        decided: dict[str, bool | None] = {}
        while not self.decisions.empty():
            name, accept = self.decisions.get()
            decided[name] = accept
        return decided

    def read(self) -> None:
        """Read until the input closes, as that of a killed server does; in a thread of its own."""
        for line in sys.stdin:
            request = json.loads(line)
            if request.get("end"):
                break
            self.decisions.put((request["blow"], request["accept"]))
        self.ended.set()
        if not self.is_following:  # a device that waits for its first record hears nothing
            os._exit(0)


def run_recording(settings: dict[str, Any], requests: Requests) -> None:
    """Record blows as `toolpoint tap --live` does; a line for what happens, for every blow, and for the responses after it."""
    say(event="words", words="opening " + settings["device"])
    try:
        live = io.open_input(settings["device"], settings["channels"], settings["rate"],
                             wait=lambda words: say(event="waiting", words=words))
        block = None if settings["device"].startswith("folder:") else settings["block"]
        store = io.BlowFolder(settings["folder"], live, block)
        tap = studies.LiveTap(live.inputs, live.device.rate, duration=block, goal=settings["blows"], kept=store.kept,
                              decisions=store.decisions)
        requests.is_following = True
        say(event="begin", rate=live.device.rate, kept=[name for name, _ in store.kept], doubts=list(live.device.doubts))
        if tap.study is not None:
            say(event="responses", **drawn_responses(tap.study), remaining=tap.remaining)
        for event in studies.follow_blows(live.device, tap, store, trigger=settings["trigger"], decisions=requests.take,
                                          is_ended=requests.ended.is_set):
            _tell(event, tap)
        say(event="end", failed=False, words="")
    except ToolpointError as error:
        say(event="end", failed=True, words=str(error))
    except OSError as error:
        say(event="end", failed=True, words=f"{error}; check the folder and the disk")


def _tell(event: Any, tap: studies.LiveTap) -> None:
    """Say an event of the test."""
    if isinstance(event, str):
        say(event="words", words=event)
    elif isinstance(event, studies.BlowVerdict):
        say(event="blow", name=event.name, struck=str(event.struck), force_n=event.force, accepted=event.accepted,
            reasons=list(event.reasons), remarks=list(event.remarks), words=event.words, is_counted=tap.is_counted(event.name))
    else:
        for line in event.changes:
            say(event="words", words=line)
        drawn = None if event.study is None else drawn_responses(event.study)
        say(event="responses", **(drawn or {"study": None}), remaining=event.remaining)


def say(**data: Any) -> None:
    """Write one event as a line of JSON, at once; numbers that JSON lacks become null."""
    print(json.dumps(plain(data)), flush=True)


if __name__ == "__main__":
    hold_process()
    requests_of_server = Requests()
    threading.Thread(target=requests_of_server.read, daemon=True).start()
    run_recording(json.loads(sys.argv[1]), requests_of_server)
