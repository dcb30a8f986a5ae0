"""Tap test while it is struck: every blow kept on disk, judged at once, and added to the responses."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from toolpoint._check import FloatArray, ToolpointError, ToolpointWarning, count, one_of
from toolpoint._doubt import Doubt
from toolpoint.acquisition import CapturedBlow, InputChannels
from toolpoint.signals.hits import HitRules
from toolpoint.signals.record_set import RecordSet
from toolpoint.studies.live_testing.blow_verdict import BlowVerdict, JudgedBlow, judge_blow
from toolpoint.studies.live_testing.response_lines import draw_response
from toolpoint.studies.measured.hammer_study import HammerStudy, study_hammer_records


@dataclass(frozen=True, eq=False)
class LiveProgress:
    """State of the test after a blow: the study of all blows so far (None before a good one), verdicts that changed since they
    were spoken, good blows that are still asked for, and doubts about the acquisition.

    >>> LiveProgress(None, ("x#1 is refused now: double hit",), 5).lines()
    ['x#1 is refused now: double hit']
    """

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
    decisions : mapping of the name of a blow to bool, optional
        Blows that a person accepts or refuses, against their verdicts.

    Examples
    --------
    Runs in ``examples/tap_while_you_strike.py``.
    """

    def __init__(self, inputs: InputChannels, rate: float, *, duration: float | None = None, goal: int = 5,
                 kept: Sequence[tuple[str, FloatArray]] = (), rules: HitRules | None = None,
                 decisions: Mapping[str, bool] | None = None) -> None:
        self.inputs, self.rate, self.duration = inputs, rate, duration
        self.goal, self.rules = count("goal", goal), rules or HitRules()
        self.study: HammerStudy | None = None
        self.doubts: tuple[Doubt, ...] = ()
        self._blows, self._decisions = list[JudgedBlow](), dict(decisions or {})
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
        """Number of accepted blows, by their verdicts or by hand."""
        return sum(self._decisions.get(blow.record.name, blow.hit is not None and blow.hit.accepted) for blow in self._blows)

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

    def decide(self, name: str, accept: bool | None) -> None:
        """Accept or refuse a blow by hand, None takes that back; `update` then gives the responses without or with it."""
        one_of("blow", name, [blow.record.name for blow in self._blows])
        self._decisions.pop(name, None)
        if accept is not None:
            self._decisions[name] = accept

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
                self.study = study_hammer_records(records, duration=self.duration, rules=self.rules,
                                                  decisions=self._counted_decisions())
        except ToolpointError:  # no good blow yet: each has heard its reasons
            self.study = None
            return LiveProgress(None, (), self.remaining, self.doubts)
        verdicts = {verdict.name: verdict.hit for verdict in self.study.verdicts}
        for place, blow in enumerate(self._blows):
            hit = verdicts.get(blow.record.name)
            if blow.hit is None or hit is None or hit.accepted == blow.hit.accepted or blow.record.name in self._decisions:
                continue
            words = "now good" if hit.accepted else "now refused: " + "; ".join(hit.reasons)
            changes.append(f"{blow.record.name}: {words}")
            self._blows[place] = replace(blow, hit=replace(blow.hit, reasons=hit.reasons))
        return LiveProgress(self.study, tuple(changes), self.remaining, self.doubts)

    def _counted_decisions(self) -> dict[str, bool]:
        """Return the decisions about blows of the test: one that was withdrawn since is no more asked for."""
        return {name: accept for name, accept in self._decisions.items() if self.is_counted(name)}
