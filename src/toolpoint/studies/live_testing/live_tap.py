"""Tap test while it is struck: every blow kept on disk, judged at once, and added to the responses."""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from toolpoint._check import FloatArray, ToolpointError, ToolpointWarning, count
from toolpoint._doubt import Doubt
from toolpoint.acquisition import BlowCapture, CapturedBlow, InputChannels, SampledInput
from toolpoint.acquisition.device import DeviceFault
from toolpoint.signals.hits import HitRules
from toolpoint.signals.record_set import RecordSet
from toolpoint.studies.live_testing.blow_verdict import BlowVerdict, JudgedBlow, ask_for, judge_blow
from toolpoint.studies.live_testing.response_lines import draw_response
from toolpoint.studies.measured.hammer_study import HammerStudy, study_hammer_records

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


@dataclass(frozen=True, eq=False)
class LiveProgress:
    """State of the test after a blow: the study of all blows so far (None before a good one), verdicts that changed since they
    were spoken, good blows that are still asked for, and doubts about the acquisition."""

    study: HammerStudy | None
    changes: tuple[str, ...]
    remaining: int
    doubts: tuple[Doubt, ...] = ()

    def lines(self) -> list[str]:
        """Return the state in a few lines: verdicts that changed, response, coherence, band and scatter."""
        if self.study is None:
            return list(self.changes)
        return [*self.changes, *draw_response(self.study.frf, self.study.band), self.study.status]


class LiveTap:
    """A tap test that grows blow by blow.

    Parameters
    ----------
    inputs : InputChannels
    rate : float
        Hz.
    duration : float, optional
        Length of a block, s; the longest that fits where left out.
    goal : int
        Good blows that are asked for.
    kept : sequence of (name, samples)
        Blows of an earlier call, as they are kept, V.
    rules : HitRules, optional
    """

    def __init__(self, inputs: InputChannels, rate: float, *, duration: float | None = None, goal: int = 5,
                 kept: Sequence[tuple[str, FloatArray]] = (), rules: HitRules | None = None) -> None:
        self.inputs, self.rate, self.duration = inputs, rate, duration
        self.goal, self.rules = count("goal", goal), rules or HitRules()
        self.study: HammerStudy | None = None
        self.doubts: tuple[Doubt, ...] = ()
        self._blows = list[JudgedBlow]()
        for name, volts in kept:
            blow, _ = judge_blow(inputs.record(volts, rate, name), self._blows, rules=self.rules, duration=duration)
            self._blows.append(blow)
        if self._blows:
            self.update()

    @property
    def struck(self) -> str:
        """Struck point and direction."""
        return str(self.inputs.channels[self.inputs.force_at].dof)

    @property
    def records(self) -> RecordSet | None:
        """All blows that count, as they are read from their files; None before the first."""
        records = [blow.record for blow in self._blows]
        return RecordSet(tuple(records), tuple(record.name for record in records)) if records else None

    @property
    def good(self) -> int:
        """Number of accepted blows."""
        return sum(blow.hit is not None and blow.hit.accepted for blow in self._blows)

    @property
    def remaining(self) -> int:
        """Good blows that are still asked for."""
        return max(self.goal - self.good, 0)

    def judge(self, blow: CapturedBlow, name: str) -> BlowVerdict:
        """Judge a blow; it is added to the test unless something that its samples do not show speaks against it."""
        record = self.inputs.record(blow.volts, self.rate, name)
        judged, verdict = judge_blow(record, self._blows, rules=self.rules, duration=self.duration, set_aside=blow.set_aside)
        turned = any(reason.startswith("direction") for reason in verdict.reasons)
        if not blow.set_aside and not turned and judged.hit is not None:
            self._blows.append(judged)
        return replace(verdict, remaining=self.remaining)

    def is_counted(self, name: str) -> bool:
        """Whether a blow is one of the test's."""
        return any(blow.record.name == name for blow in self._blows)

    def withdraw(self, name: str) -> None:
        """Take a blow out of the test."""
        self._blows = [blow for blow in self._blows if blow.record.name != name]

    def update(self) -> LiveProgress:
        """Study all blows together; verdicts may change, as blows are compared with each other."""
        records, changes = self.records, list[str]()
        if records is None:
            self.study = None
            return LiveProgress(None, (), self.remaining, self.doubts)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ToolpointWarning)  # what they say stands in the notes of the result
                self.study = study_hammer_records(records, duration=self.duration, rules=self.rules)
        except ToolpointError:  # no good blow yet: each has heard its reasons
            self.study = None
            return LiveProgress(None, (), self.remaining, self.doubts)
        verdicts = {verdict.name: verdict.hit for verdict in self.study.verdicts}
        for place, blow in enumerate(self._blows):
            hit = verdicts.get(blow.record.name)
            if blow.hit is None or hit is None or hit.accepted == blow.hit.accepted:
                continue
            words = "now good" if hit.accepted else "now refused: " + "; ".join(hit.reasons)
            changes.append(f"{blow.record.name}: {words}")
            self._blows[place] = replace(blow, hit=replace(blow.hit, reasons=hit.reasons))
        return LiveProgress(self.study, tuple(changes), self.remaining, self.doubts)


def follow_blows(device: SampledInput, tap: LiveTap, store: BlowStore, *, trigger: float | None = None,
                 patience: float | None = None) -> Iterator[BlowVerdict | LiveProgress | str]:
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

    Raises
    ------
    DeviceFault
        Where the device goes away; what was kept stays, and the test holds it.
    """
    session = _Session(device, tap, store, trigger)
    device.open()
    try:
        yield from session.run(patience)
    finally:
        device.close()


class _Session:
    """One run of a live test: blows that wait to be kept, and intervals of the stream where samples were lost."""

    def __init__(self, device: SampledInput, tap: LiveTap, store: BlowStore, trigger: float | None) -> None:
        self.device, self.tap, self.store = device, tap, store
        self.capture = BlowCapture(tap.inputs, device.rate, tap.duration or 1.0, trigger)
        self.unkept = list[tuple[str, CapturedBlow]]()
        self.delivered, self.has_clock = 0, True
        self.spans, self.losses = dict[str, tuple[int, int]](), list[tuple[int, int]]()
        tap.doubts = (*tap.doubts, *device.doubts)

    def run(self, patience: float | None) -> Iterator[BlowVerdict | LiveProgress | str]:
        """Yield what happens until the goal is reached, the device ends, or nobody strikes any more."""
        last, is_ready = time.monotonic(), False
        yield ask_for(self.tap.remaining, self.tap.inputs.channels[self.tap.inputs.force_at].dof)
        while self.tap.remaining > 0 or not self._is_checked:
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

