"""Course of a live tap test: blocks of a device become blows that are kept, judged, and added to the responses."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Protocol

from toolpoint._check import ToolpointError
from toolpoint.acquisition import BlowCapture, CapturedBlow, SampledInput
from toolpoint.acquisition.device import DeviceFault
from toolpoint.studies.live_testing.blow_verdict import BlowVerdict, ask_for
from toolpoint.studies.live_testing.live_tap import LiveProgress, LiveTap

CLOCK_SECONDS = 3.5  # s behind a blow after which the clock would have found samples lost in it
READ_SECONDS_MAX = 0.5  # s that a read waits for samples


class BlowStore(Protocol):
    """Store of blows: `keep` returns the name under which a blow is safe, `set_aside` takes one out of the test."""

    def keep(self, blow: CapturedBlow) -> str:
        """Keep a blow so that nothing loses it any more; ToolpointError where it cannot be kept."""
        ...

    def set_aside(self, name: str, reason: str) -> None:
        """Take a kept blow out of those that are read again, with the reason beside it."""
        ...


def follow_blows(device: SampledInput, tap: LiveTap, store: BlowStore, *, trigger: float | None = None,
                 patience: float | None = None, decisions: Callable[[], Mapping[str, bool | None]] | None = None,
                 is_ended: Callable[[], bool] | None = None) -> Iterator[BlowVerdict | LiveProgress | str]:
    """Yield the verdict on every blow as soon as its block is full, then the state of the test; words say what else happened.

    Parameters
    ----------
    device : SampledInput
    tap : LiveTap
    store : BlowStore
        Every blow is kept there before it is judged.
    trigger : float, optional
        Force that opens a blow, N; by the noise where left out.
    patience : float, optional
        Time without a blow after which the test ends, s; none where left out.
    decisions : callable, optional
        Returns what a person decided about blows since its last call; asked between reads, about twice a second or more often.
    is_ended : callable, optional
        Whether the person has ended the test; asked as often.

    Raises
    ------
    DeviceFault
        Where the device goes away; what was kept stays, and the test holds it.

    Examples
    --------
    Runs in ``examples/tap_while_you_strike.py``.
    """
    session = _Session(device, tap, store, trigger=trigger)
    device.open()
    try:
        yield from session.run(patience, decisions or dict, is_ended or (lambda: False))
    finally:
        device.close()


class _Session:
    """One run of a live test: blows that wait to be kept, and intervals of the stream where samples were lost."""

    def __init__(self, device: SampledInput, tap: LiveTap, store: BlowStore, *, trigger: float | None) -> None:
        self.device, self.tap, self.store = device, tap, store
        self.capture = BlowCapture(tap.inputs, device.rate, tap.duration or 1.0, trigger=trigger)
        self.unkept = list[tuple[str, CapturedBlow]]()
        self.delivered, self.has_clock = 0, True
        self.spans, self.losses = dict[str, tuple[int, int]](), list[tuple[int, int]]()
        tap.doubts = (*tap.doubts, *device.doubts)

    def run(self, patience: float | None, decisions: Callable[[], Mapping[str, bool | None]], is_ended: Callable[[], bool]
            ) -> Iterator[BlowVerdict | LiveProgress | str]:
        """Yield what happens until the goal is reached, the device or the person ends, or nobody strikes any more."""
        last, is_ready = time.monotonic(), False
        yield ask_for(self.tap.remaining, self.tap.inputs.channels[self.tap.inputs.force_at].dof)
        while (self.tap.remaining > 0 or not self._is_checked) and not is_ended():
            yield from self._decide(decisions())
            try:
                block = self.device.read(READ_SECONDS_MAX)
            except StopIteration:
                yield "the device has nothing more to deliver"
                break
            except DeviceFault:
                yield from self._keep_again(True)
                raise
            except ToolpointError as error:  # one record that cannot be read; the next may
                yield str(error)
                continue
            if block is not None:
                self.delivered, self.has_clock = block.stop, not block.is_record
                if block.lost_count:
                    yield from self._tell_loss(block.lost_count, block.lost_since, block.stop)
                for blow in self.capture.feed(block):
                    last = time.monotonic()
                    yield from self._take(blow)
            if not is_ready and self.capture.trigger is not None:
                is_ready = True
                yield f"ready: a blow above {self.capture.trigger:.2g} N is taken"
            if patience is not None and time.monotonic() - last > patience and not self.capture.is_open:
                yield f"no blow for {patience:g} s: the test ends"
                break
        yield from self._keep_again(True)

    def _decide(self, decisions: Mapping[str, bool | None]) -> Iterator[LiveProgress | str]:
        """Take decisions of a person into the test."""
        for name, accept in decisions.items():
            try:
                self.tap.decide(name, accept)
            except ToolpointError as error:  # a blow that was set aside meanwhile
                yield str(error)
        if decisions:
            yield self.tap.update()

    @property
    def _is_checked(self) -> bool:
        """Whether the clock has had the time to find samples lost in the last blow."""
        ends = [stop for name, (_, stop) in self.spans.items() if self.tap.is_counted(name)]
        return not self.has_clock or not ends or self.delivered >= max(ends) + CLOCK_SECONDS * self.device.rate

    def _take(self, blow: CapturedBlow) -> Iterator[BlowVerdict | LiveProgress | str]:
        """Keep a blow, judge it, and bring the responses up to date."""
        yield from self._keep_again()
        if any(blow.start < until and blow.stop > since for since, until in self.losses):
            blow = replace(blow, is_torn=True)
        try:
            name = self.store.keep(blow)
        except (ToolpointError, OSError) as error:
            name = f"blow in memory {len(self.unkept) + 1}"
            self.unkept.append((name, blow))
            yield f"NOT KEPT on disk ({error}): it stays in memory, and is written with the next blow where there is room"
        verdict = self.tap.judge(blow, name)
        self.spans[name] = (blow.start, blow.stop)
        yield replace(verdict, delay=max(time.monotonic() - blow.arrival, 0.0))
        if not self.tap.is_counted(name) and verdict.reasons:
            yield from self._set_aside(name, "; ".join(verdict.reasons))
        yield self.tap.update()
        if self.tap.remaining == 0 and self.has_clock:
            yield "a moment: whether samples were lost in the last blow shows in the next seconds"

    def _set_aside(self, name: str, reason: str) -> Iterator[str]:
        """Take a kept blow out of those that are read again; say so where that fails, as its file would be read again."""
        if any(name == waiting for waiting, _ in self.unkept):
            return
        try:
            self.store.set_aside(name, reason)
        except (ToolpointError, OSError) as error:
            yield f"{name}: could not be set aside ({error}); leave it out with `refuse` {name} when the files are read"

    def _keep_again(self, is_end: bool = False) -> Iterator[str]:
        """Try to keep what could not be kept; at the end it is an error that it cannot."""
        waiting, self.unkept = self.unkept, []
        for name, blow in waiting:
            try:
                kept_name = self.store.keep(blow)
            except (ToolpointError, OSError) as error:
                self.unkept.append((name, blow))
                if is_end:
                    raise ToolpointError(f"{len(waiting)} of the blows are not on disk ({error}); make room and strike them "
                                         "again") from None
                continue
            yield f"{name}: kept now, as {kept_name}"
            if not self.tap.is_counted(name):
                yield from self._set_aside(kept_name, blow.set_aside or "refused when it was struck")

    def _tell_loss(self, lost_count: int, since: int, until: int) -> Iterator[BlowVerdict | LiveProgress | str]:
        """Withdraw the blows in whose time the clock has found samples lost."""
        rate = self.device.rate
        yield (f"{lost_count} samples ({1e3 * lost_count / rate:.0f} ms) were lost in the last {(until - since) / rate:.1f} s, "
               "by the clock; close other programs, or lower the rate")
        self.losses.append((since, until))
        struck = [name for name, (start, stop) in self.spans.items()
                  if start < until and stop > since and self.tap.is_counted(name)]
        for name in struck:
            self.tap.withdraw(name)
            yield from self._set_aside(name, "samples were lost about its time")
            yield f"{name}: withdrawn, as samples were lost about its time"
        if struck:
            yield self.tap.update()

