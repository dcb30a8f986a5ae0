"""Results of a step from its folder of drafts to their place: recorded before they move, and again when they stand."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from toolpoint.project.engine.content import file_digest
from toolpoint.project.engine.drafts import list_files
from toolpoint.project.engine.record import DONE, IN_MOTION, RecordStore, StepRecord
from toolpoint.project.engine.step import ProjectStep


def publish(step: ProjectStep, record: StepRecord, draft: Path, *, root: Path, store: RecordStore, earlier: StepRecord | None
            ) -> StepRecord:
    """Move the outputs of a step to its folder of results, write its record last, and return it.

    The first record says which contents the folder may hold from now on: a kill between the moves leaves files that are known
    to be the step's own, and a step that runs again.
    """
    outputs = {file: file_digest(draft / file) for file in list_files(draft)}
    old = {} if earlier is None else {**earlier.earlier, **earlier.outputs}
    moving = replace(record, status=IN_MOTION, outputs=outputs, earlier=old)
    store.write(moving)
    place = root / step.place
    for file in outputs:
        (place / file).parent.mkdir(parents=True, exist_ok=True)
        os.replace(draft / file, place / file)
    _remove(place, {file: digest for file, digest in old.items() if file not in outputs})
    final = replace(moving, status=DONE, earlier={})
    store.write(final)
    return final


def withdraw(step: ProjectStep, record: StepRecord, *, root: Path, store: RecordStore, earlier: StepRecord | None) -> None:
    """Record that a step failed, after its results of other inputs are removed: nobody must take them for those of today."""
    if earlier is not None:
        store.write(replace(record, status=IN_MOTION, outputs={}, earlier={**earlier.earlier, **earlier.outputs}))
        _remove(root / step.place, {**earlier.earlier, **earlier.outputs})
    store.write(record)


def _remove(place: Path, digests: dict[str, str]) -> None:
    """Remove those files of a folder that are as the step left them; others are somebody's."""
    for file, digest in digests.items():
        path = place / file
        if path.is_file() and file_digest(path) == digest:
            path.unlink()
