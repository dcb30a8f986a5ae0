"""Outcomes of tried cuts from their recordings, to sharpen a probability chart."""

from __future__ import annotations

from collections.abc import Sequence

from toolpoint._check import fail
from toolpoint._doubt import Doubt
from toolpoint.studies.listening.listen import listen
from toolpoint.vibration import Record


def hear_tried(cuts: Sequence[tuple[float, float, Record]], teeth: int | None
               ) -> tuple[list[tuple[float, float, bool]], list[str]]:
    """Return the cuts (rev/min, m, stable) that their recordings decide, and a remark on each.

    Parameters
    ----------
    cuts : sequence of (rev/min, m, Record)
    teeth : int

    A recording that cannot tell is left out, with a doubt that says why. The speed of the cut is that of the sound's comb.

    Raises
    ------
    ToolpointError
        Where the number of teeth is not given, and as `listen` does.

    Examples
    --------
    >>> hear_tried([], 4)
    ([], [])
    """
    if teeth is None:
        fail("`tried`", "a recording without the number of teeth", "must be given with it", remedy="add `teeth`")
    judged, remarks = list[tuple[float, float, bool]](), list[str]()
    for speed, depth, record in cuts:
        result = listen(record, teeth, speed)
        name = record.name or "a recording"
        if result.chatters is None:
            remarks.append(Doubt(f"tried cut {name}", f"left out, its sound cannot tell: {result.reason}",
                                 "say stable or chatter by hand"))
            continue
        judged.append((result.evidence.speed.speed, depth, not result.chatters))
        remarks.append(f"tried cut {name}: {result.answer()}")
        remarks += [doubt.within(f"tried cut {name}") for doubt in result.doubts]
    return judged, remarks
