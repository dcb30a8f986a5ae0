"""One run of a step's work in a folder of drafts, with its warnings as doubts and its errors as words."""

from __future__ import annotations

import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from toolpoint._check import FileDoubt, ToolpointError, ToolpointWarning
from toolpoint._doubt import Doubt
from toolpoint._threads import hold_process
from toolpoint.project.engine.step import ProjectStep, StepOutcome


@dataclass(frozen=True)
class WorkResult:
    """StepOutcome of a step's work, or why there is none; `kept` : whether the same inputs would fail again."""

    outcome: StepOutcome
    seconds: float
    error: str = ""
    kept: bool = True


def do_work(step: ProjectStep, root: Path, draft: Path) -> WorkResult:
    """Run the work of a step, which writes into an empty folder of drafts."""
    draft.mkdir(parents=True)
    start = time.perf_counter()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ToolpointWarning)
        outcome, error, kept = _attempt(step, root, draft)
    doubts = tuple(dict.fromkeys([*outcome.doubts, *_doubts_of(caught, outcome.doubts)]))
    unwritten = [name for name in step.outputs if not (draft / name).is_file()]
    if not error and unwritten:
        error = f"its work did not write {', '.join(unwritten)}"
    return WorkResult(StepOutcome(outcome.words, doubts), time.perf_counter() - start, error, kept)


def do_work_apart(step: ProjectStep, root: Path, draft: Path) -> WorkResult:
    """Run the work of a step in a process of its own, on one thread of linear algebra."""
    hold_process()
    return do_work(step, root, draft)


def _attempt(step: ProjectStep, root: Path, draft: Path) -> tuple[StepOutcome, str, bool]:
    try:
        return step.work(folder=draft, **step.arguments(root)), "", True
    except ToolpointError as error:
        return StepOutcome(), str(error), True
    # A full disk or a lack of memory is no property of the inputs: the next run tries again.
    except (OSError, MemoryError) as error:
        return StepOutcome(), f"{type(error).__name__}: {error}; free disk or memory, and run again", False
    # One step's fault must not take the others with it.
    except Exception as error:
        return StepOutcome(), f"{type(error).__name__}: {error}; this is a fault of toolpoint, please report it", True


def _doubts_of(caught: Sequence[Any], stated: Sequence[Doubt]) -> list[Doubt]:
    """Return the warnings of the package as doubts; what came with a file stays the doubt that it was.

    stated : doubts of the outcome; a warning that is their summary (`status_of`) says nothing more.
    """
    doubts = []
    for warning in caught:
        if issubclass(warning.category, FileDoubt):
            doubts.append(warning.message.args[0])
        elif issubclass(warning.category, ToolpointWarning) and not _is_summary(str(warning.message), stated):
            doubts.append(Doubt.parsed(str(warning.message)))
    return doubts


def _is_summary(text: str, stated: Sequence[Doubt]) -> bool:
    """Whether a warning is a status that repeats doubts: "doubtful", and some of them word by word."""
    return text.startswith("doubtful") and any(doubt in text for doubt in stated)
