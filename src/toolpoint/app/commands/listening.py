"""Command about cuts that are cut_record: listen."""

from __future__ import annotations

from typing import Annotated

from toolpoint import io, pages, studies
from toolpoint.app.declare import Argument, Help, command
from toolpoint.app.frame import Frame
from toolpoint.app.values import SourceFile


@command()
def listen(run: Frame, record: Annotated[SourceFile, Argument()], *,
           teeth: Annotated[int, Help("Number of teeth.", minimum=1)],
           speed: Annotated[float | None, Help("Programmed spindle speed, rev/min, within 2 %; searched where left out.",
                                               above=0)] = None,
           highest: Annotated[float | None, Help("Highest spindle speed, rev/min, for speeds to try.", above=0)] = None,
           lowest: Annotated[float, Help("Lowest spindle speed, rev/min.", minimum=0)] = 0.0,
           channel: Annotated[int | None, Help("Channel to judge, from 1; the strongest where left out.", minimum=1)] = None,
           modes: Annotated[SourceFile | None, Help("Modes of the tool point (of identify): they name the line among its side "
                                                    "bands.")] = None) -> None:
    """Chatter or not, from the sound or vibration of a cut.

    RECORD is a sound file (WAV, FLAC, MP3, Ogg), a video with sound, or a record of vibration (any format of `toolpoint frf`).
    """
    cut_record = io.read_listened(record)
    tool_modes = None if modes is None else io.read_modes(modes)
    spindle = studies.SpindleRange(highest, lowest)
    result = studies.listen(cut_record, teeth, speed, channel=channel, modes=tool_modes, spindle=spindle)
    run.present(pages.listening_page, result, run.warnings, notes=[*result.doubts, *result.notes], name=cut_record.name)
