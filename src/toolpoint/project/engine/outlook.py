"""Outlook on a project: which steps a run would run, and why, without running any."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from toolpoint.project.engine.content import ContentCache
from toolpoint.project.engine.decision import KEEP, REPEAT, RUN, SKIP, STOP, decide
from toolpoint.project.engine.plan import StepPlan
from toolpoint.project.engine.record import FAILED, KeyParts, RecordStore, StepRecord, TracedDoubt
from toolpoint.project.engine.step import ProjectStep, normalise_options

FRESH, STALE, NEVER_RUN, BY_HAND, FAILED_STATE, HALTED = "fresh", "stale", "never run", "by hand", "failed", "stopped"
_STATE_OF_ACTION = {SKIP: FRESH, RUN: STALE, KEEP: BY_HAND, REPEAT: FAILED_STATE, STOP: HALTED}


@dataclass(frozen=True)
class StepOutlook:
    """State of a step's results today.

    state : ``fresh`` (of today's files), ``stale`` (would run again), ``never run``, ``by hand``, ``failed``, ``stopped``
    (rests on a step that failed or cannot be believed); reason : in words; record : of its last run, None where there is none.
    """

    step: ProjectStep
    state: str
    reason: str
    record: StepRecord | None = None

    @property
    def is_of_today(self) -> bool:
        """Whether the results on the disk are those of today's files."""
        return self.state in (FRESH, BY_HAND)


def foresee_steps(plan: StepPlan, cache: ContentCache, store: RecordStore) -> tuple[StepOutlook, ...]:
    """Return the state of every step of a plan; nothing is run or written.

    A step that rests on one that would run is stale: its inputs may come out the same, which only the run can say.
    """
    ends: dict[str, StepOutlook] = {}
    for step in plan.steps:
        record = store.read(step.name)
        state, reason = _judge(step, record, {name: ends[name] for name in plan.sources[step.name]}, cache)
        ends[step.name] = StepOutlook(step, NEVER_RUN if record is None and state == STALE else state, reason, record)
    return tuple(ends.values())


def _judge(step: ProjectStep, record: StepRecord | None, sources: Mapping[str, StepOutlook], cache: ContentCache
           ) -> tuple[str, str]:
    """Return the state of a step and why it is so."""
    for name, source in sources.items():
        if source.state in (FAILED_STATE, HALTED):
            return HALTED, f"rests on {name}, which {'failed' if source.state == FAILED_STATE else 'was stopped'}"
        grave = [entry for entry in _doubts(source) if entry.doubt.grave]
        if grave and source.is_of_today:
            return HALTED, f"rests on {name}, which cannot be believed: {grave[0].doubt} (mend it in {grave[0].step})"
    waiting = [name for name, source in sources.items() if not source.is_of_today]
    if waiting:
        return STALE, f"rests on {', '.join(waiting)}, which would run again"
    inherited = tuple(dict.fromkeys(f"{entry.step}: {entry.doubt}" for source in sources.values() for entry in _doubts(source)))
    parts = KeyParts(step.version, {path: cache.digest(path) for path in step.input_paths}, normalise_options(step.options),
                     inherited)
    if any(source.state == BY_HAND for source in sources.values()) and record is not None:
        # The run adds the doubt of a change by hand to what follows; only it can write that sentence.
        parts = KeyParts(parts.version, parts.inputs, parts.options, record.parts.inherited)
    decision = decide(step, parts, record, cache=cache)
    return _STATE_OF_ACTION[decision.action], decision.reason


def _doubts(outlook: StepOutlook) -> tuple[TracedDoubt, ...]:
    return () if outlook.record is None else outlook.record.doubts


def seconds_of(outlooks: tuple[StepOutlook, ...]) -> float:
    """Return how long the steps that would run took when they last ran, s; steps that never ran count nothing."""
    return sum(entry.record.seconds for entry in outlooks if not entry.is_of_today and entry.record is not None
               and entry.record.status != FAILED)


def open_cache(root: Path, state_folder: str) -> tuple[ContentCache, RecordStore]:
    """Return the digests and records of a project for looking at it."""
    return ContentCache(root, root / state_folder / "contents.json"), RecordStore(root / state_folder / "steps")
