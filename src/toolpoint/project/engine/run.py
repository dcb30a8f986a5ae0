"""Run of a project's steps: what must run runs, side by side where it can; the rest is said to be fresh, kept or stopped."""

from __future__ import annotations

import datetime
import multiprocessing
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from toolpoint._doubt import Doubt
from toolpoint.project.engine.content import ContentCache
from toolpoint.project.engine.decision import KEEP, REPEAT, RUN, STOP, Decision, decide
from toolpoint.project.engine.drafts import remove_drafts, remove_tree
from toolpoint.project.engine.lock import hold_lock
from toolpoint.project.engine.plan import StepPlan
from toolpoint.project.engine.publish import publish, withdraw
from toolpoint.project.engine.record import FAILED, KeyParts, RecordStore, StepRecord, TracedDoubt
from toolpoint.project.engine.step import ProjectStep, StepOutcome, normalise_options
from toolpoint.project.engine.work import WorkResult, do_work, do_work_apart

# Hidden, and safe to delete: everything in it is computed anew.
STATE_FOLDER = ".toolpoint"
BY_HAND_REMEDY = "remove the file, or run with --overwrite, to have it computed"


@dataclass(frozen=True)
class StepEvent:
    """Beginning or end of a step in a run: its decision, seconds and words (both empty at the beginning).

    >>> from toolpoint.project.engine.decision import Decision
    >>> StepEvent(Decision("limits/rough", "run", "the cut was changed"), ended=False).decision.step
    'limits/rough'
    """

    decision: Decision
    ended: bool
    words: str = ""
    seconds: float = 0.0
    failed: bool = False


Listener = Callable[[StepEvent], None]


@dataclass(frozen=True)
class RunResult:
    """Ends of all steps of a run in the order of the plan, and the doubts of each with those of all that it rests on."""

    events: tuple[StepEvent, ...]
    doubts: Mapping[str, tuple[TracedDoubt, ...]] = field(default_factory=dict)

    @property
    def failed(self) -> tuple[StepEvent, ...]:
        """Steps that failed, in this run or before."""
        return tuple(event for event in self.events if event.failed)

    def of(self, step: str) -> StepEvent | None:
        """Return the end of a step, None for one that was not asked for."""
        return next((event for event in self.events if event.decision.step == step), None)


def run_steps(plan: StepPlan, root: Path, *, workers: int = 1, overwrite: bool = False,
              versions: Mapping[str, str] | None = None, listen: Listener = lambda event: None) -> RunResult:
    """Run the steps of a plan whose results are not of today's inputs and options.

    Parameters
    ----------
    plan : StepPlan
    root : path
        Folder of the project. One process at a time runs in it; another gets a ToolpointError.
    workers : int
        Steps that run side by side, each in a process of its own; 1 runs all in this one.
    overwrite : bool
        Whether results that somebody changed by hand are computed again.
    versions : of what computes, for the records.
    listen : function of a StepEvent
        Called where a step begins and where it ends.
    """
    with hold_lock(root / STATE_FOLDER / "lock", root.name):
        # What a killed run left behind; no other process has drafts while this one holds the lock.
        remove_drafts(root / STATE_FOLDER)
        run = _StepRun(plan, root, overwrite=overwrite, versions=dict(versions or {}), listen=listen)
        with _pool(workers) as pool:
            run.all_steps(pool, workers)
        run.cache.save()
        return RunResult(tuple(run.ends[step.name] for step in plan.steps), run.doubts)


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor | None]:
    """Yield worker processes, none for a single worker; they end with the run, however it ends."""
    if workers <= 1:
        yield None
        return
    pool = ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn"))
    try:
        yield pool
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


@dataclass(frozen=True)
class _Task:
    """A step that runs: its key, why it runs, where it writes, and when it began."""

    step: ProjectStep
    parts: KeyParts
    decision: Decision
    draft: Path
    started: str


class _StepRun:
    """State of one run: ends and doubts of the steps so far."""

    def __init__(self, plan: StepPlan, root: Path, *, overwrite: bool, versions: dict[str, str], listen: Listener) -> None:
        self.plan, self.root, self.overwrite, self.versions, self.listen = plan, root, overwrite, versions, listen
        self.cache = ContentCache(root, root / STATE_FOLDER / "contents.json")
        self.store = RecordStore(root / STATE_FOLDER / "steps")
        self.ends: dict[str, StepEvent] = {}
        self.doubts: dict[str, tuple[TracedDoubt, ...]] = {}
        self._draft_count = 0

    def all_steps(self, pool: ProcessPoolExecutor | None, workers: int) -> None:
        """Run all steps, each when what it rests on has ended."""
        waiting, running = list(self.plan.steps), dict[Future[WorkResult], _Task]()
        while waiting or running:
            for step in [step for step in waiting if all(source in self.ends for source in self.plan.sources[step.name])]:
                if len(running) >= workers:
                    break
                waiting.remove(step)
                self._begin(step, pool, running)
            if running:
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    self._end(running.pop(future), _result_of(future))

    def _begin(self, step: ProjectStep, pool: ProcessPoolExecutor | None, running: dict[Future[WorkResult], _Task]) -> None:
        """End a step that need not run; run any other here, or in a process of the pool."""
        if stopped := self._stop_reason(step):
            self._end_without_work(step, Decision(step.name, STOP, stopped))
            return
        inherited = self._inherited(step.name)
        parts = KeyParts(step.version, {path: self.cache.digest(path) for path in step.input_paths},
                         normalise_options(step.options), tuple(f"{entry.step}: {entry.doubt}" for entry in inherited))
        decision = decide(step, parts, self.store.read(step.name), cache=self.cache, overwrite=self.overwrite)
        if decision.action != RUN:
            self._end_without_work(step, decision)
            return
        self.listen(StepEvent(decision, False))
        self._draft_count += 1
        task = _Task(step, parts, decision, self.root / STATE_FOLDER / "drafts" / str(self._draft_count),
                     datetime.datetime.now().isoformat(timespec="seconds"))
        if pool is None:
            self._end(task, do_work(step, self.root, task.draft))
            return
        try:
            running[pool.submit(do_work_apart, step, self.root, task.draft)] = task
        except BrokenProcessPool:  # one of its processes died: the others' work goes on in this one
            self._end(task, do_work(step, self.root, task.draft))

    def _stop_reason(self, step: ProjectStep) -> str:
        """Return why a step cannot follow what it rests on, nothing where it can."""
        for source in self.plan.sources[step.name]:
            end = self.ends[source]
            if end.failed or end.decision.action == STOP:
                return f"rests on {source}, which {'failed' if end.failed else 'was stopped'}"
            if grave := [entry for entry in self.doubts[source] if entry.doubt.grave]:
                return f"rests on {source}, which cannot be believed: {grave[0].doubt} (mend it in {grave[0].step})"
        return ""

    def _inherited(self, name: str) -> tuple[TracedDoubt, ...]:
        """Return the doubts of all that a step rests on, each once."""
        return tuple(dict.fromkeys(entry for source in self.plan.sources[name] for entry in self.doubts[source]))

    def _end_without_work(self, step: ProjectStep, decision: Decision) -> None:
        """End a step that does not run; what was changed by hand is doubted from here on."""
        record = self.store.read(step.name)
        doubts = self._inherited(step.name) if record is None or decision.action == STOP else record.doubts
        if decision.action == KEEP:
            hand = Doubt(", ".join(decision.by_hand), "was changed by hand, and is not what the step computed", BY_HAND_REMEDY)
            doubts = (*doubts, TracedDoubt(hand, step.name))
        words = "" if record is None or decision.action == STOP else record.words
        self._finish(step.name, StepEvent(decision, True, words, failed=decision.action == REPEAT), doubts)

    def _end(self, task: _Task, result: WorkResult) -> None:
        """Put the results of a step in place, or record that it failed."""
        step, earlier = task.step, self.store.read(task.step.name)
        inherited = self._inherited(step.name)
        # A file that says its doubts again when it is read raises none: they are mended where they arose.
        earlier_texts = {str(entry.doubt) for entry in inherited}
        arisen = [TracedDoubt(doubt, step.name) for doubt in result.outcome.doubts if str(doubt) not in earlier_texts]
        doubts = tuple(dict.fromkeys([*arisen, *inherited]))
        words = result.error or result.outcome.words
        record = StepRecord(step.name, FAILED, task.parts, {}, words, doubts, round(result.seconds, 3), task.started,
                            self.versions)
        try:
            if not result.error:
                publish(step, record, task.draft, root=self.root, store=self.store, earlier=earlier)
            elif result.kept:
                withdraw(step, record, root=self.root, store=self.store, earlier=earlier)
        except OSError as error:
            words = f"its results could not be written: {error}; free disk space, and run again"
            result = replace(result, error=words)
        remove_tree(task.draft)
        self._finish(step.name, StepEvent(task.decision, True, words, result.seconds, bool(result.error)), doubts)

    def _finish(self, name: str, event: StepEvent, doubts: tuple[TracedDoubt, ...]) -> None:
        self.ends[name], self.doubts[name] = event, doubts
        self.listen(event)


def _result_of(future: Future[WorkResult]) -> WorkResult:
    """Return the result of a step's process; one that died is a failure that the next run tries again."""
    try:
        return future.result()
    except BrokenProcessPool:
        return WorkResult(StepOutcome(), 0.0, "its process was ended from outside (out of memory?); run again", False)
