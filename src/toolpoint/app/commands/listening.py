"""Command about cuts that are recorded, or heard now: listen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from toolpoint import io, pages, studies
from toolpoint._check import ToolpointError
from toolpoint.app import console
from toolpoint.app.declare import Argument, Help, command
from toolpoint.app.frame import Frame
from toolpoint.app.values import NewFile, SourceFile


@dataclass(frozen=True)
class LiveSound:
    """Options of `listen` for a cut that is heard now."""

    live: Annotated[bool, Help("Listen to a device instead of reading a record.")] = False
    device: Annotated[str, Help("Live: sound, sound:NAME, ni:Dev1 or play:FILE; toolpoint devices lists what is there.",
                                metavar="DEVICE", needs="--live")] = "sound"
    rate: Annotated[float | None, Help("Live: samples per second, Hz; the device's own where left out.", above=0,
                                       needs="--live")] = None
    seconds: Annotated[float | None, Help("Live: how long to listen, s; until the device ends where left out.", above=0,
                                          needs="--live")] = None
    window: Annotated[float, Help("Live: seconds that are judged together.", minimum=1, needs="--live")] = 4.0
    keep: Annotated[NewFile | None, Help("Live: keep the seconds that decide here (HDF5, CSV, NumPy).", needs="--live")] = None

    def hear(self, teeth: int, speed: float | None, **judgement: Any) -> Any:
        """Print the verdict on every window; return the one that decides, and doubts about it."""
        device = io.open_microphone(self.device, self.rate)
        windows = []
        try:
            for each in studies.follow_cut(device, teeth, speed, window=self.window, seconds=self.seconds, **judgement):
                console.remark(each.words)
                windows.append(each)
        except ToolpointError as error:
            # A device that ends is no fault once something was heard: what was judged until then stands.
            if not windows:
                raise
            console.warning(str(error))
        decisive = studies.decisive_window(windows)
        if decisive is None:
            raise ToolpointError("no cut was heard; hold the microphone nearer, or look at `device` and `rate`")
        return decisive, studies.question_windows(windows)


@command(replace=True)
def listen(run: Frame, record: Annotated[SourceFile | None, Argument()] = None, *,
           teeth: Annotated[int, Help("Number of teeth.", minimum=1)],
           speed: Annotated[float | None, Help("Programmed spindle speed, rev/min, within 2 %; searched where left out.",
                                               above=0)] = None,
           highest: Annotated[float | None, Help("Highest spindle speed, rev/min, for speeds to try.", above=0)] = None,
           lowest: Annotated[float, Help("Lowest spindle speed, rev/min.", minimum=0)] = 0.0,
           channel: Annotated[int | None, Help("Channel to judge, from 1; the strongest where left out.", minimum=1)] = None,
           modes: Annotated[SourceFile | None, Help("Modes of the tool point (of identify): they name the line among its side "
                                                    "bands.")] = None, live: LiveSound) -> None:
    """Chatter or not, from the sound or vibration of a cut.

    RECORD is a sound file (WAV, FLAC, MP3, Ogg), a video with sound, or a record of vibration (any format of `toolpoint frf`).
    With --live a device is heard: the last seconds are judged every second, and the page shows those that decide.
    """
    if (record is None) != live.live:
        raise ToolpointError("RECORD and --live: must be one of them; name a record, or listen to a device with --live")
    tool_modes = None if modes is None else io.read_modes(modes)
    cut_record = None if record is None else io.read_listened(record)
    spindle = studies.SpindleRange(highest, lowest)
    if cut_record is None:
        window, doubts = live.hear(teeth, speed, channel=channel, modes=tool_modes, spindle=spindle)
        run.file_doubts += doubts
        run.write("Record", live.keep, io.write_noun, window.record)
        result, name = window.cut, f"heard until {window.time:.1f} s"
    else:
        result = studies.listen(cut_record, teeth, speed, channel=channel, modes=tool_modes, spindle=spindle)
        name = cut_record.name
    run.answers["chatter_hz"] = result.chatter_words
    run.present(pages.listening_page, result, run.warnings, notes=[*result.doubts, *result.notes], name=name)
