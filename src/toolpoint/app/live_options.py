"""Options of commands that listen to a device while it records, and what they print."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Any

from toolpoint import io, studies
from toolpoint._check import ToolpointError
from toolpoint.app import console
from toolpoint.app.declare import Help
from toolpoint.app.values import KeptFolder


@dataclass(frozen=True)
class LiveBlows:
    """Options of `tap` for blows that are recorded now."""

    live: Annotated[bool, Help("Record blows from a device instead of reading files.")] = False
    device: Annotated[str, Help("Live: sound, sound:NAME, ni:Dev1, folder:PATH or play:FILE; toolpoint devices lists what is "
                                "there.", metavar="DEVICE", needs="--live")] = "sound"
    folder: Annotated[KeptFolder | None, Help("Live: keep every blow here, and go on with those that are there.",
                                              needs="--live")] = None
    rate: Annotated[float | None, Help("Live: samples per second, Hz; the device's own where left out.", above=0,
                                       needs="--live")] = None
    blows: Annotated[int, Help("Live: good blows that are asked for.", minimum=1, needs="--live")] = 5
    block: Annotated[float, Help("Live: length of the record of a blow, s: until the ring-down has ended.", above=0,
                                 needs="--live")] = 1.0
    trigger: Annotated[float | None, Help("Live: force that opens a blow, N; twelve times the noise where left out.", above=0,
                                          needs="--live")] = None
    limit: Annotated[float | None, Help("Live: range of the inputs of an NI board, V; 10 where left out.", above=0,
                                        name="--range", needs="--live")] = None
    patience: Annotated[float | None, Help("Live: end after this time without a blow, s.", above=0, needs="--live")] = None

    def open(self, channel: tuple[str, ...]) -> Any:
        """Return the input with its described channels."""
        if self.folder is None:
            raise ToolpointError("--folder: every blow is kept on disk before it is judged; name a folder for them")
        return io.open_input(self.device, channel, self.rate, limit=self.limit, wait=console.remark)

    def follow(self, live: Any, show: Any) -> Any:
        """Record blows until enough are good; `show` receives the study after each. Return the folder of the blows, the test,
        and what is wrong with the device, if it went away."""
        assert self.folder is not None
        whole_records = self.device.startswith("folder:")
        block = None if whole_records else self.block
        folder = io.BlowFolder(self.folder, live, block)
        tap = studies.LiveTap(live.inputs, live.device.rate, duration=block, goal=self.blows, kept=folder.kept,
                              decisions=folder.decisions)
        fault = None
        try:
            for event in studies.follow_blows(live.device, tap, folder, trigger=self.trigger, patience=self.patience):
                print_event(event)
                if isinstance(event, studies.LiveProgress) and event.study is not None:
                    show(event.study)
        except ToolpointError as error:
            fault = error
        return folder, tap, fault


def print_event(event: Any) -> None:
    """Print what happens in a live test; a bell once for a good blow, twice for a refused one."""
    if isinstance(event, str):
        console.remark(event)
    elif isinstance(event, studies.BlowVerdict):
        console.ring(1 if event.accepted else 2)
        console.remark(event.words)
    else:
        print_lines(event.lines())


def print_lines(lines: Iterable[str]) -> None:
    """Print lines of what goes on beside the result."""
    for line in lines:
        console.remark("  " + line)

