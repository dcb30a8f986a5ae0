"""A cut judged while it is heard: a window of the last seconds, again and again, and the window that decides at the end."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail, positive
from toolpoint._doubt import Doubt
from toolpoint.acquisition import SampledInput
from toolpoint.studies.listening.listen import listen
from toolpoint.studies.listening.listened_cut import CHATTER, ListenedCut
from toolpoint.vibration import Dof, Record

MIN_JUDGED_WINDOWS, MAX_LONE_SHARE = 8, 0.25  # windows of a cut, and the share of them below which chatter is doubted
MIN_WINDOW_SECONDS = 1.0  # s: half a second of cut is the least that can be judged
HEARING_SECONDS = 0.2  # s that a read waits


@dataclass(frozen=True, eq=False)
class HeardWindow:
    """Verdict on the last seconds.

    time : when they ended, s from the start; cut : None where none is heard, with the reason; is_torn : whether samples were
    lost inside.

    >>> import numpy as np
    >>> from toolpoint.vibration import Dof, Record
    >>> silence = Record(np.zeros((8, 1)), 8.0, (Dof("microphone", "+x"),), ("sound",))
    >>> HeardWindow(4.0, silence, None, "no cut is heard").words
    '   4.0 s: no cut is heard'
    """

    time: float
    record: Record
    cut: ListenedCut | None
    reason: str = ""
    is_torn: bool = False

    @property
    def words(self) -> str:
        """The verdict in a line."""
        torn = " (samples were lost in these seconds)" if self.is_torn else ""
        return f"{self.time:6.1f} s: " + (self.reason if self.cut is None else self.cut.answer()) + torn


def follow_cut(device: SampledInput, teeth: int, speed: float | None = None, *, window: float = 4.0, step: float = 1.0,
               seconds: float | None = None, **judgement: Any) -> Iterator[HeardWindow]:
    """Yield the verdict on the last `window` seconds, every `step` seconds, for `seconds` or until the device ends.

    Parameters
    ----------
    device : SampledInput
        Its channels need no description: sound has no unit.
    teeth, speed
        As for `listen`.
    window, step, seconds : float
        s. A judgement that takes longer than `step` makes the next one later; no sample is lost meanwhile.
    judgement
        Further keywords of `listen`.

    Raises
    ------
    DeviceFault
        Where the device goes away.

    Examples
    --------
    Runs in ``examples/listen_while_it_cuts.py``.
    """
    if window < MIN_WINDOW_SECONDS:
        fail("window", f"{window:g} s", f"must be at least {MIN_WINDOW_SECONDS:g} s")
    positive("step", step)
    seconds_heard = _Heard(device.rate, window, len(device.names))
    device.open()
    try:
        due, judged = window, 0.0
        while seconds is None or seconds_heard.time < seconds:
            is_open = seconds_heard.take(device)
            if seconds_heard.time >= due or (not is_open and seconds_heard.time > max(judged, MIN_WINDOW_SECONDS)):
                due, judged = seconds_heard.time + step, seconds_heard.time
                yield seconds_heard.judge(teeth, speed, judgement)
            if not is_open:
                return
    finally:
        device.close()


class _Heard:
    """The last seconds of a device."""

    def __init__(self, rate: float, window: float, channels: int) -> None:
        self._rate, self._size = rate, round(window * rate)
        self._samples: FloatArray = np.zeros((0, channels))
        self._count, self._torn_at = 0, -1

    @property
    def time(self) -> float:
        """Time that was heard, s."""
        return self._count / self._rate

    def take(self, device: SampledInput) -> bool:
        """Take all samples that wait; return whether the device goes on."""
        parts, end = [self._samples], time.monotonic() + HEARING_SECONDS
        is_open = True
        while time.monotonic() < end and sum(part.shape[0] for part in parts[1:]) < self._size:
            try:
                block = device.read(HEARING_SECONDS)
            except StopIteration:
                is_open = False
                break
            if block is None:
                break
            parts.append(block.samples)
            self._count = block.stop
            if block.has_overflow or block.lost_count:
                self._torn_at = block.stop
        self._samples = np.concatenate(parts)[-self._size:]
        return is_open

    def judge(self, teeth: int, speed: float | None, judgement: dict[str, Any]) -> HeardWindow:
        """Return the verdict on the last seconds."""
        channels = self._samples.shape[1]
        record = Record(self._samples, self._rate, tuple(Dof(k + 1, "+x") for k in range(channels)), ("sound",) * channels,
                        name=f"the last {self._samples.shape[0] / self._rate:.3g} s")
        is_torn = self._torn_at >= 0 and self._torn_at > self._count - self._samples.shape[0]
        try:
            return HeardWindow(self.time, record, listen(record, teeth, speed, **judgement), is_torn=is_torn)
        except ToolpointError as error:
            return HeardWindow(self.time, record, None, f"no cut is heard ({error})", is_torn)


def question_windows(windows: list[HeardWindow]) -> list[Doubt]:
    """Return the doubt that few of many windows say chatter: the strongest of many is strong by chance alone.

    >>> question_windows([])
    []
    """
    cuts = [each.cut for each in windows if each.cut is not None]
    count = sum(cut.verdict == CHATTER for cut in cuts)
    if not count or len(cuts) < MIN_JUDGED_WINDOWS or count > MAX_LONE_SHARE * len(cuts):
        return []
    return [Doubt("chatter", f"{count} of {len(cuts)} windows say so, and the strongest is shown",
                  "listen to the same cut again, or to what was going on then", figure=count / len(cuts))]


def decisive_window(windows: list[HeardWindow]) -> HeardWindow | None:
    """Return the window with the highest probability of chatter, untorn before torn ones; None where no cut was heard.

    >>> decisive_window([]) is None  # nothing was heard
    True
    """
    cuts = [each for each in windows if each.cut is not None]
    return max(cuts, key=lambda each: (not each.is_torn, each.cut.probability if each.cut else 0.0), default=None)
